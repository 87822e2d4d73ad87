"""A robot in numbers at random values: by these a derivation is compared before it is returned.

Legs and wrenches are seen there that are turns or mirror images of others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import sympy as sp
from scipy.spatial.transform import Rotation

from robostiff.analysis import stiffness
from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.exact.exact_points import matrix_value, values_of
from robostiff.analytic.placement.closed_posture import AROUND
from robostiff.analytic.placement.robot_placement import PlacedRobot, near_home, pose_at
from robostiff.elastostatics import Status, matrix_distance
from robostiff.errors import DisagreementError, InputError, Words
from robostiff.frozen import are_equal, frozen, replace
from robostiff.kept import kept
from robostiff.kinematics.closure.leg_solver import LegSolver
from robostiff.kinematics.closure.rods import Rod
from robostiff.kinematics.jacobians import in_groups
from robostiff.model import Robot
from robostiff.spatial import Space

#: Largest relative difference of two ways: rounding of either is far below it.
AGREED = 1e-8
# Limit where the numerical form reports a loss of digits.
_AGREED_IN_DOUBT = 1e-4
_FLOOR = 1e-3  # of K of a robot, beside that of a leg

# Of parameters: formulas that differ do so at almost all values.
_SETS = 1
_POSES = 3  # for each of them, where the pose has symbols
_TRIES = 8  # for a set of parameters and a pose at which the legs close
SPREADS = (0.02, 0.005, 0.0)  # of the parameters: some robots close at few values
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
    for spread in SPREADS:
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
        distance = matrix_distance(found, K, length, least=1.0)
        if distance <= limit:
            return
    i, j = np.unravel_index(np.argmax(np.abs(np.nan_to_num(found, nan=np.inf) - K)), K.shape)
    at = ", ".join(f"{symbol} = {float(value):.6g}" for symbol, value in values.items())
    raise DisagreementError(
        "the formula and the numerical form of K",
        f"by {distance:.1e} (K{i + 1}{j + 1} is {found[i, j]:.9g} and {K[i, j]:.9g})",
        where + (f", at {at}" if at else ""),
    )


_SAME_WRENCH = 1e-10  # of the largest entry
_ALIKE = 1e-11  # of the stiffness of legs
_FEWER = 1e-4  # digits that count of its small entries, as part of those of the largest
_LEAST = 1e-6  # root of an entry that may be rounding, as part of the largest


def images_of_legs(
    robot: Robot, stiffness: Sequence[np.ndarray], length: float
) -> dict[int, tuple[int, Image]]:
    """Legs of one chain that hold as an earlier one, turned about the vertical or mirrored.

    Only turns by all equal parts, of three or more, and mirror images of all of them: their average
    is a short formula.

    `stiffness`: (n, n) of each leg about the reference point, at values of the symbols at which
    nothing is equal by chance; `length`: of the robot [m].

    Returns
    -------
    dict of leg numbers to the number of the earlier leg, and how the leg is made from it
    """
    rows = np.array(robot.space.rows)
    K = np.zeros((len(stiffness), 6, 6))
    K[:, rows[:, None], rows] = stiffness
    K /= np.outer(scale := np.array([1.0] * 3 + [length] * 3), scale)
    found: dict[int, tuple[int, Image]] = {}
    for alike in map(list, in_groups([leg.chain for leg in robot.legs], are_equal)):
        x, y, z, a, b, c = np.abs(np.diag(K[alike[0]]))
        sizes = np.sqrt([x + y, x + y, z, a + b, a + b, c])
        sizes = np.maximum(sizes, _LEAST * np.max(sizes)) if np.any(sizes) else np.ones(6)
        # Of a small entry its own digits count as well, though fewer of them.
        whole, parts = K[alike] / np.max(sizes) ** 2, _FEWER * K[alike] / np.outer(sizes, sizes)
        each = np.stack([whole, parts], axis=1)
        for orbit in _orbits(each, lambda way, x: way.of(way.of(x).mT), _ALIKE)[0]:
            first = next(iter(orbit))
            found |= {alike[i]: (alike[first], way) for i, way in orbit.items() if i != first}
    return found


#: Names of the entries of a wrench: force, moment.
COMPONENTS = ("u_x", "u_y", "u_z", "m_x", "m_y", "m_z")

Products = list[tuple[Any, Any, Any]]  # number, and two entries


@frozen
class Image:
    """How a wrench is made from another: by a mirror, a turn about the vertical, and a sign."""

    part: Fraction  # of a full turn
    mirror: tuple[int, ...] | None = None  # signs of its six entries; None without a mirror
    sign: int = 1

    def made_from(self, wrench: Sequence[Any]) -> list[Any]:
        """The image of a wrench of six formulas or entries."""
        angle = 2 * sp.pi * sp.Rational(self.part.numerator, self.part.denominator)
        return self._image(wrench, sp.cos(angle), sp.sin(angle))

    def of(self, wrenches: np.ndarray) -> np.ndarray:
        """The images of wrenches in numbers (..., 6)."""
        c, s = np.cos(2 * np.pi * self.part), np.sin(2 * np.pi * self.part)
        return np.stack(self._image([wrenches[..., i] for i in range(6)], c, s), axis=-1)

    def _image(self, wrench: Sequence[Any], c: Any, s: Any) -> list[Any]:
        """By cosine and sine of the turn."""
        signs = [self.sign * x for x in self.mirror or 6 * (1,)]
        image: list[Any] = []
        for (x, y, z), (i, j, k) in ((wrench[:3], signs[:3]), (wrench[3:], signs[3:])):
            image += [(i * c) * x + (-j * s) * y, (i * s) * x + (j * c) * y, k * z]
        return image


#: All images of a wrench under turns by equal parts, half of them perhaps in a mirror, by their
#: numbers, and how each is made from the first.
Orbit = dict[int, Image]


def orbits_of(wrenches: np.ndarray) -> list[Orbit] | None:
    """Orbits that wrenches form together, of three turns or more; None where they do not.

    `wrenches` (count, m, 6): at several samples, moments over a length.
    """
    found, rest = _orbits(
        wrenches.swapaxes(0, 1), lambda way, w: way.of(w), _SAME_WRENCH, whole=True
    )
    return None if rest else found


def _orbits(
    items: np.ndarray,
    image: Callable[[Image, np.ndarray], np.ndarray],
    close: float,
    *,
    whole: bool = False,
) -> tuple[list[Orbit], set[int]]:
    """The orbits of the most turns, half of each perhaps in a mirror, and what is in none of them.

    `image`: of one of the items (m, ...); `whole`: whether orbits count only where all are in one.
    """

    def images(first: int, ways: list[Image], remaining: set[int]) -> dict[int, Image]:
        found: dict[int, Image] = {}
        for way in ways:
            moved, rest = image(way, items[first]), sorted(remaining - found.keys())
            both = np.stack([items[rest] - moved, items[rest] + moved])
            apart = np.abs(both).max(axis=tuple(range(2, both.ndim)))
            near = np.flatnonzero(apart.min(axis=0) < close)
            if not near.size:
                return {}
            k = near[0]
            found[rest[k]] = replace(way, sign=1 if apart[0, k] <= apart[1, k] else -1)
        return found

    every = set(range(len(items)))
    for N in range(len(items), 2, -1):
        turns = [Image(Fraction(k, N)) for k in range(N)]
        found, remaining, alone = list[Orbit](), set(every), set[int]()
        while remaining and not (whole and alone):
            first = min(remaining)
            turned = images(first, turns, remaining)
            alone |= set() if turned else {first}
            remaining -= turned.keys() or {first}
            if turned:
                ways = ([replace(turn, mirror=mirror) for turn in turns] for mirror in MIRRORS)
                mirrored = next(filter(None, (images(first, x, remaining) for x in ways)), {})
                remaining -= mirrored.keys()
                found.append(turned | mirrored)
        if found and not (whole and alone):
            return found, alone
    return [], every


#: Signs of the entries of a wrench: moments are turned the other way about by a mirror.
MIRRORS = ((1, -1, 1, -1, 1, -1), (-1, 1, 1, 1, -1, -1))


def averages(
    wrenches: Mapping[int, Sequence[Any]], orbits: list[Orbit] | None
) -> dict[tuple[int, int], Products]:
    """Products whose sum is that of w w^T, by averages where the wrenches are turns of one.

    Of orbits, only the first wrenches are needed.
    """
    M: dict[tuple[int, int], Products] = {(i, j): [] for i in range(6) for j in range(i, 6)}
    if orbits is None:
        for w in wrenches.values():
            for (i, j), products in M.items():
                products.append((1, w[i], w[j]))
        return M
    for orbit in orbits:
        w = wrenches[next(iter(orbit))]
        T = np.stack([way.of(np.eye(6)) for way in orbit.values()])
        shares = np.einsum("nai,nbj->ijab", T, T)
        for (i, j), products in M.items():
            both = shares[i, j] + shares[i, j].T - np.diag(np.diag(shares[i, j]))
            # Of turns by equal parts they are whole numbers and halves.
            for a, b in np.argwhere(np.triu(np.rint(2 * both))):
                products.append((sp.Rational(round(2 * both[a, b]), 2), w[a], w[b]))
    return M


_TURNS = tuple(Fraction(k, n) for n in range(2, 7) for k in range(1, n) if math.gcd(k, n) == 1)


def turn_in_words(wrenches: Sequence[Any], others: Sequence[Any]) -> str | None:
    """The turn that makes wrenches of formulas from others, one by one, up to signs; None of none.

    About z, or, where coordinates change places or signs, one of those of a cube.
    """
    if len(wrenches) != len(others) or not wrenches:
        return None
    rows = Space.of_size(len(wrenches[0])).rows

    def is_made_by(turned: Callable[[list[Any]], Sequence[Any]]) -> bool:
        for w, other in zip(wrenches, others, strict=True):
            known = dict(zip(rows, other, strict=True))
            image = turned([known.get(i, sp.Integer(0)) for i in range(6)])
            pairs = [(sp.sympify(image[i]), x) for i, x in zip(rows, w, strict=True)]
            if all(any(sp.expand(a - sign * b, trig=True) for a, b in pairs) for sign in (1, -1)):
                return False
        return True

    for part in _TURNS:
        if is_made_by(Image(part).made_from):
            return f"about z by {360 * part} degrees"
    # Turns of a cube, those about its diagonals first.
    axes = [x for x in product((1, 0, -1), repeat=3) if x > (0, 0, 0) and len(rows) == 6]
    for axis in sorted(axes, key=lambda x: (-abs(np.array(x)).sum(), -sum(x))):
        size = sum(map(abs, axis))
        about = str(axis) if size > 1 else "xyz"[axis.index(1)]
        for degrees in {3: (120, 240), 2: (180,), 1: (90, 180, 270)}[size]:
            turn = Rotation.from_rotvec(np.array(axis) * degrees / math.sqrt(size), degrees=True)
            R = np.rint(turn.as_matrix()).astype(int)
            if is_made_by(lambda w, R=R: [*(R @ np.array(w[:3])), *(R @ np.array(w[3:]))]):
                return f"about {about} by {degrees} degrees"
    return None
