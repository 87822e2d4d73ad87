"""Coordinates that follow from the legs: those of legs closed by iteration, and of the platform.

A formula cannot iterate. What the closure of a leg, or of all of them together, decides is found in
numbers at the samples of the record; what is the same number or the same formula at all of them is
known, and the rest are further symbols of the formula.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.analytic.placement.robot_pose import (
    ABOUT_WORLD_AXES,
    AtCoordinates,
    AtHome,
    AtJoints,
    AtSymbols,
    PoseFormula,
    PoseRotation,
    all_names,
    coordinate_names,
    exact_angle,
    free_name,
)
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.kinematics import PostureFinder, posture_finder
from robostiff.kinematics.closure.leg_solver import LegSolver
from robostiff.kinematics.frames import place_chain
from robostiff.model import Joint, JointKind, Leg, Robot
from robostiff.record import Entry, Record
from robostiff.spatial import exact_number

#: Part of the robot's size, and of an angle in rad, by which poses differ from home.
AROUND = 0.03
_TRIES = 12  # of parameters and poses, for one at which all legs close
_KNOWN = 1e-10  # of the length, and rad: a coordinate equals that of the model, or a number


@frozen
class Sample:
    """A robot in numbers, closed at a pose near home."""

    values: dict[str, float]  # by name: of the robot's symbols
    finder: PostureFinder
    # by name: those that the legs decide, by the names of their inputs; also, for a general pose,
    # all that define it
    coordinates: dict[str, float]
    # (6,): of the platform, with a rotation vector [m, rad], where joint coordinates are the
    # symbols
    pose: np.ndarray | None = None


@frozen
class Following:
    """Which coordinates follow from the legs."""

    robot: Robot
    # by leg number: legs that close by iteration, and an input for each of their coordinates
    legs: dict[int, tuple[str, ...]]
    # by coordinate: inputs of those of the platform, where it or a leg follows; empty otherwise
    pose: dict[str, str]
    following: tuple[str, ...]  # names of those that do
    rotation: PoseRotation = ABOUT_WORLD_AXES  # what the coordinates of the platform's rotation are
    # whether the posture is a general one, given by the coordinates of all legs
    at_joints: bool = False

    @classmethod
    def of(cls, robot: Robot, finder: PostureFinder, pose: PoseFormula) -> Following:
        """Find them for a robot at a kind of pose."""
        taken = {str(symbol) for symbol in robot.symbols}
        legs: dict[int, tuple[str, ...]] = {}
        if robot.is_posed_by_joints:
            return cls(robot, {}, {}, ())
        if isinstance(pose, AtJoints):
            for i, leg in enumerate(robot.legs):
                for element, _ in leg.chain.moving:
                    if isinstance(element, Joint) and element.kind is JointKind.SPHERICAL:
                        raise InputError(
                            f"joint coordinates of leg {leg.name!r}",
                            got=Words(
                                f"the spherical joint {element.name!r}, whose coordinates are no "
                                "angles"
                            ),
                            expected="joints that turn or slide about axes",
                            hint="give it as a universal and a revolute joint through one point; "
                            "or write pose=AtSymbols(), where all legs are struts, or rods on "
                            "slides or cranks",
                        )
                legs[i] = tuple(
                    free_name(f"{'theta' if screw.turns else 's'}_{i + 1}_{j}", taken)
                    for j, screw in enumerate(leg.chain.freedoms, start=1)
                )
            return cls(robot, legs, {}, (), at_joints=True)
        for i, (leg, solver) in enumerate(zip(robot.legs, finder.solvers, strict=True)):
            # Away from home, joint coordinates of loops would be many more than those of the pose.
            is_loop = isinstance(pose, AtSymbols) and leg.chain.has_blocks
            if solver.recorded_form is None and not (is_loop or isinstance(pose, AtCoordinates)):
                plain = re.sub(r"\W", "_", leg.name)
                names = (f"q_{plain}_{j + 1}" for j in range(leg.chain.size))
                legs[i] = tuple(free_name(name, taken) for name in names)
        moved = _moved_by_legs(robot, finder) if isinstance(pose, AtSymbols) else ()
        if isinstance(pose, AtHome) or not (legs or moved):
            return cls(robot, legs, {}, ())
        names = all_names(pose.rotation)
        free = {*coordinate_names(robot, pose.rotation), *(names[i] for i in moved)}
        inputs = {name: free_name(name, taken) for name in names if name in free}
        following = tuple(inputs[names[i]] for i in moved)
        return cls(robot, legs, inputs, following, pose.rotation)

    @property
    def any(self) -> bool:
        """Whether any coordinate follows."""
        return bool(self.legs or self.pose)

    def meanings(self, solvers: Sequence[LegSolver]) -> dict[str, str]:
        """What the coordinates of joints stand for, by name; `solvers`: of the legs, at home."""
        found: dict[str, str] = {}
        for i, names in self.legs.items():
            chain = self.robot.legs[i].chain
            each = zip(names, chain.coordinate_names, chain.freedoms, solvers[i].home, strict=True)
            for name, joint, screw, at in each:
                kind, leg = "angle" if screw.turns else "displacement", self.robot.legs[i].name
                found[name] = (
                    "joint coordinate: number of the leg, then of the joint"
                    if self.at_joints
                    else f"{kind} of {joint} of leg {leg!r}, at which it closes, "
                    f"{at:.6g} {screw.unit} in the model"
                )
        return found

    def sample(self, random: np.random.Generator, spread: float) -> Sample:
        """Values of the symbols around the nominal ones, and a posture that is closed there.

        Raises
        ------
        InputError
            When the legs do not close there.
        """
        robot = self.robot
        names = {str(symbol) for symbol in robot.symbols}
        values = {
            name: value + spread * (abs(value) or 1.0) * random.uniform(-1, 1)
            for name, value in robot.nominal.items()
            if name in names
        }
        finder = posture_finder(robot.substituted(values) if values else robot.numeric)
        coordinates: dict[str, float] = {}
        at = [solver.home for solver in finder.solvers]
        pose: Any = None
        if self.pose or self.at_joints:
            places = robot.coordinate_places
            scale = np.where(np.arange(6) < 3, finder.length, 1.0)[places]
            steps = AROUND * scale * random.uniform(-1, 1, len(places))
            posture = finder.find(finder.home_pose[places] + steps)
            if not posture.reached[0]:
                raise InputError(
                    f"pose of {robot.name!r}", got=Words("; ".join(posture.complaints))
                )
            pose = posture.pose[0]
            at = [q[0] for q in posture.coordinates]
        for i, names in self.legs.items():
            coordinates.update(zip(names, map(float, at[i]), strict=True))
        if self.pose:
            x, y, z = pose[:3]
            R = Rotation.from_rotvec(pose[3:]).as_matrix()
            turns = self.rotation.of_rotation(R).values()
            found = dict(zip(all_names(self.rotation), map(float, (x, y, z, *turns)), strict=True))
            coordinates |= {symbol: found[name] for name, symbol in self.pose.items()}
        return Sample(values, finder, coordinates, pose)

    def samples(self, count: int, seed: int, spread: float) -> list[Sample]:
        """Several samples.

        Raises
        ------
        InputError
            When the legs close only at the nominal dimensions.
        """
        random = np.random.default_rng(seed)
        found: list[Sample] = []
        complaint: InputError | None = None
        for _ in range(_TRIES + count):
            if len(found) == count:
                return found
            try:
                found.append(self.sample(random, spread))
            except InputError as error:
                complaint = error
        raise InputError(
            f"formula of {self.robot.name!r}",
            got=Words(f"symbols at whose other values its legs do not close: {complaint}"),
            expected="legs that close at any values near those of the model",
            hint="name fewer symbols, such as the stiffnesses alone",
        )


def leg_coordinates(
    leg: Leg, names: tuple[str, ...], record: Record, length: float
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Coordinates of a closed leg: those of the model, numbers, or inputs.

    `leg`: on entries of the record; `names`: the inputs of its coordinates, with their values
    at the samples; `length`: size of the robot [m].

    Returns
    -------
    (size,) array of entries and numbers, and the names of the inputs that are left.
    """
    q = np.empty(len(names), dtype=object)
    symbols = []
    freedoms = zip(leg.chain.freedoms, leg.chain.home, names, strict=True)
    for j, (screw, home, name) in enumerate(freedoms):
        near = _KNOWN * (1.0 if screw.turns else length)
        entry = record.input(name)
        of_model = home.sample if isinstance(home, Entry) else float(home)
        closed = entry.sample
        if np.all(np.abs(closed - of_model) <= near):
            q[j] = home
        elif np.ptp(closed) <= near:
            plain = float(f"{np.mean(closed):.14g}")
            q[j] = exact_angle(plain) if screw.turns else exact_number(plain)
            q[j] = exact_number(0) if abs(np.mean(closed)) <= near else q[j]
        else:
            q[j] = record.simplify(entry)
            if isinstance(q[j], Entry) and q[j].step == entry.step:
                symbols.append(name)
                continue
        record.hide(name)
    return q, tuple(symbols)


def _moved_by_legs(robot: Robot, finder: PostureFinder) -> tuple[int, ...]:
    """Places of coordinates that the legs fix and that do not stay as they are at home."""
    given = robot.coordinate_places
    if len(given) == 6 or not given:
        return ()
    random = np.random.default_rng(7)
    scale = np.where(np.arange(6) < 3, finder.length, 1.0)
    steps = AROUND * scale[given] * random.uniform(-1, 1, (4, len(given)))
    posture = finder.find(finder.home_pose[given] + steps)
    poses, start = posture.pose[posture.reached], finder.home_pose.copy()
    if not len(poses):
        return ()
    if any(k in given for k in (3, 4, 5)):
        poses[:, 3:], start[3:] = Rotation.from_rotvec(poses[:, 3:]).as_euler("xyz"), 0.0
    moves = np.max(np.abs(poses - start) / scale, axis=0) > _KNOWN
    moves[given] = False
    if robot.space.size == 3:
        moves[3:5] = False
    if np.any(moves[3:]):
        moves[3:] = [k not in given for k in (3, 4, 5)]
    return tuple(int(k) for k in np.nonzero(moves)[0])


def gap_of(leg: Leg, q: np.ndarray, R: np.ndarray, p: np.ndarray, length: float) -> list[Any]:
    """Squares of the gaps between the end of a leg at some coordinates and the platform at R, p."""
    placed = place_chain(leg.chain, q, leg.base.R, leg.base.p)
    R_end = R @ np.array(leg.attachment.R, dtype=object)
    p_end = p + R @ np.array(leg.attachment.p, dtype=object)
    squares = []
    for gap in placed.gaps(R_end, p_end):
        shift = (gap.p_wanted - gap.p) * (1 / length)
        turn = (gap.R_wanted - gap.R).ravel()
        squares += [shift @ shift, turn @ turn]
    return squares
