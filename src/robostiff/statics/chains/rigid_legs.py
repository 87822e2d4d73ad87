"""Rigid parts: closures that the freedoms of a leg cannot meet, and what they hold of the platform.

Where the closure of a leg ``J dx = dt`` lacks the directions Λ, ``Λ^T J = 0``, the leg carries
``W = Λ z`` without compliance, and the platform moves by ``Λ^T dt = 0`` alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.statics.chains.equilibrated import Equilibrated, equilibrated, unit_free

# Of the largest singular value of a closure, in robot lengths and radians: a lost direction.
_LOST = 1e-9


@dataclass(frozen=True)
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
        largest = np.max(values, axis=1, initial=0.0)[:, None]
        ranks = np.sum((values > _LOST * largest) & (values > 0), axis=1)
        return Closure(rows, sizes, A.shape[1] - m - ranks)

    def solve(self, A: np.ndarray, b: np.ndarray, refinements: int) -> Bordered:
        """``A x = b`` (N, n, k) but for the missing directions, which are left."""
        N, n, m, d = len(A), A.shape[1], self.sizes.shape[1], int(self.deficits.max())
        U = np.linalg.svd(_scaled(A, self.rows, self.sizes))[0]
        kept = np.arange(d) >= d - self.deficits[:, None]
        missing = U[:, :, n - m - d :] * kept[:, None]
        wide = np.zeros((N, n + d, n + d))
        wide[:, :n, :n] = A
        wide[:, m:n, n:] = missing / self.rows[:, None]
        wide[:, n:, m:n] = np.swapaxes(wide[:, m:n, n:], -1, -2)
        wide[:, range(n, n + d), range(n, n + d)] = ~kept
        first = unit_free(A, self.sizes, self.rows)
        aside = np.broadcast_to(self.rows[0] / first[:, m : m + 1], (N, d))
        inverse = equilibrated(wide, first=np.concatenate([first, aside], axis=1))
        x = inverse.solve(np.concatenate([b, np.zeros((N, d, b.shape[2]))], axis=1), refinements)
        carried = np.zeros((N, n, d))
        carried[:, m:] = missing * self.rows[:, None]
        found = x[:, :n]
        # Beside redundant joints the inverse is one of least squares, and x has rough gaps.
        gaps = np.swapaxes(carried, -1, -2) @ (b - A @ found)
        return Bordered(inverse, found, gaps, carried)


@dataclass(frozen=True)
class Bordered:
    """Steps of legs with rigid parts.

    `found` (N, n, k) is without what is carried in the missing directions, `gaps` (N, d, k) what is
    left of the closure there, `carried` (N, n, d) unit wrenches Λ of these among the unknowns.
    """

    inverse: Equilibrated
    found: np.ndarray
    gaps: np.ndarray
    carried: np.ndarray


@dataclass(frozen=True)
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
        every = np.concatenate([own.reshape(-1, own.shape[2]) for own in gaps])
        U, values, Vt = np.linalg.svd(every[:, 1:-1] / scale)
        if rank is None:
            # Against motions of their own size: loops that are closed twice may hold nothing.
            rank = int(np.sum(values * length > _LOST))
        inverse = (Vt[:rank].T / values[:rank]) @ U[:, :rank].T
        return HeldPlatform(Vt[rank:].T, -inverse @ every[:, 0], inverse)

    @property
    def rank(self) -> int:
        """How many directions are held."""
        return len(self.free) - self.free.shape[1]

    def within(self, K: np.ndarray) -> np.ndarray:
        """A stiffness (r, r) among the motions left, beside which held ones have its size."""
        P = self.free @ self.free.T
        inside = P @ K @ P
        size = float(np.linalg.norm(inside)) or 1.0
        return inside + size * (np.eye(len(P)) - P)

    def missing(self, K: np.ndarray, b: np.ndarray) -> np.ndarray:
        """What ``within(K)`` is to be solved for: balance among motions left, gaps closed."""
        P = self.free @ self.free.T
        size = float(np.linalg.norm(P @ K @ P)) or 1.0
        return P @ (b - K @ self.gap) + size * self.gap


def _scaled(A: np.ndarray, rows: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    m = sizes.shape[1]
    return A[:, m:, :m] * rows[:, None] / sizes[:, None]
