"""Records read with names for lengths: a root, or a length of a part, is a symbol of its own."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, cast

import sympy as sp
from sympy.core.cache import cacheit

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.closed import factored_fraction, fraction_in_factors
from robostiff.analytic.exact.definition import (
    Definition,
    count_of,
    in_given_symbols,
    parts_of,
    symbols_in,
)
from robostiff.analytic.exact.element import root_of
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.exact.factors import (
    bound_of_terms,
    by_powers,
    completed_squares,
    factors_of,
)
from robostiff.analytic.exact.field import ExactField, shared_field
from robostiff.analytic.reading.record_reading import ClosedReading
from robostiff.analytic.reading.rewriting import free_names, shortest_trigonometry
from robostiff.record import Entry, Operation, Record
from robostiff.recorded import entry_reader

# Terms of an entry multiplied out, operations of a fraction that a person would print, and of all.
_WRITTEN = 2000
_PRINTED = 200
_ALL = 1200
# Operations from which shorter forms are looked for.
_LONG = 12
# Letters of lengths, compliances and stiffnesses.
_POSITIVE = ("L", "c", "k")
# Operations of a length that needs no name, such as l/2.
_INLINE = 2


class NamedReading:
    """Writes entries as factored fractions of the inputs, of named roots and of named lengths.

    Roots that have the same values at the samples have one name.

    `symbols`: one for each input; `springs`: what some of them stand for; `definitions`: the
    names, in the order in which they can be computed.
    """

    def __init__(
        self, record: Record, symbols: dict[str, sp.Symbol], springs: Iterable[Definition] = ()
    ) -> None:
        self.record = record
        self.definitions: list[Definition] = list(springs)
        self._closed = ClosedReading(record, dict(symbols))
        self._taken = {*symbols, *(d.symbol.name for d in self.definitions)}
        self._raw: dict[int, Any] = {}
        self._fractions: dict[Any, Any] = {}
        self._operations = 0

    def __call__(self, value: Any) -> Any:
        """A factored fraction.

        Raises
        ------
        FormulaTooLargeError
            When it is too long to be printed.
        """
        return self.fraction(self._expression(value))

    def fraction(self, expression: Any) -> Any:
        """An expression in these names as a factored fraction; a series as it is written."""
        if expression.has(sp.tanh):
            return expression
        if expression not in self._fractions:
            fraction = self._shortest(expression)
            if count_of(fraction) > _PRINTED:
                raise FormulaTooLargeError.beyond(_PRINTED)
            self._operations += count_of(fraction)
            if self._operations > _ALL:
                raise FormulaTooLargeError.beyond(_ALL)
            self._fractions[expression] = fraction
        fraction = self._fractions[expression]
        number, rest = fraction.as_coeff_Mul()
        for d in self.definitions if rest.is_Add else ():
            # A length that is the same sum or difference has a name.
            if d.symbol.is_positive and d.expression in (rest, -rest):
                return number * (d.symbol if d.expression == rest else -d.symbol)
        return fraction

    def length(self, value: Any) -> Any:
        """A length, named where it is more than a symbol or a number."""
        value = self.record.simplify(value)
        expression = self(value)
        # q + 3/50 for (50 q + 3)/50
        expression = min(expression, sp.expand_mul(expression, deep=False), key=count_of)
        symbols = expression.free_symbols
        # A number times a symbol, such as sqrt(2) a, needs no name.
        is_plain = not symbols or expression.as_independent(*symbols, as_Add=False)[1].is_Symbol
        if not isinstance(value, Entry) or is_plain:
            return expression
        self._raw[value.step] = self.define("L", expression)
        return self._raw[value.step]

    def _shortest(self, expression: Any) -> Any:
        """A factored fraction; where it is long, perhaps with squares of named roots put in."""
        fraction = _fraction(expression)
        return fraction if count_of(fraction) <= _LONG else self._by_squares(fraction)

    def _by_squares(self, fraction: Any) -> Any:
        """A fraction, perhaps with squares of named roots, or these for their even powers."""
        squares = {
            d.symbol: d.expression**2
            for d in self.definitions
            if d.symbol in symbols_in(fraction) and not (d.expression**2).is_Atom
        }
        sums = {s: x for s, x in squares.items() if x.is_Add}
        put = {s**n: x ** sp.Rational(n, 2) for s, x in sums.items() for n in (2, -2)}
        other = fraction.xreplace(put)
        best = fraction if other == fraction else min(fraction, _fraction(other), key=count_of)
        for symbol, square in squares.items():
            if symbol in symbols_in(best) and count_of(best) > _LONG:
                best = min(best, _without_powers(best, symbol, square), key=count_of)
        return best

    def quotient(self, above: Any, below: Any) -> Any:
        """A quotient as it stands or cancelled, whichever is shorter."""
        plain = above / below
        found = [plain, self.written_out(plain, count_of(plain))]
        if count_of(plain) <= _LONG:
            found.append(factored_fraction(plain))
        return min(found, key=count_of)

    def written_out(self, expression: Any, most: float) -> Any:
        """One fraction without names of compliances and shifts; itself where that would be long.

        `most`: operations beyond which a fraction is not wanted.
        """
        try:
            plain = self.without_shifts(expression, ("c_", "k_", "e_"))
            _check_terms(plain)
            field = shared_field(plain)
            # Of sines none is known: (cos x - 1) (cos x + 1) may become one.
            if not any(isinstance(x, sp.sin) for x in field.generators):
                element = field.element(plain)
                powers = (*element.num.factor()[1], *element.den.factor()[1])
                if sum(len(base) - 1 for base, _ in powers) > most:
                    return expression  # additions alone are more, without writing any
            return _fraction(plain)
        except FormulaTooLargeError:
            return expression

    def without_shifts(self, expression: Any, letters: tuple[str, ...] = ("e_",)) -> Any:
        """An expression without names that begin with some letters."""
        names = (d for d in self.definitions if d.symbol.name.startswith(letters) and not d.parts)
        return expression.xreplace(in_given_symbols(names))

    def entry(self, letter: str, expression: Any, sample: Any) -> Any:
        """An expression in names as an entry: a new input with a name where it is long."""
        if expression.is_number:
            return expression
        inputs = {self._closed.symbols[name] for name in self.record.inputs}
        if expression.free_symbols <= inputs and count_of(expression) <= _INLINE:
            return entry_reader(self.record, exact=True)(expression)
        symbol = self.define(letter, expression)
        self._closed.symbols[symbol.name] = symbol
        return self.record.add_input(symbol.name, sample)

    def define(self, letter: str, expression: Any) -> sp.Symbol:
        """A new name with a letter; one and the same for the same expression."""
        for known in self.definitions:
            if known.expression == expression and known.symbol.name.startswith(f"{letter}_"):
                return known.symbol
        assumed = {"positive": True} if letter in _POSITIVE else {"real": True}
        taken = self._taken.union(self.record.names.values())
        symbol = sp.Symbol(next(free_names(letter, taken)), **assumed)
        self._taken.add(symbol.name)
        self.definitions.append(Definition(symbol, expression))
        return symbol

    def _expression(self, value: Any) -> Any:
        if not isinstance(value, Entry):
            return self._closed(value)
        for step in self.record.steps_needed([value.step]):
            if step not in self._raw:
                self._raw[step] = self._written(step)
        return self._raw[value.step]

    def _written(self, step: int) -> Any:
        operation = self.record.operations[step]
        if operation is Operation.NEGATE:
            return -self._raw[self.record.arguments(step)[0]]
        if operation in (Operation.SINE, Operation.COSINE):
            expression = self._closed.written(step, self._raw)
            for turning in expression.atoms(sp.sin, sp.cos):
                if not turning.free_symbols:
                    # An angle in decimals is a name: its multiples are no shorter numbers.
                    named = turning.func(self.define("theta", turning.args[0]))
                    expression = expression.xreplace({turning: named})
            # The sine of an arc cosine is a root.
            for root in [x for x in expression.atoms(sp.Pow) if abs(x.exp) == sp.Rational(1, 2)]:
                if root.free_symbols:
                    named = self._root_of_fraction(root.base)
                    expression = expression.xreplace({root: named ** sp.sign(root.exp)})
            return expression
        if operation is not Operation.SQUARE_ROOT:
            expression = self._closed.written(step, self._raw)
            is_long = count_of(expression) > _LONG  # it is cancelled before it grows
            others = [self._shortest(expression)] if is_long else []
            return min([expression, *others], key=count_of)
        simpler = self.record.simplify(Entry(self.record, step))
        if not isinstance(simpler, Entry):
            return self._closed(simpler)
        if simpler.step != step:
            return self._expression(simpler)
        (radicand,) = self.record.arguments(step)
        return self._root_of_fraction(self._raw[radicand])

    def _root_of_fraction(self, radicand: Any) -> Any:
        """A square root of what is not negative."""
        above, below = sp.fraction(self._by_squares(_fraction(radicand)))
        if below.has(sp.Add):
            symbols = self._closed.symbols
            at = {symbols[name]: self.record.input(name).sample[0] for name in self.record.inputs}
            if values_of([below], at, self.definitions)[0] < 0:
                above, below = sp.expand(-above), sp.expand(-below)
        return self._root(above) / self._root(below)

    def _root(self, radicand: Any) -> Any:
        """A square root: what is a square comes out, the rest has a name."""
        factors = cast("tuple[Any, ...]", sp.Mul.make_args(radicand))
        sums, others = ([x for x in factors if x.is_Add is is_sum] for is_sum in (True, False))
        if sums and all(x.is_Rational or x.as_base_exp()[0].is_positive for x in others):
            # Of sums, SymPy would look for the sign.
            number = sp.Mul(*others)
            if number.could_extract_minus_sign():
                number, sums = -number, [sp.Integer(-1), *sums]
            return sp.sqrt(number) * self.define("L", root_of(_in_squares(sp.Mul(*sums))))
        root = root_of(radicand)
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
        return sp.Mul(*outside) * self.define("L", root_of(_in_squares(plain)))


@cacheit
def _fraction(expression: Any) -> Any:
    """A factored fraction of an expression that is short enough."""
    _check_terms(expression)
    fraction = factored_fraction(expression)
    # -sin^2 x in place of (cos x - 1) (cos x + 1)
    for turn in (x for x in parts_of(fraction) if isinstance(x, sp.cos)):
        powers = fraction.as_powers_dict()
        each = [powers.get(turn + x, 0) for x in (-1, 1)]
        if each[0] * each[1] > 0:
            k = min(each, key=abs)
            fraction *= ((-(sp.sin(turn.args[0]) ** 2)) / ((turn - 1) * (turn + 1))) ** k
    if count_of(fraction) > 2 * _PRINTED:
        raise FormulaTooLargeError.beyond(_PRINTED)
    return fraction


def _check_terms(expression: Any) -> None:
    """Raise where an expression has too many terms when it is multiplied out."""
    if bound_of_terms(expression, _WRITTEN) > _WRITTEN and any(
        bound_of_terms(part, _WRITTEN) > _WRITTEN for part in sp.fraction(expression)
    ):
        raise FormulaTooLargeError.beyond(_WRITTEN)


def _without_powers(fraction: Any, symbol: Any, square: Any) -> Any:
    """A fraction with a square in place of the even powers of a symbol above the fraction bar."""
    field = shared_field(fraction, square)
    element, by = field.element(fraction), field.element(square)
    if symbol not in field.generators:
        return fraction
    x, total = field.element(symbol), field.zero
    parts = by_powers(element.num, [field.generators.index(symbol)])
    if max(parts) < (2,):
        return fraction
    for (power,), part in parts.items():
        total = total + field.fraction(part, element.den) * by ** (power // 2) * x ** (power % 2)
    return fraction_in_factors(field, total)


def _in_squares(radicand: Any) -> Any:
    """A quadratic form as a sum of squares where that is shorter: (R - r)^2 + h^2."""
    field = shared_field(radicand)
    element = field.element(radicand)
    if element.den != field.one.den:
        return radicand
    squares, rest = completed_squares(field, element.num)
    written = [number * field.polynomial_expression(base) ** 2 for base, number in squares]
    other = sp.Add(*written, field.polynomial_expression(rest))
    turning = sorted((x for x in parts_of(radicand) if isinstance(x, sp.sin | sp.cos)), key=str)
    found = [radicand, other]
    if turning:
        # What stands before each product of sines and cosines in factors.
        by_angles = sp.expand_mul(shortest_trigonometry(radicand), deep=False)
        names = {x: sp.Dummy(str(x)) for x in turning}
        plain = radicand.xreplace(names)
        field = ExactField([plain])
        num = field.element(plain).num
        parts = by_powers(num, [field.generators.index(name) for name in names.values()])
        factors = {powers: map(sp.Pow, turning, powers) for powers in parts}
        found += [
            sp.Add(
                *(sp.Mul(factors_of(field, x), *factors[powers]) for powers, x in parts.items())
            ),
            by_angles,
        ]
    # A product under a root is one of roots.
    return min(found, key=lambda x: 2 + count_of(x) if x.is_Add else count_of(root_of(x)))
