"""Symbols of a robot as inputs of its record, and the postures at which it is sampled."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import add, mul
from typing import Any

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.kept import kept
from robostiff.kinematics import JointCoordinates, Posture, PostureFinder, posture_finder
from robostiff.model import Robot, with_entries
from robostiff.model.entries import OfSymbols, Symbolic
from robostiff.record import (
    Entry,
    Record,
    arc_cosine,
    arc_tangent,
    cosine,
    hyperbolic_tangent,
    reciprocal,
    sine,
    square_root,
)


def entry_reader(record: Record, *, exact: bool) -> Callable[[Any], Any]:
    """A function that writes SymPy expressions, or numbers, as entries of a record, or numbers.

    The record has an input for every symbol. `exact`: numbers of SymPy stay as they are; otherwise
    they become floats.
    """
    known: dict[Any, Any] = {}

    def read(expression: Any) -> Any:
        if not hasattr(type(expression), "free_symbols"):
            return expression
        if expression in known:
            return known[expression]
        if expression.is_number:
            # Sums and products of roots would grow term by term: they are steps.
            is_step = exact and not expression.is_Rational
            number = expression if exact else float(expression)
            found = Entry(record, record.number(number)) if is_step else number
        elif expression.is_Symbol:
            if expression.name not in record.inputs:
                known_ones = ", ".join(record.inputs) or "none"
                raise InputError("symbol", got=expression.name, expected=known_ones)
            found = record.input(expression.name)
        elif expression.is_Pow:
            base, exponent = read(expression.base), expression.exp
            if exponent.is_Integer:
                found = base ** int(exponent)
            elif exponent.is_Rational and exponent.q == 2:
                found = square_root(base) ** int(exponent.p)
            else:
                raise InputError("power", got=str(expression), expected="a whole or half exponent")
        else:
            combine = _FUNCTIONS.get(type(expression).__name__)
            if combine is None:
                names = ", ".join([*_FUNCTIONS][2:])
                expected = f"sums, products, whole and half powers, {names}"
                raise InputError("formula", got=str(expression), expected=expected)
            found = combine(*map(read, expression.args))
        known[expression] = found
        return found

    return read


_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "Add": lambda *terms: reduce(add, terms),
    "Mul": lambda *factors: reduce(mul, factors),
    "sin": sine,
    "cos": cosine,
    "tan": lambda angle: sine(angle) * reciprocal(cosine(angle)),
    "atan2": arc_tangent,
    "atan": lambda slope: arc_tangent(slope, 1),
    "acos": arc_cosine,
    "asin": lambda y: arc_tangent(y, square_root(1 - y * y)),
    "tanh": hyperbolic_tangent,
}


COUNT = 5
_SEED_OF_SAMPLES = 20110
_SHRINKS = 6


@kept
def sample_postures(finder: PostureFinder, seed: int | None = None, nearer: int = 0) -> Posture:
    """A few postures near home in general position, one a row, that all legs reach.

    Pose coordinates that the robot is free to choose are drawn at random; the others follow from
    the legs. For a serial arm posed by its joints, joint coordinates are drawn. Another seed gives
    others than those of the records; each whole number of `nearer` takes a fifth of the way.

    Raises
    ------
    InputError
        When no neighbourhood of home is reached.
    """
    random = np.random.default_rng(_SEED_OF_SAMPLES if seed is None else seed)
    by_joints, chain = finder.robot.is_posed_by_joints, finder.robot.legs[0].chain
    chosen = finder.robot.coordinate_places
    if by_joints:
        home, scale, most = chain.home, chain.sizes(finder.length), 3
    else:
        home, most = finder.home_pose[chosen], 1
        scale = np.where(np.arange(6) < 3, finder.length, 2.0)[chosen]
    spread = 0.1 * 0.2**nearer
    for _ in range(_SHRINKS - nearer):
        drawn = home + spread * scale * random.uniform(-most, most, (3 * COUNT, len(home)))
        posture = finder.find(JointCoordinates(drawn) if by_joints else drawn)
        rows = np.flatnonzero(posture.reached)[:COUNT]
        if rows.size == COUNT:
            if by_joints:
                return finder.find(JointCoordinates(posture.coordinates[0][rows]))
            return finder.find(posture.pose[rows])
        spread *= 0.2
    raise InputError(
        f"home pose of {finder.robot.name!r}",
        got=Words("poses around it that the legs do not reach"),
        expected="a home pose with room around it",
        hint="free coordinates that the legs fix belong out of `coordinates`",
    )


_SPREAD, _LEAST = 0.02, 1e-9  # of the nominal values
_SEED = 1911


def parameter_samples(robot: Symbolic, seed: int | None = None) -> dict[str, np.ndarray]:
    """Values of the symbols of a robot around the nominal ones, by name (samples,); {} of none.

    Another seed gives others than those of the records.
    """
    random = np.random.default_rng(_SEED if seed is None else seed)
    names = [str(symbol) for symbol in robot.symbols]
    nominal = np.array([[float(robot.nominal[name])] for name in names]).reshape(-1, 1)
    away = np.where(nominal == 0, 1.0, abs(nominal)) * random.uniform(-1, 1, (len(names), COUNT))
    spread = _SPREAD
    while robot.error_at(nominal + spread * away) and spread > _LEAST:  # as of a thin wall
        spread /= 2
    return dict(zip(names, nominal + spread * away, strict=True))


def with_inputs(robot: OfSymbols, record: Record) -> OfSymbols:
    """The robot with the inputs of a record in place of its symbols, and floats elsewhere."""
    if not robot.has_formulas:
        return robot
    return with_entries(robot, entry_reader(record, exact=False))


def closed_samples(robot: Robot, finder: PostureFinder) -> tuple[np.ndarray, list[np.ndarray]]:
    """Sample postures, each with its own values of the parameters: poses, and q of each leg.

    Arrays (samples, 6) and (samples, size) [m, rad]. An `InputError` says where a leg does not
    reach them with other values of the parameters.
    """
    posture = sample_postures(finder)
    values = parameter_samples(robot)
    if not values or robot.is_posed_by_joints:
        return posture.pose, list(posture.coordinates)
    found = []
    for k in range(COUNT):
        other = robot.substituted({name: float(x[k]) for name, x in values.items()})
        chosen = robot.coordinate_places
        closed = posture_finder(other).find(posture.pose[k : k + 1, chosen])
        if not closed.reached.all():
            subject = f"parameters of {robot.name!r}"
            expected = "parameters that may change a little while the legs reach the platform"
            raise InputError(subject, got=", ".join(values), expected=expected)
        found.append(closed)
    legs = zip(*(closed.coordinates for closed in found), strict=True)
    return np.concatenate([one.pose for one in found]), [np.concatenate(q) for q in legs]


def coordinates_at_home(robot: Robot, finder: PostureFinder) -> list[float | Entry]:
    """Home coordinates of a robot on entries; those of the position may depend on parameters.

    Raises InputError when a parameter turns the platform about axes that are not among the pose
    coordinates.
    """
    six: list[float | Entry] = finder.home_pose.tolist()
    if robot.home is None or not robot.has_formulas:
        return six
    if turns_at_home(robot) and not {3, 4, 5} <= set(robot.coordinate_places):
        raise InputError(
            f"parameters of {robot.name!r}",
            got=Words("one that turns the platform at home"),
            expected="parameters that leave the rotation of the platform at home alone",
            hint="leave that parameter at its nominal value",
        )
    return [*robot.home.p.tolist(), *six[3:]]


def turns_at_home(robot: Robot) -> bool:
    """Whether a parameter turns the platform of a robot on entries at home."""
    return robot.home is not None and any(isinstance(x, Entry) for x in robot.home.R.flat)


def rate_name(joint: str, by: str) -> str:
    """The input that is the rate of a joint with another input of its closure."""
    return f"d {joint} / d {by}"
