"""The stiffness of one leg, (6) to (8), recorded in its working frame; bounds of its entries."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.elastostatics import Tolerance, block_compliance
from robostiff.frozen import frozen
from robostiff.kinematics.jacobians import spring_compliance
from robostiff.model import PlacedLeg, PlacedSpring
from robostiff.record import Entry, Operation, Record, usual_size
from robostiff.recorded.elimination import (
    Column,
    Conjugate,
    LocalLeg,
    WorkingFrame,
    carried_by,
    local_leg,
    made_conjugate,
    to_world,
    working_frames,
)
from robostiff.spatial import Space


def lower_bound(record: Record, step: int) -> float:
    """A number that a step never falls below; minus infinity where its operations give none."""
    bounds: dict[int, float] = {}
    for i in record.steps_needed([step]):  # each step once: many share their arguments
        operation, a, b = record.operation(i)
        match operation:
            case Operation.NUMBER:
                bounds[i] = float(a)
            case Operation.SQUARE_ROOT:
                bounds[i] = 0.0
            case Operation.ADD:
                bounds[i] = bounds[a] + bounds[b]
            case Operation.MULTIPLY if a == b:
                bounds[i] = 0.0
            case Operation.MULTIPLY if min(bounds[a], bounds[b]) >= 0:
                bounds[i] = bounds[a] * bounds[b]
            case _:
                bounds[i] = -math.inf
    return bounds[step]


#: Part of `RecordedRobot.reach` below which a pose is looked at again: the numerical form decides
#: at a miss of 1e-7.
SHORT = 1e-5
# Working frames that are tried in full: those from which the leg looks simplest.
_PROMISING = 4
# A compliance below this part of the whole is watched the more closely, so that a loss of 1e4 stays
# above the ratio of 1e-10 at which `Tolerance` doubts.
_NEARLY_RIGID = 1e-4
# Part of its usual size that a compliance must never fall below for it not to be watched.
_ENOUGH = 1e-4
_NOTHING = 1e-20  # square of a wrench beside 1: rounding
_RANK = 1e-7
_ELASTIC = 1e-9  # of the largest compliance


@frozen
class RecordedLeg:
    """Wrenches and compliances of a leg, K = sum of w w^T / mu."""

    name: str
    wrenches: list[Column]  #: world axes, about the reference point; conjugate to one another
    mu: list[Any]  #: list of entries or numbers: compliance under each wrench [m/N, rad/(N m)]
    #: list of entries or numbers: of the recorded pivots; large where digits are lost, or a wrench
    #: is nearly rigid
    losses: list[Any]
    redundant: tuple[bool, ...]  #: of the passive joints
    #: tuple of entries or numbers: of the passive joints squares that vanish where one becomes
    #: redundant; nothing is divided by them
    alone: tuple[Any, ...]
    frame: int  #: which of the working frames it was recorded in
    #: the wrenches W before they were made conjugate; world axes, about the reference point
    basis: list[Column]
    energy: list[list[Any]]  #: nested list: W^T C W of this basis (m, m)


@frozen
class LegRecorder:
    """Records legs of a robot about one reference point."""

    record: Record
    reference: np.ndarray  #: (3,): reference point in the world, entries or numbers
    space: Space
    length: float  #: characteristic length [m]

    def leg(self, leg: PlacedLeg, frame: int | None = None) -> RecordedLeg:
        """Record a leg, in a given working frame or in that with the shortest record.

        A frame is given where another leg has the same elements. How many frames there are
        depends on their springs and angles, too: a leg that lacks the given one takes its own.

        Raises
        ------
        InputError
            When a transmitted wrench meets no compliance.
        """
        if frame is not None and frame < len(frames := self.frames(leg)):
            local = local_leg(leg, frames[frame], self.record, self.length)
            return self._in_frame(leg, frame, frames[frame], local)

        def cost(leg: RecordedLeg) -> int:
            K = stiffness_entries([leg], len(self.space.rows)).values()
            return self.record.cost(x.step for x in (*K, *leg.losses) if isinstance(x, Entry))

        return min((self._in_frame(leg, *choice) for choice in self.promising(leg)), key=cost)

    def promising(self, leg: PlacedLeg) -> list[tuple[int, WorkingFrame, LocalLeg]]:
        """The working frames from which a leg looks simplest, with their numbers."""
        frames = self.frames(leg)
        seen = [local_leg(leg, frame, self.record, self.length) for frame in frames]
        best = sorted(range(len(frames)), key=lambda i: seen[i].entries)[:_PROMISING]
        return [(i, frames[i], seen[i]) for i in best]

    def _in_frame(
        self, leg: PlacedLeg, number: int, frame: WorkingFrame, local: LocalLeg
    ) -> RecordedLeg:
        rows = self.space.rows
        carried = carried_by(local, rows, self.length)
        conjugate = made_conjugate(carried.wrenches, carried.energy, leg.name)
        sample = SampledLeg.of(local, rows, self.length, self.record.count)
        ratio = sample.least_ratio(conjugate, self.scale[list(rows)])
        doubt = max(1.0, _NEARLY_RIGID / ratio)
        return RecordedLeg(
            name=leg.name,
            wrenches=[to_world(w, frame, self.reference, rows) for w in conjugate.wrenches],
            mu=conjugate.mu,
            losses=[*carried.losses, *conjugate.losses, *self.near_rigid(conjugate.mu, doubt)],
            redundant=carried.redundant,
            alone=carried.alone,
            frame=number,
            basis=[to_world(w, frame, self.reference, rows) for w in carried.wrenches],
            energy=carried.energy,
        )

    def sampled(self, leg: PlacedLeg) -> SampledLeg:
        """A leg in numbers, about the reference point and in world axes."""
        local = local_leg(leg, self.world, self.record, self.length)
        return SampledLeg.of(local, self.space.rows, self.length, self.record.count)

    @property
    def world(self) -> WorkingFrame:
        """World axes about the reference point."""
        return WorkingFrame(np.eye(3, dtype=int).astype(object), self.reference)

    @property
    def scale(self) -> np.ndarray:
        """1 for forces and shifts, the length for moments: by it all entries compare (6,)."""
        return np.array([1.0] * 3 + [self.length] * 3)

    def near_rigid(self, mu: Sequence[Any], doubt: float = 1.0) -> list[Any]:
        """By how much wrenches of compliances mu are nearer to rigid than at the samples."""
        return [
            doubt * usual_size(x) / x
            for x in mu
            if isinstance(x, Entry)
            and lower_bound(self.record, x.step) < _ENOUGH * doubt * usual_size(x)
        ]

    def frames(self, leg: PlacedLeg) -> list[WorkingFrame]:
        """Working frames of a leg; in the plane those that keep it."""
        frames = list(working_frames(leg, self.world))
        if self.space is Space.PLANAR:
            frames = [
                WorkingFrame(frame.R, np.array([*frame.p[:2], self.reference[2]], dtype=object))
                for frame in frames
                if self.record.simplify(frame.R[2, 2]) == 1  # it keeps the plane
            ]
        return frames


def stiffness_entries(legs: Sequence[RecordedLeg], size: int) -> dict[tuple[int, int], Any]:
    """Upper triangle of K = sum over all legs and their wrenches of w w^T / mu, eq. (12)."""
    K: dict[tuple[int, int], Any] = {(i, j): 0 for i in range(size) for j in range(i, size)}
    for leg in legs:
        for w, mu in zip(leg.wrenches, leg.mu, strict=True):
            scaled = [x / mu for x in w]
            for (i, j), so_far in K.items():
                K[i, j] = so_far + scaled[i] * w[j]
    return K


@frozen
class SampledLeg:
    """A leg in numbers at the samples: its passive twists and compliance in a working frame.

    Rotations count by the length, and so do moments, so that all entries compare. A parallel block
    leaves free what no branch holds; its compliance is the inverse of the sum of its branches,
    where they hold anything.
    """

    J: np.ndarray  # (count, n, p): unit twists that meet no resistance, those of blocks last
    C: np.ndarray  # (count, n, n): compliance under the wrenches that do no work on them
    is_even: bool  # whether its blocks hold as many motions at all samples

    @classmethod
    def of(cls, leg: LocalLeg, rows: Sequence[int], length: float, count: int) -> SampledLeg:
        """A leg in some rows of six."""
        places, scale = list(rows), np.array([1.0] * 3 + [length] * 3)
        whole = np.zeros((count, 6, 6))
        for spring in leg.springs:
            p, R, C = (at_samples(x, count) for x in (spring.p, spring.R, spring.compliance))
            placed = PlacedSpring("", p, R, Elasticity(C))
            whole = whole + spring_compliance(placed, np.zeros((count, 3)))
        for twist, stiffness in leg.drives:
            t = at_samples(twist, count)
            whole = (
                whole + t[:, :, None] * t[:, None, :] / at_samples([stiffness], count)[..., None]
            )
        C = (whole * scale[:, None] * scale)[:, places][:, :, places]
        # Twists by shifts over the length, wrenches by moments over it: their work stays.
        columns = [(at_samples(t, count) * scale / length)[:, places] for t in leg.twists]
        is_even = True
        for block in leg.blocks:
            each = [cls.of(branch, rows, length, count) for branch in block]
            inside = block_compliance([(x.C, x.J) for x in each], np.ones(count), Tolerance())
            C, columns = C + inside.C, [*columns, *np.moveaxis(inside.J_q, 2, 0)]
            is_even &= all(x.transmitted is not None for x in each) and bool(np.all(inside.present))
        J = np.stack(columns, axis=2) if columns else np.zeros((count, len(places), 0))
        sizes = np.linalg.norm(J, axis=1)[:, None]
        return cls(J / np.where(sizes > 0, sizes, 1), C, is_even)

    @cached_property
    def transmitted(self) -> int | None:
        """How many independent wrenches it transmits; None where samples differ."""
        ranks = {*np.linalg.matrix_rank(self.J, tol=_RANK).tolist()} if self.J.size else {0}
        return self.J.shape[1] - ranks.pop() if self.is_even and len(ranks) == 1 else None

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

    def least_ratio(self, conjugate: Conjugate, scale: np.ndarray) -> float:
        """Least compliance of a unit wrench over the trace of C, the smallest of the samples.

        Right within a factor of the number of wrenches; 1 where nothing is transmitted.
        """
        trace, ratios = np.einsum("sii->s", self.C), []
        for w, mu in zip(conjugate.wrenches, conjugate.mu, strict=True):
            unit = at_samples(w, len(self.C)) / scale
            square = np.einsum("si,si->s", unit, unit)
            if np.all(square > _NOTHING):
                ratios.append(at_samples([mu], len(self.C))[:, 0] / square / trace)
        return float(np.min(ratios, initial=1.0))


def at_samples(values: Column | np.ndarray, count: int) -> np.ndarray:
    """Values of entries and numbers at the samples (samples, ...)."""
    entries = np.asarray(values, dtype=object)
    samples = [x.sample if isinstance(x, Entry) else np.full(count, float(x)) for x in entries.flat]
    return np.array(samples).T.reshape(count, *entries.shape)
