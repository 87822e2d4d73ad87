"""The stiffness of one leg, (6) to (8), recorded in its working frame; bounds of its entries."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.elastostatics import BlockCompliance, Tolerance, block_compliance
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
    """A number that a step never falls below; minus infinity where its operations give none.

    Examples
    --------
    >>> record = Record({"x": [3.0]})
    >>> x = record.input("x")
    >>> lower_bound(record, (x * x * 2 + 1).step), lower_bound(record, x.step)
    (1.0, -inf)
    """
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


@frozen
class RecordedLeg:
    """Wrenches and compliances of a leg, K = sum of w w^T / mu.

    Attributes
    ----------
    name : str
    wrenches : list of Column
        World axes, about the reference point; conjugate to one another.
    mu : list of entries or numbers
        Compliance under each wrench [m/N, rad/(N m)].
    losses : list of entries or numbers
        Of the recorded pivots; large where digits are lost, or a wrench is nearly rigid.
    redundant : tuple of bool
        Of the passive joints.
    alone : tuple of entries or numbers
        Of the passive joints squares that vanish where one becomes redundant; nothing is divided
        by them.
    frame : int
        Which of the working frames it was recorded in.
    basis : list of Column
        The wrenches W before they were made conjugate; world axes, about the reference point.
    energy : nested list
        W^T C W of this basis (m, m).
    """

    name: str
    wrenches: list[Column]
    mu: list[Any]
    losses: list[Any]
    redundant: tuple[bool, ...]
    alone: tuple[Any, ...]
    frame: int
    basis: list[Column]
    energy: list[list[Any]]


@frozen
class LegRecorder:
    """Records legs of a robot about one reference point.

    Attributes
    ----------
    record : Record
    reference : (3,) array
        Reference point in the world, entries or numbers.
    space : Space
    length : float
        Characteristic length [m].
    """

    record: Record
    reference: np.ndarray
    space: Space
    length: float

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
        ratio = compliance_ratio(local, conjugate, rows, self.length, self.record.count)
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
        world = WorkingFrame(np.eye(3, dtype=int).astype(object), self.reference)
        frames = list(working_frames(leg, world))
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


def compliance_ratio(
    leg: LocalLeg, conjugate: Conjugate, rows: Sequence[int], length: float, count: int
) -> float:
    """Least compliance of a unit wrench over the trace of C, the smallest of the samples.

    Turns are weighed by the characteristic length. It is right within a factor of the number of
    wrenches; 1 where nothing is transmitted.
    """
    if not conjugate.mu:
        return 1.0
    places = list(rows)
    scale = np.array([1.0] * 3 + [length] * 3)[places]
    C = _compliance(leg, length, count)
    trace = np.einsum("sii,i->s", C[:, places][:, :, places], scale**2)
    ratios = []
    for w, mu in zip(conjugate.wrenches, conjugate.mu, strict=True):
        unit = at_samples(w, count) / scale
        square = np.einsum("si,si->s", unit, unit)
        if np.all(square > _NOTHING):
            ratios.append(at_samples([mu], count)[:, 0] / square / trace)
    return float(np.min(ratios, initial=1.0))


def _compliance(leg: LocalLeg, length: float, count: int) -> np.ndarray:
    """Compliance of a leg about the origin of its frame, joints held (samples, 6, 6)."""
    C = np.zeros((count, 6, 6))
    for spring in leg.springs:
        p, R, compliance = (at_samples(x, count) for x in (spring.p, spring.R, spring.compliance))
        placed = PlacedSpring("", p, R, Elasticity(compliance))
        C = C + spring_compliance(placed, np.zeros((count, 3)))
    for twist, stiffness in leg.drives:
        t = at_samples(twist, count)
        C = C + t[:, :, None] * t[:, None, :] / at_samples([stiffness], count)[:, :, None]
    for block in leg.blocks:
        C = C + _rigid_block(block, length, count).C
    return C


def _rigid_block(block: Sequence[LocalLeg], length: float, count: int) -> BlockCompliance:
    branches = []
    for branch in block:
        J_q = [at_samples(twist, count) for twist in branch.twists]
        for inner in branch.blocks:
            J_q += list(np.moveaxis(_rigid_block(inner, length, count).J_q, -1, 0))
        J = np.stack(J_q, axis=-1) if J_q else np.zeros((count, 6, 0))
        branches.append((_compliance(branch, length, count), J))
    return block_compliance(branches, np.full(count, length), Tolerance())


def at_samples(values: Column | np.ndarray, count: int) -> np.ndarray:
    """Values of entries and numbers at the samples (samples, ...)."""
    entries = np.asarray(values, dtype=object)
    samples = [x.sample if isinstance(x, Entry) else np.full(count, float(x)) for x in entries.flat]
    return np.array(samples).T.reshape(count, *entries.shape)
