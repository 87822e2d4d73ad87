"""A robot at vector level: one generic leg, a table of what differs between legs, and the sum.

Legs are struts between a point a_i of the base and a point b_i of the platform. The wrenches that
they transmit are recognised among the directions that a person would name: along the strut, along
the first axis of its joints, and what is square to these.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.definition import used_definitions
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.placement.agreement import RobotInNumbers
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.placement.turned_legs import COMPONENTS, averages, orbits_of
from robostiff.analytic.reading.record_reading import ClosedReading
from robostiff.analytic.springs.leg_springs import LegReader, NotHeldByUnitWrenchesError
from robostiff.analytic.springs.unit_wrenches import WrenchSearch
from robostiff.analytic.vectors.forms import VectorForm
from robostiff.analytic.vectors.leg_table import LegTable
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
    Bar,
    Carrier,
    carrier_scalars,
    closure_of,
    cluster_of,
    rod_of,
    rods_of,
    scalars_of,
)
from robostiff.analytic.vectors.vector_wrenches import (
    KnownReading,
    LegInVectors,
    WrenchWriter,
    joint_of,
    shared_name,
)
from robostiff.recorded.leg import at_samples as sampled
from robostiff.spatial import Space

_SAME = 1e-9


def vector_form(placed: PlacedRobot) -> VectorForm | None:
    """The vector form of a placed robot; None where its legs are no struts of one kind.

    Raises
    ------
    DisagreementError
        When it differs from the numerical form at random parameters and poses.
    """
    if placed.robot.is_posed_by_joints or placed.follows.at_joints:
        return None
    try:
        found = _Recognition(placed).form()
    except (FormulaTooLargeError, NotHeldByUnitWrenchesError):
        return None
    if found is None:
        return None
    RobotInNumbers.of(placed).check(found.K, found.definitions)
    return replace(found, average=_average_of(found, placed))


def _average_of(found: VectorForm, placed: PlacedRobot) -> sp.ImmutableMatrix | None:
    """K by the wrench of the first leg, of which all others are turns or mirror images."""
    is_one = len(found.wrenches) == 1 and not (found.others or found.rods)
    if not is_one or placed.coordinates or found.space is not Space.SPATIAL:
        return None
    own = found.components()
    legs = [leg for (leg,) in found.in_each_leg(own)]
    at: dict[Any, Any] = {s: placed.record.input(name).sample for name, s in placed.symbols.items()}
    each = [[*w, c] for w, c, _ in legs]
    numbers = values_of([x for leg in each for x in leg], at, own.definitions)
    numbers = np.array(np.broadcast_arrays(*numbers)).reshape(len(legs), 7, -1)
    c = numbers[:, 6]
    if np.max(np.abs(c - c[:1]) / c) > _SAME:
        return None
    scale = np.array([1.0] * 3 + [placed.length] * 3)
    W = numbers[:, :6].transpose(2, 0, 1) / scale
    orbits = orbits_of(W)
    if orbits is None or len(orbits) > 1:
        return None
    is_nothing = np.max(np.abs(W[:, 0]), axis=0) < _SAME
    symbols: Any = sp.symbols(COMPONENTS, real=True)
    own = [sp.Integer(0) if x else name for x, name in zip(is_nothing, symbols, strict=True)]
    products = averages({0: own}, orbits)
    c_of_all = sp.Symbol("c_1", real=True)

    def entry(i: int, j: int) -> Any:
        terms = products[min(i, j), max(i, j)]
        return sp.factor_terms(sp.Add(*(n * a * b for n, a, b in terms)) / c_of_all)

    return sp.ImmutableMatrix(6, 6, entry)


_P, _A, _B, _U, _E, _J, _G, _N = map(Vector, ("p", "a_i", "b_i", "u_i", "e_i", "j_i", "g_i", "n_i"))
_S, _T = (sp.Symbol(name, positive=True) for name in ("s_i", "t_i"))
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
        self.record = placed.record
        self.count = placed.record.count
        self.plain = ClosedReading(placed.record, placed.symbols)
        self.read = KnownReading(placed.record, placed.symbols, placed.springs)
        space = placed.entries.space
        self.search = WrenchSearch(self.record, placed.reference, space, placed.length)
        self.springs = LegReader(self.search, self.read)
        R = sampled(placed.platform.R, self.count)
        r0 = sampled(placed.entries.reference_point, self.count)
        self.rotation = "Q" if "R" in placed.symbols else "R"
        self.turns = bool(np.max(np.abs(R - np.eye(3))) > _SAME)
        self.shifted = bool(np.max(np.abs(r0)) > _SAME * placed.length)
        rotation = self.rotation if self.turns else None
        self.writer = WrenchWriter(
            placed, self.springs, self.read, self.plain, rotation, self.shifted
        )
        self.table = LegTable({k: float(v) for k, v in placed.robot.nominal.items()})

    def form(self) -> VectorForm | None:
        """The whole form, where all legs are struts, or rods on slides or cranks."""
        placed = self.placed
        if _NAMES & set(placed.symbols) or (pose := self._pose()) is None:
            return None
        count = len(placed.legs)
        found = (rod_of(placed, i) for i in range(count))
        rods = [rod for rod in found if rod is not None]
        # Wrenches of links are shorter by their entries where the pose is given.
        is_dyad = any(rod.carrier is Carrier.DYAD for rod in rods)
        if len(rods) < count or (placed.given is None and is_dyad):
            return None
        each = [self._leg(i, rod) for i, rod in enumerate(rods)]
        parallel: dict[str, Any] = {}
        if None in each:
            each, parallel = self._clusters(rods)
        kinds: dict[Any, list[int]] = {}
        for i, own in enumerate(each):
            kinds.setdefault(own and (rods[i].carrier, own.wrenches), []).append(i)
        if None in kinds or 1 < len(kinds) == len(each):
            return None
        forms = []
        for numbers in sorted(kinds.values(), key=len, reverse=True):
            self.table = LegTable(self.table.nominal)
            labels = tuple(placed.legs[i].leg.name for i in numbers)
            legs = [leg for i in numbers if (leg := each[i])]
            forms.append(self._joined(pose, labels, [rods[i] for i in numbers], legs))
        if None in forms:
            return None
        return replace(forms[0], others=tuple(forms[1:]), **parallel)

    def _leg(self, number: int, rod: Bar) -> LegInVectors | None:
        basis = self.search.basis(self.placed.legs[number].leg)
        return self.writer.of(number, basis, rod) if basis and basis.wrenches else None

    def _clusters(self, rods: list[Bar]) -> tuple[list[LegInVectors | None], dict[str, Any]]:
        """Legs of parallel rods, and what the vector form has of the rods."""
        found = []
        for i, rod in enumerate(rods):
            self.read.known = carrier_scalars(rod, 0)
            found.append(cluster_of(self.placed, i, rod, self.springs))
        clusters = [x for x in found if x is not None]
        listed = rods_of(clusters)
        if len(clusters) < len(rods) or listed is None:
            return [None], {}
        wrench = Stacked(_U, Cross(self.writer.turned(_B), _U))
        legs: list[LegInVectors | None] = [
            LegInVectors((wrench,), (self.writer.of_leg(x.compliance),)) for x in clusters
        ]
        compliance = next(x.of_rod for x in clusters if x.arms)
        couple = Stacked(None, Cross(self.writer.turned(Vector("r_ij")), _U))
        arms = [(i, label, tuple(map(self.plain, arm))) for i, label, arm in listed]
        of_rod = Equation("v_ij", couple), Equation("c_r", compliance, is_vector=False)
        return legs, {"rods": tuple(arms), "of_rod": of_rod}

    def _joined(
        self,
        pose: tuple[Equation, ...],
        labels: tuple[str, ...],
        rods: list[Bar],
        legs: list[LegInVectors],
    ) -> VectorForm | None:
        first = legs[0]
        equations = self._geometry(rods, legs)
        named = self._of_wrenches(legs)
        if named is None:
            return None
        equations += named
        count = len(first.wrenches)
        own = [f"_{k}" if count > 1 else "" for k in range(1, count + 1)]
        names = [(f"w_i{k}", f"c_i{k}") for k in own]
        coupled = first.coupled
        if coupled:
            names = [(w, shared_name(k, k)) for k, (w, _) in enumerate(names)]
        alike = self.table.turns_of_one_another() or []
        return VectorForm(
            pose=pose,
            names=used_definitions(
                self.read.definitions, [c for leg in legs for c in leg.entries.values()]
            ),
            leg=tuple(equations),
            wrenches=tuple(names),
            columns={name: tuple(column) for name, column in self.table.columns.items()},
            legs=labels,
            turned=tuple(tuple(labels[i] for i in group) for group in alike if len(group) > 1),
            space=self.placed.entries.space,
            coupled=coupled,
        )

    def _geometry(self, rods: list[Bar], legs: list[LegInVectors]) -> list[Equation]:
        """Points, directions and scalars of a leg."""
        used = {Vector(x) for x in names_in(legs[0].wrenches)}
        carrier, joint = rods[0].carrier, joint_of(rods[0], self.count)
        all_met = [c for leg in legs for c in leg.entries.values()]
        scalars = set().union(*(c.free_symbols for c in all_met))

        def of_all(letter: str, angle: str, own: list[Any], rotation: Any = None) -> list[Equation]:
            return self.table.equations(
                letter, angle, [tuple(map(self.plain, v)) for v in own], rotation
            )

        e = partial(of_all, "e", "theta", [rod.axis for rod in rods])
        away = ((1, _P), (1, self.writer.turned(_B)), (-1, _A))
        equations = of_all("a", "phi", [rod.base for rod in rods])
        equations += of_all("b", "psi", [rod.tip for rod in rods])
        is_rod = carrier is not Carrier.NOTHING
        if is_rod:
            equations += e()
        equations += [Equation("d_i", Sum(away)), *closure_of(rods, self.table, self.plain)]
        if not is_rod and used & {_E, _G, _N}:
            equations += e()
        if _J in used or (joint == _J and used & {_G, _N}):
            rotation = None if is_rod else self.writer.rotation
            equations += of_all("j", "chi", [rod.joint for rod in rods], rotation)
        equations += self._across(used, joint, rods)
        equations += [
            Equation(name.name, written, is_vector=False)
            for name, written, _ in scalars_of(rods[0])
            if name in scalars
        ]
        if _S in scalars:
            equations.append(Equation("s_i", Dot(self._other(used, joint), _U), is_vector=False))
        if _T in scalars:
            across = Norm(Cross(self._other(used, joint), _U))
            t = Dot(_E, _U) if _N in used and not is_rod else across
            equations.append(Equation("t_i", t, is_vector=False))
        return equations

    def _across(self, used: set[Vector], joint: Vector, rods: list[Bar]) -> list[Equation]:
        """The directions across the leg that are used."""
        across, is_dyad = Cross(joint, _U), rods[0].carrier is Carrier.DYAD
        found = []
        if _G in used or (_N in used and not is_dyad):
            is_unit = all(rod.joint is not None and rod.is_square for rod in rods)
            found.append(Equation("g_i", across if is_unit else Over(across, Norm(across))))
        if _N in used and not is_dyad:
            found.append(Equation("n_i", Cross(_G, joint)))
        return found

    def _of_wrenches(self, legs: list[LegInVectors]) -> list[Equation] | None:
        """Wrenches and what they meet; a force that shares energy with a couple is moved by it."""
        first = legs[0]
        if any(leg.coupled != first.coupled for leg in legs):
            return None
        if first.coupled:
            return self._of_coupled(legs)
        found: list[list[Equation]] = []
        last = len(first.wrenches)
        couple = sp.Symbol(f"c_i_{last}", real=True)
        for k, w in enumerate(first.wrenches):
            own = f"_{k + 1}" if last > 1 else ""
            name = f"c_i{own}"
            met = self._scalar(name, [leg.compliances[k] for leg in legs])
            if first.moved is not None and k == first.moved[0]:
                if name in self.table.columns:
                    return None
                moved = Sum(((1, w), (-1, Times(_SHIFT, Vector(f"w_i_{last}")))))
                met -= _SHIFT**2 * couple
                found.append([Equation(f"w_i{own}", moved)])
            else:
                found.append([Equation(f"w_i{own}", w)])
            if met != sp.Symbol(name, real=True):
                found[-1].append(Equation(name, met, is_vector=False))
        if first.moved is None:
            return [e for pair in found for e in pair]
        if any(leg.moved != first.moved for leg in legs):
            return None
        number, energy = first.moved
        shift = Equation(_SHIFT.name, energy / couple, is_vector=False)
        forces = [e for k, pair in enumerate(found[:-1]) for e in pair if k != number]
        return [*forces, *found[-1], shift, *found[number]]

    def _of_coupled(self, legs: list[LegInVectors]) -> list[Equation] | None:
        """Wrenches, and the compliances that pairs of them share."""
        found = [Equation(f"w_i_{k}", w) for k, w in enumerate(legs[0].wrenches, start=1)]
        each = [leg.entries for leg in legs]
        for (i, j), met in each[0].items():
            if any(own[i, j] != met for own in each):
                return None
            found.append(Equation(shared_name(i, j), met, is_vector=False))
        return found

    def _scalar(self, name: str, each: list[Any]) -> Any:
        """What wrenches of all legs meet; drives of different stiffness are a column k_i."""
        terms = [sp.Add.make_args(x) for x in each]
        common = [x for x in terms[0] if all(x in own for own in terms)]
        rests = [sp.Add(*(x for x in own if x not in common)) for own in terms]
        stiffnesses: list[Any] = [1 / x for x in rests if x != 0]
        # One spring a leg, whose stiffness is a number or has a name that is not of a leg.
        are_plain = all(x.is_number or (x.is_Symbol and x.name[-2:] != "_i") for x in stiffnesses)
        is_column = common and are_plain and len(stiffnesses) == len(each) and len({*rests}) > 1
        if not is_column or self.table.columns.get(_DRIVE, stiffnesses) != stiffnesses:
            return self.table.scalar(name, each)
        return sp.Add(*common, 1 / self.table.scalar(_DRIVE, stiffnesses))

    def _other(self, used: set[Vector], joint: Vector) -> Vector:
        """The direction beside the strut's own, or what that is square to."""
        return _N if _N in used else joint

    def _pose(self) -> tuple[Equation, ...] | None:
        """Point and rotation of the platform; None where the rotation is not written by turns."""
        placed = self.placed
        p = Coordinates(tuple(self.plain(x) for x in placed.platform.p))
        found = [Equation("p", p)]
        turns = placed.rotation.factors(placed.given or {})
        if self.turns:
            if not turns:
                return None
            found.append(Equation(self.rotation, Turns(turns)))
        if self.shifted:
            r0 = Coordinates(tuple(self.plain(x) for x in placed.entries.reference_point))
            found.append(Equation("r_0", r0))
        return tuple(found)
