"""Formulas in names, and names written out where that is shorter or takes fewer lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import combinations
from typing import Any

import sympy as sp
from sympy.core.cache import cacheit

from robostiff.analytic.budget import spend
from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.exact.element import made_of
from robostiff.analytic.exact.operation_count import count_of, operations_in, parts_of, symbols_in
from robostiff.analytic.reading.combinations import free_names

LINES = 10  # lines that are read at a glance
_A_LINE = 4  # operations that a line beyond these costs: its name, and a look back at it
_WIDTH = 4  # ways of as many lines that are followed
_A_NAME = 1  # operations that a name for a difference saves at least, besides its own
_LETTERS = ("c", "d", "e", "k", "p", "s")  # of names that count
_LONGEST_SUM = 60  # operations of a sum in which two symbols may stand as their difference


@dataclass(frozen=True)
class Written:
    """Expressions in names, and what the names stand for."""

    results: tuple[Any, ...]  # what is counted, and printed one a line
    definitions: tuple[Definition, ...]
    # Gives what is written in the same names, and not counted.
    others: Callable[[], tuple[tuple[Any, ...], ...]] = field(default=tuple, compare=False)

    @cached_property
    def operations(self) -> int:
        """Of all results and formulas of names."""
        return sum(map(operations_in, (*self.results, *(d.expression for d in self.definitions))))

    @property
    def lines(self) -> int:
        """Results, and names that are formulas."""
        return len(self.results) + sum(bool(symbols_in(d.expression)) for d in self.definitions)

    def length(self, a_line: int) -> int:
        """Operations, and those that each line beyond ten is worth."""
        return self.operations + a_line * max(0, self.lines - LINES)


def without_idle_names(written: Written) -> Written:
    """The same without names of lengths and shifts that make nothing shorter."""
    while True:
        found = [
            one
            for d in written.definitions
            if d.symbol.name.startswith(("L_", "d_", "e_"))
            for one in _without(written, d, ())
        ]
        shortest = min(found, key=lambda one: one.operations, default=None)
        if shortest is None or shortest.operations > written.operations:
            return written
        written = shortest


def in_few_lines(
    written: Written, taken: Iterable[str], are_one: Callable[[Written, Any], bool]
) -> Written:
    """The same in fewer lines, down to ten, where a name written out costs less than a line.

    Where x^2 + y^2 = 1, even powers of x become those of y; a root that occurs in even powers
    alone is replaced by its square.

    `taken`: names that stand for something else; `are_one`: of these formulas and an expression
    in their names: whether it is one, always.

    Examples
    --------
    >>> R, r, h, c = sp.symbols("R r h c")
    >>> d, L, u = sp.symbols("d_a L_a u_x")
    >>> names = Definition(d, R - r), Definition(L, sp.sqrt(d**2 + h**2)), Definition(u, d / L)
    >>> eight = tuple(sp.Symbol(f"K{i}") * u / c for i in range(8))
    >>> found = in_few_lines(Written(eight, names), {"c"}, lambda written, expression: False)
    >>> [(str(d.symbol), d.expression) for d in found.definitions]
    [('d_a', R - r), ('u_x', d_a/sqrt(d_a**2 + h**2))]
    """
    if written.lines <= LINES:
        return written
    kept = sum(bool(symbols_in(d.expression)) for d in written.definitions if _is_kept(d))
    may_fit = len(written.results) + kept <= LINES  # only then squares are worth their names
    names = [d.symbol for d in written.definitions if d.symbol.is_positive is None]
    units = [(a, b) for a, b in combinations(names, 2) if are_one(written, a**2 + b**2)]
    units += [(b, a) for a, b in units]
    states, best = [written], written
    while states and states[0].lines > LINES:
        found: dict[Any, Written] = {}
        for own in states:
            for d in own.definitions:
                for one in (*_without(own, d, units), *_by_ratios(own, d)):
                    shorter = _with_needed_names(one)
                    key = frozenset(x.symbol for x in shorter.definitions)
                    found.setdefault((key, shorter.operations), shorter)
        after: dict[Any, Written] = {}
        for one in found.values():
            shorter = _with_squares(one, {*taken}) if may_fit else one
            key = frozenset(d.symbol for d in shorter.definitions)
            if key not in after or shorter.operations < after[key].operations:
                after[key] = shorter
        states = sorted(after.values(), key=lambda own: own.operations)[:_WIDTH]
        best = min([*states, best], key=lambda own: own.length(_A_LINE))
    return best


def with_differences(written: Written, taken: Iterable[str]) -> Written:
    """The same with a name for a difference of two symbols that stand nowhere else in long sums.

    Examples
    --------
    >>> R, r, l = sp.symbols("R r l")
    >>> K = R**2 - 2 * R * r + r**2 - l**2, (R - r - l) * (R - r + l)
    >>> found = with_differences(Written(K, ()), {"R", "r", "l"})
    >>> found.definitions[0].symbol, found.definitions[0].expression, found.results
    (d_a, R - r, (d_a**2 - l**2, (d_a - l)*(d_a + l)))
    """
    names = {d.symbol for d in written.definitions}
    formulas = (*written.results, *(d.expression for d in written.definitions))
    pairs: Counter[tuple[Any, Any]] = Counter()
    for total in (x for formula in formulas for x in parts_of(formula) if x.is_Add):
        plain = sorted((x for x in total.args if x.is_Symbol and x not in names), key=str)
        minus = sorted((-x for x in total.args if (-x).is_Symbol and -x not in names), key=str)
        pairs.update((a, b) for a in plain for b in minus)
    used = {*taken, *(x.name for x in names)}
    for (a, b), times in pairs.most_common():
        if times < max(2, pairs[b, a]) or written.lines >= LINES:
            continue
        own = Definition(sp.Symbol(next(free_names("d", used)), real=True), a - b)
        found = changed(written, lambda x, own=own, a=a, b=b: _by_difference(x, own, a, b), a)
        found = replace(found, definitions=(own, *found.definitions))
        if found.operations + _A_NAME < written.operations:
            used.add(own.symbol.name)
            written = found
    return written


@cacheit
def _by_difference(expression: Any, difference: Definition, a: Any, b: Any) -> Any:
    """An expression with the difference in its sums, where that leaves less of them."""
    if not expression.args or not {a, b} <= symbols_in(expression):
        return expression
    parts = tuple(_by_difference(part, difference, a, b) for part in expression.args)
    if parts != expression.args:
        expression = made_of(expression, parts)
    if not (expression.is_Add and {a, b} <= symbols_in(expression)):
        return expression
    if count_of(expression) > _LONGEST_SUM:
        return expression
    other = expression.xreplace({a: difference.symbol + b})
    if any(x.is_Add for x in parts_of(other) - {other}):
        other = sp.expand(other)
    return other if count_of(other) < count_of(expression) else expression


def with_shared_sums(written: Written) -> Written:
    """The same with named sums, and squares of named roots, in other sums.

    Examples
    --------
    >>> R, r, h, a, b = sp.symbols("R r h L_a L_b")
    >>> short = R**2 - R * r + r**2
    >>> names = Definition(a, sp.sqrt(short + h**2)), Definition(b, sp.sqrt(short))
    >>> [str(d.expression) for d in with_shared_sums(Written((h * a / b,), names)).definitions]
    ['sqrt(R**2 - R*r + r**2)', 'sqrt(L_b**2 + h**2)']
    """
    for root in written.definitions:
        total, name = root.expression, root.symbol
        if not total.is_Add:
            total, name = total**2, name**2
        if not (total.is_Add and symbols_in(total)):
            continue
        needed = needed_for(root.symbol, written.definitions)
        own = [d for d in written.definitions if d.symbol in needed]
        others = tuple(d for d in written.definitions if d.symbol not in needed)

        def put(x: Any, terms: Any = frozenset(total.args), name: Any = name) -> Any:
            return _with_sum(x, terms, name)

        some = min(symbols_in(total), key=str)
        found = changed(replace(written, definitions=others), put, some)
        ordered = replace(found, definitions=tuple(in_order([*own, *found.definitions])))
        written = min(written, ordered, key=lambda x: x.operations)
    return written


def _with_sum(expression: Any, terms: frozenset[Any], name: Any) -> Any:
    parts = tuple(_with_sum(part, terms, name) for part in expression.args)
    if parts != expression.args:
        expression = made_of(expression, parts)
    if expression.is_Add and terms <= {*expression.args}:
        return name + sp.Add(*(x for x in expression.args if x not in terms))
    return expression


def _is_kept(definition: Definition) -> bool:
    return definition.symbol.name.startswith(("c_", "k_", "EA", "EI", "GJ", "theta"))


def _without(
    written: Written, definition: Definition, units: Sequence[tuple[Any, Any]]
) -> Iterator[Written]:
    """The same with a name written out, also by another where the sum of both squares is one."""
    expression: Any = definition.expression
    if not symbols_in(expression) or _is_kept(definition):
        return
    symbol = definition.symbol
    others = tuple(d for d in written.definitions if d is not definition)
    left = replace(written, definitions=others)
    yield changed(left, lambda x: _written_out(x, symbol, expression), symbol)
    for other in (b for a, b in units if a == symbol):
        needed = needed_for(other, written.definitions)
        if symbol in needed or len(needed) == 1:
            continue  # computed by it, or no longer there
        rest = 1 - other**2

        found = changed(left, lambda x, rest=rest: _in_squares(x, symbol, rest, expression), symbol)
        ordered = tuple(in_order(found.definitions))
        yield replace(found, definitions=ordered)


@cacheit
def _written_out(formula: Any, symbol: Any, expression: Any) -> Any:
    if symbol not in symbols_in(formula):
        return formula
    if formula == symbol:
        return expression
    if formula.is_Pow and formula.base == symbol and expression.is_Pow:
        power = formula.exp * expression.exp
        if power.is_Integer:
            return expression.base**power
    return made_of(formula, [_written_out(x, symbol, expression) for x in formula.args])


def _by_ratios(written: Written, definition: Definition) -> Iterator[Written]:
    """The same with a length as a ratio times what it is divided by there: L = u l."""
    length = definition.symbol
    for ratio in () if definition.parts else written.definitions:  # a modulus is no length
        if not (ratio.expression.is_Mul and length in ratio.expression.args):
            continue
        below = length / ratio.expression
        if any(length in needed_for(x, written.definitions) for x in symbols_in(below)):
            continue
        own = Definition(ratio.symbol, definition.expression / below)
        left = tuple(x for x in written.definitions if x not in (definition, ratio))
        put = {length: ratio.symbol * below}
        found = changed(
            replace(written, definitions=left),
            lambda x, put=put: sp.factor_terms(x.xreplace(put)),
            length,
        )
        yield replace(found, definitions=tuple(in_order([own, *found.definitions])))


def needed_for(symbol: Any, definitions: Sequence[Definition]) -> set[Any]:
    """All symbols by which a name is computed."""
    found = {symbol}
    for d in reversed(definitions):
        if d.symbol in found:
            found |= symbols_in(d.expression)
    return found


def _with_needed_names(written: Written) -> Written:
    """The same without names that are in no result and no other name."""
    for d in reversed(written.definitions):
        others = tuple(own for own in written.definitions if own is not d)
        formulas = (*written.results, *(own.expression for own in others))
        if not _is_kept(d) and not any(d.symbol in symbols_in(x) for x in formulas):
            left = replace(written, definitions=others)
            written = changed(
                left, lambda x, d=d: _written_out(x, d.symbol, d.expression), d.symbol
            )
    return written


def _with_squares(written: Written, taken: set[str]) -> Written:
    """The same with squares in place of names that occur squared, where that is shorter."""
    for symbol in [d.symbol for d in written.definitions]:
        d = next(d for d in written.definitions if d.symbol == symbol)
        if symbol.name.startswith("L_") or not symbols_in(d.expression) or _is_kept(d):
            continue
        formulas = (*written.results, *(own.expression for own in written.definitions))
        if not any(symbol in _squared_in(x) for x in formulas):
            continue  # its square would be a name more
        used = taken | {own.symbol.name for own in written.definitions}
        name = next(free_names("p", used))
        square = Definition(sp.Symbol(name, positive=True), d.expression**2)
        is_root = square.expression.is_Add
        once = sp.sqrt(square.symbol) if is_root else d.expression

        def put(x: Any, by: Any = (symbol, square.symbol, once)) -> Any:
            return _in_squares(x, *by)

        left = replace(written, definitions=tuple(x for x in written.definitions if x is not d))
        found = changed(left, put, symbol)
        if found.operations + operations_in(square.expression) < written.operations:
            ordered = tuple(in_order([square, *found.definitions]))
            written = replace(found, definitions=ordered)
    return written


@cacheit
def _squared_in(expression: Any) -> frozenset[Any]:
    """Symbols of which an expression has a power beyond the first."""
    powers = (x for x in parts_of(expression) if x.is_Pow)
    return frozenset(x.base for x in powers if x.exp.is_Integer and abs(x.exp) > 1)


@cacheit
def _in_squares(expression: Any, symbol: Any, square: Any, once: Any) -> Any:
    """An expression with a name for the square of a symbol, and what stands for an odd factor."""
    powers: dict[Any, Any] = {symbol: once}
    for power in parts_of(expression):
        if power.is_Pow and power.base == symbol and power.exp.is_Integer:
            half, odd = divmod(int(power.exp), 2)
            powers[power] = square**half * once**odd
    return expression.xreplace(powers)


def in_letters(written: Written, taken: Iterable[str]) -> Written:
    """The same with letters in the order of the definitions: e_a before e_b; lengths keep theirs.

    Examples
    --------
    >>> R, h, first, last = sp.symbols("R h c_b c_d")
    >>> names = Definition(last, 1 / R), Definition(first, h * last)
    >>> [(str(d.symbol), d.expression) for d in in_letters(Written((), names), {"c_a"}).definitions]
    [('c_b', 1/R), ('c_c', c_b*h)]
    """
    given = {*taken} - {d.symbol.name for d in written.definitions}
    put: dict[Any, Any] = {}
    letters: dict[str, Iterator[str]] = {}
    for symbol in (d.symbol for d in written.definitions):
        letter, _, own = symbol.name.partition("_")
        if letter in _LETTERS and own and not own.isdigit():
            name = next(letters.setdefault(letter, free_names(letter, given)))
            if name != symbol.name:
                put[symbol] = sp.Symbol(name, **symbol.assumptions0)
    if not put:
        return written
    found = changed(written, lambda x: x.xreplace(put))
    names = (replace(d, symbol=put.get(d.symbol, d.symbol)) for d in found.definitions)
    return replace(found, definitions=tuple(names))


def changed(written: Written, change: Callable[[Any], Any], symbol: Any = None) -> Written:
    """The same with all formulas changed, or those that have a symbol."""
    spend()

    def own(x: Any) -> Any:
        return change(x) if symbol is None or symbol in symbols_in(x) else x

    return Written(
        tuple(map(own, written.results)),
        tuple(replace(d, expression=own(d.expression)) for d in written.definitions),
        cache(lambda: tuple(tuple(map(own, one)) for one in written.others())),
    )


def in_order(definitions: Sequence[Definition]) -> Iterator[Definition]:
    """Definitions so that each uses those before, otherwise as they came."""
    left: dict[Any, Definition] = {d.symbol: d for d in definitions}

    def with_its_own(d: Definition) -> Iterator[Definition]:
        for symbol in sorted(symbols_in(d.expression) & left.keys(), key=str):
            if symbol in left:
                yield from with_its_own(left[symbol])
        if left.pop(d.symbol, None) is not None:
            yield d

    for d in definitions:
        yield from with_its_own(d)
