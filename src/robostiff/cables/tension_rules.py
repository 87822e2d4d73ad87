"""Rules that choose the tensions of a cable robot: given, nearest to an aim, or in closed form."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.frozen import frozen, replace
from robostiff.spatial import as_floats

_BALANCED = 1e-9
_POSSIBLE = 1e-7  # of the largest tension, which a linear program decides


@frozen
class TensionProblem:
    """Find tensions t with A^T t + F = 0 and least <= t <= greatest, at N poses.

    Attributes
    ----------
    W : (N, n, m) array
        Structure matrix A^T, moments divided by a characteristic length.
    F : (N, n) array
        Wrench that the cables carry, scaled alike [N].
    least, greatest : (m,) arrays
        [N]; the greatest may be infinite.
    level : float
        Where between the two the tensions aim.
    """

    W: np.ndarray
    F: np.ndarray
    least: np.ndarray
    greatest: np.ndarray
    level: float = 0.0

    @property
    def aim(self) -> np.ndarray:
        """Desired tensions of the cables (m,) [N]."""
        if self.level == 0:
            return self.least
        return self.least + self.level * (self.greatest - self.least)

    def missing(self, tensions: np.ndarray) -> np.ndarray:
        """Wrench (N, n) that the tensions do not balance, A^T t + F."""
        return (self.W @ tensions[..., None])[..., 0] + self.F

    def balanced(self, tensions: np.ndarray) -> np.ndarray:
        """Whether the tensions balance the wrench (N,), to rounding."""
        size = np.abs(self.F).max(axis=-1) + np.abs(tensions).max(axis=-1)
        return np.asarray(np.abs(self.missing(tensions)).max(axis=-1) <= _BALANCED * size)

    def within(self, tensions: np.ndarray) -> np.ndarray:
        """Whether all tensions are within their limits (N,), to rounding."""
        return np.asarray((self.beyond(tensions) == 0).all(axis=-1))

    def beyond(self, tensions: np.ndarray) -> np.ndarray:
        """By how much tensions are beyond their limits (N, m) [N]; 0 within rounding."""
        beyond = np.maximum(self.least - tensions, tensions - self.greatest)
        return np.where(beyond > _BALANCED * (1.0 + np.abs(tensions)), beyond, 0.0)

    def excess(self, pose: int) -> float:
        """How far beyond limits tensions must be that balance the wrench at a pose, at least [N].

        Infinite where none balance it. By a linear program: the tension of every cable is scaled by
        the largest force that occurs, and the last unknown is how far the limits are moved.
        """
        m = self.W.shape[-1]
        bounded = np.isfinite(self.greatest)
        size = max(np.abs(self.F[pose]).max(), self.least.max(), 1e-300)
        size = max(size, self.greatest[bounded].max(initial=0.0))
        # Some rows may be dependent: they are replaced by independent ones.
        U, values, _ = np.linalg.svd(self.W[pose])
        rank = int(np.count_nonzero(values > 1e-9))
        span, lost = U[:, :rank], U[:, rank:]
        if np.abs(lost.T @ self.F[pose]).max(initial=0.0) > _BALANCED * size:
            return np.inf
        from scipy.optimize import linprog

        I, moved = np.eye(m), -np.ones((m, 1))
        found = linprog(
            np.eye(m + 1)[m],
            A_ub=np.vstack([np.hstack([-I, moved]), np.hstack([I, moved])[bounded]]),
            b_ub=np.concatenate([-self.least, self.greatest[bounded]]) / size,
            A_eq=np.hstack([span.T @ self.W[pose], np.zeros((rank, 1))]),
            b_eq=-span.T @ self.F[pose] / size,
            bounds=[*[(None, None)] * m, (0, None)],
            method="highs",
        )
        moved_by = float(found.x[m])
        return moved_by * size if moved_by > _POSSIBLE else 0.0


_STEPS = 100
_CHUNK = 4096  # poses worked on at once
_REGULAR = 1e-12
_NO_WORK = 1e-11  # of the most that a step works on a cable
_PROVEN = 1e-6


def nearest_tensions(problem: TensionProblem) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Minimise ``|t - t_aim|^2`` where A^T t + F = 0, least <= t <= greatest, at all poses at once.

    With a multiplier y for every row of the balance the minimiser is ``t = clip(t_aim + A y)``, and
    y maximises a concave piecewise quadratic function whose gradient is the missing wrench. Newton
    steps with an exact line search reach it in a few steps. A direction in which the function rises
    for ever proves that no tensions exist.

    Returns
    -------
    tensions : (N, m) array
        [N]; within the limits.
    solved : (N,) array of bool
        Where they balance the wrench.
    impossible : (N,) array of bool
        Where it is proven that none do.

    Examples
    --------
    Two cables pull against each other along x, and 10 N push to the right:

    >>> W = np.array([[[1.0, -1.0]]])
    >>> problem = TensionProblem(W, np.array([[10.0]]), np.full(2, 5.0), np.full(2, 100.0), 0.0)
    >>> nearest_tensions(problem)
    (array([[ 5., 15.]]), array([ True]), array([False]))
    """
    starts = range(0, max(len(problem.F), 1), _CHUNK)
    chunks = (slice(start, start + _CHUNK) for start in starts)
    parts = [_nearest(replace(problem, W=problem.W[at], F=problem.F[at])) for at in chunks]
    tensions, solved, impossible = map(np.concatenate, zip(*parts, strict=True))
    return tensions, solved, impossible


def _nearest(problem: TensionProblem) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    W, F = problem.W, problem.F
    poses, n, _ = W.shape
    low, high, aim = problem.least, problem.greatest, problem.aim
    y = np.zeros((poses, n))
    solved, impossible = np.zeros((2, poses), dtype=bool)
    active = np.arange(poses)
    for _ in range(_STEPS):
        W_a, y_a = W[active], y[active]
        raw = aim + (y_a[:, None, :] @ W_a)[:, 0]
        tensions = np.minimum(np.maximum(raw, low), high)
        gradient = -F[active] - (W_a @ tensions[..., None])[..., 0]
        size = np.abs(F[active]).max(axis=-1) + np.abs(tensions).max(axis=-1)
        done = np.abs(gradient).max(axis=-1) <= 1e-13 * size
        solved[active[done]] = True
        going = ~done
        if not going.any():
            break
        active, W_a, raw, gradient = active[going], W_a[going], raw[going], gradient[going]
        inner = ((raw >= low) & (raw <= high)).astype(float)
        H = (W_a * inner[:, None, :]) @ np.swapaxes(W_a, -1, -2) + _REGULAR * np.eye(n)
        step = np.linalg.solve(H, gradient[..., None])[..., 0]
        length, rises = _best_length(W_a, F[active], low, high, raw, step)
        y[active] += length[:, None] * step
        impossible[active[rises]] = True
        active = active[~rises]
        if not len(active):
            break
    tensions = np.minimum(np.maximum(aim + (y[:, None, :] @ W)[:, 0], low), high)
    # Newton stops at rounding; what counts is whether the wrench is balanced.
    solved |= problem.balanced(tensions)
    return tensions, solved, impossible & ~solved


def _best_length(
    W: np.ndarray,
    F: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    raw: np.ndarray,
    step: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Where along a step the dual function is largest (N,), and whether it rises for ever (N,).

    Its slope, -F.s - sum of d clip(raw + length d) with d = A s, falls and is linear between the
    lengths at which a tension meets a limit.
    """
    d = (step[:, None, :] @ W)[:, 0]
    needed = -np.einsum("ni,ni->n", F, step)

    def slope(lengths: np.ndarray) -> np.ndarray:
        tensions = raw[:, None, :] + lengths[..., None] * d[:, None, :]
        tensions = np.minimum(np.maximum(tensions, low), high)
        return needed[:, None] - (tensions @ d[..., None])[..., 0]

    most = np.abs(d).max(axis=-1)
    moving = np.where(np.abs(d) > 1e-15 * most[:, None], d, np.nan)
    start = np.zeros((len(d), 1))
    meets = np.concatenate([start, (low - raw) / moving, (high - raw) / moving], axis=-1)
    meets = np.where((meets > 0) & (meets < np.inf), meets, 0.0)
    # The last break point with a rising slope; the maximum lies between it and the next.
    rising = slope(meets) > 0
    start = np.where(rising, meets, 0.0).max(axis=-1)
    end = np.where(rising, np.inf, meets).min(axis=-1)
    # Beyond the last break point the slope is linear; two points determine it.
    unit = np.maximum(start, 1.0)
    probe = np.where(np.isfinite(end), end, start + unit)
    slope_start, slope_end = slope(np.stack([start, probe], axis=-1)).T
    fall = slope_start - slope_end
    ends = fall > 1e-14 * np.abs(slope_start)
    length = start + (probe - start) * slope_start / np.where(ends, fall, 1.0)
    # No tensions work more on the step than those at the limits on its side: less than is needed
    # is a proof, with room for cables without a limit on which it works by rounding alone.
    limits = np.where(d > 0, high, low)
    nothing = (np.abs(d) <= _NO_WORK * most[:, None]) & ~np.isfinite(limits)
    available = np.sum(d * np.where(nothing, 0.0, limits), axis=-1)
    size = np.abs(F).max(axis=-1) + np.abs(low).max()
    forever = (~ends & (slope_start > 0)) | (needed - available > _PROVEN * most * size)
    return np.where(forever, start + unit, np.maximum(length, 0.0)), forever


@runtime_checkable
class TensionRule(Protocol):
    """A rule that chooses tensions at a batch of poses."""

    @property
    def name(self) -> str:
        """Name of the rule."""
        ...

    def choose(self, problem: TensionProblem) -> tuple[np.ndarray, np.ndarray]:
        """Tensions (N, m) [N], and a status (N,) of each pose."""
        ...


@frozen
class GivenTensions:
    """The tensions themselves, as measured or commanded.

    Attributes
    ----------
    values : (m,) or (..., m) array
        Of every cable [N], at all poses or at each.
    """

    values: ArrayLike
    name = "given"

    def choose(self, problem: TensionProblem) -> tuple[np.ndarray, np.ndarray]:
        """The tensions, and whether they balance the wrench.

        Raises
        ------
        InputError
            When there are not as many as cables, or some are negative.
        """
        poses, _, cables = problem.W.shape
        expected = f"{cables} tensions [N], one a cable"
        given = as_floats("tensions", self.values, expected, "N")
        if given.ndim == 0 or given.shape[-1] != cables:
            raise InputError("tensions", got=self.values, expected=expected)
        if np.any(given < 0):
            raise InputError("tensions", got=self.values, expected="none below 0: cables only pull")
        rows = given.reshape(-1, cables)
        if len(rows) not in {1, poses}:
            raise InputError("tensions", got=given.shape, expected=f"one row, or {poses} of them")
        tensions = np.array(np.broadcast_to(rows, (poses, cables)))
        status = np.zeros(poses, dtype=np.uint16)
        status[~problem.balanced(tensions)] = Status.UNBALANCED
        return tensions, status


@frozen
class NearestTensions:
    """The tensions within the limits that are nearest to an aim, and balance the wrench.

    They exist wherever feasible tensions exist, and vary continuously with the pose. The aim lies
    between the least and the greatest tension of each cable by the level, 0 for the least.

    Attributes
    ----------
    level : float or None
        0 to 1; that of the robot when None.
    """

    level: float | None = None
    name = "nearest"

    def choose(self, problem: TensionProblem) -> tuple[np.ndarray, np.ndarray]:
        """The tensions, and a status where none exist."""
        tensions, solved, impossible = nearest_tensions(problem)
        status = np.where(impossible, int(Status.INFEASIBLE), 0).astype(np.uint16)
        return tensions, _with_failures(problem, status, ~solved & ~impossible)


@frozen
class ClosedFormTensions:
    """Pott's improved closed form, t = t_aim - (A^T)^+ (F + A^T t_aim), cables at limits fixed.

    The cable furthest beyond a limit is set to it and taken out, until all are within. Quick and
    continuous, but it may fail near the border of the workspace where `NearestTensions` does not.
    (Pott 2014, An improved force distribution algorithm for over-constrained cable robots.)

    Attributes
    ----------
    level : float or None
        0 to 1, and 0.5 in the source; that of the robot when None.
    """

    level: float | None = 0.5
    name = "closed-form"

    def choose(self, problem: TensionProblem) -> tuple[np.ndarray, np.ndarray]:
        """The tensions, and a status where the form finds none."""
        poses, _, cables = problem.W.shape
        least, greatest = problem.least, problem.greatest
        open_ = np.ones((poses, cables), dtype=bool)
        tensions = np.array(np.broadcast_to(problem.aim, (poses, cables)))
        for _ in range(cables + 1):
            missing = problem.missing(tensions)
            inverse = np.linalg.pinv(problem.W * open_[:, None, :], rcond=1e-9)
            change = np.einsum("nij,nj->ni", inverse, missing)
            trial = tensions - np.where(open_, change, 0.0)
            beyond = np.where(open_, problem.beyond(trial), 0.0)
            furthest = beyond.argmax(axis=-1)
            violated = beyond[np.arange(poses), furthest] > 0
            done = ~violated
            tensions = np.where(done[:, None], trial, tensions)
            open_[done] = False
            rows = np.flatnonzero(violated)
            if not len(rows):
                break
            fixed = furthest[rows]
            below = trial[rows, fixed] < least[fixed]
            tensions[rows, fixed] = np.where(below, least[fixed], greatest[fixed])
            open_[rows, fixed] = False
        right = problem.balanced(tensions) & problem.within(tensions)
        return tensions, _with_failures(problem, np.zeros(poses, dtype=np.uint16), ~right)


def _with_failures(problem: TensionProblem, status: np.ndarray, failed: np.ndarray) -> np.ndarray:
    """The status (N,), with that of poses at which a rule found no tensions."""
    for i in np.flatnonzero(failed).tolist():
        status[i] = Status.INFEASIBLE if problem.excess(i) else Status.FORM_DOES_NOT_HOLD
    return status
