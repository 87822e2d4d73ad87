"""Answers of the library for model files against those of `reread_machine.py`."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.robots import robot_file
from tests.campaign.answers import Complaint
from tests.campaign.random_files import arm, machine, platform
from tests.campaign.reread import rotation_vector
from tests.campaign.reread_machine import Machine, NotClosedError

SHIPPED = Path(robot_file("hexapod")).parent
KINDS = ("arms", "platforms", "machines")
_NAMES = ("x", "y", "z", "rx", "ry", "rz")


def drawn(kind: str, seed: int, number: int, folder: Path) -> Path:
    """A random model file."""
    rng = np.random.default_rng([seed, KINDS.index(kind), number])
    path = folder / f"{kind}-{number}.yaml"
    draw = {"arms": arm, "platforms": platform, "machines": machine}[kind]
    path.write_text(draw(rng))
    return path


def distance(A: np.ndarray, B: np.ndarray | None, length: float) -> float:
    """Largest difference of two matrices of stiffness, rotations in units of a length."""
    if B is None:
        return np.inf
    n = len(A)
    scale = np.where(np.arange(n) < (2 if n == 3 else 3), 1.0, 1 / length)
    A, B = (scale[:, None] * M * scale for M in (A, B))
    apart, largest = np.abs(A - B).max(), max(np.abs(A).max(), np.abs(B).max())
    return float(apart / largest) if largest else 0.0


def compared(
    path: Path, rng: np.random.Generator, poses: int = 3, given: dict[str, str] | None = None
) -> Iterator[dict[str, Any]]:
    """Status, and how far K and the pose are from those that are found anew, at home first.

    `given` are values that the library does not get.
    """
    robot = rs.load(path)
    again = Reread(robot, Machine(path, given, shipped=SHIPPED))
    for pose in range(poses):
        yield again.at(again.drawn(rng, pose > 0))


class Reread:
    """A robot, and the same read once more.

    The posture of home, which chooses the assembly mode, is taken from the library, and so is that
    of a robot with redundant drives or idle joints at each pose; they have to close the loops.
    """

    def __init__(self, robot: rs.Robot, own: Machine) -> None:
        self.robot, self.own = robot, own
        self.chains = [leg.chain for leg in robot.legs]
        self.by_joints = robot.home is None
        self.size, self.names = 0.4, [coordinate.value for coordinate in robot.coordinates]
        if self.by_joints:
            return
        home = rs.stiffness(robot)
        self.size, self.seed = home.decision.length, self.joints(home)
        if "modules" in own.file.data:  # their ends follow from home coordinates
            own.home = own.at_joints(self.seed)
        six = [*own.home[:3, 3], *rotation_vector(own.home[:3, :3])]
        self.home = [six[_NAMES.index(name)] for name in self.names]

    def joints(self, answer: Any) -> np.ndarray:
        """Coordinates of all legs, as an answer has them."""
        return self.joints_of(answer.joint_coordinates.values())

    def joints_of(self, each: Iterable[np.ndarray]) -> np.ndarray:
        """Those of all joints, by coordinates of each leg."""
        given = zip(self.chains, each, strict=True)
        return np.concatenate([chain.joint_coordinates(np.asarray(q)) for chain, q in given])

    def is_smooth(self, row: np.ndarray) -> bool:
        """Whether small steps from home lead to a pose."""
        try:
            self.own.posture(self.seed, dict(zip(self.names, map(float, row), strict=True)))
        except NotClosedError:
            return False
        return True

    def drawn(self, rng: np.random.Generator, away: bool) -> np.ndarray:
        """Home, or coordinates beside it."""
        if self.by_joints:
            (chain,) = self.chains
            held = [isinstance(role, rs.Locked) for role in chain.roles]
            moves = rng.uniform(-0.5, 0.5, chain.size) * away
            return np.where(held, 0, moves) + np.array(chain.home, dtype=float)
        steps = [0.1 * self.size if name in _NAMES[:3] else 0.1 for name in self.names]
        return np.array(self.home) + rng.uniform(-1, 1, len(self.names)) * steps * away

    def at(self, row: np.ndarray) -> dict[str, Any]:
        """Status, and how far K and the pose are apart."""
        pose: Any = (rs.JointCoordinates(row) if self.by_joints else row) if len(row) else None
        try:
            answer = rs.stiffness(self.robot, pose)
        except rs.NoAnswerError:
            return {"status": "none"}
        if answer.status & rs.Status.UNREACHABLE:
            return {"status": str(answer.status)}
        transform: Any = answer.transform
        T = transform.as_matrix()
        wanted = dict(zip(self.names, map(float, row), strict=True)) if not self.by_joints else {}
        idle = bool(answer.status & rs.Status.REDUNDANT_JOINTS)  # may turn springs between them
        if self.by_joints:
            q = self.chains[0].joint_coordinates(row)
            P = self.own.at_joints(q)
        elif idle or any("drives" in words for words in answer.advice):
            q, P, _ = self.own.close(self.joints(answer), T, wanted)
        else:
            q, P = self.own.posture(self.seed, wanted)
        found = {"status": str(answer.status), "pose": np.abs(T - P).max()}
        if answer.status & rs.Status.RIGID_DIRECTION:
            return found
        truth = self.own.stiffness(q, P)
        return found if truth is None else {**found, "K": distance(answer.K, truth.K, self.size)}


def is_right(found: dict[str, Any], limit: float = 1e-8) -> bool:
    """Whether both agree, or the answer says that it has lost digits or is none."""
    if "pose" not in found or "ill-conditioned" in found["status"]:
        return True
    return found.get("K", 0.0) < limit and found["pose"] < 0.1 * limit


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
