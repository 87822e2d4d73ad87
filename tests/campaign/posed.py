"""Random robots that can be posed: legs of every kind, arms, shipped robots of other dimensions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.errors import InputError
from robostiff.io.document import parse_document, read_document
from robostiff.io.model_file import model_from_document
from robostiff.kinematics import JointCoordinates, Pose, place_chain
from robostiff.model import ALL_COORDINATES, Element, Joint, JointKind
from robostiff.robots import robot_file, shipped_robots
from robostiff.spatial import Frame
from tests.campaign.random_files import arm, platform
from tests.generators.elements import BAR, ROD, STEEL, random_transform
from tests.generators.kernel_robots import HAND_MADE
from tests.generators.legs import PLANAR, RODS, SCREWS, SLIDING, STRUTS, random_leg

SIX_FREEDOMS = ("UPS", "SPS", "PUS", "PSU", "RUS", "RSU", "SPU", "UCU", "UHS")


@dataclass(frozen=True)
class Posed:
    """A robot and poses of it.

    Attributes
    ----------
    robot : Robot
    rows : (N, n) array
        Free pose coordinates, or joint coordinates.
    by_joints : bool
    q : (N, size) array or None
        Coordinates of a single leg that were carried forward to the poses, near home.
    parameters : mapping of str to float
        Those of a shipped robot that differ from the file's.
    text : str
        The model file of one that was drawn as a file.
    """

    robot: rs.Robot
    rows: np.ndarray
    by_joints: bool = False
    q: np.ndarray | None = None
    shipped: str = ""
    parameters: tuple[tuple[str, float], ...] = ()
    text: str = ""

    def pose(self, rows: np.ndarray | slice | int = slice(None)) -> Pose:
        """Rows as the library wants them."""
        chosen = self.rows[rows] if not isinstance(rows, np.ndarray) else rows
        return JointCoordinates(chosen) if self.by_joints else chosen


def random_posed(rng: np.random.Generator, kind: str, count: int = 4) -> Posed | None:
    """A robot of a kind of `KINDS`; None where the dimensions drawn make no robot."""
    try:
        return KINDS[kind](rng, count)
    except InputError as error:
        if "limits of the drive" in str(error) or kind in ("shipped", "file"):
            return None
        raise


def _one_leg(rng: np.random.Generator, count: int) -> Posed:
    """A single leg carried forward from coordinates near home."""
    kinds = (*STRUTS, *RODS, *PLANAR, *SLIDING, *SCREWS)
    case = random_leg(kinds[rng.integers(len(kinds))], int(rng.integers(2**31)))
    leg = case.leg
    if rng.uniform() < 0.4:
        leg = _homes_anywhere(rng, leg)
    return _carried(rng, leg, count, rng.uniform(0.02, 0.4))


def _carried(rng: np.random.Generator, leg: rs.Leg, count: int, size: float) -> Posed:
    """Home and poses of a leg's end from its coordinates."""
    home_q = np.asarray(leg.chain.home, dtype=float)
    step = np.array([0.2 if f.pitch is None else 1.0 for f in leg.chain.freedoms])
    free = leg.chain.free
    shifts = size * step * free * rng.uniform(-1, 1, (count, len(home_q)))
    q = np.vstack([home_q, home_q + shifts])
    placed, back = place_chain(leg.chain, q, leg.base.R, leg.base.p), leg.attachment.inverse
    R, p = placed.R @ back.R, placed.p + placed.R @ back.p
    robot = rs.Robot("one leg", (leg,), home=Frame(R[0], p[0]))
    return Posed(robot, np.hstack([p, Rotation.from_matrix(R).as_rotvec()]), q=q)


def _homes_anywhere(rng: np.random.Generator, leg: rs.Leg) -> rs.Leg:
    """Turns beyond half a turn, and slides to the other side."""
    elements: list[Element] = []
    for e in leg.chain.elements:
        if isinstance(e, Joint) and e.kind in (JointKind.REVOLUTE, JointKind.PRISMATIC):
            home = np.array(e.home)
            home = (
                home + 2 * np.pi * rng.integers(-1, 2)
                if e.kind is JointKind.REVOLUTE
                else (home * rng.choice([-1.0, 1.0]))
            )
            role = e.role
            if isinstance(role, rs.Actuated) and rng.uniform() < 0.7:
                width = 1.0 if e.kind is JointKind.REVOLUTE else 0.3
                role = rs.Actuated(role.stiffness, (float(home[0] - width), float(home[0] + width)))
            elements.append(replace(e, home=tuple(home.tolist()), role=role))
        else:
            elements.append(e)
    return replace(leg, chain=rs.Chain(tuple(elements)))


def _several_legs(rng: np.random.Generator, count: int) -> Posed:
    """Two to six legs that leave all six coordinates to the drives."""
    home = random_transform(rng, 0.2)
    legs = []
    for i in range(int(rng.integers(2, 7))):
        kind = SIX_FREEDOMS[rng.integers(len(SIX_FREEDOMS))]
        leg = random_leg(kind, int(rng.integers(2**31))).leg
        if rng.uniform() < 0.2:
            leg = _homes_anywhere(rng, leg)
        legs.append(_on(leg, home, f"leg{i}"))
    robot = rs.Robot("legs", tuple(legs), home=home)
    return Posed(robot, _near(rng, robot, count, 10 ** rng.uniform(-2, -0.6)))


def _coupled(rng: np.random.Generator, count: int) -> Posed:
    """A leg of five freedoms among others: one pose coordinate follows."""
    home = random_transform(rng, 0.2)
    kinds = [("UPU", "PUU", "RUU")[rng.integers(3)]]
    kinds += [SIX_FREEDOMS[rng.integers(len(SIX_FREEDOMS))] for _ in range(rng.integers(1, 4))]
    legs = tuple(
        _on(random_leg(kind, int(rng.integers(2**31))).leg, home, f"leg{i}")
        for i, kind in enumerate(kinds)
    )
    open_ = int(rng.integers(3, 6))
    coordinates = tuple(c for k, c in enumerate(ALL_COORDINATES) if k != open_)
    robot = rs.Robot("coupled legs", legs, home=home, coordinates=coordinates)
    return Posed(robot, _near(rng, robot, 2, 10 ** rng.uniform(-2, -0.8)))


def _on(leg: rs.Leg, home: Frame, name: str) -> rs.Leg:
    """The same leg with its base where its end meets the platform at home."""
    end = place_chain(leg.chain, np.asarray(leg.chain.home, dtype=float), np.eye(3), np.zeros(3))
    base = home @ leg.attachment @ Frame(end.R, end.p).inverse
    U, _, V = np.linalg.svd(base.R)
    return replace(leg, name=name, base=Frame(U @ V, base.p))


def _joints_near_home(rng: np.random.Generator, robot: rs.Robot, count: int) -> np.ndarray:
    """Home, and joint coordinates of an arm around it, but for those that are held."""
    (leg,) = robot.legs
    home = np.asarray(leg.chain.home, dtype=float)
    q = home + leg.chain.free * 0.3 * rng.uniform(-1, 1, (count, leg.chain.size))
    return np.vstack([home, q])


def _driven_arm(rng: np.random.Generator, count: int) -> Posed:
    """Six driven turns and slides with links, posed by the platform: which branch?"""
    elements: list[Element] = []
    homes = rng.uniform() < 0.6
    for i in range(6):
        axis = rng.normal(size=3)
        if rng.uniform() < 0.4:
            axis = np.eye(3)[rng.integers(3)]
        kind = JointKind.PRISMATIC if rng.uniform() < 0.15 else JointKind.REVOLUTE
        k = float(10 ** rng.uniform(4, 6))
        home = [float(rng.uniform(-1.5, 1.5))] if homes else [0.0]
        make = rs.prismatic if kind is JointKind.PRISMATIC else rs.revolute
        elements.append(make(axis, rs.Actuated(k), home=home, name=f"j{i + 1}"))
        to = rng.uniform(-0.4, 0.4, 3)
        link = (
            rs.beam_link(to, STEEL, ROD) if rng.uniform() < 0.6 else rs.Rigid(Frame(np.eye(3), to))
        )
        elements.append(link)
    leg = rs.Leg("arm", Frame.identity(), rs.Chain(tuple(elements)), Frame.identity())
    return _carried(rng, leg, count, rng.uniform(0.02, 0.3))


def _structure(rng: np.random.Generator, count: int) -> Posed:
    """Beams and locked joints between base and platform: nothing moves."""
    home = random_transform(rng, 0.2)
    legs = []
    for i in range(int(rng.integers(1, 4))):
        elements: list[Element] = [
            rs.beam_link(rng.uniform(-0.5, 0.5, 3), STEEL, BAR, y_axis=[1, 2, 3])
        ]
        for k in range(int(rng.integers(0, 3))):
            role = rs.Locked(1e5) if rng.uniform() < 0.5 else rs.Locked()
            angle = float(rng.uniform(-1, 1))
            elements.append(rs.revolute(rng.normal(size=3), role, home=[angle], name=f"lock{k}"))
            elements.append(rs.beam_link(rng.uniform(-0.5, 0.5, 3), STEEL, ROD))
        leg = rs.Leg("", Frame.identity(), rs.Chain(tuple(elements)), random_transform(rng, 0.2))
        legs.append(_on(leg, home, f"leg{i}"))
    from robostiff.kinematics.pose import home_coordinates

    named = ALL_COORDINATES if rng.uniform() < 0.5 else ()
    robot = rs.Robot("structure", tuple(legs), home=home, coordinates=named)

    return Posed(robot, home_coordinates(robot)[None])


def _hand_made(rng: np.random.Generator, count: int) -> Posed:
    names = list(HAND_MADE)
    robot = HAND_MADE[names[rng.integers(len(names))]]()
    return Posed(
        robot, _near(rng, robot, count, 10 ** rng.uniform(-2, 0)), by_joints=_by_joints(robot)
    )


def _shipped(rng: np.random.Generator, count: int) -> Posed | None:
    """A shipped robot with other dimensions."""
    names = shipped_robots()
    name = names[rng.integers(len(names))]
    values = nominal(name)
    chosen = [p for p in values if rng.uniform() < 0.5]
    by = rng.uniform(0.05, 0.2)
    parameters = {p: float(values[p] * (1 + by * rng.uniform(-1, 1))) for p in chosen}
    robot = rs.load(name, parameters)
    rows = _near(rng, robot, count, 10 ** rng.uniform(-2, -0.3))
    return Posed(robot, rows, _by_joints(robot), shipped=name, parameters=tuple(parameters.items()))


def _of_file(rng: np.random.Generator, count: int) -> Posed | None:
    """An arm or a platform of a random model file, with sums of joints and parallel blocks."""
    text = arm(rng) if rng.uniform() < 0.5 else platform(rng)
    robot = model_from_document(parse_document(text, file="drawn.yaml"))
    if not _by_joints(robot):
        return Posed(robot, _near(rng, robot, count, 10 ** rng.uniform(-2, -0.5)), text=text)
    return Posed(robot, _joints_near_home(rng, robot, count), by_joints=True, text=text)


def _hybrid(rng: np.random.Generator, count: int) -> Posed:
    """Modules in series, robots of several legs and of one; some are such machines themselves."""
    modules: list[rs.Module] = []
    machine: Any = None
    while len(modules) < 2 or (len(modules) < 3 and rng.uniform() < 0.4):
        kind = str(rng.choice(["shipped", "driven arm", "structure", "hand-made"]))
        drawn = random_posed(rng, kind, 1) if rng.uniform() < 0.9 else _hybrid(rng, 0)
        mount = random_transform(rng, 0.5) if rng.uniform() < 0.5 else None
        if drawn is None:
            continue
        try:
            more = [*modules, rs.Module(f"m{len(modules)}", drawn.robot, mount)]
            machine = rs.hybrid_machine(more)
        except rs.InputError:  # of cables, springs, couplings, in space and in a plane: no machine
            continue
        modules = more
    rows = _near(rng, machine, count, 10 ** rng.uniform(-2, -0.5)) if count else np.zeros((1, 0))
    return Posed(machine, rows, by_joints=_by_joints(machine))


@cache
def nominal(name: str, given: tuple[tuple[str, float], ...] = ()) -> dict[str, float]:
    """Parameters of a shipped robot in SI units; those that follow from others do so."""
    written = read_document(robot_file(name)).data.get("parameters", {})
    return dict(rs.load(name, dict(given), symbols=tuple(written)).nominal) if written else {}


def _by_joints(robot: rs.Robot) -> bool:
    return robot.is_serial and robot.home is None


def _near(rng: np.random.Generator, robot: rs.Robot, count: int, size: float) -> np.ndarray:
    """Home, and poses around it."""
    from tests.generators.planted_poses import PoseSpace

    space = PoseSpace(robot)
    rows = np.vstack([space.home, space.drawn(rng, count, size)])
    if rng.uniform() < 0.3:
        rows = np.vstack([rows, rng.choice(space.round_values()[:3])])
    return rows


KINDS: dict[str, Callable[[np.random.Generator, int], Posed | None]] = {
    "one leg": _one_leg,
    "several legs": _several_legs,
    "coupled legs": _coupled,
    "driven arm": _driven_arm,
    "structure": _structure,
    "hand-made": _hand_made,
    "shipped": _shipped,
    "file": _of_file,
    "hybrid": _hybrid,
}
