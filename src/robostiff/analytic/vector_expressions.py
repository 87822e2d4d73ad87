"""Expressions of vectors as they are written by hand: p + R b - a, |d|, d/L, (R b) x u."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.numeric_value import values_of


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
    Vector | Coordinates | Sum | Turned | Over | Cross | Dot | Norm | Stacked | Turns | sp.Expr
)


def vector_value(expression: Any, known: Mapping[str, Any]) -> Any:
    """An expression in numbers.

    Parameters
    ----------
    expression : VectorExpression
    known : mapping of names to floats and (3,) or (3, 3) arrays

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
            found = sum((sign * value(term) for sign, term in terms), np.zeros(3))
        case Turned(rotation, vector):
            found = known[rotation] @ value(vector)
        case Over(vector, scalar):
            found = value(vector) / value(scalar)
        case Cross(left, right):
            found = np.cross(value(left), value(right))
        case Dot(left, right):
            found = float(value(left) @ value(right))
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
