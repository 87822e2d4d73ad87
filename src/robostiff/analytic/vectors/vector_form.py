"""A robot at vector level: one generic leg, a table of what differs between legs, and the sum.

Legs are struts between a point a_i of the base and a point b_i of the platform. The wrenches that
they transmit are recognised among the directions that a person would name: along the strut, along
the first axis of its joints, and what is square to these.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.definition import used_definitions
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.placement.agreement import COMPONENTS, averages, orbits_of
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.reading.record_reading import ClosedReading
from robostiff.analytic.springs.leg_springs import LegReader, NoUnitWrenchesError, sum_of
from robostiff.analytic.springs.unit_wrenches import UnitWrench, WrenchSearch
from robostiff.analytic.vectors.forms import LegTable, VectorForm
from robostiff.analytic.vectors.vector_expressions import (
    Coordinates,
    Cross,
    Dot,
    Equation,
    Norm,
    Over,
    Stacked,
    Sum,
    Times,
    Turns,
    Vector,
    names_in,
)
from robostiff.analytic.vectors.vector_rods import (
    SAME,
    B,
    Bar,
    Carrier,
    D,
    E,
    J,
    N,
    Platform,
    U,
    across_of,
    angle_of,
    are_along,
    closure_of,
    ends_of,
    in_the_platform,
    rod_of,
)
from robostiff.analytic.vectors.vector_wrenches import (
    KnownReading,
    LegInVectors,
    WrenchWriter,
    shared_name,
)
from robostiff.recorded.leg import at_samples as sampled
from robostiff.spatial import Space


def vector_form(placed: PlacedRobot) -> VectorForm | None:
    """The vector form of a placed robot; None where its legs are no struts of one kind."""
    if placed.robot.is_posed_by_joints or placed.follows.at_joints:
        return None
    try:
        found = _Recognition(placed).form()
    except (FormulaTooLargeError, NoUnitWrenchesError):
        return None
    return found and replace(found, average=_average_of(found, placed))


def _average_of(found: VectorForm, placed: PlacedRobot) -> sp.ImmutableMatrix | None:
    """K by the wrench of the first leg, of which all others are turns or mirror images."""
    is_one = len(found.wrenches) == 1 and not (found.others or found.rods)
    if not is_one or placed.coordinates or found.space is not Space.SPATIAL:
        return None
    steps = found.components()
    legs = [leg for (leg,) in found.in_each_leg(steps)]
    at: dict[Any, Any] = {s: placed.record.input(name).sample for name, s in placed.symbols.items()}
    each = [[*w, c] for w, c, _ in legs]
    numbers = values_of([x for leg in each for x in leg], at, steps.definitions)
    numbers = np.array(np.broadcast_arrays(*numbers)).reshape(len(legs), 7, -1)
    c = numbers[:, 6]
    if np.max(np.abs(c - c[:1]) / c) > SAME:
        return None
    scale = np.array([1.0] * 3 + [placed.length] * 3)
    W = numbers[:, :6].transpose(2, 0, 1) / scale
    orbits = orbits_of(W)
    if orbits is None or len(orbits) > 1:
        return None
    is_nothing = np.max(np.abs(W[:, 0]), axis=0) < SAME
    symbols: Any = sp.symbols(COMPONENTS, real=True)
    entries = [sp.Integer(0) if x else name for x, name in zip(is_nothing, symbols, strict=True)]
    products = averages({0: entries}, orbits)
    c_of_all = sp.Symbol("c_1", real=True)

    def entry(i: int, j: int) -> Any:
        terms = products[min(i, j), max(i, j)]
        return sp.factor_terms(sp.Add(*(n * a * b for n, a, b in terms)) / c_of_all)

    return sp.ImmutableMatrix(6, 6, entry)


_SHIFT, _DRIVE = sp.Symbol("o_i", real=True), "k_i"
_NAMES = {
    "p",
    "r_0",
    "sigma_i",
    *(f"{letter}_i" for letter in "abcdefghjklmnoqstuvwxyzCLW"),
    "c_r",
    "r_ij",
    "v_ij",
}


class _Recognition:
    """Finds the vectors of a robot's legs, the same for all of them."""

    def __init__(self, placed: PlacedRobot) -> None:
        self.placed = placed
        self.plain = ClosedReading(placed.record, placed.symbols)
        self.read = KnownReading(placed.record, placed.symbols, placed.springs)
        self.springs = LegReader(WrenchSearch.of(placed), self.read)
        name, point = "Q" if "R" in placed.symbols else "R", placed.entries.reference_point
        each = {"p": placed.platform.p, name: placed.platform.R, "r_0": point}
        at = {name_of: sampled(x, placed.record.count) for name_of, x in each.items()}
        is_turned = np.max(np.abs(at[name] - np.eye(3))) > SAME
        is_shifted = bool(np.max(np.abs(at["r_0"])) > SAME * placed.length)
        self.platform = Platform(name if is_turned else None, is_shifted, at)
        self.writer = WrenchWriter(placed, self.springs, self.read, self.platform)

    def form(self) -> VectorForm | None:
        """The whole form, where all legs are struts, or rods on slides or cranks."""
        placed = self.placed
        if _NAMES & set(placed.symbols) or (pose := self._pose()) is None:
            return None
        count = len(placed.legs)
        found = (rod_of(placed, i, self.platform, self.plain) for i in range(count))
        rods = [rod for rod in found if rod is not None]
        # Wrenches of links are shorter by their entries where the pose is given.
        is_dyad = any(rod.carrier is Carrier.DYAD for rod in rods)
        if len(rods) < count or (placed.given is None and is_dyad):
            return None
        each, parallel = list[LegInVectors | None](), {}
        for i, rod in enumerate(rods):
            before = [(other, leg) for other, leg in zip(rods, each, strict=False) if leg]
            each.append(self.writer.of(i, rod, before))
        if None in each:
            each, parallel = self._parallel(rods)
        kinds: dict[Any, list[int]] = {}
        for i, leg in enumerate(each):
            kinds.setdefault(leg and (rods[i].carrier, leg.wrenches), []).append(i)
        if None in kinds or 1 < len(kinds) == len(each):
            return None
        forms = []
        for numbers in sorted(kinds.values(), key=len, reverse=True):
            labels = tuple(placed.legs[i].leg.name for i in numbers)
            legs = [leg for i in numbers if (leg := each[i])]
            forms.append(self._join(pose, labels, [rods[i] for i in numbers], legs))
        if None in forms:
            return None
        return replace(forms[0], others=tuple(forms[1:]), **parallel)

    def _parallel(self, rods: list[Bar]) -> tuple[list[LegInVectors | None], dict[str, Any]]:
        """Legs of parallel rods on slides, and what the vector form has of the rods.

        The rods of a leg act as one at their middle, and each turns this by a couple.
        """
        legs: list[LegInVectors | None] = []
        arms: list[tuple[int, str, tuple[Any, ...]]] = []
        of_rods, contributions = set[Any](), self.springs.contributions
        wrench = Stacked(U, Cross(self.platform.turned(B), U))
        for number, rod in enumerate(rods):
            leg, middle = self.placed.legs[number].leg, ends_of(self.placed.legs[number].leg)
            branches = leg.blocks[0].branches if leg.blocks else (leg,)
            bases = [self.springs.search.basis(branch) for branch in branches]
            forces = [x for basis in bases for x in (basis.wrenches if basis else ())]
            each = [w for w in forces if w.point is not None]
            is_along = [are_along(sampled(w.direction, rod.at.count), rod.at.of(U)) for w in each]
            if rod.carrier is not Carrier.SLIDE or middle is None or not all(is_along):
                return [None], {}
            if not len(forces) == len(each) == len(branches):
                return [None], {}
            self.read.known = rod.named(rod.scalars())
            mean = UnitWrench(each[0].direction, middle[1])
            compliance = sum_of(contributions(leg.without_blocks, mean, mean))
            if len(branches) > 1:
                pairs = zip(branches, each, strict=True)
                (of_rod, *_) = own_rods = [sum_of(contributions(b, f, f)) for b, f in pairs]
                of_rods |= {*own_rods}
                # Each rod takes the same share of a force through their middle.
                compliance += of_rod / len(branches)
                for branch in branches:
                    label = f"{leg.name}, {branch.name.split('/')[-1]}"
                    end = ends_of(branch)
                    away = in_the_platform(self.placed, (end or middle)[1] - middle[1])
                    arms.append((number, label, tuple(map(self.plain, away))))
            legs.append(LegInVectors((wrench,), {(0, 0): self.writer.of_leg(compliance)}))
        if len(of_rods) != 1:
            return [None], {}
        couple = Stacked(0, Cross(self.platform.turned(Vector("r_ij")), U))
        of_rod = Equation("v_ij", couple), Equation("c_r", of_rods.pop())
        return legs, {"rods": tuple(arms), "of_rod": of_rod}

    def _join(
        self,
        pose: tuple[Equation, ...],
        labels: tuple[str, ...],
        rods: list[Bar],
        legs: list[LegInVectors],
    ) -> VectorForm | None:
        """Legs of one kind: their equations, and a table of what differs between them."""
        table = LegTable({k: float(v) for k, v in self.placed.robot.nominal.items()})
        geometry, of_wrenches = self._geometry(rods, legs[0], table), self._of_wrenches(legs, table)
        if of_wrenches is None:
            return None
        count, coupled = len(legs[0].wrenches), legs[0].coupled
        numbers = [f"_{k}" if count > 1 else "" for k in range(1, count + 1)]
        names = [(f"w_i{k}", f"c_i{k}") for k in numbers]
        if coupled:
            names = [(w, shared_name(k, k)) for k, (w, _) in enumerate(names)]
        used = names_in(tuple(of_wrenches)) | {c for _, c in names}
        used |= set().union(*(names_in(tuple(table.columns.get(c, ()))) for _, c in names))
        kept = []
        for e in reversed(geometry):
            if e.name in used:
                used |= names_in(e.expression)
                kept.append(e)
        table.keep(used)
        alike = table.turns_of_one_another() or []
        return VectorForm(
            pose=pose,
            names=used_definitions(
                self.read.definitions, [c for leg in legs for c in leg.entries.values()]
            ),
            leg=(*reversed(kept), *of_wrenches),
            wrenches=tuple(names),
            columns={name: tuple(column) for name, column in table.columns.items()},
            legs=labels,
            turned=tuple(tuple(labels[i] for i in group) for group in alike if len(group) > 1),
            space=self.placed.entries.space,
            coupled=coupled,
        )

    def _geometry(self, rods: list[Bar], leg: LegInVectors, table: LegTable) -> list[Equation]:
        """Points, directions and scalars of a leg, also such as are not needed."""
        bar = rods[0]
        is_strut = bar.carrier is Carrier.NOTHING

        def of_all(letter: str, angle: str, rotation: Any = None) -> list[Equation]:
            each: list[Any] = [rod.vectors.get(letter) for rod in rods]
            if any(x is None for x in each):
                return []
            vectors = [tuple(map(self.plain, v)) for v in each]
            return table.equations(letter, angle, vectors, rotation)

        def is_everywhere(x: Any, value: int) -> bool:
            return all(np.max(np.abs(rod.at.of(x) - value)) < SAME for rod in rods)

        found = [*of_all("a", "phi"), *of_all("b", "psi")]
        found += [] if is_strut else of_all("e", "theta")
        side = table.scalar("sigma_i", [sp.Integer(rod.side) for rod in rods])
        length, crank = (
            table.scalar(name, [getattr(rod, x) for rod in rods])
            for name, x in (("l_i", "length"), ("crank_i", "crank"))
        )
        in_plane = is_everywhere(Dot(E, Over(D, Norm(D))), 0)
        found += closure_of(bar, self.platform, length, crank, side, in_plane=in_plane)
        used = names_in(leg.wrenches)
        if is_strut and used & {"e_i", "g_i", "n_i"}:
            found += of_all("e", "theta")
        if bar.first == J or "j_i" in used:
            found += of_all("j", "chi", self.platform.rotation if is_strut else None)
        found += across_of(bar, is_unit=is_everywhere(Norm(Cross(bar.first, U)), 1))
        other = N if "n_i" in used else bar.first
        return [*found, *angle_of(bar, other)]

    def _of_wrenches(self, legs: list[LegInVectors], table: LegTable) -> list[Equation] | None:
        """Wrenches and what they meet; a force that shares energy with a couple is moved by it."""
        first, last, moved = legs[0], len(legs[0].wrenches), legs[0].moved
        shared = {place: c for place, c in first.entries.items() if len({*place}) == 2}
        if any(leg.entries.keys() != first.entries.keys() for leg in legs):
            return None
        compared = first.entries if first.coupled else shared
        if any(leg.entries[x] != c for leg in legs for x, c in compared.items()):
            return None
        names = [f"w_i_{k}" if last > 1 else "w_i" for k in range(1, last + 1)]
        found = [[Equation(x, w)] for x, w in zip(names, first.wrenches, strict=True)]
        if first.coupled:
            each = [Equation(shared_name(i, j), c) for (i, j), c in first.entries.items()]
            return [*(e for equations in found for e in equations), *each]
        couple = sp.Symbol(f"c_i_{last}", real=True)
        for k, equations in enumerate(found):
            name = f"c{names[k][1:]}"
            compliance = _compliance_of_legs(table, name, [leg.entries[k, k] for leg in legs])
            if k == moved:
                if name in table.columns:
                    return None
                by = Times(_SHIFT, Vector(names[-1]))
                equations[0] = Equation(names[k], Sum((1, first.wrenches[k]), (-1, by)))
                compliance -= _SHIFT**2 * couple
            if compliance != sp.Symbol(name, real=True):
                equations.append(Equation(name, compliance))
        if moved is not None:
            shift = Equation(_SHIFT.name, shared[moved, last - 1] / couple)
            found += [[shift], found.pop(moved)]
        return [e for equations in found for e in equations]

    def _pose(self) -> tuple[Equation, ...] | None:
        """Point and rotation of the platform; None where the rotation is not written by turns."""
        placed, rotation = self.placed, self.platform.rotation
        turns = placed.rotation.factors(placed.given or {})
        if rotation and not turns:
            return None
        points = {"p": placed.platform.p, "r_0": placed.entries.reference_point}
        p, r0 = (Equation(name, Coordinates(*map(self.plain, x))) for name, x in points.items())
        turned = [Equation(rotation, Turns(*turns))] if rotation else []
        return (p, *turned, *([r0] if self.platform.is_shifted else []))


def _compliance_of_legs(table: LegTable, name: str, each: list[Any]) -> Any:
    """What wrenches of all legs meet; drives of different stiffness are a column k_i."""
    terms = [sp.Add.make_args(x) for x in each]
    common = [x for x in terms[0] if all(x in of_term for of_term in terms)]
    rests = [sp.Add(*(x for x in of_term if x not in common)) for of_term in terms]
    stiffnesses: list[Any] = [1 / x for x in rests if x != 0]
    # One spring a leg, whose stiffness is a number or has a name that is not of a leg.
    are_plain = all(x.is_number or (x.is_Symbol and x.name[-2:] != "_i") for x in stiffnesses)
    is_column = common and are_plain and len(stiffnesses) == len(each) and len({*rests}) > 1
    if not is_column or table.columns.get(_DRIVE, stiffnesses) != stiffnesses:
        return table.scalar(name, each)
    return sp.Add(*common, 1 / table.scalar(_DRIVE, stiffnesses))
