"""A robot at vector level: one generic leg, a table of what differs between legs, and the sum.

Legs are struts between a point a_i of the base and a point b_i of the platform. The wrenches that
they transmit are recognised among the directions that a person would name: along the strut, along
the first axis of its joints, and what is square to these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.agreement import check_form
from robostiff.analytic.contributions import summed
from robostiff.analytic.derivation import used_definitions
from robostiff.analytic.known_reading import KnownContributions, KnownReading
from robostiff.analytic.leg_springs import LegReader, NotHeldByUnitWrenchesError
from robostiff.analytic.leg_table import LegTable
from robostiff.analytic.operation_count import count_of
from robostiff.analytic.orbits import average_of
from robostiff.analytic.parallel_rods import cluster_of, rods_of
from robostiff.analytic.products import FormulaTooLargeError
from robostiff.analytic.record_reading import ClosedReading
from robostiff.analytic.robot_placement import PlacedRobot
from robostiff.analytic.unit_wrenches import Basis, UnitWrench, WrenchSearch
from robostiff.analytic.vector_expressions import (
    Coordinates,
    Cross,
    Dot,
    Equation,
    Norm,
    Over,
    Stacked,
    Sum,
    Times,
    Turned,
    Turns,
    Vector,
    VectorExpression,
    VectorForm,
)
from robostiff.analytic.vector_rods import (
    Bar,
    Carrier,
    closure_of,
    equations_of_felt,
    felt_across,
    felt_by_carrier,
    rod_of,
    varies,
)
from robostiff.model import PlacedLeg
from robostiff.recorded.leg import at_samples as sampled

_SAME = 1e-9
_LONGEST = 80  # operations of a compliance that is printed for a generic leg


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
    check_form("the vector form", found.stiffness, placed)
    return replace(found, average=average_of(found, placed))


@dataclass(frozen=True)
class _Leg:
    """A strut as it is written: its wrenches, what each meets, and what the two share."""

    wrenches: tuple[VectorExpression, ...]
    compliances: tuple[Any, ...]
    shared: tuple[int, Any] | None  # number of a force, and what it shares with the last, a couple


_P, _A, _B, _U, _E, _J, _G, _N = map(Vector, ("p", "a_i", "b_i", "u_i", "e_i", "j_i", "g_i", "n_i"))
_R0 = Vector("r_0")
_LENGTH, _S, _T = (sp.Symbol(name, positive=True) for name in ("L_i", "s_i", "t_i"))
_SHIFT = sp.Symbol("o_i", real=True)
_SCALARS = {sp.Symbol(f"{x}_i", real=True) for x in "fhz"} | {_LENGTH, _S, _T}
_NAMES = {
    "p",
    "r_0",
    "sigma_i",
    *(f"{letter}_i" for letter in "abcdefghjlmnoqstuvwxyzL"),
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
        self.close = _SAME * placed.length
        self.plain = ClosedReading(placed.record, placed.symbols)
        self.read = KnownReading(placed.record, placed.symbols, placed.springs)
        space = placed.entries.space
        self.search = WrenchSearch(self.record, placed.reference, space, placed.length)
        self.springs = LegReader(self.search, self.read, KnownContributions)
        self.reader = self.springs.contributions
        self.R = sampled(placed.platform.R, self.count)
        self.p = sampled(placed.platform.p, self.count)
        self.r0 = sampled(placed.entries.reference_point, self.count)
        self.rotation = "Q" if "R" in placed.symbols else "R"
        self.turns = bool(np.max(np.abs(self.R - np.eye(3))) > _SAME)
        self.shifted = bool(np.max(np.abs(self.r0)) > self.close)
        self.table = LegTable({k: float(v) for k, v in placed.robot.nominal.items()})

    def form(self) -> VectorForm | None:
        """The whole form, where all legs are struts, or rods on slides or cranks."""
        placed = self.placed
        if _NAMES & set(placed.symbols) or (pose := self._pose()) is None:
            return None
        found = [self.search.basis(own.leg) for own in placed.legs]
        bases = [basis for basis in found if basis is not None and basis.wrenches]
        rods = [rod for i in range(len(found)) if (rod := rod_of(placed, i)) is not None]
        if len(bases) < len(found) or len(rods) < len(found):
            return None
        each = [self._leg(i, basis, rods[i]) for i, basis in enumerate(bases)]
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

    def _clusters(self, rods: list[Bar]) -> tuple[list[_Leg | None], dict[str, Any]]:
        """Legs of parallel rods, and what the vector form has of the rods."""
        found = []
        for i, rod in enumerate(rods):
            self.read.known = felt_by_carrier(rod, 0)
            found.append(cluster_of(self.placed, i, rod, self.springs))
        clusters = [x for x in found if x is not None]
        listed = rods_of(clusters)
        if len(clusters) < len(rods) or listed is None:
            return [None], {}
        wrench = Stacked(_U, Cross(self._turned(_B), _U))
        legs: list[_Leg | None] = [
            _Leg((wrench,), (self._of_leg(x.compliance),), None) for x in clusters
        ]
        compliance = next(x.of_rod for x in clusters if x.arms)
        couple = Stacked(None, Cross(self._turned(Vector("r_ij")), _U))
        arms = [(i, label, tuple(map(self.plain, arm))) for i, label, arm in listed]
        of_rod = Equation("v_ij", couple), Equation("c_r", compliance, is_vector=False)
        return legs, {"rods": tuple(arms), "of_rod": of_rod}

    def _joined(
        self, pose: tuple[Equation, ...], labels: tuple[str, ...], rods: list[Bar], legs: list[_Leg]
    ) -> VectorForm | None:
        plain, first = self.plain, legs[0]
        carrier = rods[0].carrier

        def of_all(letter: str, angle: str, each: list[Any]) -> Equation:
            read = [tuple(plain(x) for x in v) for v in each]
            return Equation(f"{letter}_i", Coordinates(self.table.vectors(letter, angle, read)))

        a = of_all("a", "phi", [rod.base for rod in rods])
        b = of_all("b", "psi", [rod.tip for rod in rods])
        away = ((1, _P), (1, self._turned(_B)), (-1, _A))
        used = _vectors_of(first.wrenches)
        all_met = [c for leg in legs for c in (*leg.compliances, *(leg.shared or ())[1:])]
        scalars = set().union(*(c.free_symbols for c in all_met))
        equations = [a, b]
        is_rod = carrier is not Carrier.NOTHING
        if is_rod:
            equations.append(of_all("e", "theta", [rod.axis for rod in rods]))
        equations += [Equation("d_i", Sum(away)), *closure_of(rods, self.table, plain)]
        joint = self._joint(rods[0])
        if not is_rod and used & {_E, _G, _N}:
            equations.append(of_all("e", "theta", [rod.axis for rod in rods]))
        if _J in used or (joint == _J and used & {_G, _N}):
            j = of_all("j", "chi", [rod.joint for rod in rods])
            equations.append(j if is_rod else replace(j, expression=self._turned(j.expression)))
        if used & {_G, _N}:
            across = Cross(joint, _U)
            equations.append(Equation("g_i", Over(across, Norm(across))))
        if _N in used:
            equations.append(Equation("n_i", Cross(_G, joint)))
        equations += equations_of_felt(carrier, scalars)
        if _S in scalars:
            equations.append(Equation("s_i", Dot(self._other(used, joint), _U), is_vector=False))
        if _T in scalars:
            across = Norm(Cross(self._other(used, joint), _U))
            t = Dot(_E, _U) if _N in used and not is_rod else across
            equations.append(Equation("t_i", t, is_vector=False))
        named = self._of_wrenches(legs)
        if named is None:
            return None
        equations += named
        several = len(first.wrenches) > 1
        own = [f"_{k}" if several else "" for k in range(1, len(first.wrenches) + 1)]
        names = [(f"w_i{k}", f"c_i{k}") for k in own]
        turned = self.table.turns_of_one_another() or []
        return VectorForm(
            pose=pose,
            names=used_definitions(
                self.read.definitions, [c for leg in legs for c in leg.compliances]
            ),
            leg=tuple(equations),
            wrenches=tuple(names),
            columns={name: tuple(column) for name, column in self.table.columns.items()},
            legs=labels,
            turned=tuple(tuple(labels[i] for i in group) for group in turned if len(group) > 1),
            space=self.placed.entries.space,
        )

    def _of_wrenches(self, legs: list[_Leg]) -> list[Equation] | None:
        """Wrenches and compliances; of two that share energy the force is moved by the couple."""
        found: list[list[Equation]] = []
        first = legs[0]
        last = len(first.wrenches)
        couple = sp.Symbol(f"c_i_{last}", real=True)
        for k, w in enumerate(first.wrenches):
            own = f"_{k + 1}" if len(first.wrenches) > 1 else ""
            name = f"c_i{own}"
            met = self.table.scalar(name, [leg.compliances[k] for leg in legs])
            if first.shared is not None and k == first.shared[0]:
                if name in self.table.columns:
                    return None
                moved = Sum(((1, w), (-1, Times(_SHIFT, Vector(f"w_i_{last}")))))
                met -= _SHIFT**2 * couple
                found.append([Equation(f"w_i{own}", moved)])
            else:
                found.append([Equation(f"w_i{own}", w)])
            if met != sp.Symbol(name, real=True):
                found[-1].append(Equation(name, met, is_vector=False))
        if first.shared is None:
            return [e for pair in found for e in pair]
        if any(leg.shared != first.shared for leg in legs):
            return None
        number, energy = first.shared
        shift = Equation(_SHIFT.name, energy / couple, is_vector=False)
        forces = [e for k, pair in enumerate(found[:-1]) for e in pair if k != number]
        return [*forces, *found[-1], shift, *found[number]]

    def _turned(self, vector: VectorExpression) -> VectorExpression:
        return Turned(self.rotation, vector) if self.turns else vector

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

    def _joint(self, rod: Bar) -> Vector:
        """The name of the axis of the first joint of a rod: that of its carrier, or its own."""
        if rod.carrier is Carrier.NOTHING or rod.joint is None:
            return _E
        both = (sampled(x, self.count) for x in (rod.joint, rod.axis))
        return _E if _are_alike(*both) else _J

    def _leg(self, number: int, basis: Basis, rod: Bar) -> _Leg | None:
        own, a, b, u = self.placed.legs[number].leg, rod.start, rod.end, rod.unit
        joint = self._joint(rod)
        e = sampled(rod.axis if joint == _E or rod.joint is None else rod.joint, self.count)
        across = np.cross(e, u)
        size = np.linalg.norm(across, axis=1)
        known: list[tuple[Vector, np.ndarray]] = [(_U, u), (joint, e)]
        if np.min(size) > _SAME:
            g = across / size[:, None]
            known += [(_G, g), (_N, np.cross(g, e))]
        self.read.known = felt_by_carrier(rod, self.plain(rod.crank))
        if rod.carrier is Carrier.NOTHING and rod.joint is not None:
            known.append((_J, np.einsum("nij,nj->ni", self.R, sampled(rod.joint, self.count))))
            self.read.known.append((np.linalg.norm(b - a, axis=1), _LENGTH))
        directions: list[tuple[Vector, np.ndarray]] = []
        written: list[tuple[UnitWrench, Stacked]] = []
        for found in basis.wrenches:
            at = sampled(found.direction, self.count)
            alike = next(((v, x) for v, x in known if _are_alike(x, at)), None)
            if alike is None:
                return None
            vector, named = alike
            # The sign matters where two wrenches share energy.
            sign = 1 if np.max(np.abs(at - named)) < _SAME else -1
            wrench, at = replace(found, direction=sign * found.direction), named
            if wrench.point is None:
                written.append((wrench, Stacked(None, vector)))
            else:
                arm = self._arm(sampled(wrench.point, self.count), at, rod)
                if arm is None:
                    return None
                written.append((wrench, Stacked(vector, Cross(arm, vector))))
            directions.append((vector, at))
        written.sort(key=lambda one: (one[0].point is None, one[1].force != _U))
        # What lies across both is written by the axis of the joint, or by what is square to it.
        across_both = [e] if any(v == _G for v, _ in directions) else []
        others = [at for v, at in directions if v not in (_U, _G)] or across_both
        if len(others) > 1:
            return None
        for at in others:
            s, t = np.einsum("ni,ni->n", at, u), np.linalg.norm(np.cross(at, u), axis=1)
            if rod.carrier is Carrier.NOTHING and any(v == _N for v, _ in directions):
                t = np.einsum("ni,ni->n", e, u)  # the same but for its sign
            width = sampled(rod.width, self.count)
            name = self.plain(rod.width)
            self.read.known += felt_across(self.read.known, t, width, name)
            self.read.known += [(x, name) for x, name in ((s, _S), (t, _T)) if varies(x)]
        units = [unit for unit, _ in written]
        met = [self._shared(own, x, x) for x in units]
        shared = None
        if basis.couplings:
            if basis.couplings > 1 or sum(x.point is None for x in units) != 1:
                return None
            each = [self._shared(own, unit, units[-1]) for unit in units[:-1]]
            k = max(range(len(each)), key=lambda k: count_of(each[k]))  # all others are zero
            shared = k, each[k]
        return _Leg(tuple(w for _, w in written), tuple(met), shared)

    def _shared(self, own: PlacedLeg, a: UnitWrench, b: UnitWrench) -> Any:
        shared = self._of_leg(summed(self.reader.of(own, a, b)))
        if count_of(shared) > _LONGEST:
            raise FormulaTooLargeError.beyond(_LONGEST)
        return shared

    def _of_leg(self, compliance: Any) -> Any:
        """A compliance without names that stand for scalars of the leg."""
        for d in reversed(self.read.definitions):
            if compliance.has(d.symbol) and d.expression.free_symbols & _SCALARS:
                compliance = compliance.xreplace({d.symbol: d.expression})
        return compliance

    def _arm(self, point: np.ndarray, direction: np.ndarray, rod: Bar) -> VectorExpression | None:
        """From the reference point to the line of a force."""
        both = rod.end, rod.start
        away = [float(np.max(np.abs(np.cross(x - point, direction)))) for x in both]
        if away[0] < self.close:
            arm = Sum(((1, _B), (-1, _R0))) if self.shifted else _B
            return self._turned(arm)
        if away[1] < self.close and rod.carrier is Carrier.NOTHING:
            terms: tuple[tuple[int, VectorExpression], ...] = ((1, _A), (-1, _P))
            return Sum((*terms, (-1, self._turned(_R0))) if self.shifted else terms)
        return None


def _are_alike(own: np.ndarray, other: np.ndarray) -> bool:
    """Whether directions are the same up to one sign."""
    return any(bool(np.max(np.abs(own - sign * other)) < _SAME) for sign in (1, -1))


def _vectors_of(expressions: Sequence[Any]) -> set[Vector]:
    """Names of vectors in expressions."""
    found: set[Vector] = set()
    for expression in expressions:
        if isinstance(expression, Vector):
            found.add(expression)
        elif isinstance(expression, Stacked):
            found |= _vectors_of([x for x in (expression.force, expression.moment) if x])
        elif isinstance(expression, Cross):
            found |= _vectors_of([expression.left, expression.right])
    return found
