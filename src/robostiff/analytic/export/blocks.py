"""What a written formula consists of, whatever its language: words, equations, tables, names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import sympy as sp

from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.export.entries import (
    factored_matrix,
    in_decimals,
    operations,
    readable,
    readable_matrix,
    without_lost_digits,
)
from robostiff.analytic.vectors.vector_expressions import Equation, Vector
from robostiff.frozen import frozen

#: A matrix with more operations than this is not written out between other equations.
LONGEST = 1500


@frozen
class Title:
    """A title; level 1 is the title of the whole."""

    text: str
    level: int = 2


@frozen
class Sentences:
    """Sentences; `{}` in them stands for a formula each, or for a name, where they have some."""

    text: str
    formulas: tuple[Any, ...] = ()


@frozen
class EquationRows:
    """Equations of scalars, vectors and matrices, one below the other.

    `springs`: definitions that are stiffnesses, for the nomenclature, which has the numbers.
    """

    rows: tuple[Equation, ...]
    springs: tuple[Definition, ...] = ()


@frozen
class MatrixEquation:
    """``name = whole = factor * rest``; a column is given as the row that it is written as."""

    name: str
    whole: sp.ImmutableMatrix
    factor: Any = sp.S.One
    rest: Any = None

    @property
    def is_vector(self) -> bool:
        """Whether it is a column, written as a row."""
        return self.whole.rows == 1


@frozen
class FormulaTable:
    """Rows of a name in words and of formulas, under a head of names."""

    head: tuple[Vector | str, ...]
    rows: tuple[tuple[str, tuple[Any, ...]], ...]
    of: str = "leg"  # what the rows are


#: Names, of vectors and matrices as `Vector`, and their meaning.
Meaning = tuple[tuple[Vector | str, ...], str]


@frozen
class Nomenclature:
    """Names and their meanings; several names with the same meaning are listed together."""

    rows: tuple[Meaning, ...]


Block = Title | Sentences | EquationRows | MatrixEquation | FormulaTable | Nomenclature


def equations(definitions: Sequence[Definition]) -> EquationRows:
    """Definitions as equations; stiffnesses in numbers are left to the nomenclature."""
    springs = tuple(d for d in definitions if d.parts)
    shown = [d for d in definitions if not is_value(d)]
    return EquationRows(
        tuple(Equation(d.symbol.name, in_decimals(d.expression)) for d in shown), springs
    )


def is_value(definition: Definition) -> bool:
    """Whether it is a stiffness in numbers."""
    return bool(definition.parts) and definition.expression.is_number


def scalar_unless_name(name: str, expression: Any) -> list[Block]:
    """The same where the expression is more than the name itself."""
    is_name = expression.is_Symbol and expression.name == name
    return [] if is_name else [equation(name, readable(expression))]


def equation(name: str, expression: Any) -> EquationRows:
    """``name = expression`` alone; of matrices see `Notation.fixed`."""
    return EquationRows((Equation(name, expression),))


def column_equation(name: str, column: Any) -> MatrixEquation:
    """``name = column``, written as a row."""
    return MatrixEquation(name, readable_matrix(column).T)


def stiffness_equation(name: str, K: Any) -> MatrixEquation:
    """``name = factor * matrix`` of a stiffness matrix."""
    K = without_lost_digits(K)
    return MatrixEquation(name, readable_matrix(K), *factored_matrix(K))


def unless_long(name: str, K: Any, column: Any = None) -> list[Block]:
    """``name = K``, or ``name = column``, or a sentence where that is long."""
    count = operations(K)
    if count > LONGEST:
        words = f"{{}} takes {count} operations and is not written out."
        return [Sentences(words, (Vector(name),))]
    return [stiffness_equation(name, K) if column is None else column_equation(name, column)]


def meanings_of_given(given: Iterable[str], meanings: Mapping[str, str]) -> list[Meaning]:
    """Rows of given symbols; those with the same meaning stand in one."""
    rows: dict[str, list[str]] = {}
    for name in given:
        rows.setdefault(meanings.get(name, "given"), []).append(name)
    return [(tuple(names), meaning) for meaning, names in rows.items()]


#: Axes of a leg, or of an arm, and their origin.
OWN_AXES = (Vector("R_0"), Vector("v_0"))


def own_axes(found: Any) -> list[Block]:
    """The axes of a leg in the world, and their origin."""
    axes, arm = OWN_AXES
    return [
        MatrixEquation(axes.name, readable_matrix(found.axes)),
        column_equation(arm.name, found.arm),
    ]


def transport(after: str, before: str) -> EquationRows:
    """``after = T before T^T``: from own axes to the reference point, eq. (11)-(13)."""
    moved: Any = f"T {before} T^T"
    lever: Any = "[R_0, 0; (v_0 ×) R_0, R_0]"
    return EquationRows((Equation(after, moved), Equation("T", lever)))
