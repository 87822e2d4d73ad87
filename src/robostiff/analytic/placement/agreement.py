"""Comparison of a derivation with the numerical forms, before it is returned."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analysis import stiffness
from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.exact.exact_points import matrix_value, values_of
from robostiff.analytic.placement.closed_posture import AROUND
from robostiff.analytic.placement.robot_placement import PlacedRobot, near_home, pose_at
from robostiff.elastostatics import Status
from robostiff.errors import DisagreementError, InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.kinematics.closure.leg_solver import LegSolver
from robostiff.kinematics.closure.rods import Rod
from robostiff.model import Robot

#: Largest relative difference of two ways: rounding of either is far below it.
AGREED = 1e-8
# Limit where the numerical form reports a loss of digits.
_AGREED_IN_DOUBT = 1e-4
_FLOOR = 1e-3  # of K of a robot, beside that of a leg

# Of parameters: formulas that differ do so at almost all values.
_SETS = 1
_POSES = 3  # for each of them, where the pose has symbols
_TRIES = 8  # for a set of parameters and a pose at which the legs close
_SPREADS = (0.02, 0.005, 0.0)  # of the parameters: some robots close at few values
_SEED = 74
_DRAWN = 12  # random values of symbols without nominal ones
_PARTS = 2**20
_MEET = 1e-6  # difference of coordinates [m, rad]: the root of rounding


_Place = tuple[dict[str, float], Any, bool]  # values, answer, and whether it is in doubt


@frozen
class RobotInNumbers:
    """A robot at random values of its symbols, and at random poses where these have symbols."""

    where: str  # the robot and its pose, in words
    symbols: tuple[sp.Symbol, ...]  # those that have values
    places: tuple[_Place, ...]  # (values, answer, whether it is in doubt)
    are_general: bool  # whether no value of the robot is that of the model
    length: float  # characteristic length [m]

    @property
    def leg_stiffness(self) -> tuple[np.ndarray, ...]:
        """(n, n) of each leg about the reference point, at the first of the values."""
        return self.places[0][1].leg_stiffness

    def check(
        self, K: Any, definitions: tuple[Definition, ...] = (), leg: int | None = None
    ) -> None:
        """Compare a formula of the stiffness, or of that of a leg, with that in numbers.

        Raises
        ------
        DisagreementError
            When they differ.
        """
        for values, result, doubtful in self.places:
            given = {s: values[s.name] for s in self.symbols}
            limit = _AGREED_IN_DOUBT if doubtful and leg is None else AGREED
            found, expected, where = K, result.K, self.where
            if leg is not None:
                # A part of K is added on both sides: rounding of what vanishes is not compared.
                beside, where = _FLOOR * result.K, f"leg {leg + 1} of {where}"
                found, expected = K + sp.Matrix(beside), result.leg_stiffness[leg] + beside
            check_value(found, definitions, given, expected, limit, where, self.length)


@kept
def numbers_of(placed: PlacedRobot) -> RobotInNumbers:
    """A placed robot in numbers, drawn once.

    Raises
    ------
    InputError
        When the legs reach none of the poses near home that the formula is for, or two postures of
        a leg meet at home.
    """
    check_that_postures_differ(placed)
    where = f"{placed.robot.name!r} {placed.where}"
    places = tuple(closed_places(placed))
    symbols = tuple(s for name, s in placed.symbols.items() if name in places[0][0])
    values, nominal = places[0][0], placed.robot.nominal
    general = all(values[name] != x for name, x in nominal.items() if name in values)
    return RobotInNumbers(where, symbols, places, general, placed.length)


def check_that_postures_differ(placed: PlacedRobot) -> None:
    """Refuse a leg of which two postures are one at the nominal values: none can be chosen."""
    for solver in placed.solvers:
        if _has_meeting_postures(solver):
            name = solver.leg.name
            raise InputError(
                f"formula of {placed.robot.name!r} {placed.where}",
                got=Words(f"two postures of leg {name!r} that meet at home, at the end of reach"),
                expected="values of the model at which home coordinates choose one of them",
                hint="derive it with other values of the model, and put yours in: "
                'derivation.subs({"name": value})',
            )


@kept
def _has_meeting_postures(solver: LegSolver) -> bool:
    """Whether a rod on a slide or crank is at the end of its reach at home."""
    if not isinstance(solver.closed_form, Rod):
        return False
    own = solver.closed_form.mode
    known = dict(zip(*solver.that_close(solver.home_pose), strict=True))
    q, other = (known.get(mode) for mode in (own, replace(own, root=-own.root)))
    return q is not None and other is not None and bool(np.max(np.abs(q - other)) <= _MEET)


def closed_places(placed: PlacedRobot, sets: int = _SETS, poses: int = _POSES) -> Iterator[_Place]:
    """Random values of the symbols and poses at which the legs close, with the numerical answer.

    `sets`: sets of parameters; one for a robot without symbols; `poses`: for each of them, where
    the pose has symbols.

    Raises
    ------
    InputError
        When the legs reach none of the poses near home that the formula is for.
    """
    random = np.random.default_rng(_SEED)
    robot = placed.robot
    sets = sets if robot.symbols or placed.follows.at_joints else 1
    is_varied = any(x.free_symbols for x in (placed.given or {}).values())
    poses = poses if is_varied else 1
    checked, complaint = 0, ""
    for spread in _SPREADS:
        for _ in range(max(_TRIES, 3 * sets)):
            try:
                numeric, postures = sampled_robots(placed, random, spread, poses)
                results = [(known, stiffness(numeric, pose)) for known, pose in postures]
            except InputError as error:
                complaint = str(error)
                if checked:
                    continue
                break  # the robot does not close at these values: nearer ones are tried
            for known, result in results:
                if result.answered:
                    yield known, result, bool(result.status & Status.ILL_CONDITIONED)
                else:
                    complaint = "; ".join(result.complaints) or complaint
            checked += any(result.answered for _, result in results)
            if checked >= sets:
                return
        if checked:
            return
    if not placed.given or is_varied:
        why = f": {complaint}" * bool(complaint)
        complaint = f"no pose near home at which all legs meet the platform{why}"
    raise InputError(
        f"formula of {robot.name!r} {placed.where}",
        got=Words(complaint),
        expected="poses that the legs reach",
        hint="name all coordinates of the pose by AtSymbols(), derive it at home, or leave out of "
        "`coordinates` those that the legs fix",
    )


def sampled_robots(
    placed: PlacedRobot, random: np.random.Generator, spread: float, count: int
) -> tuple[Robot, list[tuple[dict[str, float], Any]]]:
    """A robot at random values of its symbols, and poses: all values, and the pose of each.

    Raises
    ------
    InputError
        When its legs do not close there, or close in another working mode than the formula's.
    """
    follows = placed.follows
    sample = follows.sample(random, spread)
    numeric, values = sample.finder.robot, {**sample.values, **sample.coordinates}
    solvers = zip(sample.finder.solvers, placed.solvers, strict=False)
    forms = ((x.closed_form, y.closed_form) for x, y in solvers)
    if any(a and b and a.mode.root != b.mode.root for a, b in forms):
        raise InputError(
            f"working mode of {numeric.name!r}",
            got=Words(
                "another posture that is nearer to the home coordinates than that of the model"
            ),
            hint="write elbow: plus or minus, or home coordinates that are nearer to one of them",
        )
    if placed.given is None:
        return numeric, [(values, sample.pose)]
    finder, rotation, found = sample.finder, placed.rotation, []
    for _ in range(1 if follows.pose else count):
        drawn = {
            name: value + AROUND * size * random.uniform(-1, 1)
            for name, (value, size) in near_home(placed.given, finder, rotation).items()
        }
        known = drawn | values
        found.append((known, pose_at(placed.given, finder, known, rotation)))
    return numeric, found


def random_values(
    expressions: Sequence[Any], seed: int
) -> Iterator[tuple[dict[Any, float], np.ndarray]]:
    """Some values of the symbols at which all expressions are numbers, and these.

    Some of the values suit lengths, some sines.
    """
    random = np.random.default_rng(seed)
    different = dict.fromkeys(expressions)
    symbols = sorted(set().union(*(x.free_symbols for x in different)), key=lambda x: x.name)
    for attempt in range(_DRAWN):
        low, high = ((0.5, 1.5), (0.1, 0.9))[attempt % 2]
        # Few binary digits: exact values stay short.
        drawn = random.uniform(low, high, len(symbols)).tolist()
        values = {s: round(x * _PARTS) / _PARTS for s, x in zip(symbols, drawn, strict=True)}
        found = dict(zip(different, values_of(different, values), strict=True))
        numbers = np.array([found[x] for x in expressions], dtype=float)
        if np.all(np.isfinite(numbers)):
            yield values, numbers


def check_value(
    formula: Any,
    definitions: tuple[Definition, ...],
    values: Mapping[sp.Symbol, float],
    K: np.ndarray,
    limit: float,
    where: str,
    length: float,
) -> None:
    """Compare a formula at some values with numbers; with many digits where floats differ.

    Raises
    ------
    DisagreementError
        When they differ by more than the limit.
    """
    for careful in (False, True):
        found = matrix_value(formula, values, definitions, careful=careful)
        distance = matrix_distance(found, K, length)
        if distance <= limit:
            return
    i, j = np.unravel_index(np.argmax(np.abs(np.nan_to_num(found, nan=np.inf) - K)), K.shape)
    at = ", ".join(f"{symbol} = {float(value):.6g}" for symbol, value in values.items())
    raise DisagreementError(
        "the formula and the numerical form of K",
        f"by {distance:.1e} (K{i + 1}{j + 1} is {found[i, j]:.9g} and {K[i, j]:.9g})",
        where + (f", at {at}" if at else ""),
    )


def matrix_distance(A: np.ndarray, B: np.ndarray, length: float) -> float:
    """Largest difference of two stiffness matrices, relative; rotations at a length [m]."""
    if not np.all(np.isfinite(A)):
        return np.inf
    n = len(B)
    scale = np.ones(n)
    scale[2 if n == 3 else 3 :] = 1.0 / length
    both = np.outer(scale, scale)
    largest, apart = float(np.max(np.abs(B) * both)), float(np.max(np.abs(A - B) * both))
    return apart / largest if largest > 0 else apart


def length_of(K: np.ndarray) -> float:
    """A length at which the rotational part of a matrix is as large as the translational one."""
    t = 2 if len(K) == 3 else 3
    sizes = np.max(np.abs(K[:t, :t])), np.max(np.abs(K[t:, t:]))
    return float(np.sqrt(sizes[1] / sizes[0])) if min(sizes) > 0 else 1.0
