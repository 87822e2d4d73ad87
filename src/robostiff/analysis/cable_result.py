"""The result of `cable_stiffness`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.analysis.free_motion import FreeMotion, free_motions_in_words
from robostiff.cables import (
    CableStatus,
    PlacedCables,
    elastic_stiffness,
    force_stiffness,
    geometric_stiffness,
    structure_matrix,
    weight_stiffness,
    weight_wrench,
)
from robostiff.cables.stability import Stability, stability
from robostiff.cables.status import WITHOUT_STIFFNESS
from robostiff.elastostatics import Tolerance
from robostiff.elastostatics.result import scaled_inverse
from robostiff.elastostatics.tolerance import scaling
from robostiff.errors import NoAnswerError
from robostiff.spatial import Space


@dataclass(frozen=True, repr=False)
class CableStiffness:
    """Stiffness of a cable robot about a point, in world axes, with tensions and status.

    Attributes
    ----------
    name : str
        Of the robot.
    cable_names : tuple of str
    pose : (..., 6) array
        x, y, z [m] and rotation vector [rad] of the platform.
    placed : PlacedCables
        Where the cables run, and the point about which the matrices are given.
    tensions : (..., m) array
        Of every cable [N]; zero where there is no answer.
    axial : (..., m) array
        Stiffness of every cable with its winch [N/m]; zero for a slack cable.
    wrench : (..., n) array
        Applied to the platform beside its weight, about the reference point [N, N m].
    load_point : (..., 3) array
        Point of the platform at which the force of the wrench acts, in the world [m].
    status_codes : (...) array of uint16
        `CableStatus` of every pose.
    held_rank, rank : (...) arrays of int
        Rank of the structure matrix and of K; -1 where there is no answer.
    rule : str
        How the tensions were chosen.
    tolerance : Tolerance
    """

    name: str
    cable_names: tuple[str, ...]
    pose: np.ndarray
    placed: PlacedCables
    tensions: np.ndarray
    axial: np.ndarray
    wrench: np.ndarray
    load_point: np.ndarray
    status_codes: np.ndarray
    held_rank: np.ndarray
    rank: np.ndarray
    rule: str
    tolerance: Tolerance

    @property
    def space(self) -> Space:
        """Spatial (6 x 6) or planar (3 x 3)."""
        return self.placed.space

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """Shape of the batch of poses, () for a single one."""
        return self.status_codes.shape

    @property
    def reference_point(self) -> np.ndarray:
        """Point about which K is given, in the world (..., 3) [m]."""
        return self.placed.reference_point

    @property
    def K(self) -> np.ndarray:
        """Stiffness matrix (..., n, n) [N/m, N, N m]: elastic, geometric, of weight and wrench.

        The second derivative of the potential energy; symmetric.

        Raises
        ------
        NoAnswerError
            When a pose has none.
        """
        return self.elastic + self.geometric + self.of_forces

    @property
    def elastic(self) -> np.ndarray:
        """The part of stretching cables, A^T diag(k) A (..., n, n)."""
        self._require_answer()
        return elastic_stiffness(self.placed, self.axial)

    @property
    def geometric(self) -> np.ndarray:
        """The part of turning cables under tension (..., n, n)."""
        self._require_answer()
        return geometric_stiffness(self.placed, self.tensions)

    @property
    def of_forces(self) -> np.ndarray:
        """The part of weight and wrench, forces that keep their direction (..., n, n).

        Those that act at the reference point have none.
        """
        self._require_answer()
        return _of_forces(self)

    @property
    def taut_stiffness(self) -> np.ndarray:
        """K without the cables that have no tension (..., n, n)."""
        taut = np.where(self.tensions > 0, self.axial, 0.0)
        return elastic_stiffness(self.placed, taut) + self.geometric + self.of_forces

    @property
    def compliance(self) -> np.ndarray | None:
        """Inverse of K (..., n, n) [m/N, 1/N, rad/(N m)]; None where K is singular or missing."""
        if not np.all(self.answered) or np.any(self.rank < self.space.size):
            return None
        return scaled_inverse(self.K, self.placed.characteristic_length)

    def required_compliance(self) -> np.ndarray:
        """Compliance matrix, or an exception that says why there is none.

        Raises
        ------
        NoAnswerError
        """
        C = self.compliance
        if C is None:
            self._require_answer()
            reason = CableStatus.FREE_MOTIONS.advice[0]
            raise NoAnswerError(f"no compliance matrix of {self.name!r}: {reason}")
        return C

    @property
    def status(self) -> CableStatus:
        """Status of a single pose; of a batch, all flags that hold at any pose."""
        return CableStatus(int(np.bitwise_or.reduce(self.status_codes, axis=None)))

    @property
    def answered(self) -> np.ndarray:
        """Where there is a stiffness matrix (...)."""
        return (self.status_codes & int(WITHOUT_STIFFNESS)) == 0

    @property
    def advice(self) -> tuple[str, ...]:
        """Advice about this result, a sentence each."""
        return self.status.advice

    @property
    def untensioned(self) -> tuple[str, ...]:
        """Cables without tension, at any pose."""
        without = (self.tensions <= 0) & self.answered[..., None]
        lost = np.flatnonzero(without.reshape(-1, len(self.cable_names)).any(axis=0))
        return tuple(self.cable_names[i] for i in lost)

    @property
    def missing_wrench(self) -> np.ndarray:
        """Wrench (..., n) that cables, weight and the applied wrench do not balance [N, N m]."""
        self._require_answer()
        pulled = np.einsum("...ij,...j->...i", structure_matrix(self.placed), self.tensions)
        return -(pulled + weight_wrench(self.placed) + self.wrench)

    @property
    def free_motions(self) -> tuple[FreeMotion, ...]:
        """Free motions of the platform, at a single pose."""
        return self._in_words("free")

    @property
    def unstable_motions(self) -> tuple[FreeMotion, ...]:
        """Unstable motions of the platform, at a single pose."""
        return self._in_words("unstable")

    def about(self, point: np.ndarray) -> CableStiffness:
        """The same answer about another point of the platform (..., 3), in the world [m]."""
        placed = self.placed.about(point)
        v = placed.reference_point - self.reference_point
        wrench = moved_wrench(self.wrench, v, self.space)
        return replace(self, placed=placed, wrench=wrench)

    def __getitem__(self, index: Any) -> CableStiffness:
        """The answer at one pose, or at some poses, of a batch."""
        return replace(
            self,
            pose=self.pose[index],
            placed=self.placed[index],
            tensions=self.tensions[index],
            axial=self.axial[index],
            wrench=self.wrench[index],
            load_point=self.load_point[index],
            status_codes=np.asarray(self.status_codes[index]),
            held_rank=np.asarray(self.held_rank[index]),
            rank=np.asarray(self.rank[index]),
        )

    def __repr__(self) -> str:
        if self.batch_shape:
            answered = int(np.count_nonzero(self.answered))
            poses = int(np.prod(self.batch_shape))
            return f"<CableStiffness of {self.name!r}, {poses} poses, {answered} with a matrix>"
        point = ", ".join(f"{x:.5g}" for x in self.reference_point)
        return (
            f"<CableStiffness of {self.name!r} about ({point}) m, rank {int(self.rank)} of "
            f"{self.space.size}, status {self.status}>"
        )

    def _in_words(self, kind: str) -> tuple[FreeMotion, ...]:
        if self.batch_shape:
            raise NoAnswerError(
                f"{kind} motions of {np.prod(self.batch_shape)} poses at once: they differ in "
                "number; take one pose, result[i]"
            )
        if not self.answered:
            return ()
        length = self.placed.characteristic_length
        basis = getattr(stability_of(self), kind).T / scaling(length, self.space)
        return free_motions_in_words(basis, self.reference_point, float(length))

    def _require_answer(self) -> None:
        if np.all(self.answered):
            return
        advice = " ".join(
            f"{line}." for line in CableStatus(self.status & WITHOUT_STIFFNESS).advice
        )
        where = "at this pose"
        if self.batch_shape:
            poses = np.count_nonzero(~self.answered)
            where = f"at {poses} of {self.answered.size} poses"
            advice += " result[result.answered] keeps the others."
        raise NoAnswerError(f"no stiffness matrix of {self.name!r} {where}: {advice}")


def steady_stiffness(result: CableStiffness) -> np.ndarray:
    """The part that is not elastic, at poses without an answer too (..., n, n)."""
    return geometric_stiffness(result.placed, result.tensions) + _of_forces(result)


def _of_forces(result: CableStiffness) -> np.ndarray:
    force = np.zeros((*result.wrench.shape[:-1], 3))
    d = result.space.translations
    force[..., :d] = result.wrench[..., :d]
    arm = result.load_point - result.reference_point
    return weight_stiffness(result.placed) + force_stiffness(force, arm, result.space)


def stability_of(result: CableStiffness) -> Stability:
    """Rank and stability of a single pose."""
    s = scaling(result.placed.characteristic_length, result.space)
    scale = np.outer(s, s)
    tension = steady_stiffness(result)
    # What the tensions could give, were none to cancel another.
    size = float(np.sum(result.tensions / result.placed.lengths))
    size = max(size, float(np.abs(tension / scale).max()))
    W = structure_matrix(result.placed)[:, result.axial > 0] / s[:, None]
    return stability(W, result.K / scale, size, result.tolerance)


def moved_wrench(wrench: np.ndarray, v: np.ndarray, space: Space) -> np.ndarray:
    """Wrench about a reference point that is v (..., 3) further, in space or in the plane."""
    six = np.zeros((*wrench.shape[:-1], 6))
    six[..., list(space.rows)] = wrench
    six[..., 3:] -= np.cross(v, six[..., :3])
    return six[..., list(space.rows)]
