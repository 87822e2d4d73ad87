"""Two equal bars side by side between pins, as in the parallelogram of an Orthoglide.

Bars of length L along u lie w apart along j; each turns about a pin along g = j x u / s at either
end, s = |j x u|. Moved as one they hold three wrenches that share no energy:

* a force along u: each has half of it, and the compliance is L/(2 EA);
* a couple about g: traction F in one bar and -F in the other with F w s = 1, hence
  2 L/(EA w^2 s^2);
* a couple about n = g x j: both bars are twisted and bent in series, and in parallel to that they
  are sheared across by -w/2 and w/2. Its stiffness is
  6 EI w^2/L^3 + 1/(L s^2/(2 GJ) + L (1 - s^2)/(2 EI)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.springs.contributions import Contribution, recognised_beam
from robostiff.analytic.springs.leg_springs import LegReader
from robostiff.analytic.springs.unit_wrenches import UnitWrench
from robostiff.analytic.vectors.vector_rods import Bar, are_along, varies
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.recorded.leg import at_samples as sampled

_SAME = 1e-9
_SINE = sp.Symbol("s_i", positive=True)  # of the angle between the bars and the line across them


@dataclass(frozen=True, eq=False)
class ParallelBars:
    """Two bars of a leg, and what their directions are at the samples (count, 3)."""

    reader: LegReader
    along: Any  # L
    products: dict[str, Any]  # of a bar
    bends: str  # which of them bends when the bars are sheared
    bar: str  # name of one of them
    width: Any
    unit: np.ndarray
    pin: np.ndarray

    @classmethod
    def of(
        cls, leg: PlacedLeg, rod: Bar, reader: LegReader, placed: PlacedRobot
    ) -> ParallelBars | None:
        """The bars of a leg; None where it has others, or where they always cross j squarely."""
        j, u, count = rod.joint, rod.unit, placed.record.count
        if j is None or np.min(sampled(rod.width, count)) <= 0 or len(leg.blocks) != 1:
            return None
        across = np.cross(sampled(j, count), u)
        sine = np.linalg.norm(across, axis=1)
        if np.min(sine) <= _SAME or not varies(sine):
            return None
        pin = across / sine[:, None]
        beams = [_bar_of(branch, u, pin, count) for branch in leg.blocks[0].branches]
        first = beams[0]
        if len(beams) != 2 or first is None or not _are_equal(beams, count):
            return None
        found = recognised_beam(first, placed.record)
        axes = [sampled(axis, count) for axis in first.rotation.T]
        letters = ("EI_z", axes[1]), ("EI_y", axes[2])
        bends = next((letter for letter, axis in letters if are_along(axis, pin)), None)
        if found is None or bends is None:
            return None
        between = np.linalg.norm(rod.end - rod.start, axis=1)
        if np.max(np.abs(sampled(found[0], count) - between)) > _SAME * placed.length:
            return None
        products = reader.contributions.products.of(found[1])
        along, width = reader.read.length(found[0]), reader.read(rod.width)
        return cls(reader, along, products, bends, first.name, width, u, pin)

    def of_pair(self, leg: PlacedLeg, a: UnitWrench, b: UnitWrench) -> list[Contribution]:
        """What the springs of the leg add to a^T C b; the bars only where both are the same."""
        rest = self.reader.contributions.of(leg.without_blocks, a, b)
        return [*rest, *(self._own(a) if a is b else ())]

    def _own(self, wrench: UnitWrench) -> tuple[Contribution, ...]:
        L, w = self.along, self.width
        if wrench.point is not None:
            met = L / (2 * self._value("EA"))
        elif are_along(sampled(wrench.direction, len(self.unit)), self.pin):
            met = 2 * L / (self._value("EA") * w**2 * _SINE**2)
        else:
            EI, GJ = self._value(self.bends), self._value("GJ")
            in_series = L * _SINE**2 / (2 * GJ) + L * (1 - _SINE**2) / (2 * EI)
            met = 1 / (6 * EI * w**2 / L**3 + 1 / in_series)
        return (Contribution(self.bar, sp.Integer(1), met),)

    def _value(self, letter: str) -> Any:
        return self.reader.contributions.products.value(self.products[letter], self.bar)


def _bar_of(
    branch: PlacedLeg, unit: np.ndarray, pin: np.ndarray, count: int
) -> PlacedSpring | None:
    """The beam of a branch along u between two pins; None where it has other parts."""
    if len(branch.elements) != 3:
        return None
    first, beam, last = branch.elements
    if not isinstance(beam, PlacedSpring):
        return None
    for joint in (first, last):
        if not (isinstance(joint, PlacedFreedom) and joint.is_passive and joint.is_rotation):
            return None
        if not are_along(sampled(joint.axis, count), pin):
            return None
    return beam if are_along(sampled(beam.rotation[:, 0], count), unit) else None


def _are_equal(beams: Sequence[PlacedSpring | None], count: int) -> bool:
    each = [sampled(x.elasticity.compliance, count) for x in beams if x is not None]
    apart = [np.abs(C - each[0]) <= _SAME * np.abs(each[0]) for C in each]
    return len(each) == len(beams) and bool(np.all(apart))
