"""Legs in numbers, at the samples of their record: passive twists, compliance, stiffness."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robostiff.kinematics.jacobians import freedom_twist
from robostiff.model import PlacedBlock, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record
from robostiff.spatial import Space

_RANK = 1e-7


def sampled(values: Any, count: int) -> np.ndarray:
    """Entries and numbers at the samples of their record, (count, ...)."""
    array = np.asarray(values, dtype=object)
    flat = [x.sample if isinstance(x, Entry) else np.full(count, float(x)) for x in array.flat]
    return np.array(flat).T.reshape(count, *array.shape)


@dataclass
class Seen:
    """Vectors at the samples that are looked up by their values."""

    close: float
    up_to_sign: bool
    others: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0)))
    count: int = 0

    def add(self, own: np.ndarray) -> None:
        """One more."""
        if self.count == len(self.others):
            more = np.empty((2 * self.count or 16, *own.shape))
            more[: self.count] = self.others.reshape(self.count, *own.shape)
            self.others = more
        self.others[self.count] = own
        self.count += 1

    def first_alike(self, own: np.ndarray) -> int | None:
        """The first that is the same, perhaps up to its sign."""
        if not self.count:
            return None
        others = self.others[: self.count]
        alike = np.abs(others - own).max(axis=(1, 2)) < self.close
        if self.up_to_sign:
            alike |= np.abs(others + own).max(axis=(1, 2)) < self.close
        first = int(alike.argmax())
        return first if alike[first] else None


@dataclass(frozen=True)
class Surroundings:
    """About which point a leg is looked at, and with which sizes."""

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

    @classmethod
    def of(cls, leg: PlacedLeg, around: Surroundings) -> SampledLeg | None:
        """A leg in numbers; None where a block holds different motions at different samples."""
        record, rows, scale = around.record, list(around.space.rows), around.scale
        reference = sampled(around.reference, record.count)
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
                R, p = sampled(part.rotation, record.count), sampled(part.point, record.count)
                own = _moved(sampled(part.elasticity.compliance, record.count), R, p - reference)
            else:
                twist = sampled(freedom_twist(part, at), record.count)
                if part.is_passive:
                    # Twists by shifts over the length, wrenches by moments: their work stays.
                    twist = twist * np.where(np.arange(6) < 3, 1 / around.length, 1.0)
                    columns.append(twist[:, rows])
                    continue
                if part.stiffness is None:
                    continue
                k = sampled([part.stiffness], record.count)
                own = twist[:, :, None] * twist[:, None, :] / k[:, :, None]
            C += (own * scale[:, None] * scale)[:, rows][:, :, rows]
        J = np.zeros((record.count, n, 0))
        if columns:
            J = np.stack(columns, axis=2)
            J = J / np.linalg.norm(J, axis=1)[:, None, :]
        ranks = {int(r) for r in np.linalg.matrix_rank(J, tol=_RANK)} if columns else {0}
        return cls(J, C, n - ranks.pop() if len(ranks) == 1 else None)

    @property
    def wrenches(self) -> np.ndarray:
        """An orthonormal basis of what is transmitted (count, n, m)."""
        n = self.C.shape[1]
        if not self.J.shape[2]:
            return np.broadcast_to(np.eye(n), self.C.shape)
        return np.linalg.svd(self.J)[0][:, :, n - (self.transmitted or 0) :]


def _of_block(block: PlacedBlock, around: Surroundings) -> SampledLeg | None:
    branches = []
    for branch in block.branches:
        own = SampledLeg.of(branch, around)
        if own is None or own.transmitted is None:
            return None
        branches.append(own)
    held = np.concatenate([own.wrenches for own in branches], axis=2)
    U, sizes, _ = np.linalg.svd(held)
    ranks = {int(np.sum(s > _RANK)) for s in sizes}
    if len(ranks) > 1:
        return None
    m = ranks.pop()
    Q = U[:, :, :m]
    K = np.zeros((len(Q), m, m))
    for own in branches:
        W = np.swapaxes(Q, 1, 2) @ own.wrenches
        A = np.swapaxes(own.wrenches, 1, 2) @ own.C @ own.wrenches
        K += W @ np.linalg.solve(A, np.swapaxes(W, 1, 2))
    return SampledLeg(U[:, :, m:], Q @ np.linalg.solve(K, np.swapaxes(Q, 1, 2)), m)


def _moved(C: np.ndarray, R: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Compliances of parts in their own axes about a point that is -v from them, world axes."""
    count = len(C)
    felt = np.zeros((count, 6, 6))  # of a wrench about the reference, at the part
    felt[:, :3, :3] = felt[:, 3:, 3:] = np.swapaxes(R, 1, 2)
    lever = np.zeros((count, 3, 3))
    lever[:, 0, 1], lever[:, 0, 2], lever[:, 1, 2] = v[:, 2], -v[:, 1], v[:, 0]
    lever[:, 1, 0], lever[:, 2, 0], lever[:, 2, 1] = -v[:, 2], v[:, 1], -v[:, 0]
    felt[:, 3:, :3] = np.swapaxes(R, 1, 2) @ lever
    return np.swapaxes(felt, 1, 2) @ C @ felt
