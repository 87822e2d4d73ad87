"""Expressions of vectors as they are written by hand: p + R b - a, |d|, d/L, (R b) x u.

The equations of a generic leg with a table of what differs are a robot at vector level.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.exact.exact_points import values_of
from robostiff.spatial import Space


@dataclass(frozen=True)
class Vector:
    """A vector with a name, or a rotation."""

    name: str


@dataclass(frozen=True)
class Coordinates:
    """A vector by its coordinates, which are formulas."""

    entries: tuple[Any, ...]


@dataclass(frozen=True)
class Sum:
    """A sum of terms, each with its sign."""

    terms: tuple[tuple[int, VectorExpression], ...]


@dataclass(frozen=True)
class Turned:
    """A vector in the axes of the platform, turned by a rotation into the world."""

    rotation: str
    vector: VectorExpression


@dataclass(frozen=True)
class Over:
    """A vector over a scalar."""

    vector: VectorExpression
    scalar: VectorExpression


@dataclass(frozen=True)
class Times:
    """A scalar times a vector."""

    scalar: sp.Expr
    vector: VectorExpression


@dataclass(frozen=True)
class Cross:
    """A vector product."""

    left: VectorExpression
    right: VectorExpression


@dataclass(frozen=True)
class Dot:
    """A scalar product."""

    left: VectorExpression
    right: VectorExpression


@dataclass(frozen=True)
class Norm:
    """The length of a vector."""

    vector: VectorExpression


@dataclass(frozen=True)
class Stacked:
    """A wrench: its force, and its moment; either may be zero."""

    force: VectorExpression | None
    moment: VectorExpression | None


@dataclass(frozen=True)
class Turns:
    """A product of turns about axes of the world, such as Rz(gamma) Ry(beta)."""

    turns: tuple[tuple[str, Any], ...]


VectorExpression = (
    Vector
    | Coordinates
    | Sum
    | Turned
    | Over
    | Times
    | Cross
    | Dot
    | Norm
    | Stacked
    | Turns
    | sp.Expr
)


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
    average : sympy.ImmutableMatrix or None
        K in the components u_x, ..., m_z of the wrench of the first leg, and in c, where the
        wrenches of all legs are turns of it, or mirror images.
    rods : tuple of (int, str, tuple of sympy.Expr)
        Rods in parallel: number of the leg, name, and the vector r_ij from the middle of the rods
        of that leg to the end of this one, in the platform's axes.
    of_rod : tuple of Equation
        The couple v_ij of a rod, and its compliance c_r.
    others : tuple of VectorForm
        Of legs of another kind, such as a post.
    coupled : tuple of tuples of str
        Where wrenches of a leg share energy: names of the entries of the matrix C_i of what pairs
        of them meet, empty for zero. The leg's stiffness is W_i C_i^-1 W_i^T.
    """

    pose: tuple[Equation, ...]
    names: tuple[Definition, ...]
    leg: tuple[Equation, ...]
    wrenches: tuple[tuple[str, str], ...]
    columns: dict[str, tuple[Any, ...]]
    legs: tuple[str, ...]
    turned: tuple[tuple[str, ...], ...]
    space: Space
    average: Any = None
    rods: tuple[tuple[int, str, tuple[Any, ...]], ...] = ()
    of_rod: tuple[Equation, ...] = ()
    others: tuple[VectorForm, ...] = ()
    coupled: tuple[tuple[str, ...], ...] = ()

    def stiffness(self, values: Mapping[str, float]) -> np.ndarray:
        """K (n, n) at values of the given symbols, by the very equations that are printed."""
        rows = list(self.space.rows)
        K = np.zeros((6, 6))
        for w, c in self.wrenches_at(values):
            K += np.einsum("ki,k,kj->ij", w, 1 / c, w)
        return sum((form.stiffness(values) for form in self.others), K[np.ix_(rows, rows)])

    def wrenches_at(self, values: Mapping[str, float]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Wrenches (k, 6) that share no energy, and compliances (k) of each leg in numbers."""
        known: dict[str, Any] = dict(values)
        for definition in self.names:
            given = {s: known[str(s)] for s in definition.expression.free_symbols}
            known[definition.symbol.name] = values_of([definition.expression], given)[0]
        for equation in self.pose:
            known[equation.name] = vector_value(equation.expression, known)
        compliances = self.columns.keys() & {c for _, c in self.wrenches}
        for number in range(len(self.legs)):
            own = dict(known)
            for name in self.columns.keys() - compliances:
                own[name] = vector_value(self.columns[name][number], known)
            for equation in self.leg:
                own[equation.name] = vector_value(equation.expression, own)
            for name in compliances:  # which may depend on the length of the leg
                own[name] = vector_value(self.columns[name][number], own)
            met = [(own[w], own[c]) for w, c in self.wrenches]
            if self.coupled:
                C = np.array([[own[c] if c else 0.0 for c in row] for row in self.coupled])
                W = np.linalg.solve(np.linalg.cholesky(C), np.array([w for w, _ in met]))
                met = [(w, 1.0) for w in W]
            for leg, _, arm in self.rods:
                if leg == number:
                    own["r_ij"] = vector_value(Coordinates(arm), known)
                    met.append(tuple(vector_value(e.expression, own) for e in self.of_rod))
            yield np.array([w for w, _ in met]), np.array([c for _, c in met])


def with_formulas_changed(part: Any, change: Callable[[Any], Any]) -> Any:
    """An expression of vectors, an equation or a whole form with every formula in it changed.

    Examples
    --------
    >>> r, b = sp.symbols("r b")
    >>> with_formulas_changed(Turned("R", Coordinates((r, b))), lambda x: x.subs(r, 2))
    Turned(rotation='R', vector=Coordinates(entries=(2, b)))
    """
    if isinstance(part, sp.Basic):
        return change(part)
    if isinstance(part, tuple):
        return tuple(with_formulas_changed(x, change) for x in part)
    if isinstance(part, dict):
        return {name: with_formulas_changed(x, change) for name, x in part.items()}
    if is_dataclass(part) and not isinstance(part, type):
        own = {f.name: getattr(part, f.name) for f in fields(part)}
        return replace(part, **with_formulas_changed(own, change))
    return part


def vector_value(expression: Any, known: Mapping[str, Any]) -> Any:
    """An expression in numbers.

    `known`: mapping of names to floats and (3,) or (3, 3) arrays.

    Examples
    --------
    >>> known = {"d": np.array([3.0, 0, 4.0]), "L": 5.0}
    >>> vector_value(Over(Vector("d"), sp.Symbol("L")), known).tolist()
    [0.6, 0.0, 0.8]
    """

    def value(part: Any) -> Any:
        return vector_value(part, known)

    match expression:
        case Vector(name):
            found = known[name]
        case Coordinates(entries):
            found = np.array([value(x) for x in entries])
        case Sum(terms):
            found = sum(sign * value(term) for sign, term in terms)
        case Turned(rotation, vector):
            found = known[rotation] @ value(vector)
        case Over(vector, scalar):
            found = value(vector) / value(scalar)
        case Times(scalar, vector):
            found = value(scalar) * value(vector)
        case Cross(left, right) | Dot(left, right):
            product = np.cross if isinstance(expression, Cross) else np.dot
            found = product(value(left), value(right))
        case Norm(vector):
            found = float(np.linalg.norm(value(vector)))
        case Stacked(force, moment):
            found = np.concatenate(
                [np.zeros(3) if x is None else value(x) for x in (force, moment)]
            )
        case Turns(turns):
            found = np.eye(3)
            for axis, angle in turns:
                found = found @ _turn("xyz".index(axis), value(angle))
        case _:
            given = {s: known[s.name] for s in expression.free_symbols}
            found = float(values_of([expression], given)[0])
    return found


def _turn(axis: int, angle: float) -> np.ndarray:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = np.cos(angle)
    R[j, i] = np.sin(angle)
    R[i, j] = -R[j, i]
    return R


@dataclass(frozen=True)
class ArmOfSprings:
    """The compliance of a serial arm at vector level: a sum over its drives and beams.

    A drive adds ``c t t^T`` by the twist t of its unit motion, a beam ``T D T^T`` by its compliance
    ``D = diag(L/EA, L^3/(12 EI_z), L^3/(12 EI_y), L/GJ, L/EI_y, L/EI_z)`` about its middle.

    Attributes
    ----------
    names : tuple of Definition
        Products of beams and the like.
    equations : tuple of Equation
        Rotations, points, and twists about the reference point, in the order in which they can be
        computed; translation before rotation.
    drives : tuple of (str, str, sympy.Expr)
        Name of the joint, that of its twist, and its compliance.
    beams : tuple of (str, str, str, tuple of sympy.Expr)
        Name of the part, that of its axes, that of the vector from the reference point to its
        middle, and L, EA, EI_y, EI_z and GJ.
    space : Space
    """

    names: tuple[Definition, ...]
    equations: tuple[Equation, ...]
    drives: tuple[tuple[str, str, Any], ...]
    beams: tuple[tuple[str, str, str, tuple[Any, ...]], ...]
    space: Space

    def stiffness(self, values: Mapping[str, float]) -> np.ndarray:
        """K (n, n) at values of the given symbols, by the very equations that are printed."""
        known: dict[str, Any] = dict(values)
        for definition in self.names:
            known[definition.symbol.name] = vector_value(definition.expression, known)
        for equation in self.equations:
            known[equation.name] = vector_value(equation.expression, known)
        C = np.zeros((6, 6))
        for _, twist, compliance in self.drives:
            C += vector_value(compliance, known) * np.outer(known[twist], known[twist])
        for _, axes, middle, of_beam in self.beams:
            L, EA, EI_y, EI_z, GJ = (vector_value(x, known) for x in of_beam)
            Q = known[axes]
            T = np.block([[Q, np.cross(known[middle], Q, axisb=0, axisc=0)], [np.zeros((3, 3)), Q]])
            D = [L / EA, L**3 / (12 * EI_z), L**3 / (12 * EI_y), L / GJ, L / EI_y, L / EI_z]
            C += T @ np.diag(D) @ T.T
        rows = list(self.space.rows)
        return np.linalg.inv(C[np.ix_(rows, rows)])
