"""The wrenches of a leg among the directions that a person would name, and what each meets.

Directions are along the leg, along the axes of its joints, and square to these. Wrenches that share
no energy have a compliance each; where one force shares energy with one couple, it is moved by the
couple; where more of them do, the leg has a small matrix of compliances.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.definition import Definition, count_of
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.reading.record_reading import ClosedReading
from robostiff.analytic.springs.contributions import Contribution, recognised_beam, summed
from robostiff.analytic.springs.leg_springs import LegReader
from robostiff.analytic.springs.unit_wrenches import Basis, UnitWrench
from robostiff.analytic.vectors.vector_expressions import (
    Cross,
    Stacked,
    Sum,
    Times,
    Turned,
    Vector,
    VectorExpression,
)
from robostiff.analytic.vectors.vector_rods import (
    Bar,
    Carrier,
    are_along,
    carrier_scalars,
    scalars_across,
    varies,
)
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record
from robostiff.recorded.leg import at_samples as sampled
from robostiff.recorded.working_frame import cross

_SAME = 1e-9
_LONGEST = 80  # operations of a compliance that is printed for a generic leg

_P, _A, _B, _U, _E, _J, _G, _N, _M, _V = map(
    Vector, ("p", "a_i", "b_i", "u_i", "e_i", "j_i", "g_i", "n_i", "m_i", "v_i")
)
_R0 = Vector("r_0")
_LENGTH, _S, _T = (sp.Symbol(name, positive=True) for name in ("L_i", "s_i", "t_i"))
_SCALARS = {sp.Symbol(f"{x}_i", real=True) for x in "fhxz"} | {_LENGTH, _S, _T}


@dataclass(frozen=True)
class LegInVectors:
    """A leg as it is written: its wrenches, what each meets, and what pairs of them share."""

    wrenches: tuple[VectorExpression, ...]
    compliances: tuple[Any, ...]
    # Numbers of two wrenches, the first one less, and what they share
    shared: tuple[tuple[int, int, Any], ...] = ()

    @property
    def entries(self) -> dict[tuple[int, int], Any]:
        """What pairs of wrenches meet, by their numbers; none of those that share no energy."""
        found = {(k, k): c for k, c in enumerate(self.compliances)}
        return dict(sorted((found | {(i, j): c for i, j, c in self.shared}).items()))

    @property
    def moved(self) -> tuple[int, Any] | None:
        """The force that only shares energy with the last wrench, a couple, and what they share."""
        if len(self.shared) != 1:
            return None
        i, j, energy = self.shared[0]
        forces = [isinstance(w, Stacked) and w.force is not None for w in self.wrenches]
        return (i, energy) if j == len(forces) - 1 and forces[i] and not forces[j] else None

    @property
    def coupled(self) -> tuple[tuple[str, ...], ...]:
        """Names of what pairs meet, empty for zero; none where at most a force is moved."""
        if not self.shared or self.moved is not None:
            return ()
        known, places = self.entries, range(len(self.wrenches))
        return tuple(
            tuple(shared_name(i, j) * ((min(i, j), max(i, j)) in known) for j in places)
            for i in places
        )


# Its place in the basis, and how it is written
_Written = tuple[int, UnitWrench, Stacked]


@dataclass(frozen=True)
class WrenchWriter:
    """Writes the wrenches of legs in vectors, and what they meet in scalars of these."""

    placed: PlacedRobot
    springs: LegReader
    read: KnownReading
    plain: ClosedReading
    rotation: str | None  # of the platform; None where it is not turned
    shifted: bool  # whether the reference point is not the platform's origin

    def of(self, number: int, basis: Basis, rod: Bar) -> LegInVectors | None:
        """A leg; None where a wrench has another direction, or acts along another line."""
        own, count = self.placed.legs[number].leg, self.placed.record.count
        if rod.carrier is not Carrier.SLIDE:
            basis = self._with_couples(own, basis, rod)
        known, joint = self._directions(rod)
        e = dict(known)[joint]
        self.read.known = carrier_scalars(rod, self.plain(rod.crank))
        if rod.carrier is Carrier.NOTHING and rod.joint is not None:
            L = np.linalg.norm(rod.end - rod.start, axis=1)
            self.read.known += [(L, _LENGTH), (L / 2, _LENGTH / 2)]
        written: list[_Written] = []
        at_samples: dict[VectorExpression, np.ndarray] = {}
        for place, found in enumerate(basis.wrenches):
            at = sampled(found.direction, count)
            alike = next(((v, x) for v, x in known if are_along(x, at)), None)
            if alike is None:
                return None
            vector, named = alike
            # The sign matters where two wrenches share energy.
            sign = 1 if np.max(np.abs(at - named)) < _SAME else -1
            wrench = replace(found, direction=sign * found.direction)
            if wrench.point is None:
                written.append((place, wrench, Stacked(None, vector)))
            else:
                arm = self._arm(sampled(wrench.point, count), named, rod)
                if arm is None:
                    return None
                written.append((place, wrench, Stacked(vector, Cross(arm, vector))))
            at_samples[vector] = named
        written.sort(key=lambda one: (one[1].point is None, one[2].force != _U))
        if rod.carrier in (Carrier.NOTHING, Carrier.SLIDE, Carrier.CRANK):
            # What lies across both is written by the axis of the joint, or by what is square to it.
            across_both = [e] if _G in at_samples else []
            others = [x for v, x in at_samples.items() if v not in (_U, _G)] or across_both
            if any(not are_along(x, others[0]) for x in others):
                return None
            for at in others[:1]:
                u, width = rod.unit, self.plain(rod.width)
                s, t = np.einsum("ni,ni->n", at, u), np.linalg.norm(np.cross(at, u), axis=1)
                if rod.carrier is Carrier.NOTHING and _N in at_samples:
                    t = np.einsum("ni,ni->n", e, u)  # the same but for its sign
                self.read.known += scalars_across(
                    self.read.known, t, sampled(rod.width, count), width
                )
                self.read.known += [(x, name) for x, name in ((s, _S), (t, _T)) if varies(x)]
        bars = None
        if _N in at_samples and own.blocks:
            bars = ParallelBars.of(own, rod, self.springs, self.placed)
        return self._in_scalars(own, written, basis, bars)

    def _in_scalars(
        self, own: PlacedLeg, written: list[_Written], basis: Basis, bars: ParallelBars | None
    ) -> LegInVectors:
        """What the wrenches meet and share; the couple that comes with a force is the last."""
        pairs, places = basis.coupled, [place for place, _, _ in written]
        coupled = [
            (i, j) for i, j in combinations(range(len(written)), 2) if pairs[places[i], places[j]]
        ]
        if len(coupled) == 1:
            written.append(written.pop(coupled[0][1]))
            coupled = [(coupled[0][0], len(written) - 1)]
        units = [unit for _, unit, _ in written]
        met = [self._shared(own, x, x, bars) for x in units]
        shared = tuple((i, j, self._shared(own, units[i], units[j], bars)) for i, j in coupled)
        return LegInVectors(tuple(w for *_, w in written), tuple(met), shared)

    def _directions(self, rod: Bar) -> tuple[list[tuple[VectorExpression, np.ndarray]], Vector]:
        """Names of directions with their values at the samples, and that of the joint's axis."""
        count = self.placed.record.count
        joint, u = joint_of(rod, count), rod.unit
        e = sampled(rod.axis if joint == _E or rod.joint is None else rod.joint, count)
        known: list[tuple[VectorExpression, np.ndarray]] = [(_U, u), (joint, e)]
        if rod.carrier is Carrier.DYAD:
            m, n, v = rod.across, np.cross(rod.across, e), rod.along
            known += [(_M, m), (_N, n), (_V, v), (_G, np.cross(e, u))]
            known.append((Cross(_E, _V), np.cross(e, v)))
            return known, joint
        across = np.cross(e, u)
        size = np.linalg.norm(across, axis=1)
        if np.min(size) > _SAME:
            g = across / size[:, None]
            known += [(_G, g), (_N, np.cross(g, e))]
        if rod.carrier is Carrier.NOTHING and rod.joint is not None:
            R = sampled(self.placed.platform.R, count)
            known.append((_J, np.einsum("nij,nj->ni", R, sampled(rod.joint, count))))
        return known, joint

    def _with_couples(self, own: PlacedLeg, basis: Basis, rod: Bar) -> Basis:
        """Of forces along parallel lines across a bar, one at an end of it, and couples.

        Couples are along and across the bar. Of two links the force is at the joint between them.
        """
        record, units = self.placed.record, basis.wrenches
        forces = [w for w in units if w.point is not None]
        at = [sampled(w.direction, record.count) for w in forces]
        axes = (axis for spring in own.springs for axis in np.asarray(spring.rotation).T)
        is_along = (x for x in axes if are_along(sampled(x, record.count), rod.unit))
        along = next(is_along, None)
        if along is None or basis.couplings == 0:
            return basis
        for i, j in combinations(range(len(forces)), 2):
            is_across = np.max(np.abs(np.sum(at[i] * rod.unit, axis=1))) < _SAME
            if not (is_across and are_along(at[i], at[j])):
                continue
            force, turning = forces[i].direction, cross(forces[i].direction, along)
            across = np.array([record.simplified(x) for x in turning], dtype=object)
            kept = [w for w in units if w not in (forces[i], forces[j])]
            point = own.end
            if rod.carrier is not Carrier.NOTHING:
                point = [f for f in own.freedoms if f.is_passive][-2].point
                others = (w for w, d in zip(forces, at, strict=True) if not are_along(d, at[i]))
                kept = [*others, UnitWrench(along, None)]
            chosen = (*kept, UnitWrench(across, None), UnitWrench(force, point))
            found = self.springs.search.of_wrenches(own, chosen)
            return basis if found is None or found.couplings > basis.couplings else found
        return basis

    def _shared(
        self, own: PlacedLeg, a: UnitWrench, b: UnitWrench, bars: ParallelBars | None
    ) -> Any:
        without = own if bars is None else own.without_blocks
        met = self.springs.contributions.of(without, a, b)
        if bars is not None and a is b:
            met = [*met, *bars.of_wrench(a)]
        shared = self.of_leg(summed(met))
        if count_of(shared) > _LONGEST:
            raise FormulaTooLargeError.beyond(_LONGEST)
        return shared

    def of_leg(self, compliance: Any) -> Any:
        """A compliance without names that stand for scalars of the leg."""
        for d in reversed(self.read.definitions):
            if compliance.has(d.symbol) and d.expression.free_symbols & _SCALARS:
                compliance = compliance.xreplace({d.symbol: d.expression})
        return compliance

    def turned(self, vector: VectorExpression) -> VectorExpression:
        """A vector of the platform in the world."""
        return vector if self.rotation is None else Turned(self.rotation, vector)

    @property
    def end(self) -> VectorExpression:
        """From the reference point to the leg's joint on the platform."""
        return self.turned(Sum(((1, _B), (-1, _R0))) if self.shifted else _B)

    def _arm(self, point: np.ndarray, direction: np.ndarray, rod: Bar) -> VectorExpression | None:
        """From the reference point to the line of a force."""
        close = _SAME * self.placed.length
        places = rod.end, rod.start, (rod.end + rod.start) / 2
        away = [float(np.max(np.abs(np.cross(x - point, direction)))) for x in places]
        if away[0] < close:
            return self.end
        if away[1] < close and rod.carrier is Carrier.NOTHING:
            terms: tuple[tuple[int, VectorExpression], ...] = ((1, _A), (-1, _P))
            return Sum((*terms, (-1, self.turned(_R0))) if self.shifted else terms)
        back = None
        if away[1] < close:
            back = self.plain(rod.length)
        elif away[2] < close and rod.carrier is Carrier.NOTHING:
            back = _LENGTH / 2
        return None if back is None else Sum(((1, self.end), (-1, Times(back, _U))))


def shared_name(i: int, j: int) -> str:
    """The name of what two wrenches of a leg share."""
    return f"c_i_{min(i, j) + 1}{max(i, j) + 1}"


def joint_of(rod: Bar, count: int) -> Vector:
    """The name of the axis of the first joint of a rod: that of its carrier, or its own."""
    if rod.carrier is Carrier.NOTHING or rod.joint is None:
        return _E
    both = (sampled(x, count) for x in (rod.joint, rod.axis))
    return _E if are_along(*both) else _J


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
        each = [sampled(x.elasticity.compliance, count) for x in beams if x is not None]
        apart = [np.abs(C - each[0]) <= _SAME * np.abs(each[0]) for C in each]
        if first is None or {len(beams), len(each)} != {2} or not np.all(apart):
            return None
        found = recognised_beam(first, placed.record)
        axes = [sampled(axis, count) for axis in first.rotation.T]
        letters = ("EI_z", axes[1]), ("EI_y", axes[2])
        bends = next((letter for letter, axis in letters if are_along(axis, pin)), None)
        between = np.linalg.norm(rod.end - rod.start, axis=1)
        if (
            found is None
            or bends is None
            or np.max(np.abs(sampled(found[0], count) - between)) > _SAME * placed.length
        ):
            return None
        products = reader.contributions.products.of(found[1])
        along, width = reader.read.length(found[0]), reader.read(rod.width)
        return cls(reader, along, products, bends, first.name, width, u, pin)

    def of_wrench(self, wrench: UnitWrench) -> tuple[Contribution, ...]:
        """What the bars add to the compliance under a wrench."""
        L, w = self.along, self.width
        if wrench.point is not None:
            met = L / (2 * self._value("EA"))
        elif are_along(sampled(wrench.direction, len(self.unit)), self.pin):
            met = 2 * L / (self._value("EA") * w**2 * _SINE**2)
        else:
            EI, GJ = self._value(self.bends), self._value("GJ")
            in_series = L * _SINE**2 / (2 * GJ) + L * (1 - _SINE**2) / (2 * EI)
            met = 1 / (6 * EI * w**2 / L**3 + 1 / in_series)
        return ((sp.Integer(1), met),)

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
        return self(self.record.simplified(value))

    def _expression(self, value: Any) -> Any:
        return self._of_step(value.step) if isinstance(value, Entry) else super()._expression(value)

    def _of_step(self, step: int) -> Any:
        """A step from its known parts: what lies before these is not read."""
        if step not in self._raw:
            found = self._recognised(step)
            if found is None:
                for argument in self.record.arguments(step):
                    self._of_step(argument)
                found = self._written(step)
            self._raw[step] = found
        return self._raw[step]

    def _recognised(self, step: int) -> Any:
        at = self.record.sample(step)
        for other, symbol in self.known:
            for sign in (1, -1):
                if np.max(np.abs(at - sign * other)) <= _SAME * np.max(np.abs(other)):
                    return sign * symbol
        return None
