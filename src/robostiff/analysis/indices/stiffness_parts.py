"""K at one pose in its parts: forces and moments, the rest held or free, with their ranks.

Most indices follow from four small matrices. They are blocks of K, and blocks of C inverted
(their Schur complements, which exist where C does not):

    ``K_tt``                            forces against displacements, rotations held
    ``K_tt - K_tr K_rr^-1 K_rt``        the same with rotations free, (C_tt)^-1
    ``K_rr``                            moments against rotations, displacements held
    ``K_rr - K_rt K_tt^-1 K_tr``        the same with displacements free, (C_rr)^-1

Their ranks are decided as that of K is: by the wrenches that hold the platform.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from robostiff.analysis.cable_stiffness import CableStiffness
from robostiff.analysis.result import Stiffness, require_one_pose
from robostiff.elastostatics import Status, scaling
from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.kept import kept
from robostiff.spatial import Space, move_wrench

_ROUNDING = 1e-15


@frozen
class EigenPart:
    """A symmetric matrix of one unit, as its eigenvalues and eigenvectors."""

    values: np.ndarray  # (d,): ascending; those of free directions are exactly zero
    directions: np.ndarray  # (d, d): unit eigenvectors, rows in the order of `values`

    @property
    def rank(self) -> int:
        """How many values are above zero."""
        return int(np.count_nonzero(self.values))

    @property
    def largest_inverse(self) -> float | None:
        """One over the smallest value; None where a direction is free."""
        return float(1 / self.values[0]) if self.values[0] > 0 else None

    @property
    def ratio(self) -> float | None:
        """Largest over smallest value; None where a direction is free."""
        return float(self.values[-1] / self.values[0]) if self.values[0] > 0 else None

    def solve(self, load: np.ndarray) -> np.ndarray:
        """Displacements (d, m) under loads (d, m) without components along free directions."""
        stiff = self.values > 0
        e = self.directions[stiff]
        return e.T @ ((e @ load) / self.values[stiff, None])


@frozen
class StationaryStiffness:
    """Stiffnesses of forces and of moments, ascending, with their directions as rows."""

    units: ClassVar[tuple[str, str]] = ("N/m", "N m/rad")

    translational: np.ndarray  # (d,): force per displacement along it [N/m]
    translational_directions: np.ndarray  # (d, d): unit vectors, rows
    rotational: np.ndarray  # (r,): moment per rotation about it [N m/rad]
    # (r, r): unit vectors, rows; in the plane the one rotation is about z, and its row is [1]
    rotational_directions: np.ndarray
    status: Status


@frozen
class StiffnessParts:
    """K of a single pose about its reference point, and the ranks of its parts."""

    result: Any  # stiffness at a single pose with a matrix
    K: np.ndarray  # (n, n): about the reference point [N/m, N, N m]
    # (n, n) or None: compliance about the same point; None where K is singular, or so nearly that
    # no digit of its inverse would hold
    C: np.ndarray | None
    # Of ``K_tt`` and of ``K_rr``
    rank_of_forces: int
    rank_of_moments: int
    # Part of the largest value below which no digit holds; None where all that is held has some
    rigidity: float | None = None

    @property
    def space(self) -> Space:
        """Spatial or planar."""
        return self.result.space

    @property
    def rank(self) -> int:
        """Of K."""
        return int(self.result.rank)

    @property
    def status(self) -> Status:
        """Status of the pose."""
        return self.result.status

    @cached_property
    def at_origin(self) -> StiffnessParts:
        """The parts about the robot's own point, from where the digits are best."""
        return stiffness_parts(self.result.about(self.result.origin))

    @cached_property
    def forces_rotations_held(self) -> EigenPart:
        """K_tt [N/m]; it does not depend on the reference point."""
        d = self.space.translations
        return eigenparts(self.K[:d, :d], self.rank_of_forces)

    @cached_property
    def moments_translations_held(self) -> EigenPart:
        """K_rr [N m/rad], about the reference point."""
        d = self.space.translations
        return eigenparts(self.K[d:, d:], self.rank_of_moments)

    @cached_property
    def forces_rotations_free(self) -> EigenPart:
        """The inverse of C_tt [N/m], for forces through the reference point."""
        d = self.space.translations
        if self.C is not None:
            return _inverse_parts(self.C[:d, :d])
        free = _schur(self.K[:d, :d], self.K[:d, d:], self.moments_translations_held)
        return self._free_parts(free, self.rank - self.rank_of_moments)

    @cached_property
    def moments_translations_free(self) -> EigenPart:
        """The inverse of C_rr [N m/rad]; it does not depend on the reference point."""
        d = self.space.translations
        if self.C is not None:
            return _inverse_parts(self.C[d:, d:])
        free = _schur(self.K[d:, d:], self.K[d:, :d], self.forces_rotations_held)
        return self._free_parts(free, self.rank - self.rank_of_forces)

    def _free_parts(self, free: np.ndarray, rank: int) -> EigenPart:
        """Of a Schur complement, in which values that are not above rounding are zero."""
        if self.rigidity is not None:
            values = np.linalg.eigvalsh(0.5 * (free + free.T))
            above = np.count_nonzero(values > self.rigidity * values[-1])
            rank = min(rank, int(above))
        return eigenparts(free, rank)


def stiffness_parts(result: Stiffness) -> StiffnessParts:
    """The parts of K at a single pose."""
    if not isinstance(result, Stiffness):
        raise InputError(
            "result",
            got=result,
            expected="a result of stiffness for a robot with legs, or for a network",
            hint="write stiffness(robot)",
        )
    hint = "take result[i], or indices(result) for all of them"
    require_one_pose("an index", result.batch_shape, hint)
    return _parts_of(result)


@kept
def _parts_of(result: Stiffness) -> StiffnessParts:
    space = result.space
    if result.inverted[1]:  # K of the record has full rank, and so have its parts
        d, n = space.translations, space.size
        return StiffnessParts(result, result.K, result.compliance, d, n - d)
    # Ranks of the force rows and of the moment rows of the wrenches that hold the platform
    answer = result.details()
    tolerance = answer.tolerance.independence
    U, values, _ = np.linalg.svd(answer.held)
    H = U[:, : int(np.count_nonzero(values > tolerance))]
    d = space.translations
    forces = np.linalg.svd(H[:d], compute_uv=False)
    v = result.reference_point - result.origin
    if np.any(v):
        s = scaling(answer.length, space)
        v = v[:d]
        H = np.linalg.qr(move_wrench((s[:, None] * H).T, v).T / s[:, None])[0]
    moments = np.linalg.svd(H[d:], compute_uv=False)
    ranks = (int(np.count_nonzero(x > tolerance)) for x in (forces, moments))
    C = result.compliance
    rigidity = None if C is not None or answer.invertible else answer.tolerance.rigidity
    return StiffnessParts(result, result.K, C, *ranks, rigidity=rigidity)


def parts_of_cables(result: CableStiffness) -> StiffnessParts:
    """The parts of K of a cable robot at a single pose, their ranks by its free motions."""
    K, d = result.K, result.space.translations
    twists = np.array([motion.twist for motion in result.free_motions]).reshape(-1, len(K))
    turning, shifting = (np.linalg.matrix_rank(x) for x in (twists[:, d:], twists[:, :d]))
    ranks = d - (len(twists) - int(turning)), len(K) - d - (len(twists) - int(shifting))
    return StiffnessParts(result, K, result.compliance, *ranks)


def eigenparts(matrix: np.ndarray, rank: int) -> EigenPart:
    """Eigenvalues and eigenvectors of a positive semidefinite matrix of known rank.

    Directions are readable: of equal eigenvalues along world axes as far as they allow, and with
    their largest component positive.
    """
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    values = np.maximum(values, _ROUNDING * max(values[-1], 0.0))
    values[: len(values) - rank] = 0.0
    return EigenPart(values, _readable(values, vectors.T))


def _inverse_parts(C: np.ndarray) -> EigenPart:
    """Of the inverse of a regular matrix, without inverting it."""
    compliant = eigenparts(C, len(C))
    values = 1 / compliant.values[::-1]
    return EigenPart(values, _readable(values, compliant.directions[::-1]))


def _schur(A: np.ndarray, B: np.ndarray, D: EigenPart) -> np.ndarray:
    """A - B D^-1 B^T; as K is positive semidefinite, free directions of D have no part in B."""
    return A - B @ D.solve(B.T)


def _readable(values: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Eigenvectors as rows, those of equal values as near to the axes as they can be."""
    rows, start = [], 0
    # Soft directions beside a stiff one differ by their own size.
    alike = 1e-9 * values + 10 * _ROUNDING * values[-1]
    for end in range(1, len(values) + 1):
        if end == len(values) or values[end] - values[end - 1] > alike[end]:
            rows += _along_axes(vectors[start:end])
            start = end
    return np.array(rows)


def _along_axes(basis: np.ndarray) -> list[np.ndarray]:
    """Orthonormal basis of the span of rows (k, d), near the axes, largest components positive."""
    vectors: list[np.ndarray] = []
    rest = basis
    while len(rest):
        shadows = rest.T @ rest  # columns: the axes projected on what is left
        sizes = np.diag(shadows)
        axis = int(np.argmax(sizes > 0.999 * sizes.max()))
        e = shadows[axis] / np.linalg.norm(shadows[axis])
        e = e * np.copysign(1.0, e[int(np.argmax(np.abs(e) > 0.999 * np.abs(e).max()))])
        vectors.append(e + 0.0)
        if len(rest) == 1:
            break
        rest = np.linalg.svd(rest - np.outer(rest @ e, e))[2][: len(rest) - 1]
    return sorted(vectors, key=lambda e: int(np.argmax(np.abs(e))))
