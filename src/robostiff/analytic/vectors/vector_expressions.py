"""Expressions of vectors as they are written by hand: p + R b - a, |d|, d/L, (R b) x u.

They are nodes that SymPy replaces, compares and keeps, and that it does not simplify.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, is_dataclass
from functools import reduce
from itertools import product
from operator import add, matmul
from typing import Any

import numpy as np
import sympy as sp
from sympy.core.function import AppliedUndef
from sympy.core.symbol import Str

from robostiff.analytic.exact.definition import Definition, NamedSteps, count_of
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
    """``name = expression``; the name is that of a vector, a rotation or a scalar."""

    name: str
    expression: Any  #: expression of vectors or of scalars, or text of matrices

    @property
    def is_vector(self) -> bool:
        """Whether the name is that of a vector or a matrix, such as diag(a, b)."""
        is_diagonal = isinstance(self.expression, AppliedUndef)
        return is_diagonal or not isinstance(self.expression, sp.Expr | Dot | Norm)


def names_in(part: Any) -> set[str]:
    """Names of the vectors, rotations and symbols in an expression, or in several."""
    if isinstance(part, sp.Basic):
        found: Any = part.free_symbols | part.atoms(Vector)
        return {x.name for x in found}
    if is_dataclass(part):
        part = [getattr(part, f.name) for f in fields(part)]
    elif not isinstance(part, list | tuple | dict):
        return set()
    return set().union(*map(names_in, part.values() if isinstance(part, dict) else part))


# Operations of a number from which on it has a name: SymPy asks for its sign by all its digits.
_LONG = 30


class Components(NamedSteps):
    """Vectors by their components: steps of scalars, in order.

    `taken`: names that stand for something else; `names`: of products of beams and the like,
    numbers among which are written where they are used.
    """

    def __init__(self, taken: Iterable[str], names: Sequence[Definition] = ()) -> None:
        super().__init__(taken)
        self.known: dict[str, Any] = {}
        self.add(names)

    def add(self, names: Sequence[Definition]) -> None:
        """Further names."""
        for d in names:
            value = self.value(d.expression)
            if value.free_symbols and d.symbol.name not in self.known:
                self.taken.add(d.symbol.name)
                self.definitions.append(Definition(d.symbol, value))
            self.known.setdefault(d.symbol.name, d.symbol if value.free_symbols else value)

    def with_steps(self, M: Any, definitions: Sequence[Definition]) -> Any:
        """A matrix in steps of its own, which have other names where theirs are taken."""
        own: dict[Any, Any] = {}
        for d in definitions:
            value = self.value(d.expression.xreplace(own))
            if Definition(d.symbol, value) not in self.definitions:
                own[d.symbol] = self.named(d.symbol.name, value)
        return M.applyfunc(lambda x: self.value(x.xreplace(own)))

    def value(self, expression: Any) -> Any:
        """A scalar, or an array of components: (3,), (6,) of a wrench, (3, 3) of a rotation."""

        def scalar(expression: Any) -> Any:
            known = {s: self.known.get(s.name) for s in expression.free_symbols}
            return expression.xreplace({s: x for s, x in known.items() if isinstance(x, sp.Expr)})

        return value_of(expression, self.known, scalar)

    def give(self, name: str, expression: Any, number: str = "") -> None:
        """Define a name, each of its components with a name of its own.

        `number`: of the leg, in place of the index i, such as ``_1``; ``_1_2`` in place of ij.
        """
        value, full = self.value(expression), name
        if number:
            full = name.replace("_ij", number).replace("_i", number)
            full += number * (full == name)
        if not isinstance(value, np.ndarray):
            self.known[name] = self.named(full, value)
            return
        marks = "xyz" if value.shape == (3,) else range(1, len(value) + 1)
        places = marks if value.ndim == 1 else [f"{i}{j}" for i, j in product(marks, repeat=2)]
        each = [self.named(f"{full}_{m}", x) for m, x in zip(places, value.flat, strict=True)]
        self.known[name] = np.array(each, dtype=object).reshape(value.shape)

    def named(self, name: str, value: Any) -> Any:
        """A new name for a scalar with symbols, or for a long number."""
        is_short = not value.free_symbols and count_of(value) <= _LONG
        return value if is_short else super().named(name, value)
