"""The wrenches of a leg among the directions that a person would name, and what each meets.

Directions are along the leg, along the axes of its joints, and square to these. Wrenches that share
no energy have a compliance each; where one force shares energy with one couple, it is moved by the
couple; where more of them do, the leg has a small matrix of compliances.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.definition import Definition, count_of
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.springs.leg_springs import LegReader, recognised_beam, sum_of
from robostiff.analytic.springs.unit_wrenches import Basis, UnitWrench
from robostiff.analytic.vectors.vector_expressions import Cross, Norm, Stacked, Sum, Times
from robostiff.analytic.vectors.vector_rods import (
    COSINE,
    LENGTH,
    SAME,
    SCALARS,
    SINE,
    Bar,
    Carrier,
    G,
    J,
    N,
    Platform,
    U,
    are_along,
    varies,
)
from robostiff.frozen import frozen, replace
from robostiff.model import PlacedLeg
from robostiff.record import Entry, Record
from robostiff.recorded.elimination import cross
from robostiff.recorded.leg import at_samples as sampled

_LONGEST = 80  # operations of a compliance that is printed for a generic leg


@frozen
class LegInVectors:
    """A leg as it is written: its wrenches, what each meets, and what pairs of them share."""

    wrenches: tuple[Stacked, ...]
    # What pairs of them meet, by their numbers, the first one not more; none of others
    entries: dict[tuple[int, int], Any]

    @property
    def moved(self) -> int | None:
        """The force that only shares energy with the last wrench, a couple."""
        shared = [(i, j) for i, j in self.entries if i < j]
        if len(shared) != 1 or shared[0][1] != len(self.wrenches) - 1:
            return None
        i, last = shared[0][0], self.wrenches[-1]
        return i if self.wrenches[i].parts[0] != 0 and last.parts[0] == 0 else None

    @property
    def coupled(self) -> tuple[tuple[str, ...], ...]:
        """Names of what pairs meet, empty for zero; none where at most a force is moved."""
        known, places = self.entries, range(len(self.wrenches))
        if len(known) == len(places) or self.moved is not None:
            return ()
        return tuple(
            tuple(shared_name(i, j) * ((min(i, j), max(i, j)) in known) for j in places)
            for i in places
        )


# Its place in the basis, and how it is written
_Written = tuple[int, UnitWrench, Stacked]
_OfBars = Callable[[UnitWrench], Any]


@frozen
class WrenchWriter:
    """Writes the wrenches of legs in vectors, and what they meet in scalars of these."""

    placed: PlacedRobot
    springs: LegReader
    read: KnownReading
    platform: Platform

    def of(
        self, number: int, rod: Bar, before: Sequence[tuple[Bar, LegInVectors]] = ()
    ) -> LegInVectors | None:
        """A leg; None where a wrench has another direction, or acts along another line.

        `before`: legs that are known, of which one may hold as this one does.
        """
        placed_leg, search = self.placed.legs[number].leg, self.springs.search
        for other, leg in before:
            is_alike = other.carrier is rod.carrier and other.first == rod.first
            if is_alike and self.is_stiffness(placed_leg, leg, rod):
                return leg
        basis = search.basis(placed_leg)
        if basis is None or not basis.wrenches:
            return None
        if rod.carrier is not Carrier.SLIDE:
            basis = self._with_couples(placed_leg, basis, rod)
        written = [self._written(i, unit, rod) for i, unit in enumerate(basis.wrenches)]
        found = sorted(
            (one for one in written if one is not None),
            key=lambda one: (one[1].point is None, one[2].parts[0] != U),
        )
        if len(found) < len(written):
            return None
        used = [w.parts[0] or w.parts[1] for *_, w in found]
        self.read.known = rod.named(rod.scalars())
        if across := rod.give_angle(used):
            if any(not are_along(rod.at.of(x), rod.at.of(across[0])) for x in across):
                return None
            self.read.known += rod.named([*rod.scalars_across(), COSINE, SINE])
        for bars in (_bars_of(placed_leg, rod, self) if N in used else None, None):
            leg = self._in_scalars(placed_leg, found, basis, bars)
            if bars is None or self.is_stiffness(placed_leg, leg, rod):
                return leg
        return None

    def _written(self, place: int, found: UnitWrench, rod: Bar) -> _Written | None:
        """A unit wrench along one of the named directions."""
        at = sampled(found.direction, rod.at.count)
        vector = next((x for x in rod.directions if are_along(rod.at.of(x), at)), None)
        if vector is None:
            return None
        named = rod.at.of(vector)
        # The sign matters where two wrenches share energy.
        sign = 1 if np.max(np.abs(at - named)) < SAME else -1
        wrench = replace(found, direction=sign * found.direction)
        if wrench.point is None:
            return place, wrench, Stacked(0, vector)
        away = sampled(wrench.point - self.placed.reference, rod.at.count)
        # From the reference point to places of a rod.
        end, is_strut = self.platform.end, rod.carrier is Carrier.NOTHING
        back = Times(LENGTH / 2 if is_strut else rod.length, U)
        for arm in (end, *[self.platform.base] * is_strut, Sum((1, end), (-1, back))):
            apart = np.cross(rod.at.of(arm) - away, named)
            if np.max(np.abs(apart)) < SAME * self.placed.length:
                return place, wrench, Stacked(vector, Cross(arm, vector))
        return None

    def is_stiffness(self, placed_leg: PlacedLeg, leg: LegInVectors, rod: Bar) -> bool:
        """Whether a leg as it is written transmits and meets what it does at the samples."""
        search = self.springs.search
        rows, sample = list(search.space.rows), search.sampled(placed_leg)
        if sample.transmitted != len(leg.wrenches):
            return False
        rod.give_angle([w.parts[0] or w.parts[1] for w in leg.wrenches])
        W = np.stack([rod.at.of(w) for w in leg.wrenches], axis=2)[:, rows]
        W /= search.scale[rows][:, None]
        C = np.zeros((rod.at.count, *2 * (len(leg.wrenches),)))
        given = {s: rod.at.known[s.name] for s in SCALARS if s.name in rod.at.known}
        given |= {s: rod.at.known[name] for name, s in self.placed.symbols.items()}
        for (i, j), value in zip(
            leg.entries, values_of(leg.entries.values(), given, self.read.definitions), strict=True
        ):
            C[:, i, j] = C[:, j, i] = value
        compliance = W.mT @ sample.C @ W
        sizes = np.sqrt(np.einsum("nii->ni", compliance))
        is_same = np.abs(compliance - C) <= SAME * sizes[:, :, None] * sizes[:, None]
        return bool(np.all(is_same) and np.all(np.abs(W.mT @ sample.J) <= SAME * np.max(np.abs(W))))

    def _in_scalars(
        self, leg: PlacedLeg, found: list[_Written], basis: Basis, bars: _OfBars | None
    ) -> LegInVectors:
        """What the wrenches meet and share; the couple that comes with a force is the last."""

        def coupled() -> list[tuple[int, int]]:
            places, pairs = [place for place, _, _ in found], basis.coupled
            both = combinations(range(len(found)), 2)
            return [(i, j) for i, j in both if pairs[places[i], places[j]]]

        if len(coupled()) == 1:
            found.append(found.pop(coupled()[0][1]))
        alone, units = [(k, k) for k in range(len(found))], [unit for _, unit, _ in found]
        without, shared = leg if bars is None else leg.without_blocks, dict[tuple[int, int], Any]()
        for i, j in sorted([*alone, *coupled()]):
            contributions = self.springs.contributions(without, units[i], units[j])
            if bars is not None and i == j:
                contributions = [*contributions, (sp.Integer(1), bars(units[i]))]
            shared[i, j] = self.of_leg(sum_of(contributions))
            if count_of(shared[i, j]) > _LONGEST:
                raise FormulaTooLargeError.beyond(_LONGEST)
        return LegInVectors(tuple(w for *_, w in found), shared)

    def _with_couples(self, leg: PlacedLeg, basis: Basis, rod: Bar) -> Basis:
        """Of forces along parallel lines across a bar, one at an end of it, and couples.

        Couples are along and across the bar. Of two links the force is at the joint between them.
        """
        record, units = self.placed.record, basis.wrenches
        forces = [w for w in units if w.point is not None]
        at = [sampled(w.direction, record.count) for w in forces]
        axes = (axis for spring in leg.springs for axis in np.asarray(spring.rotation).T)
        u = rod.at.of(U)
        is_along = (x for x in axes if are_along(sampled(x, record.count), u))
        along = next(is_along, None)
        if along is None or basis.couplings == 0:
            return basis
        for i, j in combinations(range(len(forces)), 2):
            is_across = np.max(np.abs(np.sum(at[i] * u, axis=1))) < SAME
            if not (is_across and are_along(at[i], at[j])):
                continue
            force, turning = forces[i].direction, cross(forces[i].direction, along)
            across = np.array([record.simplify(x) for x in turning], dtype=object)
            kept = [w for w in units if w not in (forces[i], forces[j])]
            point = leg.end
            if rod.carrier is not Carrier.NOTHING:
                point = [f for f in leg.freedoms if f.is_passive][-2].point
                others = (w for w, d in zip(forces, at, strict=True) if not are_along(d, at[i]))
                kept = [*others, UnitWrench(along, None)]
            chosen = (*kept, UnitWrench(across, None), UnitWrench(force, point))
            found = self.springs.search.of_wrenches(leg, chosen)
            return basis if found is None or found.couplings > basis.couplings else found
        return basis

    def of_leg(self, compliance: Any) -> Any:
        """A compliance without names that stand for scalars of the leg."""
        for d in reversed(self.read.definitions):
            if compliance.has(d.symbol) and d.expression.free_symbols & SCALARS:
                compliance = compliance.xreplace({d.symbol: d.expression})
        return compliance


def shared_name(i: int, j: int) -> str:
    """The name of what two wrenches of a leg share."""
    return f"c_i_{min(i, j) + 1}{max(i, j) + 1}"


def _bars_of(leg: PlacedLeg, rod: Bar, writer: WrenchWriter) -> _OfBars | None:
    """What two bars between pins across them add to the compliance under a wrench.

    None where a leg has others, or where they always cross j squarely.
    """
    if len(leg.blocks) != 1 or rod.width == 0 or not varies(rod.at.of(Norm(Cross(J, U)))):
        return None
    bar = next(leg.blocks[0].branches[0].springs)
    beam, pin = recognised_beam(bar, writer.placed.record), rod.at.of(G)
    across = {"EI_z": bar.rotation[:, 1], "EI_y": bar.rotation[:, 2]}
    bends = [x for x, axis in across.items() if are_along(sampled(axis, rod.at.count), pin)]
    if beam is None or not bends:
        return None
    L, w, s = writer.read.length(beam[0]), rod.width, COSINE
    EA, EI, GJ = (writer.read(beam[1][x]) for x in ("EA", bends[0], "GJ"))

    def added(wrench: UnitWrench) -> Any:
        if wrench.point is not None:
            return L / (2 * EA)
        if are_along(sampled(wrench.direction, rod.at.count), pin):
            return 2 * L / (EA * w**2 * s**2)
        in_series = L * s**2 / (2 * GJ) + L * (1 - s**2) / (2 * EI)
        return 1 / (6 * EI * w**2 / L**3 + 1 / in_series)

    return added


class KnownReading(NamedReading):
    """Reads entries with names for scalars of the leg, recognised at the samples.

    `known`: list of (values at the samples, symbol).
    """

    def __init__(
        self, record: Record, symbols: dict[str, sp.Symbol], springs: Iterable[Definition]
    ) -> None:
        super().__init__(record, symbols, springs)
        self.known: list[tuple[np.ndarray, Any]] = []

    def length(self, value: Any) -> Any:
        """A length, written out: it differs from leg to leg."""
        return self(self.record.simplify(value))

    def _expression(self, value: Any) -> Any:
        return self._of_step(value.step) if isinstance(value, Entry) else super()._expression(value)

    def _of_step(self, step: int) -> Any:
        """A step from its known parts: what lies before these is not read."""
        if step not in self._raw:
            found, at = None, self.record.sample(step)
            for other, symbol in self.known:
                size = SAME * np.max(np.abs(other))
                signs = (s for s in (1, -1) if np.max(np.abs(at - s * other)) <= size)
                if (sign := next(signs, None)) is not None:
                    found = sign * symbol
                    break
            if found is None:
                for argument in self.record.arguments(step):
                    self._of_step(argument)
                found = self._written(step)
            self._raw[step] = found
        return self._raw[step]
