"""Searches for the unknowns of a campaign, by weighted least squares."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.identification.measurement_kinds import LoadAxes
from robostiff.identification.readings import ReadingModel
from robostiff.identification.unknowns import Identifiability, identifiability

_MOST_STEPS = 60
# Of the numbers that were read: what must have equilibria where a search ends.
_KEPT = 0.9
# Turns of an instrument that are no more, and at most so many of them.
_SAME_TURN, _TURNS = 1e-10, 6
# Of a standard deviation: a last step; and of the way of a search: where it ends.
_LAST, _ENDS, _ROUNDING = 1e-7, 1e-12, 1e-14


@frozen
class Squares:
    """The sum of squares: the best estimate where errors are normal."""


@frozen
class Robust:
    """``2 (sqrt(1 + z^2) - 1)`` in place of z^2, z in units of `scale` standard deviations.

    Large errors count in proportion, not squared.
    """

    scale: float = 2.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise InputError("scale of a robust loss", got=self.scale, expected="more than zero")


@frozen(eq=False)
class Fit:
    """Where a search ended, and what it began with."""

    x: np.ndarray
    start: np.ndarray
    bounds: tuple[np.ndarray, np.ndarray]
    loss: Squares | Robust
    identifiability: Identifiability
    converged: bool
    known: np.ndarray  # (M,) numbers that were used
    too_few: str = ""  # what is missing, where there are less numbers than unknowns


def fit(
    model: ReadingModel,
    start: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    loss: Squares | Robust,
) -> tuple[ReadingModel, Fit]:
    """The fit of a model from a start (n,) on, between bounds; and the model at its end."""
    read, least = len(model.values), len(start) + (not model.measured.has_sigma)
    if read < least:
        more = "" if model.measured.has_sigma else ", and one for their standard deviation"
        names = ", ".join(unknown.name for unknown in model.unknowns)
        words = f"{read} numbers were read, for {len(start)} unknowns{more}: {names}"
        too_few = f"{words}; read more, or fix some of them"
        report = Identifiability(tuple(range(len(start))), (), (), ())
        known = np.ones(read, dtype=bool)
        return model, Fit(start, start, bounds, loss, report, False, known, too_few)
    model, fit = _fit(model, start, bounds, loss)
    if model.sought[:6].any() and LoadAxes.INSTRUMENT in model.measured.axes:
        for _ in range(_TURNS):  # loads turn with the instrument
            before = model.frames(fit.x)[0]
            model, fit = _fit(model.of(model.measured, fit.x), fit.x, bounds, loss)
            if np.abs(model.frames(fit.x)[0] - before).max() < _SAME_TURN:
                break
    return model, fit


def _fit(
    model: ReadingModel,
    start: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    loss: Squares | Robust,
) -> tuple[ReadingModel, Fit]:
    """The fit from unknowns `start` (n,) on, within bounds (n,), and the model with its states."""
    known = _where_known(model, start)
    report = _identifiability_at(model, start, known)
    x, converged = _search(model, start, report.fixed, bounds, loss, known)
    again = _identifiability_at(model, x, known & _where_known(model, x))
    if set(again.fixed) != set(report.fixed):  # the start was in a special place, or the end is
        report = again
        x, converged = _search(model, x, report.fixed, bounds, loss, known)
    statics, _ = model.statics.verify(x[: len(model.parameters)])
    at_end = replace(model, statics=statics)
    known_there = _where_known(at_end, x)
    if not np.array_equal(known_there, known):  # near singular postures it has become another
        before, known = np.count_nonzero(known), known_there
        x, converged = _search(at_end, x, report.fixed, bounds, loss, known)
        converged = converged and bool(np.count_nonzero(known) >= _KEPT * before)
    return at_end, Fit(x, start, bounds, loss, report, converged, known)


def _identifiability_at(model: ReadingModel, x: np.ndarray, known: np.ndarray) -> Identifiability:
    """What those numbers of readings that are known (M,) tell of the unknowns, at x (n,)."""
    y, J = model.prediction(x)
    rows, size = J[known] / model.sigma[known, None], np.linalg.norm((y / model.sigma)[known])
    return identifiability(rows, model.unknowns, float(size))


def _where_known(model: ReadingModel, x: np.ndarray) -> np.ndarray:
    """Numbers (M,) whose rates are known; InputError where none are."""
    y, J = model.prediction(x)
    known = np.isfinite(y) & np.isfinite(J).all(axis=1)
    if np.count_nonzero(known) < J.shape[1]:
        raise InputError(
            "postures",
            got=Words(f"{np.count_nonzero(~known)} numbers read where rates are not known"),
            expected="more at postures that are not singular, and readings that the robot can have",
            hint="look at the units of readings and loads",
        )
    return known


def _search(
    model: ReadingModel,
    x: np.ndarray,
    fixed: Sequence[int],
    bounds: tuple[np.ndarray, np.ndarray],
    loss: Squares | Robust,
    known: np.ndarray,
) -> tuple[np.ndarray, bool]:
    """Unknowns (n,) of the least sum, from x (n,) on, some fixed; and whether the search ended.

    Of the numbers of readings those that are `known` (M,) count.
    """
    from scipy.optimize import least_squares

    free = np.setdiff1d(np.arange(len(x)), fixed)
    if not free.size:
        return x, True
    low, high = (bound[free] for bound in bounds)
    sigma, values = model.sigma[known], model.values[known]

    def at(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        point = x.copy()
        point[free] = z
        y, J = model.prediction(point)
        r, J = (y[known] - values) / sigma, J[np.ix_(known, free)] / sigma[:, None]
        lost = ~(np.isfinite(r) & np.isfinite(J).all(axis=1))
        r[lost], J[lost] = 0.0, 0.0
        return r, J

    z = x[free]
    robust, scale, converged = isinstance(loss, Robust), 1.0, False
    if robust and not model.measured.has_sigma:
        first = _gauss_newton(at, z, low, high)[0]
        scale = 1.4826 * float(np.median(np.abs(at(first)[0])))
    if not robust:
        z, converged = _gauss_newton(at, z, low, high)
    if not converged:
        length = np.linalg.norm(at(z)[1], axis=0)
        result = least_squares(
            lambda z: at(z)[0],
            np.clip(z, low, high),
            jac=lambda z: at(z)[1],  # pyright: ignore[reportArgumentType]
            bounds=(low, high),
            x_scale=1 / np.where(length > 0, length, 1.0),
            loss="soft_l1" if robust else "linear",
            f_scale=getattr(loss, "scale", 1.0) * scale,
            ftol=_ENDS,
            xtol=_ENDS,
            gtol=_ENDS,
            max_nfev=_MOST_STEPS,
        )
        z, converged = result.x, result.status > 0
        if not robust:
            z, _ = _gauss_newton(at, z, low, high)
    x = x.copy()
    x[free] = z
    return x, bool(converged)


def _gauss_newton(
    at: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    z: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
) -> tuple[np.ndarray, bool]:
    """Steps of Gauss and Newton while they shrink, ``min |r + J dz|`` each, from z (n,) on.

    From z follow residuals r (M,) over their standard deviations, and rates J (M, n), by `at`. The
    last z before a step that leaves the bounds (n,), or does not shrink, and whether that step is
    rounding.
    """
    before = np.inf
    for _ in range(12):
        r, J = at(z)
        length = np.linalg.norm(J, axis=0)
        length[length == 0] = 1.0
        Q, R = np.linalg.qr(J / length)
        if not np.linalg.cond(R) < 1e14:
            return z, False
        step = -np.linalg.solve(R, Q.T @ r)
        size = float(np.linalg.norm(R @ step))
        # of a standard deviation of what was read; or what rounding leaves of exact readings
        rounding = _ROUNDING * float(np.linalg.norm(R)) * float(np.max(np.abs(z * length)))
        least = _LAST * float(np.linalg.norm(r)) / len(r) ** 0.5 + rounding
        after = z + step / length
        if not (np.all(after >= low) and np.all(after <= high)) or not size < 0.9 * before:
            return z, size <= 1e3 * least
        z, before = after, size
        if size <= least:
            return z, True
    return z, False
