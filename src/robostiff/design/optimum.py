"""The best values of the parameters of a robot."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from enum import Enum
from functools import partial, reduce
from typing import Any

import numpy as np

from robostiff.compiled import Output, TotalMass
from robostiff.design.numbers import NumbersOfDesigns, Poses, require_answers
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen
from robostiff.io.edited_file import write_parameters
from robostiff.kept import kept_for_last
from robostiff.markup import InNotebooks, number
from robostiff.model import Robot
from robostiff.record import least
from robostiff.recorded import RecordedRobot
from robostiff.spatial import Space, as_float, as_floats

# Of the range of a variable, or of a limit: what counts as reached.
_REACHED = 1e-6
# Legs must close with this part of what stands below the roots of their closure, at least.
_ROOM = 1e-2
_PRECISION, _MOST_STEPS = 1e-12, 300
# Beside rounding; and the mode of SLSQP without a direction of descent.
_ROUNDED, _NO_DESCENT = 1e-9, 8
# In place of the objective where there is no answer, so that a step is shortened.
_FAR = 1e6


@frozen
class Within:
    """A limit of a number at each pose: it is at most or at least so large [SI].

    Attributes
    ----------
    output : Output
    most, least : float or None
    """

    output: Output
    most: float | None = None
    least: float | None = None

    def __post_init__(self) -> None:
        if self.most is None and self.least is None:
            raise InputError(
                f"limits of {self.output.name}", got=Words("none"), expected="most=, least= or both"
            )
        for _, value, _ in self.bounds(1.0):
            as_float(f"limit of {self.output.name}", value, "a number [SI]")

    def bounds(self, size: float) -> list[tuple[str, float, float]]:
        """Those that are given: word, bound, and what makes the room below it positive, and 1.

        A bound of zero is compared with the size of the numbers.
        """
        each = ("most", self.most, -1.0), ("least", self.least, 1.0)
        return [(word, x, sign / (abs(x) or size)) for word, x, sign in each if x is not None]


def mass_below(most: float) -> Within:
    """The limit of a total mass [kg]."""
    return Within(TotalMass(), most=most)


@frozen
class Worst:
    """The largest of the numbers at all poses."""


@frozen
class Mean:
    """The mean of the numbers at all poses."""


@frozen
class PNorm:
    """``(mean |x|^p)^(1/p)`` of the numbers at all poses: between mean and largest size."""

    p: float = 8.0

    def __post_init__(self) -> None:
        if not 1.0 <= self.p < np.inf:
            expected = "a number from 1 on; write Worst() for the largest"
            raise InputError("p of PNorm", got=self.p, expected=expected)


class Ending(Enum):
    """How the search for an optimum ended."""

    OPTIMUM = "optimum"
    INFEASIBLE = "infeasible"
    NOT_CONVERGED = "not-converged"

    @property
    def advice(self) -> str:
        """What to do."""
        return {
            Ending.OPTIMUM: "a local optimum; other starts may lead to others",
            Ending.INFEASIBLE: "no values within the ranges were found that keep all limits; "
            "widen the ranges or the limits, or give another start",
            Ending.NOT_CONVERGED: "the search stopped before an optimum; begin again from its "
            "values, start=found.values, or narrow the ranges",
        }[self]


@frozen
class Optimum(InNotebooks):
    """What `optimise` found.

    Attributes
    ----------
    values : dict of str to float
        Of the variables [SI].
    objective, at_start : float
        The combined objective there, and at the start.
    ending : Ending
    at_limits : tuple of str
        Variables at an end of their range, and limits that hold with equality.
    steps : int
        Iterations.
    robot : Robot
        With these values.
    """

    values: dict[str, float]
    objective: float
    at_start: float
    ending: Ending
    at_limits: tuple[str, ...]
    steps: int
    robot: Robot

    @property
    def status(self) -> Ending:
        """How the search ended: `ending`, under the name that all results have."""
        return self.ending

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do, in sentences."""
        return (self.ending.advice,)

    def write(self, path: str | os.PathLike[str], source: str | os.PathLike[str]) -> None:
        """Write the model file `source` with the values that were found, as a new file.

        Comments, order and units stay.

        Raises
        ------
        InputError
            When the file has no such parameter, or would be written over.
        NoAnswerError
            When the values keep not all limits.
        """
        if self.ending is Ending.INFEASIBLE:
            raise NoAnswerError(f"no best values of {self.robot.name!r}: {self.ending.advice}")
        write_parameters(self.values, path, source)

    def __repr__(self) -> str:
        values = ", ".join(f"{name} = {number(value)}" for name, value in self.values.items())
        limits = f"; at limits: {', '.join(self.at_limits)}" if self.at_limits else ""
        return (
            f"<{self.ending.value} after {self.steps} steps: {number(self.objective)}, "
            f"{number(self.at_start)} at the start; {values}{limits}>"
        )


@frozen
class _Room:
    """By how much the legs close and the drives are within their limits, as parts."""

    name = "room"

    def shape(self, space: Space) -> tuple[int, ...]:
        return ()

    def entries(self, robot: RecordedRobot) -> list[Any]:
        # where legs miss the platform no answer is confirmed, and none is left
        parts = [x for x in robot.reach if not any(x is gap for gap in robot.gaps)]
        return [reduce(least, [*parts, *robot.limits], 1.0)]


def optimise(
    robot: Robot,
    objective: Output,
    variables: Mapping[str, tuple[float, float]],
    *,
    poses: Poses = None,
    constraints: Sequence[Within] = (),
    combine: Worst | Mean | PNorm = Worst(),
    start: Mapping[str, float] | None = None,
) -> Optimum:
    """Values of parameters that make a number as small as possible.

    Sequential quadratic programming with exact gradients: of all variables by one sweep back
    through the record. The worst of several poses is one more variable that no pose exceeds.
    Variables are scaled to their ranges, the objective and limits to their sizes. That the legs
    close at all poses is a constraint.

    Parameters
    ----------
    robot : Robot
        With symbols for the variables.
    objective : Output
        Of one number a pose: `WorstDeflection`, `DisplacementUnder`, `EntryOf`, `TotalMass`.
    variables : mapping of str to (float, float)
        The range of each parameter that may change [SI].
    poses : (N, n) array or JointCoordinates, optional
        Free pose coordinates [m, rad]; the home of the nominal robot when left out.
    constraints : sequence of Within
        Such as ``[rs.mass_below(60), rs.Within(rs.WorstDeflection(), most=2e-8)]``.
    combine : Worst, Mean or PNorm
        What is made of the numbers of several poses.
    start : mapping of str to float, optional
        Where the search begins; nominal values when left out, moved into the ranges.

    Raises
    ------
    InputError
        When a variable is no parameter, a start is that of no variable, or a range is empty; when a
        range is without the nominal value, and a pose without answer there.
    NoAnswerError
        When a pose has no answer at the start.

    References
    ----------
    Kraft: A software package for sequential quadratic programming, DFVLR-FB 88-28, 1988.

    Examples
    --------
    The worst deflection of a platform at its home, by the radius of its base:

    >>> import robostiff as rs
    >>> robot = rs.load("gough-stewart-b", symbols=("R",))
    >>> found = rs.optimise(robot, rs.WorstDeflection(), {"R": (0.3, 2.0)})
    >>> found.ending.value, found.objective < found.at_start
    ('optimum', True)
    """
    names, (low, high) = tuple(variables), _ranges(variables)
    limits = [*constraints, Within(_Room(), least=_ROOM)]
    outputs = tuple(dict.fromkeys([objective, *(each.output for each in limits)]))
    numbers = NumbersOfDesigns.of(robot, outputs, names, poses)
    begun = {n: as_float(f"start of {n}", x, "a number [SI]") for n, x in (start or {}).items()}
    x = np.array([begun.get(name, robot.nominal.get(name, np.nan)) for name in names])
    x = np.clip(np.where(np.isfinite(x), x, 0.5 * (low + high)), low, high)
    first = _at_start(robot, numbers, x, begun, (low, high))
    sizes = [float(np.max(np.abs(numbers))) or 1.0 for numbers in first]
    size = sizes[0]
    n = len(names)

    def at(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Numbers (outputs, N) and rates (outputs, N, n) with scaled variables."""
        x = low + z * (high - low)
        values, rates = kept_for_last(_on_the_way, numbers, x, first.shape)
        return values, rates * (high - low)

    is_worst = isinstance(combine, Worst)
    bounds = [(0.0, 1.0)] * n + [(None, None)] * is_worst

    def objective_at(z: np.ndarray) -> tuple[float, np.ndarray]:
        if is_worst:
            return float(z[n]), np.append(np.zeros(n), 1.0)
        values, rates = (each[0] / size for each in at(z[:n]))
        value, weights = _combination(combine, values)
        return (value, weights @ rates) if np.isfinite(value) else (_FAR, np.zeros(n))

    def room_below(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What must not be negative (m,), and its rates (m, variables)."""
        values, rates = at(z[:n])
        parts = []
        if is_worst:
            above = np.column_stack([-rates[0] / size, np.ones(values.shape[1])])
            parts.append((z[n] - values[0] / size, above))
        for limit in limits:
            row = outputs.index(limit.output)
            for _, bound, scale in limit.bounds(sizes[row]):
                rate = np.pad(scale * rates[row], ((0, 0), (0, int(is_worst))))
                parts.append((scale * (values[row] - bound), rate))
        room, rate = (np.concatenate(each) for each in zip(*parts, strict=True))
        return np.where(np.isfinite(room), room, -_FAR), np.nan_to_num(rate)

    z = (x - low) / (high - low)
    begin = np.append(z, np.max(first[0]) / size) if is_worst else z
    found = _search(objective_at, room_below, begin, bounds)
    z = np.clip(found.x[:n], 0.0, 1.0)
    values, _ = at(z)
    if lost := not np.isfinite(values).all():  # the search stopped where there is no answer
        z, values = begin[:n], first
    kept = bool(np.min(room_below(np.append(z, np.max(values[0]) / size))[0]) > -_REACHED)
    ending = Ending.OPTIMUM if found.success and not lost else Ending.NOT_CONVERGED
    best = dict(zip(names, (low + z * (high - low)).tolist(), strict=True))
    at_ends = [name for name, part in zip(names, z, strict=True) if min(part, 1 - part) < _REACHED]
    held = [
        f"{limit.output.name} at {word} {number(bound)}"
        for limit in constraints
        for row in [outputs.index(limit.output)]
        for word, bound, scale in limit.bounds(sizes[row])
        if abs(np.min(scale * (values[row] - bound))) <= _REACHED
    ]
    return Optimum(
        values=best,
        objective=_combination(combine, values[0])[0],
        at_start=_combination(combine, first[0])[0],
        ending=ending if kept else Ending.INFEASIBLE,
        at_limits=(*at_ends, *held),
        steps=int(found.nit),
        robot=robot.substituted(best),
    )


def _search(objective: Any, room: Any, begin: np.ndarray, bounds: Any) -> Any:
    """By SLSQP; where rounding leaves it no direction of descent, it begins again there."""
    from scipy.optimize import minimize

    limits = {"type": "ineq", "fun": lambda z: room(z)[0], "jac": lambda z: room(z)[1]}
    given: Any = {"jac": True, "bounds": bounds, "constraints": limits}
    search = partial(minimize, objective, method="SLSQP", **given)
    found = search(begin, options={"ftol": _PRECISION, "maxiter": _MOST_STEPS})
    if found.status == _NO_DESCENT:
        found = search(found.x, options={"ftol": _ROUNDED, "maxiter": _MOST_STEPS})
    return found


def _on_the_way(
    numbers: NumbersOfDesigns, x: np.ndarray, shape: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of a shape (outputs, N), and rates (outputs, N, n), of variables (n,) of a search.

    Not a number where these are values of no robot, as of a negative stiffness.
    """
    try:
        return numbers.at(x)[:2]
    except InputError:
        return np.full(shape, np.nan), np.full((*shape, len(x)), np.nan)


def _at_start(
    robot: Robot,
    numbers: NumbersOfDesigns,
    x: np.ndarray,
    start: Mapping[str, float],
    ranges: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Numbers (outputs, N) at a start (n,), some variables of which were given.

    Raises NoAnswerError where one of them has no value, or no rates; InputError where that is in a
    range without the nominal value, or what is given is no variable.
    """
    for name in set(start) - set(numbers.names):
        names = ", ".join(numbers.names)
        raise InputError("start of a variable", got=name, expected=f"one of {names}")
    values, rates, codes = numbers.at(x)
    for pose in np.flatnonzero(~np.isfinite(values).all(axis=0))[:1]:
        for name, low, high in zip(numbers.names, *ranges, strict=True):
            nominal = robot.nominal.get(name, low)
            if name not in start and not low <= nominal <= high:
                meaning = robot.meanings.get(name, f"{number(nominal)} in the model")
                raise InputError(
                    f"range of {name}",
                    got=(float(low), float(high)),
                    expected=f"values near the nominal one ({meaning}): pose {pose + 1} has no "
                    "answer at the start",
                    hint="ranges are in m, rad, N/m and N m/rad; start={...} begins elsewhere",
                )
    require_answers(f"optimum of {robot.name!r}", "the start", values, codes)
    for pose in np.flatnonzero(~np.isfinite(rates).all(axis=(0, 2)))[:1]:
        raise NoAnswerError(
            f"no optimum of {robot.name!r}: eigenvalues meet at pose {pose + 1}, where the "
            "objective or a limit has no rates; write WorstDeflection() or "
            "DisplacementUnder(wrench), or take a pose away from the symmetric one"
        )
    return values


def _ranges(variables: Mapping[str, tuple[float, float]]) -> np.ndarray:
    """Lowest and highest values (2, n)."""
    if not variables:
        hint = 'write {"R": (0.4, 0.6)}'
        raise InputError("variables", got=Words("none"), expected="names with ranges", hint=hint)
    expected = "a lower and a higher value each [SI]"
    ends = np.array(
        [as_floats(f"range of {n}", v, expected, shape=(2,)) for n, v in variables.items()]
    )
    if not np.all(ends[:, 0] < ends[:, 1]):
        raise InputError("ranges of variables", got=dict(variables), expected=expected)
    return ends.T


def _combination(combine: Worst | Mean | PNorm, values: np.ndarray) -> tuple[float, np.ndarray]:
    """Of numbers (N,) of several poses, and its rates with them (N,)."""
    if isinstance(combine, Worst):
        return float(np.max(values)), np.eye(len(values))[np.argmax(values)]
    if isinstance(combine, Mean):
        return float(np.mean(values)), np.full(len(values), 1 / len(values))
    largest = float(np.max(np.abs(values))) or 1.0  # powers of small numbers would be none
    sizes = np.abs(values) / largest
    mean = float(np.mean(sizes**combine.p))
    rates = np.copysign(sizes ** (combine.p - 1), values) / len(values)
    return largest * mean ** (1 / combine.p), rates * (mean or 1.0) ** (1 / combine.p - 1)
