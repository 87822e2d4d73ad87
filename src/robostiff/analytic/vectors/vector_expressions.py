"""Expressions of vectors as they are written by hand: p + R b - a, |d|, d/L, (R b) x u.

They are nodes that SymPy replaces, compares and keeps, and that it does not simplify.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import reduce
from operator import add, matmul
from typing import Any

import numpy as np
import sympy as sp
from sympy.core.function import AppliedUndef
from sympy.core.symbol import Str

from robostiff.frozen import frozen

#: A vector, a wrench, a rotation or a scalar.
VectorExpression = sp.Basic


class Vector(Str):
    """A vector with a name, or a rotation."""

    __slots__ = ()
    __match_args__ = ("name",)
    name: str


class _Node(sp.Basic):
    """An expression by its parts."""

    __slots__ = ()
    __match_args__ = ("parts",)

    def __new__(cls, *parts: Any) -> Any:
        return super().__new__(cls, *map(sp.sympify, parts))

    def _sympystr(self, printer: Any) -> str:
        """SymPy has a sum and products of its own."""
        return f"{type(self).__name__}({', '.join(map(printer.doprint, self.args))})"

    @property
    def parts(self) -> tuple[Any, ...]:
        """All of them, by which it is matched."""
        return self.args


class Coordinates(_Node):
    """A vector by its coordinates, which are formulas."""


class Sum(_Node):
    """A sum of terms, each with its sign: (1, p), (-1, a)."""


class Turned(_Node):
    """A rotation by its name, and a vector in the axes of the platform that it turns."""

    def __new__(cls, rotation: Any, vector: Any) -> Any:
        """The rotation may be given by its name."""
        return super().__new__(cls, Vector(str(rotation)), vector)


class Over(_Node):
    """A vector over a scalar."""


class Times(_Node):
    """A scalar times a vector."""


class Cross(_Node):
    """A vector product."""


class Dot(_Node):
    """A scalar product."""


class Norm(_Node):
    """The length of a vector."""


class Stacked(_Node):
    """A wrench or a twist: its force and its moment; either may be zero."""


class Turns(_Node):
    """A product of turns about axes of the world, such as Rz(gamma) Ry(beta): axes and angles."""

    def __new__(cls, *turns: Any) -> Any:
        """Axes are those of the world by their letters, which are no symbols."""
        return super().__new__(cls, *(sp.Tuple(Str(str(axis)), angle) for axis, angle in turns))


class Columns(_Node):
    """Axes by their unit vectors, side by side: a rotation."""


_TURNS: dict[str, Callable[[Any], sp.Matrix]] = {
    "x": sp.rot_ccw_axis1,
    "y": sp.rot_ccw_axis2,
    "z": sp.rot_ccw_axis3,
}


def value_of(x: Any, known: Any, scalar: Callable[[Any], Any]) -> Any:  # noqa: PLR0912
    """An expression of vectors in formulas, or in numbers at samples, its components first.

    Parameters
    ----------
    x : expression of vectors
    known : mapping of str to arrays
        Vectors (3, ...), wrenches (6, ...) and rotations (3, 3, ...), by name.
    scalar : function
        The value of an expression of scalars.
    """

    def of(x: Any) -> Any:
        return value_of(x, known, scalar)

    match x:
        case Vector(name):
            found = known[name]
        case Coordinates(parts):
            found = np.array([of(part) for part in parts], dtype=object)
        case Sum(terms):
            found = reduce(add, (int(sign) * of(term) for sign, term in terms))
        case Turned((rotation, vector)):
            found = np.einsum("ij...,j...->i...", of(rotation), of(vector))
        case Over((vector, number)):
            found = of(vector) / of(number)
        case Times((number, vector)):
            found = of(number) * of(vector)
        case Cross((a, b)):
            (a1, a2, a3), (b1, b2, b3) = of(a), of(b)
            found = np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])
        case Dot((a, b)):
            found = np.sum(of(a) * of(b), axis=0)
        case Norm((vector,)):
            square = np.sum(of(vector) ** 2, axis=0)
            found = np.sqrt(square) if isinstance(square, np.ndarray) else sp.sqrt(square)
        case Stacked():
            both: list[Any] = [0 if part == 0 else of(part) for part in x.args]
            found = np.concatenate([v + 0 * w for v, w in (both, both[::-1])])
        case Turns(turns):
            each = (np.array(_TURNS[axis.name](of(angle))) for axis, angle in turns)
            found = reduce(matmul, each, np.array(sp.eye(3)))
        case Columns(vectors):
            found = np.stack([of(v) for v in vectors], axis=1)
        case _:
            found = scalar(sp.sympify(x))
    return found


@frozen
class Equation:
    """``name = expression``; the name is that of a vector, a rotation or a scalar.

    Attributes
    ----------
    name : str
    expression : expression of vectors or of scalars, or text of matrices
    """

    name: str
    expression: Any

    @property
    def is_vector(self) -> bool:
        """Whether the name is that of a vector or a matrix, such as diag(a, b)."""
        is_diagonal = isinstance(self.expression, AppliedUndef)
        return is_diagonal or not isinstance(self.expression, sp.Expr | Dot | Norm)


def names_in(part: Any) -> set[str]:
    """Names of the vectors, rotations and symbols in an expression, or in several.

    Examples
    --------
    >>> sorted(names_in(Cross(Vector("e_i"), Turned(Vector("R"), Vector("b_i")))))
    ['R', 'b_i', 'e_i']
    """
    if isinstance(part, sp.Basic):
        found: Any = part.free_symbols | part.atoms(Vector)
        return {x.name for x in found}
    if is_dataclass(part):
        part = [getattr(part, f.name) for f in fields(part)]
    elif not isinstance(part, list | tuple | dict):
        return set()
    return set().union(*map(names_in, part.values() if isinstance(part, dict) else part))
