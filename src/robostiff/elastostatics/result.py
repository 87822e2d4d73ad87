"""The stiffness of a chain or a robot, with rank, free motions and status."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from robostiff.elastostatics.conjugate_wrenches import ConjugateWrenches, LeastEnergy, least_energy
from robostiff.elastostatics.status import WITHOUT_STIFFNESS, PoseBatch, Status, StatusOfPoses
from robostiff.elastostatics.tolerance import (
    RankDecision,
    Tolerance,
    scaling,
    smallest_held_stiffness,
)
from robostiff.errors import NoAnswerError
from robostiff.frozen import frozen
from robostiff.spatial import Space, move_stiffness
from robostiff.spatial.batch import empty_batch


def scaled_inverse(K: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Symmetric inverse of a regular K, taken where translations and rotations are both lengths."""
    s = scaling(length, Space.of_size(K.shape[-1]))
    scale = s[..., :, None] * s[..., None, :]
    inverse = np.linalg.inv(K / scale)
    return 0.5 * (inverse + np.swapaxes(inverse, -1, -2)) / scale


# Diagonal entry over pivot: with less, an inverse has nine digits of matrices that have twelve.
_FEW_LOST = 1e3
# Poses: few enough for the cache, and enough to hide what calls of NumPy cost.
_AT_ONCE = 6136


def definite_inverse(K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inverse of symmetric K (..., n, n), and where it is certain to nine digits (...).

    By symmetric sweeps of the upper triangle, over all poses side by side, or by the factor of
    Cholesky of a single K. Pivots do not depend on units: those of a positive definite K are above
    zero, and digits are lost where they are small beside the diagonal.

    References
    ----------
    J. Goodnight: A tutorial on the SWEEP operator. The American Statistician 33(3), 1979.
    """
    n = K.shape[-1]
    if K.ndim == 2:
        try:
            L = np.linalg.cholesky(K)
        except np.linalg.LinAlgError:
            return np.full(K.shape, np.nan), np.array(False)
        L_inv = np.linalg.inv(L)
        certain = np.all(np.diag(L) ** 2 * _FEW_LOST > np.diag(K))
        return L_inv.T @ L_inv, np.array(certain)
    given = K.reshape(-1, n, n)
    C, certain = empty_batch((len(given),), (n, n)), np.ones(len(given), dtype=bool)
    places = [(i, j) for i in range(n) for j in range(i, n)]
    for start in range(0, len(given), _AT_ONCE):
        chunk = slice(start, start + _AT_ONCE)
        rows, inverse = (np.moveaxis(array[chunk], 0, -1) for array in (given, C))
        A, product = {place: rows[place].copy() for place in places}, np.empty(rows.shape[-1])
        with np.errstate(all="ignore"):
            for k in range(n):
                certain[chunk] &= A[k, k] * _FEW_LOST > rows[k, k]
                A[k, k] = factor = -1 / A[k, k]
                column = [A[min(i, k), max(i, k)] for i in range(n)]
                scaled = [entry * factor for entry in column]
                for i, j in places:
                    if k not in (i, j):
                        A[i, j] += np.multiply(column[i], scaled[j], out=product)
                for i in set(range(n)) - {k}:
                    A[min(i, k), max(i, k)] = -scaled[i]
        for i, j in places:
            inverse[j, i] = np.negative(A[i, j], out=inverse[i, j])
    return C.reshape(K.shape), certain.reshape(K.shape[:-2])


class StiffnessOfPoses(StatusOfPoses):
    """Base of results that have a stiffness matrix, rank and status at each pose.

    They have a ``matrix`` (..., n, n) of all poses, meaningful where `answered`.
    """

    @property
    def K(self: Any) -> np.ndarray:
        """Stiffness matrix (..., n, n) [N/m, N, N m] about the reference point.

        Raises
        ------
        NoAnswerError
            When a pose has none; ``result[result.answered]`` keeps the others.
        """
        self.check_answered()
        return self.matrix

    @property
    def space(self: Any) -> Space:
        """Spatial (6 x 6) or planar (3 x 3)."""
        return Space.of_size(self.matrix.shape[-1])

    def __repr__(self: Any) -> str:
        """Point, rank and status; of a batch how many poses have a matrix."""
        kind = f"{type(self).__name__} of {self.name!r}"
        if self.batch_shape:
            count = int(np.count_nonzero(self.answered))
            return f"<{kind}, {int(np.prod(self.batch_shape))} poses, {count} with a matrix>"
        point = ", ".join(f"{x:.5g}" for x in self.reference_point)
        rank = f"rank {int(self.rank)} of {self.space.size}"
        return f"<{kind} about ({point}) m, {rank}, status {self.status}>"

    def check_answered(self: Any) -> None:
        """Raise a NoAnswerError, with the advice of the status, unless all poses have a matrix."""
        if self.answered.all():
            return
        name, reason = getattr(self, "name", ""), getattr(self, "reason", "")
        what = f"no stiffness matrix of {name!r}" if name else "no stiffness matrix"
        advice = " ".join(f"{line}." for line in Status(self.status & WITHOUT_STIFFNESS).advice)
        advice += f" Reason: {reason}." if reason else ""
        if not self.batch_shape:
            raise NoAnswerError(f"{what} at this pose ({self.status}): {advice}")
        first = tuple(int(i) for i in np.argwhere(~self.answered)[0])
        raise NoAnswerError(
            f"{what} at {np.count_nonzero(~self.answered)} of {self.answered.size} poses, the "
            f"first being {first} ({self.status}): {advice} "
            "result[result.answered] keeps the others."
        )

    def check_is_single(self: Any, what: str) -> None:
        """Raise a NoAnswerError for what poses of a batch have in different numbers."""
        if self.batch_shape:
            raise NoAnswerError(
                f"{what} of {np.prod(self.batch_shape)} poses at once: they differ in number; "
                f"take one pose, result[i]"
            )


@frozen
class CartesianStiffness(StiffnessOfPoses, PoseBatch):
    """K_C about a point, at one pose or a batch of poses, with rank, free motions and status.

    Attributes
    ----------
    matrix : (..., n, n) array
        K_C, meaningful where `answered`; `K` is the safe way to it.
    status_codes : (...) array of uint16
        `Status` of each pose.
    rank : (...) array of int
        Rank of K_C: how many independent wrenches the platform is held by.
    held : (..., n, m) array
        Unit wrenches by which the platform is held, in coordinates scaled by `length`.
    redundant : (..., q) array of bool
        Passive joints that add no freedom to those before them.
    length : (...) array
        Characteristic length [m] of the scaling.
    rigid : (..., n, k) array
        Wrenches that meet no compliance, scaled like `held`; zero columns fill up.
    tolerance : Tolerance
        What decided.
    reason : str
        Why the form refused, where it did.
    carried : ConjugateWrenches or None
        The wrenches of all legs and the compliance that each meets, from which compliance and loads
        of legs follow; None where the matrix alone is known.
    """

    matrix: np.ndarray
    status_codes: np.ndarray
    rank: np.ndarray
    held: np.ndarray
    redundant: np.ndarray
    length: np.ndarray
    rigid: np.ndarray
    tolerance: Tolerance
    reason: str = ""
    carried: ConjugateWrenches | None = None

    def moved(self, v: np.ndarray) -> np.ndarray:
        """K (..., n, n) about a point that is v (..., 3) away [m], unchecked."""
        v = v[..., : self.space.translations]
        return move_stiffness(self.matrix, v) if np.any(v) else self.matrix

    @property
    def free_motions(self) -> np.ndarray:
        """Twists that meet no stiffness, rows of an (f, n) array; of a single pose.

        Each row has unit length when rotations are multiplied by `length`.
        """
        self.check_is_single("free motions")
        U, values, _ = np.linalg.svd(self.held)
        free = U[:, np.count_nonzero(values > self.tolerance.independence) :].T
        return free / scaling(self.length, self.space)

    @property
    def rigid_directions(self) -> np.ndarray:
        """Wrenches that meet no compliance, rows of an (r, n) array; of a single pose."""
        self.check_is_single("rigid directions")
        columns = self.rigid.T[np.any(self.rigid != 0, axis=0)]
        return columns * scaling(self.length, self.space)

    @property
    def invertible(self) -> np.ndarray:
        """Where K can be inverted on the directions that are held (...).

        Elsewhere its smallest value there is not above rounding, and no digit would hold.
        """
        found = np.array(self.answered)
        if np.any(found):
            some = self[found] if self.batch_shape else self
            s = scaling(some.length, some.space)
            unit = some.matrix / (s[..., :, None] * s[..., None, :])
            found[found] = smallest_held_stiffness(unit, some.rank) > self.tolerance.rigidity
        return found

    @property
    def has_compliance(self) -> np.ndarray:
        """Where every load meets a finite compliance (...), rigid directions among them.

        From K alone it needs full rank, and digits enough to invert K.
        """
        reached = (self.status_codes & int(Status.UNREACHABLE)) == 0
        known = self.invertible if self.carried is None else self.carried.count >= self.space.size
        return reached & known & (self.rank == self.space.size)

    @property
    def compliance(self) -> np.ndarray | None:
        """Compliance C (..., n, n) [m/N, 1/N, rad/(N m)]; None when some pose has none.

        The inverse of K where there is one. Where a direction is rigid there is none, and C is
        zero for its wrench.
        """
        return self.inverse if np.all(self.has_compliance) else None

    @property
    def inverse(self) -> np.ndarray:
        """As `compliance`, of poses all of which have one."""
        if self.carried is None:
            return scaled_inverse(self.matrix, self.length)
        s = scaling(self.length, self.space)
        return self.load_sharing.compliance / (s[..., :, None] * s[..., None, :])

    @property
    def wrenches(self) -> ConjugateWrenches:
        """What carries a load.

        Raises NoAnswerError for a form that gives the matrix alone.
        """
        if self.carried is None:
            raise NoAnswerError("no loads by a form that gives K alone: use the wrench basis form")
        return self.carried

    @cached_property
    def load_sharing(self) -> LeastEnergy:
        """How these wrenches share a load, with the least energy; in scaled coordinates."""
        w = self.wrenches
        return least_energy(w.unit, w.compliance, w.rigid, self.rank, self.tolerance)

    @property
    def decision(self) -> RankDecision:
        """How the rank of a single pose was decided."""
        self.check_is_single("rank decision")
        values = np.linalg.svd(self.held, compute_uv=False)
        kept = values[values > self.tolerance.independence]
        dropped = values[values <= self.tolerance.independence]
        return RankDecision(
            smallest_kept=float(kept.min()) if kept.size else None,
            largest_dropped=float(dropped.max()) if dropped.size else None,
            tolerance=self.tolerance.independence,
            length=float(self.length),
        )
