"""Entries of matrices as expressions, and their names."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.factors import bound_of_terms, factored
from robostiff.analytic.field import ExactField
from robostiff.analytic.operation_count import count_of
from robostiff.errors import InputError


def symbols_of(expressions: Iterable[Any]) -> set[Any]:
    """Symbols of expressions and matrices."""
    found: set[Any] = set()
    for expression in expressions:
        found |= expression.free_symbols
    return found


def operations(matrix: Any) -> int:
    """Number of operations of all entries of a matrix."""
    return sum(count_of(entry) for entry in matrix.flat())


@dataclass(frozen=True)
class MatrixName:
    """Name of a matrix or vector, such as K_1, as distinct from a symbol."""

    name: str


class EntryNames:
    """Names for matrices, vectors and their entries that differ from all given symbols.

    `given`: the given symbols, those of the joints included, in alphabetical order.

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


#: Of a decimal in print.
DIGITS = 12

# No search for factors where it would take seconds.
_MOST_OPERATIONS = 600
_MOST_OPERATIONS_OF_AN_ENTRY = 60
_MOST_TERMS = 500


def in_decimals(expression: Any) -> Any:
    """The same expression with numbers of many digits as decimals, as people write them.

    Such are products of a material and a section, or lengths between given points. The exact number
    stays in the formula, and in what is exported to be computed.
    """
    if not any(_is_long(number) for number in expression.atoms(sp.Rational)):
        return expression
    if expression.is_number:
        return sp.Float(expression.evalf(DIGITS + 3), DIGITS)
    if expression.is_Add or expression.is_Mul:
        numbers = [part for part in expression.args if part.is_number]
        others = [in_decimals(part) for part in expression.args if not part.is_number]
        return expression.func(in_decimals(expression.func(*numbers)), *others)
    return expression.func(*map(in_decimals, expression.args))


def without_lost_digits(K: sp.ImmutableMatrix) -> sp.ImmutableMatrix:
    """A stiffness matrix in decimals, 0 where its digits do not hold beside the diagonal."""
    if not all(x.is_number for x in K.flat()) or not any(map(_is_long, K.atoms(sp.Rational))):
        return K
    values = np.array(K.evalf(DIGITS + 3), dtype=float)
    size = np.sqrt(np.abs(np.diagonal(values)))
    lost = np.abs(values) <= 10.0**-DIGITS * np.outer(size, size)
    return sp.ImmutableMatrix(K.rows, K.cols, lambda i, j: 0 if lost[i, j] else K[i, j])


def _is_long(number: Any) -> bool:
    return any(len(str(abs(x))) > DIGITS for x in (number.p, number.q))


def readable(expression: Any) -> Any:
    """The same expression, factored where that is shorter."""
    expression = in_decimals(expression)
    before = count_of(expression)
    if not 1 < before <= _MOST_OPERATIONS_OF_AN_ENTRY or not _is_manageable([expression]):
        return expression
    try:
        field = ExactField([expression])
        element = field.element(expression)
    except InputError:
        return expression
    # A sum over compliances stays one where that is no longer than over one denominator.
    found = [
        sp.factor_terms(expression),
        factored(field, element.num) / factored(field, element.den),
    ]
    shorter = min(found, key=count_of)
    return shorter if count_of(shorter) < before else expression


def readable_matrix(M: sp.ImmutableMatrix) -> sp.ImmutableMatrix:
    """A matrix of readable entries; those that differ by the sign alone still do."""
    written: dict[Any, Any] = {}
    for entry in M.flat():
        if entry not in written:
            written[entry] = -written[-entry] if -entry in written else readable(entry)
    return sp.ImmutableMatrix(M.rows, M.cols, [written[entry] for entry in M.flat()])


def factored_matrix(K: sp.ImmutableMatrix) -> tuple[sp.Expr, sp.ImmutableMatrix]:
    """Common factor of the entries and the remaining matrix; 1 where that is not shorter."""
    K = K.applyfunc(in_decimals)
    whole = readable_matrix(K)
    if operations(K) > _MOST_OPERATIONS or not _is_manageable(K.flat()):
        return sp.Integer(1), whole
    try:
        factor, rest = _common_factor(K)
    except InputError:
        return sp.Integer(1), whole
    if operations(rest) + count_of(factor) < operations(whole):
        return factor, rest
    return sp.Integer(1), whole


def _common_factor(K: sp.ImmutableMatrix) -> tuple[sp.Expr, sp.ImmutableMatrix]:
    """``K = factor * rest``, the entries of the rest polynomials with whole coefficients."""
    field = ExactField(K.flat())
    elements = [field.element(entry) for entry in K.flat()]
    above, below = field.ring.constant(0), field.ring.constant(1)
    for element in elements:
        if not element.is_zero:
            above = element.num.gcd(above)
            below = below * (element.den / below.gcd(element.den))
    if above.is_zero():
        return sp.Integer(1), K
    rests = [element.num / above * (below / element.den) for element in elements]
    coefficients = [c for rest in rests for c in rest.coeffs()]
    content = sp.Rational(
        math.gcd(*(int(c.p) for c in coefficients)), math.lcm(*(int(c.q) for c in coefficients))
    )
    factor = content * factored(field, above) / factored(field, below)
    written = [factored(field, rest / field.element(content).num) for rest in rests]
    return factor, sp.ImmutableMatrix(K.rows, K.cols, written)


def _is_manageable(expressions: list[Any]) -> bool:
    """Whether expressions are short when multiplied out, and exact."""
    return all(
        not e.has(sp.Float) and bound_of_terms(e, _MOST_TERMS) <= _MOST_TERMS for e in expressions
    )
