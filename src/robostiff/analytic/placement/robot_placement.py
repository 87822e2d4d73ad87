"""A robot on recorded entries, placed at a pose: its closure as formulas."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, cached_property
from typing import Any

import numpy as np
import sympy as sp
from scipy.spatial.transform import Rotation

from robostiff.analytic.exact.definition import Definition, in_given_symbols
from robostiff.analytic.placement.closed_posture import Following, Sample, leg_coordinates
from robostiff.analytic.placement.named_springs import NamedSprings, with_samples
from robostiff.analytic.placement.robot_pose import (
    ABOUT_WORLD_AXES,
    AtHome,
    PoseFormula,
    PoseRotation,
    coordinate_expressions,
    exact_angle,
    platform_pose,
)
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.kinematics import JointCoordinates, PostureFinder, posture_finder
from robostiff.kinematics.closure.leg_solver import LegSolver
from robostiff.kinematics.formula import FormulaPose, PlacedFormula, place_leg, place_leg_at_joints
from robostiff.kinematics.pose import six_coordinates
from robostiff.model import Leg, Robot, with_entries
from robostiff.model.entries import as_meant
from robostiff.record import Entry, Record
from robostiff.recorded import RecordedLeg, RecordedRobot, entry_reader, robot_stiffness
from robostiff.spatial import exact_number

AT_HOME = "in the home configuration"
_SAMPLES = 5
_SPREAD = 0.03  # of the nominal values, for the samples
_SEED = 2011


@frozen
class PlacedRobot:
    """A robot on recorded entries, placed at its pose."""

    robot: Robot  # as it was given
    entries: Robot  # the same on entries of the record
    pose: PoseFormula
    where: str  # the pose, in words
    coordinates: tuple[str, ...]  # names of the symbols of the pose
    # names of the symbols, some coordinates among them, whose values the closure of the legs
    # decides
    following: tuple[str, ...]
    follows: Following  # how to find them in numbers
    # by name: coordinates of the platform, or of a serial arm; None at home
    given: dict[str, Any] | None
    rotation: PoseRotation  # what the coordinates of its rotation are
    closed: dict[int, np.ndarray]  # by leg number: coordinates of the legs that close by iteration
    record: Record
    symbols: dict[str, sp.Symbol]  # by name: one for each input of the record
    # what those of them stand for that are no given symbols, and other names
    springs: tuple[Definition, ...]
    platform: FormulaPose
    # a leg by its number; not placed before it is needed
    place: Callable[[int], PlacedFormula]
    solvers: tuple[LegSolver, ...]  # of the legs at nominal values
    length: float  # characteristic length [m]

    @property
    def reference(self) -> np.ndarray:
        """Reference point in the world (3,)."""
        point = np.array(self.entries.reference_point, dtype=object)
        return self.platform.p + self.platform.R @ point

    @property
    def meanings(self) -> dict[str, str]:
        """What the symbols are: coordinates of the pose, and parameters of the robot."""
        given, found = self.given or {}, {}
        turns = self.rotation.in_words(given)
        for name, value in given.items():
            if not value.is_Symbol:
                words = f"coordinate of the pose, {name} = {value}"
            elif self.robot.is_posed_by_joints:
                words = "joint coordinate, in the order of the arm [rad, or m of a slide]"
            elif name in self.rotation.names:
                words = f"rotation of the platform, {turns}"
            else:
                words = "place of the platform's origin [m]"
            found |= {symbol.name: words for symbol in value.free_symbols}
        return found | self.follows.meanings(self.solvers) | dict(self.robot.meanings)

    def knowing(self, definitions: Sequence[Definition]) -> PlacedRobot:
        """The same with names that formulas have, so that each formula gets one."""
        own = {d.symbol for d in self.springs}
        others = (d for d in definitions if d.symbol not in own)
        return replace(self, springs=(*self.springs, *others))

    @cached_property
    def written_out(self) -> dict[str, Any]:
        """The symbols by name, and what those of springs stand for in given symbols."""
        named = in_given_symbols(self.springs)
        return {name: named.get(symbol, symbol) for name, symbol in self.symbols.items()}

    @cached_property
    def legs(self) -> tuple[PlacedFormula, ...]:
        """All legs."""
        return tuple(map(self.place, range(len(self.entries.legs))))

    @cached_property
    def recorded(self) -> RecordedRobot:
        """Its elimination on the same record, when it is first looked at."""
        return robot_stiffness(self.entries, self.record, self.platform, self.legs, self.length)

    @property
    def eliminated(self) -> tuple[RecordedLeg, ...]:
        """The legs of this elimination; none where it was not looked at."""
        return vars(self)["recorded"].legs if "recorded" in vars(self) else ()


def place_robot(robot: Robot, pose: PoseFormula) -> PlacedRobot:
    """Close all legs of a robot in formulas.

    Symbols are entries of a record whose samples lie around the nominal values; the working modes
    of the legs are those of home.

    `pose`: AtHome, AtSymbols or AtCoordinates.

    Raises
    ------
    InputError
        When a symbol has no nominal value, or a leg has no closed form away from home.
    """
    robot = robot if robot.has_formulas else as_meant(robot)
    finder = posture_finder(robot.numeric)
    given = coordinate_expressions(robot, pose)
    rotation = ABOUT_WORLD_AXES if isinstance(pose, AtHome) else pose.rotation
    follows = Following.of(robot, finder, pose)
    if follows.pose:
        given = {name: sp.Symbol(symbol, real=True) for name, symbol in follows.pose.items()}
    symbols = {symbol.name: symbol for symbol in robot.symbols}
    for expression in (given or {}).values():
        symbols |= {symbol.name: symbol for symbol in expression.free_symbols}
    for names in follows.legs.values():
        symbols |= {name: sp.Symbol(name, real=True) for name in names}
    names = NamedSprings(robot, symbols) if symbols else None
    springs = () if names is None else names.definitions
    samples = _samples(symbols, given, robot, finder, follows, rotation)
    record = Record(with_samples(springs, samples, symbols))
    read = entry_reader(record, exact=True)
    exact = cache(exact_number)  # most numbers are 0 or 1
    named = {} if names is None else names.parts(read)
    entries = with_entries(robot, lambda x: x if isinstance(x, Entry) else read(exact(x)), named)
    coordinates = None
    if given is not None:
        coordinates = {name: as_step(read(value), record) for name, value in given.items()}
    following = follows.following
    at_joints: dict[int, np.ndarray] = {}

    if robot.is_posed_by_joints:
        # The given coordinates, the others at home.
        chain = entries.legs[0].chain
        q = np.array(chain.home, dtype=object)
        for i, screw in enumerate(chain.freedoms):
            value = (coordinates or {}).get(f"q{i + 1}", q[i])
            if screw.turns and not isinstance(value, Entry):
                value = as_step(exact_angle(value), record)
            q[i] = value
        at_joints[0] = q
        platform = place_leg_at_joints(entries.legs[0], q).platform
    else:
        platform = platform_pose(FormulaPose(*home_frame(entries)), coordinates, rotation)
        for i, names_of_leg in follows.legs.items():
            leg = entries.legs[i]
            q, symbols_of_leg = leg_coordinates(leg, names_of_leg, record, finder.length)
            pairs = zip(q, leg.chain.freedoms, strict=True)
            angled = [as_step(x, record) if screw.turns else x for x, screw in pairs]
            at_joints[i], following = np.array(angled, dtype=object), following + symbols_of_leg

    def closing(i: int) -> PlacedFormula:
        leg = entries.legs[i]
        if i in at_joints:
            return place_leg_at_joints(leg, at_joints[i])
        return place_leg(leg, platform, finder.solvers[i])

    place = cache(
        lambda i: with_entries(closing(i), lambda x: x if isinstance(x, Entry) else read(x))
    )
    for i in {*range(len(entries.legs))} - at_joints.keys():
        _check_closed_form(entries.legs[i], finder.solvers[i])
    if follows.at_joints:
        platform = place(0).platform
    return PlacedRobot(
        robot=robot,
        entries=entries,
        pose=pose,
        where=_in_words(given, following, rotation, at_joints=follows.at_joints),
        coordinates=tuple(str(v) for v in (given or {}).values() if v.is_Symbol),
        following=following,
        follows=follows,
        given=given,
        rotation=rotation,
        closed={} if robot.is_posed_by_joints else at_joints,
        record=record,
        symbols=symbols,
        springs=springs,
        platform=platform,
        place=place,
        solvers=() if robot.is_posed_by_joints else finder.solvers,
        length=finder.length,
    )


def near_home(
    given: Mapping[str, Any], finder: PostureFinder, rotation: PoseRotation
) -> dict[str, tuple[float, float]]:
    """Values at home of the symbols of a pose, and sizes by which they may differ from these.

    What a coordinate is made of by a formula has no value at home: it is near 1.
    """
    at_home = home_values(finder, rotation)
    found: dict[str, tuple[float, float]] = {}
    for name, expression in given.items():
        value_and_size = at_home[name], finder.length if name in ("x", "y", "z") else 1.0
        for symbol in expression.free_symbols:
            found[str(symbol)] = value_and_size if expression.is_Symbol else (1.0, 1.0)
    return found


def pose_at(
    given: Mapping[str, Any],
    finder: PostureFinder,
    values: Mapping[str, float],
    rotation: PoseRotation,
) -> Any:
    """The pose (6,) of the platform that has given coordinates, others as at home.

    Of a serial arm its joint coordinates.
    """
    numbers = {
        name: float(x.evalf(30, subs={s: values[s.name] for s in x.free_symbols}))
        for name, x in given.items()
    }
    if finder.robot.is_posed_by_joints:
        return JointCoordinates(np.array([*(home_values(finder, rotation) | numbers).values()]))
    six = finder.home_pose
    home = FormulaPose(Rotation.from_rotvec(six[3:]).as_matrix(), six[:3])
    pose = platform_pose(home, numbers, rotation)
    return six_coordinates(pose.R.astype(float), pose.p.astype(float))


def as_step(value: Any, record: Record) -> Any:
    """An angle whose cosine is no root of numbers, as a step: its exact numbers are too long."""
    if isinstance(value, Entry) or not sp.cos(value).has(sp.cos, sp.sin):
        return value
    return Entry(record, record.number(value))


def home_frame(entries: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and point of the platform at home."""
    if entries.home is None:
        raise InputError(
            f"home pose of {entries.name!r}", expected="a pose of the platform, or a serial arm"
        )
    return np.array(entries.home.R, dtype=object), np.array(entries.home.p, dtype=object)


def _check_closed_form(leg: Leg, solver: LegSolver) -> None:
    if solver.recorded_form is not None:
        return
    in_joints = ", or at pose=AtSymbols(), where joint coordinates of the legs are symbols"
    in_joints *= not leg.chain.has_blocks
    raise InputError(
        f"closure of leg {leg.name!r}",
        got=Words("a leg without a closed form"),
        expected="a strut, a rod on a slide or a crank, or a post with one joint, at given "
        "coordinates of the pose",
        hint=f"derive it at home{in_joints}; or compute numbers: rs.stiffness(robot, pose)",
    )


def _samples(
    symbols: Mapping[str, sp.Symbol],
    given: Mapping[str, Any] | None,
    robot: Robot,
    finder: PostureFinder,
    follows: Following,
    rotation: PoseRotation,
) -> dict[str, Any]:
    """Values of the symbols around the nominal ones, and of pose symbols around home.

    Where coordinates follow from the legs, all values are those of closed postures.
    """
    if follows.any:
        closed: list[Sample] = follows.samples(_SAMPLES, _SEED, _SPREAD)
        found = [{**sample.values, **sample.coordinates} for sample in closed]
        return {name: np.array([values[name] for values in found]) for name in symbols}
    random = np.random.default_rng(_SEED)
    near = near_home(given or {}, finder, rotation)
    near |= {name: (float(x), 1.0) for name, x in robot.nominal.items()}
    samples: dict[str, Any] = {}
    for name in symbols:
        value, size = near.get(name, (1.0, 1.0))
        spread = _SPREAD * (abs(value) or min(size, 1.0))
        samples[name] = value + spread * random.uniform(-1, 1, _SAMPLES)
    return samples


def home_values(finder: PostureFinder, rotation: PoseRotation) -> dict[str, float]:
    """Coordinates of a pose formula at home, those of a rotation near which it is derived."""
    twin = finder.robot
    if twin.is_posed_by_joints:
        home = twin.legs[0].chain.home
        return {f"q{i + 1}": float(q) for i, q in enumerate(home)}
    point = dict(zip("xyz", map(float, finder.home_pose[:3]), strict=True))
    return point | dict.fromkeys(rotation.names, 0.0)


def _in_words(
    given: Mapping[str, Any] | None,
    following: tuple[str, ...],
    rotation: PoseRotation,
    *,
    at_joints: bool,
) -> str:
    if at_joints:
        return f"at joint coordinates {', '.join(following)} at which the legs close"
    if not given:
        where = AT_HOME
    else:
        where = "at " + ", ".join(
            name if str(value) == name else f"{name} = {value}" for name, value in given.items()
        )
        if rotation != ABOUT_WORLD_AXES and any(name in given for name in rotation.names):
            where += f", turned by {rotation.in_words(given)}"
    return f"{where}, where the legs determine {', '.join(following)}" if following else where
