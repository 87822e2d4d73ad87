"""A stiffness at vector level: one generic leg and a table, or the springs of an arm in series.

What differs between the legs are angles of points on circles, or coordinates.

Its equations are those that are printed. Written by components, one leg after the other, they are
steps of scalars, by which all else is found: numbers, derivatives, programs.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.derivation import Formula
from robostiff.analytic.exact.definition import Definition, used_definitions
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.vectors.vector_expressions import (
    Components,
    Coordinates,
    Equation,
    Turned,
    names_in,
)
from robostiff.errors import InputError
from robostiff.frozen import field, frozen, replace
from robostiff.spatial import Space


def transport(R: Any, v: Any, space: Space) -> sp.Matrix:
    """Wrenches in axes R (3, 3) with an arm v (3, 1) from a point, seen from there (n, n)."""
    rows = [(row + 3) % 6 for row in space.rows]
    return _moved(R, v).extract(rows, rows)


def _moved(R: Any, v: Any) -> sp.Matrix:
    """Twists in axes R (3, 3) at the end of an arm v (3, 1) from a point, seen from there."""
    lever = sp.Matrix.hstack(*(v.cross(R.col(j)) for j in range(3)))
    return sp.Matrix([[R, lever], [sp.zeros(3), R]])


@frozen
class VectorForm(Formula):
    """A generic leg, a table of what differs between the legs, and the sum.

    K and its steps are those of the components.

    A leg holds by wrenches and what these meet, or by its springs in series: a drive adds
    ``c t t^T`` to its compliance C by the twist t of its unit motion, a beam ``T D T^T`` by its own
    ``D = diag(L/EA, L^3/(12 EI_z), L^3/(12 EI_y), L/GJ, L/EI_y, L/EI_z)`` about its middle. Its
    stiffness is then ``W (W^T C W)^-1 W^T``, where W has the wrenches that do no work on the
    twists of its passive joints; of an arm, which has none, C^-1.
    """

    names: tuple[Definition, ...]  #: products of beams and the like
    space: Space
    pose: tuple[Equation, ...] = ()  #: point and rotation of the platform
    #: of one generic leg i, in the order in which they can be computed
    leg: tuple[Equation, ...] = ()
    #: tuple of (str, str): names of its wrenches and of their compliances
    wrenches: tuple[tuple[str, str], ...] = ()
    #: dict of names to tuples of SymPy expressions: what differs between the legs, one row a leg
    columns: dict[str, tuple[Any, ...]] = field(default_factory=dict)
    legs: tuple[str, ...] = ()  #: their names
    #: legs that are turns of one another about the vertical, where only angles differ
    turned: tuple[tuple[str, ...], ...] = ()
    #: sympy.ImmutableMatrix or None: K in the components u_x, ..., m_z of the wrench of the first
    #: leg, and in c, where the wrenches of all legs are turns of it, or mirror images
    average: Any = None
    #: tuple of (int, str, tuple of sympy.Expr): rods in parallel: number of the leg, name, and the
    #: vector r_ij from the middle of the rods of that leg to the end of this one, in the platform's
    #: axes
    rods: tuple[tuple[int, str, tuple[Any, ...]], ...] = ()
    of_rod: tuple[Equation, ...] = ()  #: the couple v_ij of a rod, and its compliance c_r
    others: tuple[VectorForm, ...] = ()  #: of legs of another kind, such as a post
    #: where wrenches of a leg share energy: names of the entries of the matrix C_i of what pairs of
    #: them meet, empty for zero. The leg's stiffness is W_i C_i^-1 W_i^T.
    coupled: tuple[tuple[str, ...], ...] = ()
    #: tuple of (str, str, sympy.Expr): name of the joint, that of its twist, and its compliance
    drives: tuple[tuple[str, str, Any], ...] = ()
    #: tuple of (str, str, str, tuple of sympy.Expr): name of the part, that of its axes, that of
    #: the vector from the reference point to its middle, and L, EA, EI_y, EI_z and GJ
    beams: tuple[tuple[str, str, str, tuple[Any, ...]], ...] = ()
    #: names of the twists of passive joints, none of which depends on the others
    passive: tuple[str, ...] = ()
    #: tuple of (str, str, str, RobotDerivation or sympy.ImmutableMatrix): robots inside an arm, and
    #: links given by a matrix: name, those of their axes, ``1`` for the world's, and of the vector
    #: from the reference point to their end, and the derivation of the stiffness, or the
    #: compliance, about this point in these axes
    modules: tuple[tuple[str, str, str, Any], ...] = ()

    keeps_numbers = is_of_legs = True

    @cached_property
    def _in_components(self) -> tuple[sp.ImmutableMatrix, tuple[Definition, ...]]:
        K, definitions = self._written()
        K = sp.ImmutableMatrix(K)
        return K, used_definitions(definitions, [K])

    @property
    def K(self) -> sp.ImmutableMatrix:
        """Stiffness about the reference point, world axes (n, n)."""
        return self._in_components[0]

    @property
    def definitions(self) -> tuple[Definition, ...]:
        """Components of all vectors, one leg after the other."""
        return self._in_components[1]

    @property
    def is_arm(self) -> bool:
        """Whether it is one leg of springs, without passive joints."""
        return not (self.wrenches or self.passive)

    def of_leg(self, leg: str) -> VectorForm | None:
        """One of its legs alone, with its values in place of the table; None where it has others.

        Wrenches in parallel rods, and those of a leg by its springs, are left to all legs.
        """
        form = next((x for x in (self, *self.others) if leg in x.legs), None)
        if form is None or form.rods or not form.wrenches:
            return None
        row = {name: column[form.legs.index(leg)] for name, column in form.columns.items()}
        given = {sp.Symbol(x, real=True): v for x, v in row.items() if isinstance(v, sp.Expr)}
        compliances = {c for _, c in form.wrenches}
        first = [Equation(x, v) for x, v in row.items() if isinstance(v, Coordinates)]
        last = [Equation(x, v) for x, v in row.items() if x in compliances]
        each = (replace(e, expression=e.expression.xreplace(given)) for e in form.leg)
        alone: Any = {"columns": {}, "turned": (), "average": None, "others": ()}
        return replace(form, pose=self.pose, legs=(leg,), leg=(*first, *each, *last), **alone)

    def _written(self) -> tuple[Any, list[Definition]]:
        """K (n, n) and steps by components."""
        steps, terms, first = self.components(), [], 1
        for form in (self, *self.others):
            steps.add(form.names)
            terms += [x for leg in form.in_each_leg(steps, first) for x in leg]
            first += len(form.legs)
        rows = list(self.space.rows)

        def entry(i: int, j: int) -> Any:
            i, j = sorted((rows[i], rows[j]))
            return sp.Add(*(w[i] * v[j] for w, _, v in terms))

        return sp.Matrix(len(rows), len(rows), entry), steps.definitions

    def components(self) -> Components:
        """Those of the pose, and names; no name is that of a given symbol."""
        others = {"space", "modules"}
        own = (f.name for f in fields(self) if not f.kw_only and f.name not in others)
        inner = (inner_level(module) for *_, module in self.modules)
        given = (s.name for level in inner for s in level.free_symbols)
        steps = Components({*names_in(tuple(getattr(self, x) for x in own)), *given}, self.names)
        for e in self.pose:
            steps.give(e.name, e.expression)
        return steps

    def in_each_leg(
        self, steps: Components, first: int = 1
    ) -> Iterator[list[tuple[Any, Any, Any]]]:
        """For each leg wrenches w, what they meet, and v: the sum of w v^T is its stiffness.

        `steps`: what the pose defines; `first`: number of the first leg.
        """
        later, pose = self.columns.keys() & {c for _, c in self.wrenches}, dict(steps.known)
        for n in range(len(self.legs)):
            number = "" if self.is_arm else f"_{first + n}"
            steps.known = dict(pose)
            for name in self.columns.keys() - later:
                steps.known[name] = steps.value(self.columns[name][n])
            for e in self.leg:
                steps.give(e.name, e.expression, number)
            if not self.wrenches:
                yield self._of_springs(steps, number)
                continue
            for name in later:  # which may depend on the length of the leg
                steps.give(name, self.columns[name][n], number)
            pairs = [(steps.known[w], steps.known[c]) for w, c in self.wrenches]
            for leg, rod, arm in self.rods:
                if leg == n:
                    steps.known["r_ij"] = steps.value(Coordinates(*arm))
                    of_rod = f"{number}_{[x for i, x, _ in self.rods if i == n].index(rod) + 1}"
                    for e in self.of_rod:
                        steps.give(e.name, e.expression, of_rod)
                    pairs.append(tuple(steps.known[e.name] for e in self.of_rod))
            if not self.coupled:
                yield [(w, c, w / c) for w, c in pairs]
                continue
            W = np.stack([w for w, _ in pairs], axis=1)
            C = sp.Matrix([[steps.known[c] if c else 0 for c in row] for row in self.coupled])
            V = W @ np.array(steps.inverse(steps.entries(C, f"c{number}_"), f"a{number}_"))
            yield [(w, C[k, k], v) for k, (w, v) in enumerate(zip(W.T, V.T, strict=True))]

    def _of_springs(self, steps: Components, number: str) -> list[tuple[Any, Any, Any]]:
        """The stiffness of a leg by its springs: C^-1, of which passive joints take their part.

        Each of them takes u u^T/mu, u = K J, mu = J^T u, eq. (15).
        """
        C, rows = sp.zeros(6), list(self.space.rows)
        units = sp.eye(6)[:, rows]
        for _, twist, compliance in self.drives:
            t = sp.Matrix(steps.known[twist])
            C += steps.value(compliance) * t * t.T
        for _, axes, middle, of_beam in self.beams:
            Q, D = (
                sp.Matrix(steps.known[axes]),
                sp.diag(*beam_compliances(*map(steps.value, of_beam))),
            )
            T = _moved(Q, sp.Matrix(steps.known[middle]))
            C += T * D * T.T
        known: dict[Any, Any] = {}
        for place, (_, axes, point, module) in enumerate(self.modules, start=1):
            of = f"_{place}_"
            if module not in known and isinstance(module, sp.MatrixBase):
                C_i = module.applyfunc(steps.value).extract(rows, rows)
                known[module] = steps.entries(C_i, f"C{of}")
            elif module not in known:
                level = inner_level(module)
                K_i = steps.entries(steps.with_steps(level.K, level.definitions), f"K{of}")
                known[module] = steps.inverse(K_i, f"b{of}", f"C{of}")
            B = sp.eye(3) if axes == "1" else sp.Matrix(steps.known[axes])
            T = _moved(B, sp.Matrix(steps.known[point]))
            T = T.extract(rows, rows)
            C += units * T * known[module] * T.T * units.T
        step = f"a{number}_" if number else "a"
        K: Any = steps.inverse(steps.entries(C.extract(rows, rows), f"C{number}_"), step)
        for k, twist in enumerate(self.passive, start=1):
            J = sp.Matrix(steps.known[twist]).extract(rows, [0])
            *_, K = steps.eliminate(K, J, f"{number}_{k}")
        return [((units * K).col(k), None, units.col(k)) for k in range(len(rows))]


def inner_level(module: Any) -> Any:
    """Of a module's formula in names, where it has some; of a link its compliance."""
    return getattr(module, "named", None) or module


def beam_compliances(L: Any, EA: Any, EI_y: Any, EI_z: Any, GJ: Any) -> list[Any]:
    """Of a beam about its middle, in its own axes, x along it."""
    return [L / EA, L**3 / (12 * EI_z), L**3 / (12 * EI_y), L / GJ, L / EI_y, L / EI_z]


@frozen
class InSeries(VectorForm):
    """The compliance of a serial arm in axes of its own, entry by entry."""

    #: (n, n), in names; the stiffness in these axes is its inverse
    C: sp.ImmutableMatrix = sp.ImmutableMatrix()
    axes: sp.ImmutableMatrix = sp.ImmutableMatrix()  #: columns: its axes in the world (3 x 3)
    #: from the reference point to the origin of these axes (3 x 1) [m], world axes
    arm: sp.ImmutableMatrix = sp.ImmutableMatrix()

    def _written(self) -> tuple[Any, list[Definition]]:
        steps = self.components()
        T = transport(self.axes.applyfunc(steps.value), self.arm.applyfunc(steps.value), self.space)
        C = steps.entries(self.C.applyfunc(steps.value), "C_")
        return T * steps.inverse(C, "a") * T.T, steps.definitions


_FULL_TURN = 1440  # quarters of a degree
_SAME = 1e-9
_WHOLE = 1e-6
_SLOPE = 0.1  # in place of zero
_STEP = 0.01  # of an angle, to see which points turn with it


class LegTable:
    """Columns of what differs, one row a leg.

    `nominal`: of the symbols, to distinguish angles from their cosines.
    """

    def __init__(self, nominal: dict[str, float]) -> None:
        self.nominal = nominal
        self.columns: dict[str, list[Any]] = {}  # by name
        self.angles: list[str] = []

    def equations(
        self, letter: str, angle: str, each: Sequence[Sequence[Any]], rotation: str | None = None
    ) -> list[Equation]:
        """The equation of a vector of all legs, with an angle where they lie on a circle about z.

        It is turned where there is a rotation. None where all three coordinates differ between the
        legs: then the vector itself is a column, unless it is turned.

        Examples
        --------
        >>> r = sp.Symbol("r", positive=True)
        >>> table = LegTable({"r": 0.3})
        >>> table.equations("b", "psi", [(r, 0, 0), (0, r, 0)])[0].expression.parts
        (r*cos(psi_i), r*sin(psi_i), 0)
        >>> table.columns
        {'psi_i': [0, pi/2]}
        """
        found = first = tuple(map(sp.sympify, each[0]))
        if not all(_are_same(first, v) for v in each[1:]):
            # Points that are as far from the z axis, and as high, have a radius and angles.
            polar = [
                self.polar(*map(sp.sympify, v[:2])) for v in each if _are_same(first[2:], v[2:])
            ]
            known = [x for x in polar if x and polar[0] and _are_same(polar[0][:1], x[:1])]
            differ = (any(not _are_same((v[k],), (first[k],)) for v in each[1:]) for k in range(3))
            if len(known) == len(each):
                radius, turned = known[0][0], self.angle(angle, [x for _, x in known])
                found = radius * sp.cos(turned), radius * sp.sin(turned), first[2]
            elif rotation is None and all(differ):
                self.columns[f"{letter}_i"] = [Coordinates(*map(sp.sympify, v)) for v in each]
                return []
            else:
                columns = enumerate("xyz")
                found = [self.scalar(f"{letter}_i{x}", [v[k] for v in each]) for k, x in columns]
        vector = Coordinates(*found)
        return [Equation(f"{letter}_i", vector if rotation is None else Turned(rotation, vector))]

    def keep(self, used: Container[str]) -> None:
        """Leave the columns that are used."""
        self.columns = {name: x for name, x in self.columns.items() if name in used}
        self.angles = [name for name in self.angles if name in used]

    def angle(self, name: str, each: Sequence[Any]) -> Any:
        """An angle of all legs: a column, perhaps of another one from which it differs by one."""
        if all(x == each[0] for x in each):
            return each[0]
        for known in self.angles:
            apart = {_wrapped(a - b) for a, b in zip(each, self.columns[known], strict=True)}
            if len(apart) == 1:
                return sp.Symbol(known, real=True) + apart.pop()
        self.columns[f"{name}_i"] = list(each)
        self.angles.append(f"{name}_i")
        return sp.Symbol(f"{name}_i", real=True)

    def turns_of_one_another(self) -> list[list[int]] | None:
        """Legs that turns about z map on one another; None where more than angles differ."""
        if not self.angles or len(self.angles) < len(self.columns):
            return None
        first = self.columns[self.angles[0]]
        groups: dict[tuple[Any, ...], list[int]] = {}
        for leg, start in enumerate(first):
            angles = [self.columns[name][leg] for name in self.angles[1:]]
            key = tuple(_wrapped(angle - start) for angle in angles)
            # With a symbol, legs may also turn by it: these are no turns of one another.
            groups.setdefault((*key, start - _number(start)), []).append(leg)
        return list(groups.values())

    def scalar(self, name: str, each: Sequence[Any]) -> Any:
        """A scalar of all legs: its formula where they have one, a column otherwise."""
        if all(_are_same((each[0],), (x,)) for x in each[1:]):
            return sp.sympify(each[0])
        self.columns[name] = [sp.sympify(x) for x in each]
        return sp.Symbol(name, real=True)

    def polar(self, x: Any, y: Any) -> tuple[Any, Any] | None:
        """Radius and angle of a point in the plane; None where they are no short formulas."""
        symbols = sorted(x.free_symbols | y.free_symbols, key=str)
        turning = [
            s
            for s in symbols
            if any(s in f.free_symbols for f in (x + sp.I * y).atoms(sp.sin, sp.cos))
        ]

        # At a slope of zero, what slopes has no angle.
        near = {s.name: self.nominal.get(s.name, 1.0) or _SLOPE for s in symbols}

        def angle(**other: float) -> float:
            values = {s: near[s.name] + other.get(s.name, 0.0) for s in symbols}
            across, up = map(float, values_of([x, y], values))
            return float(np.arctan2(up, across))

        here = angle()
        slopes = {s: (angle(**{s.name: _STEP}) - here) / _STEP for s in turning}
        if any(abs(n - round(n)) > _WHOLE for n in slopes.values()):
            return None
        slopes = {s: round(n) for s, n in slopes.items()}
        written = sum((n * s for s, n in slopes.items()), sp.Integer(0))
        start = here - sum(n * near[s.name] for s, n in slopes.items())
        quarters = start / (2 * np.pi) * _FULL_TURN
        if abs(quarters - round(quarters)) > _SAME * _FULL_TURN:
            return None
        written += _wrapped(2 * sp.pi * sp.Rational(round(quarters), _FULL_TURN))
        square = sp.expand(sp.expand_trig(x**2 + y**2))
        known = ExactField([square])
        square = known.expression(known.element(square))
        in_sines = sp.expand(square.replace(sp.cos, lambda t: sp.sqrt(1 - sp.sin(t) ** 2)))
        for form in dict.fromkeys((square, in_sines)):
            radius = sp.sqrt(sp.factor(form)).replace(sp.Abs, lambda size: size)
            if _are_same((radius * sp.cos(written), radius * sp.sin(written)), (x, y)):
                return radius, written
        return None


def _number(angle: Any) -> Any:
    """The part of a sum without symbols."""
    terms = sp.Add.make_args(sp.expand(angle))
    return sum((t for t in terms if not t.free_symbols), sp.Integer(0))


def _wrapped(angle: Any) -> Any:
    """The same angle between 0 and a full turn, as far as it is a number."""
    number = _number(angle)
    return sp.expand(angle) - number + number % (2 * sp.pi)


def _are_same(first: Sequence[Any], other: Sequence[Any]) -> bool:
    """Whether formulas are equal, in exact arithmetic."""
    for a, b in zip(first, other, strict=True):
        difference = sp.expand_trig(sp.sympify(a) - sp.sympify(b))
        if difference == 0:
            continue
        try:
            known = ExactField([difference])
            if not known.element(difference).is_zero:
                return False
        except InputError:
            return False
    return True
