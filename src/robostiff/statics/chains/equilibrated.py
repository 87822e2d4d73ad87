"""Linear systems of mixed units: equilibrated, answers refined; those of rigid parts.

Where the closure of a leg ``J dx = dt`` lacks the directions Λ, ``Λ^T J = 0``, the leg carries
``W = Λ z`` without compliance, and the platform moves by ``Λ^T dt = 0`` alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import cached_property

import numpy as np

from robostiff.frozen import frozen

# Of the largest singular value of an equilibrated system: below this a direction is lost.
LOST = 1e-11
# Condition of an equilibrated system beyond which lost directions are looked for.
_SINGULAR = 1e12
# Condition, as far as the solution for one right side shows it, below which none are looked for.
_SURELY = 1e10
_PROBE = np.random.default_rng(3).uniform(-1, 1, 997)
# Of the largest stiffness of a leg: a coordinate of less has none but that of rounding or loads.
_PASSIVE = 1e-9
# Of the largest singular value of a closure, in robot lengths and radians: a lost direction.
_LOST = 1e-9


def unit_free(A: np.ndarray, sizes: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Factors (N, n) by which unknowns of legs are independent of the units of length and force.

    Parameters
    ----------
    A : (N, n, n) array
        Tangents: n - m closures stand behind m coordinates.
    sizes : (N, m) array
        What a unit of each coordinate turns or shifts, in radians and lengths of the robot.
    rows : (n - m,) array
        What makes such numbers of the gaps of the closures.

    Returns
    -------
    (N, n) array
        Their products from both sides leave closures near one, and stiffnesses as far above as
        below it.
    """
    stiffness = np.abs(np.diagonal(A, axis1=1, axis2=2)[:, : sizes.shape[1]]) / sizes**2
    elastic = stiffness > _PASSIVE * np.max(stiffness, axis=1, keepdims=True, initial=0.0)
    logs = np.sum(np.log(np.where(elastic, stiffness, 1.0)), axis=1)
    level = np.exp(0.5 * logs / np.maximum(np.sum(elastic, axis=1), 1))[:, None]
    return np.concatenate([1.0 / (sizes * level), rows * level], axis=1)


def solve(
    A: np.ndarray, b: np.ndarray, first: np.ndarray | None = None, refinements: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Solve systems of mixed units, as symmetric in size as those of energies.

    Of a system that has lost directions, the least-squares solution. There are many factors that
    bring the largest entries of all rows near one; those nearest to the factors `first` (N, n) are
    used.

    Parameters
    ----------
    A : (N, n, n) array
    b : (N, n, k) array
    first : (N, n) array, optional
    refinements : int

    Returns
    -------
    (N, n, k) array
        X with ``A x = b``, refined so many times.
    (N,) array of int
        How many directions each system has lost.
    """
    scale = np.ones(A.shape[:2]) if first is None else first
    size, scaled = np.abs(A), np.empty(A.shape)
    for _ in range(3):
        largest = scale * np.multiply(size, scale[:, None], out=scaled).max(2, initial=0.0)
        scale = scale / np.sqrt(largest + (largest == 0))
    np.multiply(A, scale[:, None], out=scaled)
    scaled *= scale[:, :, None]
    scale = scale[..., None]
    probe = np.broadcast_to(np.resize(_PROBE, A.shape[1])[:, None], (*A.shape[:2], 1))
    lost, inverse = np.zeros(len(A), dtype=int), None
    try:
        x = np.linalg.solve(scaled, np.concatenate([scale * b, probe], axis=-1))
        near = _norm(scaled) * np.abs(x[..., -1]).max(-1, initial=0.0) < _SURELY
    except np.linalg.LinAlgError:
        x, near = b, False
    if np.all(near):
        x = scale * x[..., :-1]
    else:
        inverse = np.empty(A.shape)
        for i, S in enumerate(scaled):
            with suppress(np.linalg.LinAlgError):
                inverse[i] = np.linalg.inv(S)
                if _norm(S) * _norm(inverse[i]) < _SINGULAR:
                    continue
            inverse[i] = np.linalg.pinv(S, rcond=LOST)  # of least squares
            lost[i] = _rank_loss(np.linalg.svd(S, compute_uv=False), LOST)
        x = scale * (inverse @ (scale * b))
    for _ in range(refinements):
        rest = scale * (b - A @ x)
        x = x + scale * (np.linalg.solve(scaled, rest) if inverse is None else inverse @ rest)
    return x, lost


def _rank_loss(values: np.ndarray, part: float) -> np.ndarray:
    """How many singular values (..., n) are none, or below a part of the largest."""
    return np.sum(values <= part * np.max(values, axis=-1, keepdims=True, initial=0.0), axis=-1)


def _norm(A: np.ndarray) -> np.ndarray:
    return np.abs(A).sum(-1).max(-1, initial=0.0)


@frozen
class Closure:
    """The closure of legs of a group, by coordinates that turn by 1 rad or shift by a length."""

    # (c,): what makes its gaps numbers: 1 for turns, one over the robot's length for shifts
    rows: np.ndarray
    sizes: np.ndarray  # (N, m): what a unit of each unknown turns or shifts
    deficits: np.ndarray  # (N,): how many of its directions are missing

    @staticmethod
    def of(A: np.ndarray, rows: np.ndarray, sizes: np.ndarray) -> Closure:
        """Of tangents A (N, n, n) at the unloaded posture: elsewhere closures have full rank."""
        m = sizes.shape[1]
        values = np.linalg.svd(_scaled(A, rows, sizes), compute_uv=False)
        ranks = values.shape[1] - _rank_loss(values, _LOST)
        return Closure(rows, sizes, A.shape[1] - m - ranks)

    def lacks_digits(self, A: np.ndarray) -> bool:
        """Whether a leg has lost more directions than rigid parts and redundant joints explain."""
        m = self.sizes.shape[1]
        _, lost = solve(A, np.zeros((*A.shape[:2], 0)), unit_free(A, self.sizes, self.rows))
        H = A[:, :m, :m] / (self.sizes[:, :, None] * self.sizes[:, None])
        stiffness = np.abs(np.diagonal(H, axis1=1, axis2=2))
        elastic = stiffness > _PASSIVE * np.max(stiffness, axis=1, keepdims=True, initial=0.0)
        f = elastic / np.sqrt(np.where(elastic, stiffness, 1.0))
        J = _scaled(A, self.rows, self.sizes)
        both = np.concatenate([f[:, :, None] * H * f[:, None], J], axis=1)
        redundant = _rank_loss(np.linalg.svd(both, compute_uv=False), _LOST)
        return bool(np.any(lost > redundant + self.deficits))

    @cached_property
    def deficit(self) -> int:
        """How many directions of a leg are missing at most."""
        return int(self.deficits.max(initial=0))

    def solve(
        self, A: np.ndarray, b: np.ndarray, refinements: int
    ) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray] | None]:
        """``A x = b`` (N, n, k) but for the missing directions, which stay open.

        Returns what is found without what is carried in these (N, n, k), and how many directions
        each leg has lost (N,); then, of legs that miss some, what the closure misses there (N, d,
        k), and unit wrenches Λ of these among the unknowns (N, n, d).
        """
        N, n, m, d = len(A), A.shape[1], self.sizes.shape[1], self.deficit
        first = unit_free(A, self.sizes, self.rows)
        if not d:
            return *solve(A, b, first, refinements), None
        U = np.linalg.svd(_scaled(A, self.rows, self.sizes))[0]
        kept = np.arange(d) >= d - self.deficits[:, None]
        missing = U[:, :, n - m - d :] * kept[:, None]
        wide = np.zeros((N, n + d, n + d))
        wide[:, :n, :n] = A
        wide[:, m:n, n:] = missing / self.rows[:, None]
        wide[:, n:, m:n] = np.swapaxes(wide[:, m:n, n:], -1, -2)
        wide[:, range(n, n + d), range(n, n + d)] = ~kept
        aside = np.broadcast_to(self.rows[0] / first[:, m : m + 1], (N, d))
        wanted = np.concatenate([b, np.zeros((N, d, b.shape[2]))], axis=1)
        factors = np.concatenate([first, aside], axis=1)
        x, lost = solve(wide, wanted, factors, refinements)
        carried = np.zeros((N, n, d))
        carried[:, m:] = missing * self.rows[:, None]
        found = x[:, :n]
        # Beside redundant joints the inverse is one of least squares, and x has rough gaps.
        gaps = np.swapaxes(carried, -1, -2) @ (b - A @ found)
        return found, lost, (gaps, carried)


@frozen
class HeldPlatform:
    """Directions of the platform that rigid parts hold, in lengths (scaled coordinates)."""

    free: np.ndarray  # (r, m): orthonormal: motions that they leave
    gap: np.ndarray  # (r,): motion that closes them
    # (r, D): from the gaps of all legs to motions of the platform: of rank r - m
    inverse: np.ndarray

    @staticmethod
    def of(
        gaps: Sequence[np.ndarray], scale: np.ndarray, length: float, rank: int | None
    ) -> HeldPlatform:
        """From gaps (N, d, 1 + r + 1) of all legs: alone, by the twist, by the load factor.

        `length` is that of the robot [m]; `rank`: how many directions are held; found, at the
        unloaded posture, when None.
        """
        G = np.concatenate([leg.reshape(-1, leg.shape[2]) for leg in gaps])
        U, values, Vt = np.linalg.svd(G[:, 1:-1] / scale)
        if rank is None:
            # Against motions of their own size: loops that are closed twice may hold nothing.
            rank = int(np.sum(values * length > _LOST))
        inverse = (Vt[:rank].T / values[:rank]) @ U[:, :rank].T
        return HeldPlatform(Vt[rank:].T, -inverse @ G[:, 0], inverse)

    @property
    def rank(self) -> int:
        """How many directions are held."""
        return len(self.free) - self.free.shape[1]

    def within(self, K: np.ndarray) -> np.ndarray:
        """A stiffness (r, r) among the free motions, beside which held ones have its size."""
        P = self.free @ self.free.T
        inside = P @ K @ P
        size = float(np.linalg.norm(inside)) or 1.0
        return inside + size * (np.eye(len(P)) - P)

    def missing(self, K: np.ndarray, b: np.ndarray) -> np.ndarray:
        """What ``within(K)`` is to be solved for: balance among free motions, gaps closed."""
        P = self.free @ self.free.T
        size = float(np.linalg.norm(P @ K @ P)) or 1.0
        return P @ (b - K @ self.gap) + size * self.gap


def _scaled(A: np.ndarray, rows: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    m = sizes.shape[1]
    return A[:, m:, :m] * rows[:, None] / sizes[:, None]
