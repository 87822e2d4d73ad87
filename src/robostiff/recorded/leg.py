"""The stiffness of one leg, recorded in the working frame with the shortest record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.model import PlacedLeg
from robostiff.record import Entry, Record
from robostiff.recorded.elimination import Column, made_conjugate, transmitted_by
from robostiff.recorded.working_frame import (
    LocalLeg,
    WorkingFrame,
    energy_of,
    local_leg,
    to_world,
    working_frames,
)
from robostiff.spatial import Space

# Working frames that are tried in full: those from which the leg looks simplest.
_PROMISING = 4


@dataclass(frozen=True)
class RecordedLeg:
    """How a leg holds the platform, K = sum of w w^T / mu.

    Attributes
    ----------
    name : str
    wrenches : list of Column
        World axes, about the reference point; conjugate to one another.
    mu : list of entries or numbers
        Compliance that each wrench meets [m/N, rad/(N m)].
    margins : list of entries or numbers
        How safe the recorded pivots are; towards 0 the digits are lost.
    redundant : tuple of bool
        Of the passive joints.
    frame : int
        Which of the working frames it was recorded in.
    """

    name: str
    wrenches: list[Column]
    mu: list[Any]
    margins: list[Any]
    redundant: tuple[bool, ...]
    frame: int


@dataclass(frozen=True)
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

        Raises
        ------
        InputError
            When a transmitted wrench meets no compliance.
        """
        frames = self._frames(leg)
        if frame is not None:
            local = local_leg(leg, frames[frame], self.record, self.length)
            return self._in_frame(leg, local, frames[frame], frame)
        seen = [local_leg(leg, own, self.record, self.length) for own in frames]
        promising = sorted(range(len(frames)), key=lambda i: seen[i].entries)[:_PROMISING]
        tried = [self._in_frame(leg, seen[i], frames[i], i) for i in promising]
        return min(tried, key=self._cost)

    def _in_frame(
        self, leg: PlacedLeg, local: LocalLeg, frame: WorkingFrame, number: int
    ) -> RecordedLeg:
        rows = self.space.rows
        twists = [[twist[row] for row in rows] for twist in local.twists]
        transmitted = transmitted_by(twists, len(rows), self.length)
        energy = energy_of(local, transmitted.wrenches, rows)
        conjugate = made_conjugate(transmitted.wrenches, energy, leg.name)
        return RecordedLeg(
            name=leg.name,
            wrenches=[to_world(w, frame, self.reference, rows) for w in conjugate.wrenches],
            mu=conjugate.mu,
            margins=[*transmitted.margins, *conjugate.margins],
            redundant=transmitted.redundant,
            frame=number,
        )

    def _frames(self, leg: PlacedLeg) -> list[WorkingFrame]:
        world = WorkingFrame(np.eye(3, dtype=int).astype(object), self.reference)
        frames = list(working_frames(leg, world))
        if self.space is Space.PLANAR:
            frames = [own for own in frames if _keeps_the_plane(own, self.record)]
        return frames

    def _cost(self, leg: RecordedLeg) -> int:
        return self.record.cost(
            x.step for x in _flat(stiffness_entries([leg], len(self.space.rows)), leg.margins)
        )


def stiffness_entries(legs: Sequence[RecordedLeg], size: int) -> dict[tuple[int, int], Any]:
    """Upper triangle of K = sum over all legs and their wrenches of w w^T / mu, eq. (12)."""
    K: dict[tuple[int, int], Any] = {(i, j): 0 for i in range(size) for j in range(i, size)}
    for leg in legs:
        for w, mu in zip(leg.wrenches, leg.mu, strict=True):
            scaled = [x / mu for x in w]
            for (i, j), so_far in K.items():
                K[i, j] = so_far + scaled[i] * w[j]
    return K


def _flat(K: dict[tuple[int, int], Any], margins: Sequence[Any]) -> list[Entry]:
    return [x for x in (*K.values(), *margins) if isinstance(x, Entry)]


def _keeps_the_plane(frame: WorkingFrame, record: Record) -> bool:
    """Whether the frame's z axis is that of the plane."""
    return bool(record.settled(frame.R[2, 2]) == 1)
