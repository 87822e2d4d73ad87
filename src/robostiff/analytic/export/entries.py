"""Entries of matrices as expressions, and their names."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from robostiff.analytic.derivation import Derivation


def entries(matrix: Any) -> list[Any]:
    """All entries of a matrix, row after row.

    Examples
    --------
    >>> import sympy as sp
    >>> entries(sp.Matrix([[1, 2], [3, 4]]))
    [1, 2, 3, 4]
    """
    return [matrix[i, j] for i in range(matrix.rows) for j in range(matrix.cols)]


def rows(matrix: Any) -> list[list[Any]]:
    """The entries of a matrix, a list for each row.

    Examples
    --------
    >>> import sympy as sp
    >>> rows(sp.Matrix([[1, 2], [3, 4]]))
    [[1, 2], [3, 4]]
    """
    return [[matrix[i, j] for j in range(matrix.cols)] for i in range(matrix.rows)]


def symbols_of(expressions: Iterable[Any]) -> set[Any]:
    """Symbols of expressions and matrices.

    Examples
    --------
    >>> import sympy as sp
    >>> x, y = sp.symbols("x y")
    >>> sorted(symbols_of([x + 1, sp.Matrix([y])]), key=str)
    [x, y]
    """
    found: set[Any] = set()
    for expression in expressions:
        found |= expression.free_symbols
    return found


def operations(matrix: Any) -> int:
    """Number of operations of all entries of a matrix.

    Examples
    --------
    >>> import sympy as sp
    >>> x, y = sp.symbols("x y")
    >>> operations(sp.Matrix([[x + y, x * y + 1]]))
    3
    """
    return sum(int(entry.count_ops()) for entry in entries(matrix))


@dataclass(frozen=True)
class MatrixName:
    """Name of a matrix or vector, such as K_1, as distinct from a symbol."""

    name: str


class EntryNames:
    """Names for matrices, vectors and their entries that differ from all given symbols.

    Parameters
    ----------
    derivation : Derivation

    Attributes
    ----------
    given : tuple of str
        The given symbols, those of the joints included, in alphabetical order.
    result : MatrixName

    Examples
    --------
    >>> import sympy as sp
    >>> K = sp.ImmutableMatrix(sp.diag(sp.Symbol("K_0"), 1, 1))
    >>> EntryNames(Derivation("K_C", K, (), K)).stiffness(0)
    MatrixName(name="K'_0")
    """

    def __init__(self, derivation: Derivation) -> None:
        matrices: list[Any] = [derivation.K0, derivation.K]
        for stage in derivation.stages:
            matrices += [stage.J, stage.u, stage.K, stage.mu]
        matrices += [d.expression for d in derivation.definitions]
        used = {symbol.name for symbol in symbols_of(matrices)}
        # The derivation's own names, such as mu_1, u_1_2 and K_1_12, have the same meaning here.
        self.given = tuple(sorted(used - {d.symbol.name for d in derivation.definitions}))
        self._stages = len(derivation.stages)
        is_symbol = re.fullmatch(r"K(_?[A-Za-z]\w*)?", derivation.name)
        result = derivation.name if is_symbol else "K_C"
        while any(name == result or name.startswith(f"{result}_") for name in self.given):
            result = f"{result[0]}'{result[1:]}"
        self.result = MatrixName(result)

    def stiffness(self, stage: int) -> MatrixName:
        """Stiffness after a number of joints."""
        return MatrixName(self.scalar("K", stage))

    def column(self, letter: str, stage: int) -> MatrixName:
        """Twist J or wrench u of a joint."""
        return MatrixName(self.scalar(letter, stage))

    def scalar(self, letter: str, stage: int) -> str:
        """Letter and number, primed where given symbols are called like one of these names."""
        while any(self._is_stage_of(letter, name) for name in self.given):
            letter += "'"
        return f"{letter}_{stage}"

    def entries_of(self, matrix: MatrixName) -> Callable[[int, int], str]:
        """Name for the entry in row i and column j, from 0."""
        is_vector = matrix.name[0] in "Ju"
        return lambda i, j: f"{matrix.name}_" + ("" if is_vector else f"{i + 1}") + f"{j + 1}"

    def _is_stage_of(self, letter: str, name: str) -> bool:
        matched = re.fullmatch(rf"{letter}_(\d+)(_\d+)?", name)
        return matched is not None and int(matched[1]) <= self._stages
