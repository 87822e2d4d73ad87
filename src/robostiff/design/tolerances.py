"""What tolerances of the parameters of a robot do to its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from robostiff.analysis.compiled_stiffness import CompiledStiffness
from robostiff.compiled import Gradient, Output, WorstDeflection
from robostiff.design.numbers import (
    NumbersOfDesigns,
    Poses,
    kept_kernel,
    kernel_poses,
    parameters_like,
    require_answers,
)
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen
from robostiff.io.units import parse_quantity
from robostiff.kinematics import JointCoordinates
from robostiff.markup import InNotebooks, number, percent
from robostiff.model import Robot
from robostiff.spatial import as_float, check_whole

# Sequences of points that know nothing of one another: their spread is the error of a quantile.
_SEQUENCES = 8
_CHUNK = 2**12
# Half of a step of Sobol points, which are whole numbers of these: none of them is 0.
_HALF_STEP = 2.0**-31
# Quantiles nearer to 0 and 1 are as this one is: 6.2 standard deviations away.
_NEAREST = 2.0**-32
# Robots whose parameters are kept, about.
_MOST_DRAWN = 2**15
_WORST = WorstDeflection()


@frozen
class Uniform:
    """Evenly spread up to a half-width on both sides.

    Attributes
    ----------
    half_width : float or str
        A part of the nominal value, ``0.2``; or a text with the unit of the parameter,
        ``"0.2 mm"``, without one only where the parameter is a plain number.
    """

    half_width: float | str


@frozen
class Normal:
    """Normally distributed.

    Attributes
    ----------
    deviation : float or str
        Standard deviation, as the half-width of `Uniform` is given.
    """

    deviation: float | str


def _deviation(spread: Uniform | Normal, robot: Robot, name: str) -> float:
    """Standard deviation of a parameter [SI]; a text has the unit of what a model file gives.

    A bare number in a text could be one of SI units, as elsewhere, or the part that a number is.
    """
    subject, nominal = f"spread of {name!r}", float(robot.nominal[name])
    is_uniform = isinstance(spread, Uniform)
    given = spread.half_width if is_uniform else spread.deviation
    if isinstance(given, str):
        try:
            quantity = parse_quantity(given)
        except InputError as error:
            raise InputError(subject, got=given, expected=error.expected, hint=error.hint) from None
        unit = robot.units.get(name)  # None: of a symbol that comes from no file
        like = parse_quantity(f"{nominal!r} {unit or ''}")
        is_like = quantity.is_bare == like.is_bare and quantity.units.is_like(like.units)
        if unit is not None and not is_like:
            part = f"{type(spread).__name__}({given.strip()})"
            hint = f'write "{given.strip()} {unit}", or {part} for that part of the nominal value'
            expected = f"the same dimension as {like}"
            hint = hint if quantity.is_bare else None
            raise InputError(subject, got=given, expected=expected, hint=hint)
        size = float(quantity.magnitude)
    elif nominal == 0.0:
        expected = "a text with a unit, as its nominal value is zero"
        raise InputError(subject, got=given, expected=expected)
    else:
        expected = "a part of the nominal value, or a text with a unit"
        size = abs(nominal) * as_float(subject, given, expected)
    if not (np.isfinite(size) and size > 0):
        raise InputError(subject, got=given, expected="more than zero")
    return size / 3**0.5 if is_uniform else size


class Estimate(Protocol):
    """Parameters whose errors go together, such as what `identify` found."""

    @property
    def estimate(self) -> tuple[Robot, dict[str, float], np.ndarray]:
        """A robot with symbols, values of these, and their covariance (n, n)."""
        ...


@frozen
class Tolerances(InNotebooks):
    """Numbers of a robot whose parameters are spread.

    Attributes
    ----------
    samples : dict of str to (samples, N) array
        Of each output at each pose; not a number for a robot that has no answer at some pose, or
        for which a parameter changes its sign that its file takes to be positive.
    deviations : dict of str to float
        Standard deviation of each parameter [SI].
    nominal : dict of str to (N,) array
        Of each output.
    rates : dict of str to (N, n) array
        Of each output with each parameter, in the order of `deviations`.
    answered : float
        Part of the robots for which this is not so.
    covariance : (n, n) array
        Of the parameters.
    drawn : (m, n) array
        Parameters of the first robots, some 30,000.
    """

    samples: dict[str, np.ndarray]
    deviations: dict[str, float]
    nominal: dict[str, np.ndarray]
    rates: dict[str, np.ndarray]
    answered: float
    covariance: np.ndarray
    drawn: np.ndarray

    def quantile(self, name: str, q: float) -> tuple[np.ndarray, np.ndarray]:
        """A quantile (N,) of an output at each pose, and its standard error (N,).

        Of robots that have an answer. InputError for another output, or a q beyond 0 and 1.
        """
        values = self._of(name)
        if np.ndim(q) or not 0 <= q <= 1:
            raise InputError("quantile", got=q, expected="a number from 0 to 1")
        parts = np.array_split(values, _SEQUENCES)
        of_parts = np.array([np.nanquantile(part, q, axis=0) for part in parts])
        error = np.std(of_parts, axis=0, ddof=1) / _SEQUENCES**0.5
        return np.nanquantile(values, q, axis=0), error

    def _of(self, name: str) -> np.ndarray:
        """Values (samples, N) of an output."""
        if name not in self.samples:
            raise InputError("output", got=name, expected=", ".join(self.samples))
        return self.samples[name]

    def histogram(self, name: str, bins: int = 50, pose: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of robots (bins,) between values (bins + 1,) of an output at a pose.

        Raises InputError when there is no such output or pose, or no bin.
        """
        values = self._at(name, pose)
        check_whole("bins", bins)
        return np.histogram(values[np.isfinite(values)], bins)

    def rank_correlations(self, name: str, pose: int = 0) -> dict[str, float]:
        """Spearman's correlation of each parameter with an output, of the first robots.

        Its square is near to the share of a parameter wherever the output follows it in one
        direction, to first order or not. NoAnswerError when no parameter changes the output.
        """
        from scipy.stats import rankdata

        values = self._at(name, pose)[: len(self.drawn)]
        ranks = rankdata(np.column_stack([self.drawn, values])[np.isfinite(values)], axis=0)
        if not np.ptp(ranks[:, -1]):
            raise _same(name)
        each = np.corrcoef(ranks, rowvar=False)[-1, :-1].tolist()
        return dict(zip(self.deviations, each, strict=True))

    def _at(self, name: str, pose: int) -> np.ndarray:
        """Values (samples,) of an output at a pose."""
        values = self._of(name)
        if not (isinstance(pose, int) and 0 <= pose < values.shape[1]):
            raise InputError("pose", got=pose, expected=f"0 to {values.shape[1] - 1}")
        return values[:, pose]

    def mean(self, name: str) -> np.ndarray:
        """Mean (N,) of an output at each pose."""
        return np.nanmean(self._of(name), axis=0)

    def deviation(self, name: str) -> np.ndarray:
        """Standard deviation (N,) of an output at each pose."""
        return np.nanstd(self._of(name), axis=0, ddof=1)

    def first_order(self, name: str) -> np.ndarray:
        """Standard deviation (N,) to first order in the spreads."""
        return np.sqrt(np.sum(self._parts(name), axis=1))

    def shares(self, name: str, pose: int = 0) -> dict[str, float]:
        """Share of each parameter in the variance of an output, to first order, largest first.

        Of parameters whose errors go together with its covariance: some may be below zero.
        NoAnswerError when no parameter changes the output to first order.
        """
        self._at(name, pose)  # raises where there is no such output or pose
        parts = self._parts(name)[pose]
        if not (variance := np.sum(parts)):
            raise _same(name)
        each = zip(self.deviations, (parts / variance).tolist(), strict=True)
        return dict(sorted(each, key=lambda pair: -pair[1]))

    def _parts(self, name: str) -> np.ndarray:
        return self.rates[name] * (self.rates[name] @ self.covariance)

    def __repr__(self) -> str:
        count = len(next(iter(self.samples.values())))
        parts = [
            f"{name} {number(home[0], 4)}, 99 % below {number(self.quantile(name, 0.99)[0][0], 4)}"
            for name, home in self.nominal.items()
        ]
        lost = f"; {percent(1 - self.answered)} without an answer" if self.answered < 1 else ""
        return f"<Tolerances of {count} robots: {'; '.join(parts)}{lost}>"


def _same(name: str) -> NoAnswerError:
    return NoAnswerError(f"no shares of {name!r}: none of these parameters changes it")


def tolerances(
    robot: Robot,
    spreads: Mapping[str, Uniform | Normal] | Estimate,
    outputs: Sequence[Output] = (WorstDeflection(),),
    poses: Poses = None,
    *,
    samples: int = 2**14,
    seed: int = 0,
    threads: int = 1,
) -> Tolerances:
    """Numbers of many robots whose parameters are spread about their nominal values.

    Parameters are independent, or those of an identification with their covariance,
    ``rs.tolerances(found.robot, found)``. Their values are eight scrambled Sobol sequences, whose
    spread gives the errors of quantiles. Shares in the variance are to first order, by the gradient
    at nominal values.

    Parameters
    ----------
    robot : Robot
        With symbols for the parameters.
    spreads : mapping of str to Uniform or Normal, or Identified
        By name, or by a pattern for several: ``{"k*": rs.Uniform(0.2), "R": rs.Normal("0.2 mm")}``;
        the last that fits a name holds.
    outputs : sequence of Output
        Of one number a pose.
    poses : (N, n) array or JointCoordinates, optional
        Free pose coordinates [m, rad]; the home of the nominal robot when left out.
    samples : int
        Rounded up to eight times a power of two.
    seed, threads : int

    Raises
    ------
    InputError
        When a name is no parameter, or a spread is none.
    NoAnswerError
        When a pose has no answer at nominal values.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("gough-stewart-b", symbols=("R", "k"))
    >>> spread = {"k": rs.Uniform(0.2), "R": rs.Normal("1 mm")}
    >>> found = rs.tolerances(robot, spread)
    >>> most, error = found.quantile("worst_deflection", 0.95)
    >>> bool(1.15 < most[0] / found.nominal["worst_deflection"][0] < 1.25)
    True
    >>> bool(error[0] < 0.01 * most[0])
    True
    >>> next(iter(found.shares("worst_deflection")))
    'k'
    """
    from scipy.stats import qmc

    check_whole("samples of tolerances", samples)
    check_whole("seed of tolerances", seed, 0)
    drawn = _DrawnRobots.of(robot, spreads, outputs, poses, threads)
    at_nominal = NumbersOfDesigns.of(drawn.robot, outputs, drawn.names, poses)
    numbers, rates, _ = at_nominal.at(drawn.nominal)
    in_sequence = 2 ** max(0, int(np.ceil(np.log2(samples / _SEQUENCES))))
    shape = _SEQUENCES * in_sequence, len(drawn.rows)
    found = {x.name: np.empty(shape) for x in outputs}
    first = drawn.values(np.empty((len(drawn.names), 0)))
    for k in range(_SEQUENCES):
        points = qmc.Sobol(len(drawn.names), rng=np.random.default_rng([seed, k]))
        for start in range(k * in_sequence, (k + 1) * in_sequence, _CHUNK):
            u = points.random(min(_CHUNK, in_sequence)).T.copy()
            u += _HALF_STEP
            values = drawn.values(u)
            if first.shape[1] < _MOST_DRAWN:
                first = np.concatenate([first, values], axis=1)
            where = slice(start, start + u.shape[1])
            drawn.fill(values, {name: numbers[where] for name, numbers in found.items()})
    return Tolerances(
        samples=found,
        deviations=dict(zip(drawn.names, np.sqrt(np.diag(drawn.covariance)).tolist(), strict=True)),
        nominal={x.name: number for x, number in zip(outputs, numbers, strict=True)},
        rates={x.name: rate for x, rate in zip(outputs, rates, strict=True)},
        answered=float(np.mean(np.isfinite(next(iter(found.values()))[:, 0]))),
        covariance=drawn.covariance,
        drawn=first.T,
    )


@frozen
class _DrawnRobots:
    """A robot whose parameters are spread, compiled."""

    robot: Robot  # with symbols
    compiled: CompiledStiffness
    names: tuple[str, ...]  # of the parameters, sorted as those of the kernel
    nominal: np.ndarray  # (n,)
    covariance: np.ndarray  # (n, n)
    are_normal: np.ndarray  # (n,) of bool: which parameters are normally distributed
    positive: np.ndarray  # (n,) of bool: those for whose positive values formulas were written
    poses: np.ndarray | JointCoordinates  # (N, n)
    threads: int

    @cached_property
    def rows(self) -> np.ndarray:
        """Poses (N, n)."""
        return np.asarray(getattr(self.poses, "values", self.poses))

    @staticmethod
    def of(
        robot: Robot,
        spreads: Mapping[str, Uniform | Normal] | Estimate,
        outputs: Sequence[Output],
        poses: Poses,
        threads: int = 1,
    ) -> _DrawnRobots:
        """Compile the outputs.

        Raises InputError for a name that is no parameter, no spread, or an output of several
        numbers; NoAnswerError where the robot has no answer at nominal values.
        """
        of: dict[str, Uniform | Normal] = {}
        if not spreads or not (isinstance(spreads, Mapping) or hasattr(spreads, "estimate")):
            expected = 'such as {"k*": rs.Uniform(0.2)}, or what identify found'
            raise InputError("spreads", got=spreads or Words("none"), expected=expected)
        if isinstance(spreads, Mapping):
            for pattern, spread in spreads.items():
                if not isinstance(spread, Uniform | Normal):
                    expected = 'Uniform(0.2) or Normal("0.2 mm")'
                    raise InputError(f"spread of {pattern!r}", got=spread, expected=expected)
                of |= dict.fromkeys(parameters_like(robot, pattern), spread)
            values = {name: float(robot.nominal[name]) for name in of}
            covariance = np.diag([_deviation(x, robot, name) ** 2 for name, x in of.items()])
        else:
            robot, values, covariance = spreads.estimate
        names = tuple(sorted(values))
        order = [[*values].index(name) for name in names]
        for output in outputs:
            Gradient(output, names).shape(robot.space)  # raises where it has several
        positive = {symbol.name for symbol in robot.symbols if symbol.is_positive}
        drawn = _DrawnRobots(
            robot,
            kept_kernel(robot, tuple(outputs), names),
            names,
            np.array([values[name] for name in names]),
            covariance[np.ix_(order, order)],
            np.array([not isinstance(of.get(name), Uniform) for name in names]),
            np.array([name in positive for name in names]),
            kernel_poses(robot, poses),
            threads,
        )
        nominal = drawn.compiled.evaluate(drawn.poses, parameters=values)
        numbers, codes = np.array([nominal.values[x.name] for x in outputs]), nominal.status_codes
        require_answers(f"tolerances of {robot.name!r}", "nominal values", numbers, codes)
        return drawn

    def values(self, u: np.ndarray) -> np.ndarray:
        """Parameters (n, m) of m robots, by quantiles u (n, m) between 0 and 1, ends excluded."""
        from scipy.special import ndtri

        z = 3**0.5 * (2.0 * u - 1.0)
        z[self.are_normal] = ndtri(u[self.are_normal])
        return np.linalg.cholesky(self.covariance) @ z + self.nominal[:, None]

    def fill(self, values: np.ndarray, out: Mapping[str, np.ndarray]) -> None:
        """Fill each output (m, N) of m robots with parameters (n, m).

        Not a number for a robot that has no answer at some pose.
        """
        lost, count = np.zeros(values.shape[1], dtype=bool), values.shape[1]
        if np.any(values.min(axis=1) <= 0, where=self.positive):
            wrong = (values <= 0) & self.positive[:, None]
            lost, values = wrong.any(axis=0), np.where(wrong, self.nominal[:, None], values)
        for place, row in enumerate(self.rows):
            pose: Any = np.repeat(row[:, None], count, axis=1).T
            if isinstance(self.poses, JointCoordinates):
                pose = JointCoordinates(pose)
            answer = self.compiled.evaluate(pose, parameters=values, threads=self.threads)
            for name, result in out.items():
                result[:, place] = answer.values[name]
                lost |= ~np.isfinite(result[:, place])
        for result in out.values():
            result[lost] = np.nan


def sobol_indices(
    robot: Robot,
    spreads: Mapping[str, Uniform | Normal],
    output: Output = _WORST,
    pose: Poses = None,
    *,
    samples: int = 2**12,
    seed: int = 0,
    threads: int = 1,
) -> dict[str, tuple[float, float]]:
    """Shares of parameters in the variance of a number: alone, and with all others.

    ``S_i = Var(E(y | p_i)) / Var(y)`` and ``T_i = 1 - Var(E(y | all but p_i)) / Var(y)``. To first
    order in the spreads both are `Tolerances.shares`; where T is well above S, parameters act
    together.

    Parameters
    ----------
    robot, spreads, seed, threads
        As for `tolerances`.
    output : Output
        Of one number a pose.
    pose : (n,) array or JointCoordinates, optional
        Free pose coordinates [m, rad]; the home of the nominal robot when left out.
    samples : int
        A power of two; ``samples (n + 2)`` robots are computed.

    Returns
    -------
    dict of str to (float, float)
        S and T of each parameter, largest T first. Their errors fall with the root of `samples`.

    Raises
    ------
    InputError
        When a name is no parameter, a spread is none, or there are several poses.
    NoAnswerError
        When some of the robots have no answer, or no parameter changes the number.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("gough-stewart-b", symbols=("R", "k"))
    >>> found = rs.sobol_indices(robot, {"k": rs.Uniform(0.2), "R": rs.Normal("1 mm")})
    >>> round(found["k"][0], 2), round(found["k"][1], 2)
    (1.0, 1.0)
    """
    from scipy.stats import sobol_indices as indices_of
    from scipy.stats import uniform

    drawn = _DrawnRobots.of(robot, spreads, [output], pose, threads)
    if (count := len(drawn.rows)) != 1:
        raise InputError("pose of indices", got=Words(f"{count} poses"), expected="one pose")
    if samples < 1 or samples & (samples - 1):
        raise InputError("samples of indices", got=samples, expected="a power of two")

    def numbers(u: np.ndarray) -> np.ndarray:
        found = np.empty((u.shape[1], 1))
        inside = np.clip(u, _NEAREST, 1.0 - _NEAREST)  # points at 0 and 1 are among these
        drawn.fill(drawn.values(np.ascontiguousarray(inside)), {output.name: found})
        if lost := int(np.count_nonzero(~np.isfinite(found))):
            raise NoAnswerError(f"{lost} of {len(found)} robots have no answer: spread them less")
        return found[:, 0]

    cubes, rng = [uniform()] * len(drawn.names), np.random.default_rng(seed)
    if len(cubes) == 1:  # all of the variance is its own
        if not np.ptp(numbers(rng.random((1, samples)))):
            raise _same(output.name)
        return {drawn.names[0]: (1.0, 1.0)}
    found = indices_of(func=numbers, n=samples, dists=cubes, rng=rng)
    if np.isnan(found.total_order).any():
        raise _same(output.name)
    pairs = zip(np.ravel(found.first_order), np.ravel(found.total_order), strict=True)
    each = {name: (float(S), float(T)) for name, (S, T) in zip(drawn.names, pairs, strict=True)}
    return dict(sorted(each.items(), key=lambda item: -item[1][1]))
