"""Steps of a record at random rational points, in ball arithmetic with some ninety digits.

An identity of formulas, such as an entry that is zero everywhere, is decided at points that no
simple relation singles out, and by enclosures instead of floats: two formulas that agree at all of
them to 40 digits are one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from functools import reduce
from operator import add, mul
from typing import Any, cast

import flint
import numpy as np
import sympy as sp

from robostiff.analytic.budget import spend
from robostiff.analytic.exact.definition import Definition
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.record import OPERATORS, Operation, Record

_DIGITS = 40
_ACCURATE = 140  # bits of a ball that are compared
_NOTHING = 1e-40  # size of a ball around zero that is zero, and relative difference of equal values
_POINTS = 2
_SHORT = 8  # characters of a number that was meant as it is written
_LARGEST_PART, _ROUNDING = 1000, 4e-15  # of a fraction that a float is, but for its last digits
_LARGEST = 4  # of the whole numbers and halves that stand for themselves

_FUNCTIONS: dict[Operation, Any] = {
    **OPERATORS,
    Operation.SQUARE_ROOT: flint.arb.sqrt,
    Operation.SINE: flint.arb.sin,
    Operation.COSINE: flint.arb.cos,
    Operation.ARC_COSINE: flint.arb.acos,
    Operation.ARC_TANGENT: flint.arb.atan2,
    Operation.HYPERBOLIC_TANGENT: flint.arb.tanh,
}


@frozen
class Same:
    """What a step equals at all points."""

    step: int | None  # the first step with the same value up to a sign; None for a number
    factor: Any  # the sign, or the number


class ExactPoints:
    """Values of the steps of a record at the first of its samples, which are taken as exact."""

    def __init__(self, record: Record) -> None:
        self.record = record
        self.count: int = min(_POINTS, record.count)
        self._known: dict[int, tuple[Any, ...]] = {}

    def values(self, step: int) -> tuple[Any, ...]:
        """Balls that contain the values of a step, one a point."""
        if step not in self._known:
            # Steps that are asked for in order have what they work on.
            record = self.record
            is_next = all(argument in self._known for argument in record.arguments(step))
            with flint.ctx.workprec(BITS):
                for needed in (step,) if is_next else record.steps_needed([step]):
                    if needed not in self._known:
                        self._known[needed] = self._computed(needed)
        return self._known[step]

    def same(self, steps: Iterable[int]) -> dict[int, Same]:
        """What each of some steps, in order, equals at all points: a number, or an earlier one.

        At one point nothing is known.
        """
        if self.record.inputs and self.count < _POINTS:
            return {step: Same(step, sp.Integer(1)) for step in steps}
        first: dict[Any, int] = {}
        found = {}
        for step in steps:
            values = self.values(step)
            negative, key = bool(values[0] < 0), None
            with flint.ctx.workprec(BITS):
                # Products of small lengths may be as small, but their balls do not contain zero.
                zero = [0 in x and abs(x) < _NOTHING for x in values]
                halves = (0 if zero[i] else (2 * x).unique_fmpz() for i, x in enumerate(values))
                twice, *others = dict.fromkeys(halves)
                if all(x.is_finite() and x.rel_accuracy_bits() >= _ACCURATE for x in values):
                    sized = (-x if negative else x for x in values)
                    key = tuple(x.str(_DIGITS, radius=False) for x in sized)
            is_other = others or self.record.operations[step] is Operation.INPUT
            if not is_other and twice is not None and abs(int(twice)) <= 2 * _LARGEST:
                found[step] = Same(None, sp.Rational(int(twice), 2))
                continue
            earlier = step if key is None else first.setdefault(key, step)
            sign = bool(self.values(earlier)[0] < 0) == negative
            found[step] = Same(earlier, sp.Integer(1 if sign else -1))
        return found

    def are_equal(self, step: int, factors: tuple[int, int], sign: int) -> bool:
        """Whether a step is a product of two others, or its negative."""
        with flint.ctx.workprec(BITS):
            return all(
                bool(abs(ball - sign * a * b) <= _NOTHING * abs(ball))
                for ball, a, b in zip(*map(self.values, (step, *factors)), strict=True)
            )

    def _computed(self, step: int) -> tuple[Any, ...]:
        spend()
        operation, a, _ = self.record.operation(step)
        if operation is Operation.INPUT:
            sample = self.record.input(a).sample
            ratios = [float(x).as_integer_ratio() for x in sample[: self.count]]
            return tuple(flint.arb(flint.fmpq(*ratio)) for ratio in ratios)
        if operation is Operation.NUMBER:
            return tuple(balls_of([exact(a)], {})) * self.count
        arguments = self.record.arguments(step)
        if operation in (Operation.LEAST, Operation.GREATER):
            is_greater = chooses_greater(self.record, step)
            if operation is Operation.GREATER:
                return (flint.arb(int(is_greater)),) * self.count
            return self._known[arguments[1] if is_greater else arguments[0]]
        balls = zip(*(self._known[argument] for argument in arguments), strict=True)
        return tuple(_FUNCTIONS[operation](*known) for known in balls)


def chooses_greater(record: Record, step: int) -> bool:
    """The branch of a formula: that of the samples, which lie around the nominal values."""
    a, b = map(record.sample, record.arguments(step))
    return bool(np.mean(a - b) > 0)


def exact(number: Any) -> sp.Expr:
    """A number of SymPy; a float as the decimal that it prints as, or the short fraction it is."""
    if isinstance(number, float | sp.Float):
        number = float(number)
        if len(repr(number)) <= _SHORT:
            return sp.Rational(repr(number))  # others may be near a short fraction
        ratio = Fraction(number).limit_denominator(_LARGEST_PART)
        if 0 < abs(ratio) < _LARGEST_PART and abs(number / ratio - 1) < _ROUNDING:
            return sp.Rational(ratio.numerator, ratio.denominator)
        return sp.Rational(f"{number:.15g}")
    written = sp.sympify(number)
    is_exact = written.is_Rational or not written.has(sp.Float)
    return written if is_exact else sp.nsimplify(written, rational=True)


#: Precision of balls, some ninety digits.
BITS = 300


def values_of(
    expressions: Iterable[Any],
    values: Mapping[Any, Any],
    definitions: Iterable[Definition] = (),
    *,
    careful: bool = False,
) -> list[Any]:
    """Values of expressions, of definitions one after the other; not a number where there is none.

    `values`: mapping of symbols to floats, or to arrays of them; `definitions`: steps that the
    expressions need, in order; `careful`: by balls of `BITS`, for numbers only; this avoids
    cancellation in floats.
    """
    if careful:
        with flint.ctx.workprec(BITS):
            return [float(x) for x in balls_of(expressions, values, definitions)]
    known: dict[Any, Any] = {
        symbol: value if isinstance(value, np.ndarray) else float(value)
        for symbol, value in values.items()
    }
    with np.errstate(all="ignore"):
        return _values(expressions, known, definitions, float, _in_floats)


def balls_of(
    expressions: Iterable[Any], values: Mapping[Any, Any], definitions: Iterable[Definition] = ()
) -> list[Any]:
    """Values as balls of FLINT that contain them, at its precision; given values are exact."""
    known = {symbol: _ball(value) for symbol, value in values.items()}
    return _values(expressions, known, definitions, _ball, _in_balls)


def matrix_value(
    K: Any, values: Mapping[Any, Any], definitions: Iterable[Definition], *, careful: bool = False
) -> np.ndarray:
    """A symmetric matrix of formulas as numbers (..., n, n), see `values_of`."""
    n, entries = K.rows, K.flat()
    places = [(i, j) for i in range(n) for j in range(i, n)]
    upper = [entries[i * n + j] for i, j in places]
    found = values_of(upper, values, definitions, careful=careful)
    matrix = np.zeros((*np.broadcast_shapes(*map(np.shape, values.values())), n, n))
    for (i, j), value in zip(places, found, strict=True):
        matrix[..., i, j] = matrix[..., j, i] = value
    return matrix


def _values(
    expressions: Iterable[Any],
    known: dict[Any, Any],
    definitions: Iterable[Definition],
    number: Callable[[Any], Any],
    compute: Callable[[Any, list[Any]], Any],
) -> list[Any]:
    def value_of(expression: Any) -> Any:
        found = known.get(expression)
        if found is not None:
            return found
        if expression.is_Number or not expression.args:
            if expression.is_Symbol:
                raise InputError("values of symbols", got=Words(f"none for {expression}"))
            value = number(expression)
        else:
            arguments = [value_of(part) for part in expression.args]
            if expression.is_Add or expression.is_Mul:
                value = reduce(add if expression.is_Add else mul, arguments)
            else:
                value = compute(expression, arguments)
        known[expression] = value
        return value

    for definition in definitions:
        known[definition.symbol] = value_of(definition.expression)
    return [value_of(expression) for expression in expressions]


def _in_floats(expression: Any, arguments: list[Any]) -> Any:
    if expression.is_Pow:
        base, exponent = np.asarray(arguments[0], dtype=float), expression.exp
        if exponent == sp.Rational(1, 2):
            return np.sqrt(base)[()]
        return np.power(base, arguments[1])[()]
    function = getattr(np, type(expression).__name__.lower(), None)
    if function is None:
        raise InputError("formula", got=str(expression), expected="functions that have a value")
    return function(*arguments)


def _ball(number: Any) -> Any:
    if number is sp.pi:
        return flint.arb.pi()
    known = sp.sympify(number)
    if not known.is_Number:  # such as E
        known = sp.N(known, BITS)
    exact = cast("sp.Rational", sp.Rational(known))  # finite
    return flint.arb(flint.fmpq(int(exact.p), int(exact.q)))


def _in_balls(expression: Any, arguments: list[Any]) -> Any:
    if expression.is_Pow:
        base, exponent = arguments[0], expression.exp
        if exponent.is_Rational and exponent.q == 2:
            return base.sqrt() ** int(exponent.p)
        return base ** int(exponent) if exponent.is_Integer else base ** arguments[1]
    name = type(expression).__name__
    return abs(*arguments) if name == "Abs" else getattr(flint.arb, name)(*arguments)
