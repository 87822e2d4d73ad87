"""Expressions of vectors as they are written by hand: p + R b - a, |d|, d/L, (R b) x u."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, cast

import sympy as sp


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


@dataclass(frozen=True)
class Columns:
    """Axes by their unit vectors, side by side: a rotation."""

    vectors: tuple[VectorExpression, ...]


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
    | Columns
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


def names_in(part: Any) -> set[str]:
    """Names of the vectors, rotations and symbols in an expression.

    Examples
    --------
    >>> sorted(names_in(Cross(Vector("e_i"), Turned("R", Vector("b_i")))))
    ['R', 'b_i', 'e_i']
    """
    if isinstance(part, sp.Basic):
        return {s.name for s in cast("set[sp.Symbol]", part.free_symbols)}
    if isinstance(part, tuple | dict):
        each = part.values() if isinstance(part, dict) else part
        return set().union(*map(names_in, each))
    if not is_dataclass(part) or isinstance(part, type):
        return set()
    own = {part.name} if isinstance(part, Vector) else set[str]()
    own |= {part.rotation} if isinstance(part, Turned) else set()
    return own.union(*(names_in(getattr(part, f.name)) for f in fields(part)))


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
