"""Records read with names for lengths: a root, or a length of a part, is a symbol of its own."""

from __future__ import annotations

from typing import Any, cast

import sympy as sp

from robostiff.analytic.closed_sum import factored_fraction
from robostiff.analytic.combinations import suffix
from robostiff.analytic.derivation import Definition
from robostiff.analytic.factors import bound_of_terms
from robostiff.analytic.field import ExactField
from robostiff.analytic.products import FormulaTooLargeError
from robostiff.analytic.record_reading import ClosedReading
from robostiff.analytic.squares import completed_squares
from robostiff.record import Entry, Operation, Record

# Terms of an entry multiplied out, operations of a fraction that a person would print, and of all.
_WRITTEN = 2000
_PRINTED = 200
_ALL = 1200
# Operations from which even powers of roots are worth replacing.
_LONG = 12
# Operations of an intermediate from which it is cancelled before it is used.
_LONG_ON_THE_WAY = 40


class NamedReading:
    """Writes entries as factored fractions of the inputs, of named roots and of named lengths.

    Roots that have the same values at the samples have one name.

    Parameters
    ----------
    record : Record
    symbols : dict of names to SymPy symbols
        One for each input.

    Attributes
    ----------
    definitions : list of Definition
        The names, in the order in which they can be computed.

    Examples
    --------
    >>> from robostiff.record import square_root
    >>> record = Record({"x": [3.0, 4.0]})
    >>> x = record.input("x")
    >>> read = NamedReading(record, {"x": sp.Symbol("x")})
    >>> read((x + 1) / square_root(x * x + 1)), read.definitions
    ((x + 1)/L_a, [Definition(symbol=L_a, expression=sqrt(x**2 + 1))])
    """

    def __init__(self, record: Record, symbols: dict[str, sp.Symbol]) -> None:
        self.record = record
        self.definitions: list[Definition] = []
        self._closed = ClosedReading(record, symbols)
        self._taken = set(symbols)
        self._raw: dict[int, Any] = {}
        self._fractions: dict[Any, Any] = {}
        self._counts: dict[str, int] = {}
        self._operations = 0

    def __call__(self, value: Any) -> Any:
        """A factored fraction.

        Raises
        ------
        FormulaTooLargeError
            When nobody would print it.
        """
        return self.fraction(self._expression(value))

    def fraction(self, expression: Any) -> Any:
        """An expression in these names as a factored fraction."""
        if expression not in self._fractions:
            fraction = self._without_even_powers(_fraction(expression))
            if int(fraction.count_ops()) > _PRINTED:
                raise FormulaTooLargeError.beyond(_PRINTED)
            self._operations += int(fraction.count_ops())
            if self._operations > _ALL:
                raise FormulaTooLargeError.beyond(_ALL)
            self._fractions[expression] = fraction
        return self._fractions[expression]

    def length(self, value: Any) -> Any:
        """A length, named where it is more than a symbol or a number."""
        value = self.record.simplified(value)
        expression = self(value)
        if not isinstance(value, Entry) or expression.is_Symbol or not expression.free_symbols:
            return expression
        self._raw[value.step] = self.define("L", expression)
        return self._raw[value.step]

    def _without_even_powers(self, fraction: Any) -> Any:
        """The same with squares of named roots in place of their powers, where that is shorter."""
        if int(fraction.count_ops()) <= _LONG:
            return fraction
        best = fraction
        for definition in self.definitions:
            square = definition.expression**2
            above, below = sp.fraction(best)
            if not above.has(definition.symbol) or square.is_Symbol or square.is_number:
                continue
            powers = sp.Poly(sp.expand(above), definition.symbol)
            replaced = sp.Add(
                *(
                    c * square ** (k // 2) * definition.symbol ** (k % 2)
                    for (k,), c in powers.terms()
                )
            )
            other = factored_fraction(replaced / below)
            best = min(best, other, key=lambda e: int(e.count_ops()))
        return best

    def define(self, letter: str, expression: Any, own: str | None = None) -> sp.Symbol:
        """A new name with a number; one and the same for the same expression."""
        for known in self.definitions:
            if known.expression == expression and known.symbol.name.startswith(f"{letter}_"):
                return known.symbol
        is_angle = letter == "theta"
        assumed = {"real": True} if is_angle else {"positive": True}
        symbol = sp.Symbol(own or self._free(letter), **assumed)
        self._taken.add(symbol.name)
        self.definitions.append(Definition(symbol, expression))
        return symbol

    def _expression(self, value: Any) -> Any:
        if not isinstance(value, Entry):
            return self._closed(value)
        for step in self.record.needed([value.step]):
            if step not in self._raw:
                self._raw[step] = self._written(step)
        return self._raw[value.step]

    def _written(self, step: int) -> Any:
        operation = self.record.operations[step][0]
        if operation in (Operation.SINE, Operation.COSINE):
            expression = self._closed.written(step, self._raw)
            if expression.is_Function and not expression.free_symbols:
                # An angle in decimals is a name: its multiples are no shorter numbers.
                return expression.func(self.define("theta", expression.args[0]))
        if operation is not Operation.SQUARE_ROOT:
            expression = self._closed.written(step, self._raw)
            # Cancelled on the way, before it grows.
            if int(expression.count_ops()) <= _LONG_ON_THE_WAY:
                return expression
            return min(expression, _fraction(expression), key=lambda e: int(e.count_ops()))
        simpler = self.record.simplified(Entry(self.record, step))
        if not isinstance(simpler, Entry):
            return self._closed(simpler)
        if simpler.step != step:
            return self._expression(simpler)
        (below,) = self.record.arguments(step)
        radicand = _fraction(self._raw[below])
        above, below = sp.fraction(radicand)
        return self._root(above) / self._root(below)

    def _root(self, radicand: Any) -> Any:
        """A square root: what is a square comes out, the rest has a name."""
        root = sp.sqrt(radicand)
        if not root.free_symbols:
            return root
        outside, inside = [], []
        for factor in cast("tuple[Any, ...]", sp.Mul.make_args(root)):
            is_root = factor.is_Pow and factor.exp == sp.Rational(1, 2) and factor.free_symbols
            is_named = is_root and not factor.base.is_Symbol
            (inside if is_named else outside).append(factor)
        if not inside:
            return root
        plain = sp.Mul(*(factor.base for factor in inside))
        return sp.Mul(*outside) * self.define("L", sp.sqrt(_in_squares(plain)))

    def _free(self, letter: str) -> str:
        number = self._counts.get(letter, 0)
        while f"{letter}_{suffix(number)}" in self._taken:
            number += 1
        self._counts[letter] = number + 1
        return f"{letter}_{suffix(number)}"


def _fraction(expression: Any) -> Any:
    """A factored fraction of an expression that is short enough."""
    if max(bound_of_terms(part, _WRITTEN) for part in sp.fraction(expression)) > _WRITTEN:
        raise FormulaTooLargeError.beyond(_WRITTEN)
    fraction = factored_fraction(expression)
    if int(fraction.count_ops()) > 2 * _PRINTED:
        raise FormulaTooLargeError.beyond(_PRINTED)
    return fraction


def _in_squares(radicand: Any) -> Any:
    """A quadratic form as a sum of squares where that is shorter: (R - r)^2 + h^2."""
    field = ExactField([radicand])
    element = field.element(radicand)
    if element.den != field.one.den:
        return radicand
    squares, rest = completed_squares(field, element.num)
    written = [number * field.polynomial_expression(base) ** 2 for base, number in squares]
    other = sp.Add(*written, field.polynomial_expression(rest))
    turning = sorted(radicand.atoms(sp.sin, sp.cos), key=str)
    apart = sp.collect(radicand, [x**k for x in turning for k in (2, 1)], func=sp.factor)
    return min(radicand, other, apart, key=lambda e: int(e.count_ops()))
