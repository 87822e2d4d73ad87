"""A robot at vector level: one generic leg, a table of what differs between legs, and the sum.

Legs are struts between a point a_i of the base and a point b_i of the platform. The wrenches that
they transmit are recognised among the directions that a person would name: along the strut, along
the first axis of its joints, and what is square to these.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.agreement import AGREED, closed_places, matrix_distance
from robostiff.analytic.contributions import BeamProducts, BlockOfSprings, summed
from robostiff.analytic.derivation import Definition
from robostiff.analytic.known_reading import KnownContributions, KnownReading
from robostiff.analytic.leg_springs import NotHeldByUnitWrenchesError
from robostiff.analytic.leg_table import LegTable
from robostiff.analytic.numeric_value import values_of
from robostiff.analytic.products import FormulaTooLargeError
from robostiff.analytic.record_reading import ClosedReading
from robostiff.analytic.robot_placement import PlacedRobot
from robostiff.analytic.sampled_leg import sampled
from robostiff.analytic.unit_wrenches import Basis, UnitWrench, WrenchSearch
from robostiff.analytic.vector_expressions import (
    Coordinates,
    Cross,
    Dot,
    Norm,
    Over,
    Stacked,
    Sum,
    Turned,
    Turns,
    Vector,
    VectorExpression,
    vector_value,
)
from robostiff.errors import DisagreementError
from robostiff.model import PlacedBlock
from robostiff.spatial import Space

_SAME = 1e-9


@dataclass(frozen=True)
class Equation:
    """``name = expression``; the name is that of a vector, a rotation or a scalar.

    Attributes
    ----------
    name : str
    expression : VectorExpression
    is_vector : bool
    """

    name: str
    expression: VectorExpression
    is_vector: bool = True


@dataclass(frozen=True)
class VectorForm:
    """A robot's stiffness at vector level.

    Attributes
    ----------
    pose : tuple of Equation
        Point and rotation of the platform.
    names : tuple of Definition
        Products of beams and the like, the same for all legs.
    leg : tuple of Equation
        Of one generic leg i, in the order in which they can be computed.
    wrenches : tuple of (str, str)
        Names of its wrenches and of their compliances.
    columns : dict of names to tuples of SymPy expressions
        What differs between the legs, one row a leg.
    legs : tuple of str
        Their names.
    turned : tuple of tuples of str
        Legs that are turns of one another about the vertical, where only angles differ.
    space : Space
    """

    pose: tuple[Equation, ...]
    names: tuple[Definition, ...]
    leg: tuple[Equation, ...]
    wrenches: tuple[tuple[str, str], ...]
    columns: dict[str, tuple[Any, ...]]
    legs: tuple[str, ...]
    turned: tuple[tuple[str, ...], ...]
    space: Space

    def stiffness(self, values: Mapping[str, float]) -> np.ndarray:
        """K (n, n) in numbers, by the very equations that are printed.

        Parameters
        ----------
        values : mapping of names to float
            Of the given symbols.
        """
        known: dict[str, Any] = dict(values)
        for definition in self.names:
            given = {s: known[str(s)] for s in definition.expression.free_symbols}
            known[definition.symbol.name] = values_of([definition.expression], given)[0]
        for equation in self.pose:
            known[equation.name] = vector_value(equation.expression, known)
        rows = list(self.space.rows)
        K = np.zeros((6, 6))
        for number in range(len(self.legs)):
            own = dict(known)
            for name, column in self.columns.items():
                own[name] = vector_value(column[number], known)
            for equation in self.leg:
                own[equation.name] = vector_value(equation.expression, own)
            for w, c in self.wrenches:
                K += np.outer(own[w], own[w]) / own[c]
        return K[np.ix_(rows, rows)]


def vector_form(placed: PlacedRobot) -> VectorForm | None:
    """The vector form of a placed robot; None where its legs are no struts of one kind.

    Raises
    ------
    DisagreementError
        When it differs from the numerical form at random parameters and poses.
    """
    if placed.robot.is_posed_by_joints:
        return None
    try:
        found = _Recognition(placed).form()
    except FormulaTooLargeError:
        return None
    if found is not None:
        check_vector_form(found, placed)
    return found


def check_vector_form(found: VectorForm, placed: PlacedRobot) -> None:
    """Compare it with the numerical form at random parameters and poses.

    Raises
    ------
    DisagreementError
    """
    for values, result, _ in closed_places(placed, placed.where):
        distance = matrix_distance(found.stiffness(values), result.K, placed.length)
        if distance > AGREED:
            at = ", ".join(f"{name} = {value:.6g}" for name, value in values.items())
            where = f"{placed.robot.name!r} {placed.where}, at {at}"
            raise DisagreementError("the vector form and the numerical form of K", distance, where)


@dataclass(frozen=True)
class _Leg:
    """A strut as it is written: its wrenches, and the compliance that each meets."""

    wrenches: tuple[VectorExpression, ...]
    compliances: tuple[Any, ...]


_P, _A, _B, _D, _U, _E, _G, _N = map(Vector, ("p", "a_i", "b_i", "d_i", "u_i", "e_i", "g_i", "n_i"))
_R0 = Vector("r_0")
_LENGTH, _S, _T = (sp.Symbol(name, positive=True) for name in ("L_i", "s_i", "t_i"))
_NAMES = {"p", "r_0", "L_i", "s_i", "t_i"}
_NAMES |= {f"{letter}_i" for letter in "abduegncw"}


class _Recognition:
    """Finds the vectors of a robot's legs, the same for all of them."""

    def __init__(self, placed: PlacedRobot) -> None:
        self.placed = placed
        self.record = placed.record
        self.count = placed.record.count
        self.close = _SAME * placed.length
        self.plain = ClosedReading(placed.record, placed.symbols)
        self.read = KnownReading(placed.record, placed.symbols)
        self.reader = KnownContributions(
            placed.record, placed.length, self.read, BeamProducts(self.read), _no_block
        )
        self.R = sampled(placed.platform.R, self.count)
        self.p = sampled(placed.platform.p, self.count)
        self.r0 = sampled(placed.entries.reference_point, self.count)
        self.rotation = "Q" if "R" in placed.symbols else "R"
        self.turns = bool(np.max(np.abs(self.R - np.eye(3))) > _SAME)
        self.shifted = bool(np.max(np.abs(self.r0)) > self.close)
        self.table = LegTable({k: float(v) for k, v in placed.robot.nominal.items()})

    def form(self) -> VectorForm | None:
        """The whole form, where all legs are struts with the same wrenches."""
        placed = self.placed
        if _NAMES & set(placed.symbols):
            return None
        pose = self._pose()
        space = placed.entries.space
        search = WrenchSearch(self.record, placed.reference, space, placed.length)
        bases = [_alone(search.basis(own.leg)) for own in placed.legs]
        if pose is None or not all(bases) or any(own.leg.blocks for own in placed.legs):
            return None
        places = [self._ends(i) for i in range(len(bases))]
        each = [
            None if place is None else self._leg(i, basis, *place)
            for i, (basis, place) in enumerate(zip(bases, places, strict=True))
        ]
        legs = [own for own in each if own is not None]
        if len(legs) < len(each) or any(own.wrenches != legs[0].wrenches for own in legs):
            return None
        return self._joined(pose, legs)

    def _joined(self, pose: tuple[Equation, ...], legs: list[_Leg]) -> VectorForm | None:
        placed, plain, first = self.placed, self.plain, legs[0]
        chains = placed.entries.legs

        def of_all(letter: str, angle: str, each: list[Any]) -> Equation:
            read = [tuple(plain(x) for x in v) for v in each]
            return Equation(f"{letter}_i", Coordinates(self.table.vectors(letter, angle, read)))

        a = of_all("a", "phi", [leg.base.p for leg in chains])
        b = of_all("b", "psi", [leg.attachment.p for leg in chains])
        away = ((1, _P), (1, self._turned(_B)), (-1, _A))
        equations = [
            a,
            b,
            Equation("d_i", Sum(away)),
            Equation("L_i", Norm(_D), is_vector=False),
            Equation("u_i", Over(_D, _LENGTH)),
        ]
        used = _vectors_of(first.wrenches)
        scalars = set().union(*(c.free_symbols for leg in legs for c in leg.compliances))
        if used & {_E, _G, _N}:
            axes = [next(own.leg.freedoms).axis for own in placed.legs]
            equations.append(of_all("e", "theta", axes))
        if used & {_G, _N}:
            across = Cross(_E, _U)
            equations.append(Equation("g_i", Over(across, Norm(across))))
        if _N in used:
            equations.append(Equation("n_i", Cross(_G, _E)))
        if _S in scalars:
            equations.append(Equation("s_i", Dot(self._other(used), _U), is_vector=False))
        if _T in scalars:
            across = Norm(Cross(self._other(used), _U))
            equations.append(Equation("t_i", across, is_vector=False))
        names = []
        for k, w in enumerate(first.wrenches):
            own = f"_{k + 1}" if len(first.wrenches) > 1 else ""
            met = self.table.scalar(f"c_i{own}", [leg.compliances[k] for leg in legs])
            if any(
                len({*x.free_symbols} & {_LENGTH, _S, _T})
                for x in self.table.columns.get(f"c_i{own}", ())
            ):
                return None
            equations.append(Equation(f"w_i{own}", w))
            if met != sp.Symbol(f"c_i{own}", real=True):
                equations.append(Equation(f"c_i{own}", met, is_vector=False))
            names.append((f"w_i{own}", f"c_i{own}"))
        turned = self.table.turns_of_one_another() or []
        labels = tuple(own.leg.name for own in placed.legs)
        return VectorForm(
            pose=pose,
            names=tuple(d for d in self.read.definitions if d.symbol in scalars),
            leg=tuple(equations),
            wrenches=tuple(names),
            columns={name: tuple(column) for name, column in self.table.columns.items()},
            legs=labels,
            turned=tuple(tuple(labels[i] for i in group) for group in turned if len(group) > 1),
            space=placed.entries.space,
        )

    def _turned(self, vector: VectorExpression) -> VectorExpression:
        return Turned(self.rotation, vector) if self.turns else vector

    def _other(self, used: set[Vector]) -> Vector:
        """The direction beside the strut's own."""
        return next(v for v in (_N, _G, _E) if v in used)

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

    def _ends(self, number: int) -> tuple[np.ndarray, np.ndarray] | None:
        """Where a strut begins and ends at the samples; None where no joint is there."""
        chain, own = self.placed.entries.legs[number], self.placed.legs[number].leg
        a = sampled(chain.base.p, self.count)
        b = self.p + np.einsum("nij,nj->ni", self.R, sampled(chain.attachment.p, self.count))
        points = [sampled(f.point, self.count) for f in own.freedoms if f.turns]
        joints = all(any(np.max(np.abs(x - q)) < self.close for q in points) for x in (a, b))
        return (a, b) if joints else None

    def _leg(
        self, number: int, basis: Sequence[UnitWrench], a: np.ndarray, b: np.ndarray
    ) -> _Leg | None:
        own = self.placed.legs[number].leg
        d = b - a
        L = np.linalg.norm(d, axis=1)
        u = d / L[:, None]
        e = sampled(next(own.freedoms).axis, self.count)
        across = np.cross(e, u)
        size = np.linalg.norm(across, axis=1)
        known: list[tuple[Vector, np.ndarray]] = [(_U, u), (_E, e)]
        if np.min(size) > _SAME:
            g = across / size[:, None]
            known += [(_G, g), (_N, np.cross(g, e))]
        self.read.known = [(L, _LENGTH)]
        wrenches, compliances = [], []
        directions = []
        for wrench in basis:
            at = sampled(wrench.direction, self.count)
            vector = next((v for v, x in known if _are_alike(x, at)), None)
            if vector is None:
                return None
            if wrench.point is None:
                wrenches.append(Stacked(None, vector))
            else:
                arm = self._arm(sampled(wrench.point, self.count), at, a, b)
                if arm is None:
                    return None
                wrenches.append(Stacked(vector, Cross(arm, vector)))
            directions.append((vector, at))
        others = {vector: at for vector, at in directions if vector != _U}
        if len(others) > 1:
            return None
        for at in others.values():
            s, t = np.einsum("ni,ni->n", at, u), np.linalg.norm(np.cross(at, u), axis=1)
            self.read.known += [
                (x, name)
                for x, name in ((s, _S), (t, _T))
                if np.max(np.abs(x - np.rint(x))) > _SAME
            ]
        for wrench in basis:
            compliances.append(summed(self.reader.of(own, wrench, wrench)))
        return _Leg(tuple(wrenches), tuple(compliances))

    def _arm(
        self, point: np.ndarray, direction: np.ndarray, a: np.ndarray, b: np.ndarray
    ) -> VectorExpression | None:
        """From the reference point to the line of a force."""
        away = [float(np.max(np.abs(np.cross(x - point, direction)))) for x in (b, a)]
        if away[0] < self.close:
            arm = Sum(((1, _B), (-1, _R0))) if self.shifted else _B
            return self._turned(arm)
        if away[1] < self.close:
            terms: tuple[tuple[int, VectorExpression], ...] = ((1, _A), (-1, _P))
            return Sum((*terms, (-1, self._turned(_R0))) if self.shifted else terms)
        return None


def _alone(basis: Basis | None) -> tuple[UnitWrench, ...]:
    """The wrenches of a basis, forces first; none where some of them share energy."""
    if basis is None:
        return ()
    A = np.abs(basis.compliance)
    size = np.sqrt(np.einsum("nii,njj->nij", A, A))
    if np.any(np.where(np.eye(A.shape[-1], dtype=bool), np.inf, _SAME * size) < A):
        return ()
    return tuple(sorted(basis.wrenches, key=lambda wrench: wrench.point is None))


def _no_block(block: PlacedBlock) -> BlockOfSprings:
    raise NotHeldByUnitWrenchesError(block.name)


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
