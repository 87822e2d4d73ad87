"""Coupled joints on recorded entries: sums of their coordinates, held by springs or rigidly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from robostiff.model import CoupledFreedom, PlacedLeg
from robostiff.statics.kernels.elements import RecordedJoint, recorded_joint
from robostiff.statics.kernels.elimination import SymmetricElimination


@dataclass(frozen=True)
class RecordedCoupling:
    """A sum ``s = sum(a q)`` of coordinates that is the motion of a spring, or 0 where it is rigid.

    What it pushes with is an unknown of its own; see `FiniteCoupling`.
    """

    name: str  # its unknowns begin with it
    terms: tuple[tuple[str, Any], ...]  # tuple of (str, entry or number): coordinates, and a
    drive: RecordedJoint  # with the stiffness against s, and a preload
    is_rigid: bool

    @property
    def push(self) -> str:
        """Name of what it pushes with [N or N m]."""
        return f"{self.name}.f"

    @property
    def motion(self) -> list[str]:
        """Name of the motion of its spring; none of a rigid one."""
        return [] if self.is_rigid else [f"{self.name}.s"]

    def add_to(
        self, elimination: SymmetricElimination, values: Mapping[str, Any], length: float
    ) -> None:
        """Add ``sum(a q) - s = 0`` and what pushes."""
        (size,) = self.drive.sample_sizes(length)
        elimination.unknown(self.push, size)
        terms = [*self.terms, *((name, -1) for name in self.motion)]
        for name in self.motion:
            elimination.unknown(name, 1.0)
            elimination.add(name, name, self.drive.stiffness)
            pull = self.drive.stiffness * values[name] - self.drive.preload
            elimination.add_right(name, -pull)
        for name, factor in terms:
            elimination.add(self.push, name, factor)
            elimination.add_right(name, values[self.push] * factor)
            elimination.add_right(self.push, -(values[name] * factor))


def recorded_couplings(
    placed: PlacedLeg, coordinates: Mapping[str, str], prefix: str, preload: Mapping[str, float]
) -> tuple[RecordedCoupling, ...]:
    """Couplings of a leg, from coordinates of its joints that move; preloads by ``leg/part``."""
    return tuple(
        RecordedCoupling(
            f"{placed.name}.{own.name}",
            tuple((coordinates[joint], a) for joint, a in own.sum if joint in coordinates),
            recorded_joint(own, preload.get(prefix + own.name, 0)),
            own.stiffness is None,
        )
        for own in placed.parts
        if isinstance(own, CoupledFreedom) and len(own.sum) > 1
    )
