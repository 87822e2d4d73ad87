"""Newton's method for closed postures: the nearest, and the one in the assembly mode of home."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from robostiff.elastostatics.tolerance import Tolerance

CLOSED = 1e-10
_NEARLY_CLOSED = 1e-7
_CONVERGED = 1e-14
_STANDSTILL = 1e-11
_NEAREST_ITERATIONS = 60
_LARGEST_STEP = 0.5

_NEWTON_STEPS = 6
_CONTRACTION = 0.5
# Steps below this are as small as rounding makes them: they need not become smaller.
_SMALL_STEP = 1e-9
# Into how many parts the way from home is cut where it is too far for one.
_PARTS_OF_WAY = (1, 4, 16, 64)

_INDEPENDENT = Tolerance().independence
# Coordinates this far from home, in radians and parts of the length, say what rank is usual there.
_ASIDE, _SEED = 1e-3, 5


@dataclass(frozen=True)
class Part:
    """Equations whose determinant keeps its sign within an assembly mode.

    Attributes
    ----------
    loops : (n,) array of int
        Equations of loops inside legs, which are taken first.
    ends : (n,) array of int
        The other equations.
    unknowns : (n,) array of int
    """

    loops: np.ndarray
    ends: np.ndarray
    unknowns: np.ndarray

    @property
    def equations(self) -> np.ndarray:
        """All equations, those of loops first."""
        return np.concatenate([self.loops, self.ends])


class Equations(Protocol):
    """What must be closed, at postures x, one a row.

    Gaps and unknowns are scaled to radians and parts of the length. ``given`` are the places in x
    of coordinates that are prescribed, ``parts`` what has an assembly mode of its own; the last of
    them has all equations and unknowns.
    """

    @property
    def given(self) -> np.ndarray:
        """Places of prescribed coordinates."""
        ...

    @property
    def parts(self) -> Sequence[Part]:
        """What has an assembly mode of its own, then all."""
        ...

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """What stays open (N, m)."""
        ...

    def rates(self, x: np.ndarray) -> np.ndarray:
        """Rates at which the unknowns close it (N, m, n)."""
        ...

    def moved(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Postures after steps (N, n) of the unknowns."""
        ...

    def lengths(self, x: np.ndarray) -> np.ndarray:
        """What must be longer than nothing (N, k) [m]."""
        ...


def nearest(equations: Equations, x: np.ndarray) -> np.ndarray:
    """Postures closed, or as nearly as it goes, by Levenberg steps from guesses x (N, size).

    Steps are damped by the square of the gap. They may lead to another assembly mode.
    """
    best, best_size = x, np.full(len(x), np.inf)
    done = np.zeros(len(x), dtype=bool)
    for _ in range(_NEAREST_ITERATIONS):
        e = equations.gaps(x)
        size = np.max(np.abs(e), axis=-1, initial=0.0)
        better = (size < best_size) & ~done
        best_size = np.where(better, size, best_size)
        best = np.where(better[:, None], x, best)
        done |= (best_size <= _CONVERGED) | (~better & (best_size < _STANDSTILL))
        if np.all(done):
            break
        J = equations.rates(x)
        if J.shape[-1] == 0:
            break  # nothing can move
        J_T = np.swapaxes(J, -1, -2)
        wide = J.shape[-1] > J.shape[-2]
        A = J @ J_T if wide else J_T @ J
        trace = np.trace(A, axis1=-2, axis2=-1) / A.shape[-1]
        # Where nothing moves a gap, any damping keeps it at rest.
        damping = np.maximum(np.minimum(size, 1.0) ** 2, 1e-15) * np.where(trace > 0, trace, 1.0)
        A = A + damping[:, None, None] * np.eye(A.shape[-1])
        right = e[..., None] if wide else J_T @ e[..., None]
        found = np.linalg.solve(A, right)
        step = (J_T @ found if wide else found)[..., 0]
        longest = np.max(np.abs(step), axis=-1, keepdims=True)
        x = equations.moved(x, step * np.minimum(1.0, _LARGEST_STEP / np.maximum(longest, 1e-300)))
    return best


@dataclass(frozen=True)
class _Directions:
    """Combinations of equations and of unknowns in which a part is square and regular.

    ``U`` (..., m, r) and ``V`` (..., n, r) are orthonormal, ``sign`` that of det U^T J V.
    """

    U: np.ndarray
    V: np.ndarray
    sign: np.ndarray

    def of_rows(self, rows: np.ndarray) -> _Directions:
        """Those of some postures; at home they are the same for all."""
        return (
            self if self.U.ndim == 2 else _Directions(self.U[rows], self.V[rows], self.sign[rows])
        )

    def square(self, J: np.ndarray) -> np.ndarray:
        """U^T J V (N, r, r)."""
        return np.swapaxes(self.U, -1, -2) @ J @ self.V


@dataclass(frozen=True)
class AssemblyMode:
    """The assembly mode of a closed posture: what a path without singularity reaches from there.

    Along the way every part keeps the sign of its determinant det(U^T J V), telescopes stay longer
    than nothing, and each Newton step is at most half of the one before, six at most. The way is
    gone at once where that holds, otherwise in 4, 16 or 64 parts. The answer at a pose is the same
    to the last bit whatever other poses come with it.

    Attributes
    ----------
    equations : Equations
    home : (size,) array
        The closed posture.
    """

    equations: Equations
    home: np.ndarray

    def at(self, given: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Postures at prescribed coordinates.

        Parameters
        ----------
        given : (N, g) array
            In the order of ``equations.given``.

        Returns
        -------
        x : (N, size) array
            Home's unknowns where none is found.
        kept : (N,) array of bool
            Where a closed posture is found in this assembly mode.
        """
        found = np.tile(self.home, (len(given), 1))
        found[:, self.equations.given] = given
        kept = np.zeros(len(given), dtype=bool)
        for parts_of_way in _PARTS_OF_WAY:
            rows = np.flatnonzero(~kept)
            if rows.size == 0:
                break
            rows, there = self._along(given, rows, parts_of_way)
            found[rows], kept[rows] = there, True
        return found, kept

    def _along(
        self, given: np.ndarray, rows: np.ndarray, parts_of_way: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Postures at the end of the straight way from home, and whose they are."""
        places = self.equations.given
        start = self.home[places]
        x = np.tile(self.home, (len(rows), 1))
        directions = self._at_home
        for k in range(1, parts_of_way + 1):
            x[:, places] = start + k / parts_of_way * (given[rows] - start)
            if directions is None:
                x = nearest(self.equations, x)
                kept = _size(self.equations.gaps(x)) <= _NEARLY_CLOSED
            else:
                x, kept = self._newton(x, directions[-1])
            kept &= np.all(self.equations.lengths(x)[:, self._long_at_home] > 0, axis=-1)
            rows, x = rows[kept], x[kept]
            if rows.size == 0:
                break
            if directions is not None:
                directions = [one.of_rows(kept) for one in directions]
                J = self.equations.rates(x)
                kept = self._same_signs(J, directions)
                rows, x, J = rows[kept], x[kept], J[kept]
                if rows.size == 0:
                    break
                if k < parts_of_way:
                    directions = [
                        _carried(part, one.of_rows(kept), J)
                        for part, one in zip(self.equations.parts, directions, strict=True)
                    ]
        return rows, x

    def _newton(self, x: np.ndarray, directions: _Directions) -> tuple[np.ndarray, np.ndarray]:
        """Close from guesses by steps that contract, and where that succeeds."""
        x = x.copy()
        closed = np.zeros(len(x), dtype=bool)
        last = np.full(len(x), np.inf)
        going = np.arange(len(x))
        for taken in range(_NEWTON_STEPS + 1):
            e = self.equations.gaps(x[going])
            size = _size(e)
            still = last[going] <= _SMALL_STEP
            # Where nothing moves any more, dimensions with few digits may leave a little open.
            closed[going] = size <= np.where(still, _NEARLY_CLOSED, CLOSED)
            on = (size > _CONVERGED) & ~still
            if taken == _NEWTON_STEPS or not np.any(on):
                break
            going, e = going[on], e[on]
            own = directions.of_rows(going)
            whole = self.equations.parts[-1]
            T = own.square(_of_part(whole, self.equations.rates(x[going])))
            right = np.swapaxes(own.U, -1, -2) @ np.take(e, whole.equations, axis=1)[..., None]
            step = (own.V @ _solved(T, right))[..., 0]
            length = np.sqrt(np.sum(step * step, axis=-1))
            contracts = (length <= _CONTRACTION * last[going]) | (length <= _SMALL_STEP)
            closed[going[~contracts]] = False
            going, step, length = going[contracts], step[contracts], length[contracts]
            if going.size == 0:
                break
            x[going], last[going] = self.equations.moved(x[going], step), length
        return x, closed

    def _same_signs(self, J: np.ndarray, directions: list[_Directions]) -> np.ndarray:
        same = np.ones(len(J), dtype=bool)
        for part, own in zip(self.equations.parts, directions, strict=True):
            sign = np.linalg.slogdet(own.square(_of_part(part, J)))[0]
            same &= sign * own.sign > 0
        return same

    @cached_property
    def _at_home(self) -> list[_Directions] | None:
        """Directions at home; None where home is singular, so that modes meet there."""
        J = self.equations.rates(self.home[None])[0]
        aside = np.random.default_rng(_SEED).uniform(-_ASIDE, _ASIDE, (1, J.shape[-1]))
        J_aside = self.equations.rates(self.equations.moved(self.home[None], aside))[0]
        found = []
        for part in self.equations.parts:
            own = _directions(part, _of_part(part, J))
            if own.V.shape[-1] < _directions(part, _of_part(part, J_aside)).V.shape[-1]:
                return None
            found.append(own)
        return found

    @cached_property
    def _long_at_home(self) -> np.ndarray:
        return np.flatnonzero(self.equations.lengths(self.home[None])[0] > 0)


def _size(e: np.ndarray) -> np.ndarray:
    return np.max(np.abs(e), axis=-1, initial=0.0)


def _of_part(part: Part, J: np.ndarray) -> np.ndarray:
    """The rates of one part, those of loops first."""
    # Indices leave equal entries of all postures side by side, which products sum in another order.
    return np.ascontiguousarray(J[..., part.equations[:, None], part.unknowns])


def _solved(T: np.ndarray, right: np.ndarray) -> np.ndarray:
    """T^-1 right; infinite where T is singular."""
    try:
        return np.linalg.solve(T, right)
    except np.linalg.LinAlgError:
        singular = np.linalg.slogdet(T)[0] == 0
        T = np.where(singular[:, None, None], np.eye(T.shape[-1]), T)
        return np.where(singular[:, None, None], np.inf, np.linalg.solve(T, right))


def _directions(part: Part, J: np.ndarray) -> _Directions:
    """Directions at one posture, by singular values; loops close before the ends do."""
    k = len(part.loops)
    U_loops, V_loops = _spans(J[:k])
    ends = J[k:] - (J[k:] @ V_loops) @ V_loops.T
    U_ends, V_ends = _spans(ends)
    U = np.zeros((len(J), U_loops.shape[1] + U_ends.shape[1]))
    U[:k, : U_loops.shape[1]], U[k:, U_loops.shape[1] :] = U_loops, U_ends
    V = np.concatenate([V_loops, V_ends], axis=1)
    return _Directions(U, V, np.linalg.slogdet(U.T @ J @ V)[0])


def _spans(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal bases of what a matrix reaches, and of what it does not lose."""
    if 0 in A.shape:
        return np.zeros((A.shape[0], 0)), np.zeros((A.shape[1], 0))
    U, s, V_T = np.linalg.svd(A, full_matrices=False)
    rank = int(np.count_nonzero(s > _INDEPENDENT))
    return U[:, :rank], V_T[:rank].T


def _carried(part: Part, before: _Directions, J: np.ndarray) -> _Directions:
    """Directions at the next postures along a way, from those before: ranks stay what they were."""
    J = _of_part(part, J)
    k = len(part.loops)
    U = np.broadcast_to(before.U, (len(J), *before.U.shape[-2:]))
    r = int(np.count_nonzero(np.any(U[0, :k], axis=0))) if k else 0
    U_loops, V_loops = _carried_spans(J[:, :k], U[:, :k, :r])
    over = np.swapaxes(V_loops, -1, -2)
    U_ends, V_ends = _carried_spans(J[:, k:] - (J[:, k:] @ V_loops) @ over, U[:, k:, r:])
    U = np.zeros(U.shape)
    U[:, :k, :r], U[:, k:, r:] = U_loops, U_ends
    V = np.concatenate([V_loops, V_ends], axis=-1)
    return _Directions(U, V, np.linalg.slogdet(np.swapaxes(U, -1, -2) @ J @ V)[0])


def _carried_spans(A: np.ndarray, U: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As `_spans`, of the same rank as the directions U before."""
    A_T = np.swapaxes(A, -1, -2)
    V = np.linalg.qr(A_T @ U)[0]
    return np.linalg.qr(A @ V)[0], V
