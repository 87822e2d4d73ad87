"""Answers of the library for model files against those of `reread_machine.py`."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.robots import robot_file
from tests.campaign.answers import Complaint
from tests.campaign.random_files import arm, machine, platform
from tests.campaign.reread import rotation_vector
from tests.campaign.reread_machine import Machine

SHIPPED = Path(robot_file("hexapod")).parent
KINDS = ("arms", "platforms", "machines")
_NAMES = ("x", "y", "z", "rx", "ry", "rz")


def drawn(kind: str, seed: int, number: int, folder: Path) -> Path:
    """A random model file."""
    rng = np.random.default_rng([seed, KINDS.index(kind), number])
    path = folder / f"{kind}-{number}.yaml"
    draw = {"arms": arm, "platforms": lambda own: platform(own, path), "machines": machine}[kind]
    path.write_text(draw(rng))
    return path


def distance(A: np.ndarray, B: np.ndarray, length: float) -> float:
    """Largest difference of two matrices of stiffness, rotations in units of a length."""
    n = len(A)
    scale = np.where(np.arange(n) < (2 if n == 3 else 3), 1.0, 1 / length)
    A, B = (scale[:, None] * M * scale for M in (A, B))
    apart, largest = np.abs(A - B).max(), max(np.abs(A).max(), np.abs(B).max())
    return float(apart / largest) if largest else 0.0


def compared(
    path: Path, rng: np.random.Generator, poses: int = 3, given: dict[str, str] | None = None
) -> Iterator[dict[str, Any]]:
    """Status, and how far K and the pose are from those that are found anew, at home first.

    The posture of home, which chooses the assembly mode, is taken from the library, and so is that
    of a robot with redundant drives or idle joints at each pose; they have to close the loops.
    `given` are values that the library does not get.
    """
    robot = rs.load(path)
    own = Machine(path, given, shipped=SHIPPED)
    home = rs.stiffness(robot)
    if robot.home is None:
        yield from _at_joints(robot, own, rng, poses)
        return
    chains = [leg.chain for leg in robot.legs]
    size = home.decision.length
    seed = _joints(chains, home)
    T = home.transform.as_matrix()
    if "modules" in own.file.data:  # their ends follow from home coordinates
        own.home = own.at_joints(seed)
    at_home = dict(zip(_NAMES, [*own.home[:3, 3], *rotation_vector(own.home[:3, :3])], strict=True))
    names = [coordinate.value for coordinate in robot.coordinates]
    for pose in range(poses):
        steps = [0.1 * size if name in _NAMES[:3] else 0.1 for name in names]
        moves = rng.uniform(-1, 1, len(names)) * steps * (pose > 0)
        wanted = {n: at_home[n] + move for n, move in zip(names, moves, strict=True)}
        answer = rs.stiffness(robot, list(wanted.values())) if names else home
        if answer.status & rs.Status.UNREACHABLE:
            yield {"status": str(answer.status)}
            continue
        T = answer.transform.as_matrix()
        idle = bool(answer.status & rs.Status.REDUNDANT_JOINTS)  # may turn springs between them
        if idle or any("drives of leg" in words for words in answer.advice):
            q, P = own.close(_joints(chains, answer), T, wanted)
        else:
            q, P = own.posture(seed, wanted)
        found = {"K": distance(answer.K, own.stiffness(q, P), size), "pose": np.abs(T - P).max()}
        yield {"status": str(answer.status), **found}


def _joints(chains: list[rs.Chain], answer: Any) -> np.ndarray:
    given = zip(chains, answer.joint_coordinates.values(), strict=True)
    return np.concatenate([chain.joint_coordinates(np.asarray(q)) for chain, q in given])


def _at_joints(
    robot: rs.Robot, own: Machine, rng: np.random.Generator, poses: int
) -> Iterator[dict[str, Any]]:
    (leg,) = robot.legs
    chain = leg.chain
    held = [isinstance(role, rs.Locked) for role in chain.roles]
    for pose in range(poses):
        moves = rng.uniform(-0.5, 0.5, chain.size) * (pose > 0)
        p = np.where(held, 0, moves) + np.array(chain.home, dtype=float)
        try:
            answer = rs.stiffness(robot, rs.JointCoordinates(p))
        except rs.NoAnswerError:
            yield {"status": "none"}
            continue
        q = chain.joint_coordinates(p)
        P = own.at_joints(q)
        transform: Any = answer.transform
        T = transform.as_matrix()
        found = {"K": distance(answer.K, own.stiffness(q, P), 0.4), "pose": np.abs(T - P).max()}
        yield {"status": str(answer.status), **found}


def is_right(found: dict[str, Any]) -> bool:
    """Whether both agree, or the answer says that it has lost digits or is none."""
    if "K" not in found or "ill-conditioned" in found["status"]:
        return True
    return found["K"] < 1e-8 and found["pose"] < 1e-9


def judged_file(seed: int, number: int) -> list[Complaint]:
    """What is wrong with the answers for a random model file."""
    with tempfile.TemporaryDirectory() as folder:
        kind = KINDS[number % len(KINDS)]
        path = drawn(kind, seed, number, Path(folder))
        try:
            answers = list(compared(path, np.random.default_rng([seed, number])))
        except (rs.FileError, rs.NoAnswerError):  # too short a telescope
            return []
    return [Complaint(kind, "another answer", str(own)) for own in answers if not is_right(own)]
