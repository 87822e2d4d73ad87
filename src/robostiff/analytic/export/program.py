"""A derivation as a program: assignments in order, and denominators that must not vanish."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import count
from typing import Any

import sympy as sp
from sympy.simplify.cse_main import tree_cse

from robostiff.analytic.derivation import Formula
from robostiff.analytic.exact.definition import Definition, count_of, used_definitions
from robostiff.analytic.export.nomenclature import in_programs
from robostiff.analytic.reading.combinations import name_combinations
from robostiff.analytic.reading.rewriting import in_order
from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen

#: Products of numbers with more digits exceed the range of doubles. Exact arithmetic on decimals
#: leaves sums (a x + b y) / (c x + d y) of such numbers, though the quotient is of usual size.
#: A power of ten near its largest number stands before a sum, and cancels where sums divide.
LARGE = sp.Integer(10) ** 50


def scale(expression: Any, scales: Mapping[Any, Any]) -> tuple[Any, Any]:
    """A power of ten and an expression of usual size, whose product is an expression.

    Symbols are to be multiplied by ten to the power of their `scales`, if they have one.
    """
    if expression.is_Rational:
        power = sp.S.Zero
        if expression and not 1 / LARGE <= abs(expression) <= LARGE:
            bits = int(abs(expression.p)).bit_length() - int(expression.q).bit_length()
            power = sp.Integer(2 * (3 * bits // 20))  # even; a bit is 3/10 of a digit
        return power, expression / sp.Integer(10) ** power
    if not expression.args:
        return scales.get(expression, 0), expression
    parts = [scale(part, scales) for part in expression.args]
    if expression.is_Mul:
        return sum(power for power, _ in parts), sp.Mul(*(rest for _, rest in parts))
    if expression.is_Add:
        most = max(power for power, _ in parts)
        return most, sp.Add(*(_product(power - most, rest) for power, rest in parts))
    if expression.is_Pow and expression.exp.is_Rational:
        (power, base), exponent = parts[0], expression.exp
        inside = power % exponent.q  # a root of it is no power of ten
        return (power - inside) * exponent, _product(inside, base) ** exponent
    return 0, expression.func(*(_product(*part) for part in parts))


def _product(power: Any, rest: Any) -> Any:
    return rest if power == 0 else sp.Integer(10) ** power * rest


#: Smallest ratio of a denominator to its terms: below it, the digits of K are lost.
SAFE = 1e-6
#: The same for a radicand in a denominator.
SAFE_UNDER_ROOT = 1e-12


@frozen
class Guard:
    """A sum that must not cancel: |sum of terms| > part * sum of |terms|."""

    value: Any  # the sum, or the symbol to which it is assigned
    terms: tuple[Any, ...]
    part: float


def _sums(
    below: Any, value: Any, assigned: Mapping[Any, Any], positive: set[Any], part: float
) -> Iterator[Guard]:
    """The sums among the factors of a denominator, through roots and names."""
    if below in assigned:
        yield from _sums(assigned[below], below, assigned, positive, part)
    elif below.is_Add:
        if not _is_nonnegative(below, positive):
            yield Guard(value, below.args, part)
    elif below.is_Mul:
        for factor in below.args:
            yield from _sums(factor, factor, assigned, positive, part)
    elif below.is_Pow:
        under = SAFE_UNDER_ROOT if not below.exp.is_Integer else part
        yield from _sums(below.base, below.base, assigned, positive, under)


def _is_nonnegative(expression: Any, positive: set[Any]) -> bool:
    """Whether the form of an expression excludes negative values."""
    if expression in positive or expression.is_nonnegative:
        return True
    if expression.is_Add or expression.is_Mul:
        return all(_is_nonnegative(part, positive) for part in expression.args)
    if expression.is_Pow:
        exponent = expression.exp
        is_even = exponent.is_Integer and int(exponent) % 2 == 0
        is_root = exponent.is_Rational and exponent.q % 2 == 0
        return is_even or is_root or _is_nonnegative(expression.base, positive)
    return False


@frozen
class FormulaProgram:
    """Assignments, guards and conditions that compute a stiffness matrix."""

    arguments: tuple[sp.Symbol, ...]  # the given symbols, in alphabetical order
    assignments: tuple[Definition, ...]  # what the result needs, in order
    # K (n x n), and dK where there is a derivative, in arguments and assigned symbols
    results: tuple[sp.ImmutableMatrix, ...]
    # what must hold besides, such as the signs of arguments that were assumed: in words, and an
    # expression that is > 0 or >= 0 where it does
    conditions: tuple[tuple[str, Any, str], ...] = ()
    meanings: Mapping[str, str] = field(default_factory=dict)  # of arguments, by their names

    @property
    def operations(self) -> int:
        """How many it takes."""
        entries = dict.fromkeys(entry for matrix in self.results for entry in matrix.flat())
        return sum(map(count_of, (*(a.expression for a in self.assignments), *entries)))

    @property
    def guards(self) -> tuple[Guard, ...]:
        """The sums by which the program divides, and that can cancel."""
        assigned, positive = {a.symbol: a.expression for a in self.assignments}, set[Any]()
        for symbol, expression in assigned.items():
            if _is_nonnegative(expression, positive):
                positive.add(symbol)
        found: dict[Any, Guard] = {}
        entries = (entry for matrix in self.results for entry in matrix.flat())
        for expression in (*assigned.values(), *entries):
            part: Any
            for part in sp.preorder_traversal(expression):
                if part.is_Pow and part.exp.could_extract_minus_sign():
                    for guard in _sums(part.base, part.base, assigned, positive, SAFE):
                        found.setdefault(guard.value, guard)
        return tuple(found.values())


def program(derivation: Formula, *, plain: bool = False) -> FormulaProgram:
    """Put a derivation, or its derivative with it, in the order of computation.

    A robot in named steps is computed by its vectors, where these take fewer operations. A `plain`
    program shares equal subexpressions alone: it is found quickly, and less readable.

    Raises
    ------
    InputError
        When two symbols have the same name.
    """
    matrices, definitions = derivation.as_printed
    matrix = sp.ImmutableMatrix.vstack(*matrices)
    if plain:
        return _in_order(derivation, matrix, definitions, tree_cse)
    if not definitions:
        named = name_combinations(matrix, (symbol.name for symbol in derivation.symbols))
        matrix, definitions = named.matrix, named.definitions
    found = _in_order(derivation, matrix, definitions, sp.cse)
    form = None if derivation.is_closed else derivation.at_vector_level
    if form is None or derivation.steps_asked:
        return found
    known = {*derivation.symbols, *(d.symbol for d in form.definitions)}
    if any(d.expression.free_symbols - known for d in form.definitions):
        return found  # vectors with a coordinate on which K does not depend
    in_vectors = _in_order(derivation, form.K, form.definitions, sp.cse)
    return min(found, in_vectors, key=lambda steps: steps.operations)


def _in_order(
    derivation: Formula, matrix: Any, definitions: tuple[Definition, ...], share: Callable[..., Any]
) -> FormulaProgram:
    conditions = in_programs(derivation)
    arguments = derivation.symbols
    defined = [d.symbol for d in definitions]
    names = [symbol.name for symbol in (*arguments, *defined)]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                "symbols", got=Words(f"two called {name!r}"), expected="one of each name"
            )
    expressions = [
        *(d.expression for d in definitions),
        *matrix.flat(),
        *(expression for _, expression in conditions),
    ]

    def unused() -> Iterator[sp.Symbol]:
        return (sp.Symbol(x) for i in count(1) if (x := f"t{i}") not in names)

    shared, reduced = share(expressions, symbols=unused())
    # A shared subexpression that is a definition has the name of that.
    same: dict[Any, Any] = {}
    values = dict(shared)
    for symbol, expression in zip(defined, reduced, strict=False):
        if expression in values:
            same.setdefault(expression, symbol)
    assigned: dict[Any, Any] = {same.get(x, x): value.xreplace(same) for x, value in values.items()}
    for symbol, expression in zip(defined, reduced, strict=False):
        assigned.setdefault(symbol, expression.xreplace(same))
    results: list[Any] = [x.xreplace(same) for x in reduced[len(defined) :]]
    every = [Definition(x, assigned[x]) for x in dict.fromkeys((*defined, *assigned))]
    placed = used_definitions([*in_order(every)], results)
    temporary = [d.symbol for d in placed if d.symbol not in defined]
    put: dict[Any, Any] = dict(zip(temporary, unused(), strict=False))
    steps = [
        Definition(put.get(d.symbol, d.symbol), assigned[d.symbol].xreplace(put)) for d in placed
    ]
    results = [x.xreplace(put) for x in results]
    numbers = (x for e in (*(d.expression for d in steps), *results) for x in e.atoms(sp.Rational))
    if any(abs(x.p) > LARGE or x.q > LARGE for x in numbers):  # beyond the range of doubles
        scales: dict[Any, Any] = {}
        for i, d in enumerate(steps):
            scales[d.symbol], rest = scale(d.expression, scales)
            steps[i] = Definition(d.symbol, rest)
        results = [_product(*scale(result, scales)) for result in results]
    n = matrix.cols
    written: Any = sp.ImmutableMatrix(matrix.rows, n, results[: matrix.rows * n])
    beside = zip(conditions, results[matrix.rows * n :], strict=True)
    # Arguments have the signs of their symbols: sqrt(k**2) was written as k.
    signs: list[tuple[str, Any, str]] = []
    for sign, words in ((1, "positive"), (-1, "negative")):
        symbols = [x for x in arguments if (sign * x).is_nonnegative]
        listed, verb = ", ".join(x.name for x in symbols), "are" if len(symbols) > 1 else "is"
        signs += ((f"{listed} {verb} {words} or zero", sign * x, ">=") for x in symbols)
    return FormulaProgram(
        arguments,
        tuple(steps),
        tuple(written[i : i + n, :] for i in range(0, matrix.rows, n)),
        (*signs, *((words, x, ">") for (words, _), x in beside)),
        derivation.meanings,
    )
