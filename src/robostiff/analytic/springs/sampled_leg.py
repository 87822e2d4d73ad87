"""Legs at the samples: their passive twists, and their compliance."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.elastostatics.parallel_block import block_compliance
from robostiff.elastostatics.tolerance import Tolerance
from robostiff.kinematics.jacobians import freedom_twist, spring_compliance
from robostiff.model import PlacedBlock, PlacedLeg, PlacedSpring
from robostiff.record import Record
from robostiff.recorded.leg import at_samples
from robostiff.spatial import Space

_RANK = 1e-7
_ELASTIC = 1e-9  # of the largest compliance


@dataclass(frozen=True)
class Surroundings:
    """The record and the place of a leg."""

    record: Record
    reference: np.ndarray  # (3,): reference point, entries or numbers
    space: Space
    length: float  # characteristic length [m]

    @property
    def scale(self) -> np.ndarray:
        """1 for forces and shifts, the length for moments: by it all entries compare (6,)."""
        return np.array([1.0] * 3 + [self.length] * 3)


@dataclass(frozen=True)
class SampledLeg:
    """A leg at the samples: passive twists and compliance about the reference, scaled.

    Rotations count by the length, and so do moments, so that all entries compare. A parallel block
    inside the leg leaves free what no branch holds; its compliance is the inverse of the sum of
    its branches, where they hold anything.
    """

    J: np.ndarray  # (count, n, p): unit twists that meet no resistance
    C: np.ndarray  # (count, n, n): compliance under the wrenches that do no work on them
    # number of independent such wrenches; None where it differs from sample to sample
    transmitted: int | None

    @property
    def elastic_directions(self) -> int:
        """In how many independent directions it yields with its passive joints held."""
        tolerance = _ELASTIC * np.max(np.abs(self.C))
        return int(np.min(np.linalg.matrix_rank(self.C, tol=tolerance, hermitian=True)))

    @property
    def redundant(self) -> tuple[bool, ...]:
        """Which of its passive joints add no freedom to those before."""
        count = self.J.shape[2]
        ranks = [np.linalg.matrix_rank(self.J[:, :, :k], tol=_RANK) for k in range(1, count + 1)]
        pairs = pairwise([np.zeros(len(self.J)), *ranks])
        return tuple(bool(np.all(after == before)) for before, after in pairs)

    @property
    def stiffness(self) -> np.ndarray:
        """W (W^T C W)^-1 W^T over the wrenches that it transmits (count, n, n)."""
        W = np.linalg.svd(self.J)[0][:, :, self.C.shape[1] - (self.transmitted or 0) :]
        return W @ np.linalg.pinv(W.mT @ self.C @ W, hermitian=True) @ W.mT

    @classmethod
    def of(cls, leg: PlacedLeg, around: Surroundings) -> SampledLeg | None:
        """A leg in numbers; None where a block holds different motions at different samples."""
        record, rows, scale = around.record, list(around.space.rows), around.scale
        reference = at_samples(around.reference, record.count)
        at = np.asarray(around.reference, dtype=object)
        n = len(rows)
        C = np.zeros((record.count, n, n))
        columns: list[np.ndarray] = []
        for part in leg.elements:
            if isinstance(part, PlacedBlock):
                block = _of_block(part, around)
                if block is None:
                    return None
                C += block.C
                columns += list(np.moveaxis(block.J, 2, 0))
                continue
            if isinstance(part, PlacedSpring):
                R, p = at_samples(part.rotation, record.count), at_samples(part.point, record.count)
                own = Elasticity(at_samples(part.elasticity.compliance, record.count))
                own = spring_compliance(PlacedSpring("", p, R, own), reference)
            else:
                twist = at_samples(freedom_twist(part, at), record.count)
                if part.is_passive:
                    # Twists by shifts over the length, wrenches by moments: their work stays.
                    twist = twist * np.where(np.arange(6) < 3, 1 / around.length, 1.0)
                    columns.append(twist[:, rows])
                    continue
                if part.stiffness is None:
                    continue
                k = at_samples([part.stiffness], record.count)
                own = twist[:, :, None] * twist[:, None, :] / k[:, :, None]
            C += (own * scale[:, None] * scale)[:, rows][:, :, rows]
        J = np.zeros((record.count, n, 0))
        if columns:
            J = np.stack(columns, axis=2)
            J = J / np.linalg.norm(J, axis=1)[:, None, :]
        ranks = {int(r) for r in np.linalg.matrix_rank(J, tol=_RANK)} if columns else {0}
        return cls(J, C, n - ranks.pop() if len(ranks) == 1 else None)


def _of_block(block: PlacedBlock, around: Surroundings) -> SampledLeg | None:
    branches = []
    for branch in block.branches:
        own = SampledLeg.of(branch, around)
        if own is None or own.transmitted is None:
            return None
        branches.append((own.C, own.J))
    found = block_compliance(branches, np.ones(around.record.count), Tolerance())
    if not np.all(np.linalg.norm(found.J_q, axis=1)):
        return None
    return SampledLeg(found.J_q, found.C, found.C.shape[1] - found.J_q.shape[2])
