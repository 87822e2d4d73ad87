"""Names for ratios of lengths that recur, such as u_x = d_a/L_a, and names that are not worth it.

A ratio of lengths is a component of a unit vector. Where it occurs in several places, it has the
name of that component; a name that is used little is written out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, count, permutations
from typing import Any

import sympy as sp

from robostiff.analytic.combinations import suffix
from robostiff.analytic.derivation import Definition

_NAMES = 6  # that are given at most
_A_LINE = 3  # operations for which a further line is worth it, beyond those read at a glance
_LINES = 10  # lines that are read at a glance
_WORTH = 0.95  # of the length before, for which names are exchanged
_GROWN = 1.1  # operations by which these may grow for fewer lines
_WIDTH = 4  # ways of as many lines that are followed


@dataclass(frozen=True)
class Written:
    """Expressions in names, and what the names stand for.

    Attributes
    ----------
    results : tuple of sympy.Expr
        What is counted, and printed one a line.
    definitions : tuple of Definition
    others : tuple of sympy expressions and matrices
        What is written in the same names, and not counted.
    """

    results: tuple[Any, ...]
    definitions: tuple[Definition, ...]
    others: tuple[Any, ...] = ()

    @cached_property
    def operations(self) -> int:
        """Of all results and formulas of names."""
        return sum(map(_operations, (*self.results, *(d.expression for d in self.definitions))))

    @property
    def lines(self) -> int:
        """Results, and names that are formulas."""
        return len(self.results) + sum(bool(d.expression.free_symbols) for d in self.definitions)


def as_printed(
    written: Written,
    taken: Iterable[str],
    components: Sequence[str],
    are_one: Callable[[Written, Any], bool],
) -> Written:
    """With names for components and without idle ones, where that is worth the change.

    Parameters
    ----------
    written : Written
    taken, components
        See `with_components`.
    are_one : callable
        Of these formulas and an expression in their names: whether it is one, always.
    """
    found = by_unit_length(with_components(written, taken, components), are_one)
    found = without_idle_names(found)
    found = found if _length(found) <= _WORTH * _length(written) else written
    return in_few_lines(found, taken, are_one)


def with_components(
    written: Written, taken: Iterable[str], components: Sequence[str] = ()
) -> Written:
    """The same with names for ratios that recur and their moments, while that makes it shorter.

    Parameters
    ----------
    written : Written
    taken : iterable of str
        Names that stand for something else.
    components : sequence of str
        Names for what is an entry of a matrix among the others, a name a row.

    Examples
    --------
    >>> d, L, h, r, c = sp.symbols("d_a L_a h r c")
    >>> K = d**2 / (L**2 * c), h * r * d / (L**2 * c), h**2 / (L**2 * c) + c
    >>> length = Definition(L, sp.sqrt(d**2 + h**2))
    >>> found = with_components(Written(K, (length,)), {"c"})
    >>> sorted((str(d.symbol), d.expression) for d in found.definitions[1:])
    [('s_a', d_a/L_a), ('s_b', h/L_a)]
    >>> found.results
    (s_a**2/c, r*s_a*s_b/c, c + s_b**2/c)
    """
    used = {*taken, *(d.symbol.name for d in written.definitions)}
    ours: set[Any] = set()
    refused: set[Any] = set()
    best = written
    for _ in range(_NAMES):
        product = _most_useful(written, ours, refused)
        if product is None:
            break
        name = _name_of(product, written.others, components, used)
        if product.as_numer_denom()[1] == 1 and name not in components:
            refused.add(product)  # a moment is the entry of a wrench
            continue
        used.add(name)
        symbol = sp.Symbol(name, real=True)
        ours.add(symbol)
        written = _with_cosine(written, Definition(symbol, product), ours)
        best = min(best, written, key=_length)
    return best


def _with_cosine(written: Written, new: Definition, ours: set[Any]) -> Written:
    """The same with a further name; of a ratio of roots by its sine where that is a product.

    For s = L_a/L_b with L_a^2 = L_b^2 - x^2 it is sqrt(1 - (x/L_b)^2), and L_a becomes s L_b.
    """
    full: dict[Any, Any] = {d.symbol: d.expression for d in written.definitions}
    above, below = new.expression.as_numer_denom()
    squares = [full.get(length, sp.Integer(0)) ** 2 for length in (above, below)]
    rest: Any = sp.factor_terms(sp.expand(squares[1] - squares[0]))
    for turn in rest.atoms(sp.cos):
        rest = rest.xreplace({1 - turn**2: sp.sin(turn.args[0]) ** 2})
    if not (squares[0].is_Add and squares[1].is_Add) or rest.is_Add:
        return _with_name(written, new)
    left = tuple(d for d in written.definitions if d.symbol != above)
    put = {above: new.symbol * below}
    written = _with(replace(written, definitions=left), lambda x: x.xreplace(put))
    sine: Any = rest / below**2
    for symbol in sorted(ours - {new.symbol}, key=str):
        own = next(d for d in written.definitions if d.symbol == symbol)
        others = tuple(d for d in written.definitions if d is not own)
        written = _with_name(replace(written, definitions=others), own)
        sine = _divided(sine, own)
    return _with_name(written, Definition(new.symbol, sp.sqrt(1 - sine)))


def _length(written: Written) -> int:
    return written.operations + _A_LINE * max(0, written.lines - _LINES)


def by_unit_length(written: Written, are_one: Callable[[Written, Any], bool]) -> Written:
    """The same with x^2 in place of 1 - y^2 where x and y have names and x^2 + y^2 = 1.

    Parameters
    ----------
    written : Written
    are_one : callable
        Of these formulas and an expression in their names: whether it is one, always.
    """
    lengths = [d.symbol for d in written.definitions if d.symbol.is_positive is None]
    for a, b in permutations(lengths, 2):
        put = {1 - b**2: a**2}
        needed = _needs(a, written.definitions)
        first = [d for d in written.definitions if d.symbol in needed]
        left = tuple(d for d in written.definitions if d.symbol not in needed)
        later = replace(written, definitions=left)
        found = _with(later, lambda x, put=put: x.xreplace(put))
        if found != later and are_one(written, a**2 + b**2):
            written = replace(found, definitions=tuple(_in_order([*first, *found.definitions])))
    return written


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
    """The same in ten lines, where names can be written out and little is lost.

    Where x^2 + y^2 = 1, even powers of x become those of y; a root that occurs in even powers
    alone gives way to its square.

    Parameters
    ----------
    written : Written
    taken : iterable of str
        Names that stand for something else.
    are_one : callable
        Of these formulas and an expression in their names: whether it is one, always.

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
    kept = sum(bool(d.expression.free_symbols) for d in written.definitions if _is_kept(d))
    if written.lines <= _LINES or len(written.results) + kept > _LINES:
        return written
    names = [d.symbol for d in written.definitions if d.symbol.is_positive is None]
    units = [(a, b) for a, b in combinations(names, 2) if are_one(written, a**2 + b**2)]
    units += [(b, a) for a, b in units]
    states = [written]
    while states and states[0].lines > _LINES:
        after: dict[Any, Written] = {}
        for one in (x for own in states for d in own.definitions for x in _without(own, d, units)):
            shorter = _with_squares(_with_needed_names(one), {*taken})
            key = frozenset(d.symbol for d in shorter.definitions)
            if key not in after or shorter.operations < after[key].operations:
                after[key] = shorter
        states = sorted(after.values(), key=lambda own: own.operations)[:_WIDTH]
    few = (x for x in states if x.lines <= _LINES and x.operations <= _GROWN * written.operations)
    return next(few, written)


def _is_kept(definition: Definition) -> bool:
    return definition.symbol.name.startswith(("c_", "k_", "EA", "EI", "GJ", "theta"))


def _without(
    written: Written, definition: Definition, units: Sequence[tuple[Any, Any]]
) -> Iterator[Written]:
    """The same with a name written out, also by another where the sum of both squares is one."""
    expression: Any = definition.expression
    if not expression.free_symbols or _is_kept(definition):
        return
    symbol = definition.symbol
    others = tuple(d for d in written.definitions if d is not definition)
    left = replace(written, definitions=others)
    yield _with(left, lambda x: x.xreplace({symbol: expression}))
    for other in (b for a, b in units if a == symbol):
        needed = _needs(other, written.definitions)
        if symbol in needed or len(needed) == 1:
            continue  # computed by it, or no longer there
        rest = 1 - other**2

        found = _with(left, lambda x, rest=rest: _in_squares(x, symbol, rest, expression))
        ordered = tuple(_in_order(found.definitions))
        yield replace(found, definitions=ordered)


def _needs(symbol: Any, definitions: Sequence[Definition]) -> set[Any]:
    """All symbols by which a name is computed."""
    found = {symbol}
    for d in reversed(definitions):
        if d.symbol in found:
            found |= d.expression.free_symbols
    return found


def _with_needed_names(written: Written) -> Written:
    """The same without names that are in no result and no other name."""
    for d in reversed(written.definitions):
        others = tuple(own for own in written.definitions if own is not d)
        formulas = (*written.results, *(own.expression for own in others))
        if not _is_kept(d) and not any(x.has(d.symbol) for x in formulas):
            put = {d.symbol: d.expression}
            left = tuple(x.xreplace(put) for x in written.others)
            written = Written(written.results, others, left)
    return written


def _with_squares(written: Written, taken: set[str]) -> Written:
    """The same with squares in place of names that occur squared, where that is shorter."""
    for symbol in [d.symbol for d in written.definitions]:
        d = next(d for d in written.definitions if d.symbol == symbol)
        if symbol.name.startswith("L_") or not d.expression.free_symbols or _is_kept(d):
            continue
        used = taken | {own.symbol.name for own in written.definitions}
        number = next(i for i in count() if f"p_{suffix(i)}" not in used)
        square = Definition(sp.Symbol(f"p_{suffix(number)}", positive=True), d.expression**2)
        is_root = square.expression.is_Add
        once = sp.sqrt(square.symbol) if is_root else d.expression
        found = _with(
            replace(written, definitions=tuple(x for x in written.definitions if x is not d)),
            lambda x, by=(d.symbol, square.symbol, once): _in_squares(x, *by),
        )
        ordered = tuple(_in_order([square, *found.definitions]))
        written = min(written, replace(found, definitions=ordered), key=lambda x: x.operations)
    return written


def _in_squares(expression: Any, symbol: Any, square: Any, once: Any) -> Any:
    """An expression with a name for the square of a symbol, and what stands for an odd factor."""
    powers: dict[Any, Any] = {symbol: once}
    for power in expression.atoms(sp.Pow):
        if power.base == symbol and power.exp.is_Integer:
            half, odd = divmod(int(power.exp), 2)
            powers[power] = square**half * once**odd
    return expression.xreplace(powers)


def _with(written: Written, change: Callable[[Any], Any]) -> Written:
    """The same with all formulas changed."""
    return Written(
        tuple(map(change, written.results)),
        tuple(Definition(d.symbol, change(d.expression)) for d in written.definitions),
        tuple(map(change, written.others)),
    )


def _with_name(written: Written, new: Definition) -> Written:
    """The same with a further name in all later formulas, where that is no longer."""

    def put(expression: Any) -> Any:
        if isinstance(expression, sp.MatrixBase):
            return expression.applyfunc(put)
        return _divided(expression, new)

    found = _with(written, put)
    return replace(found, definitions=tuple(_in_order([new, *found.definitions])))


def _in_order(definitions: Sequence[Definition]) -> Iterator[Definition]:
    """Definitions so that each uses those before, otherwise as they came."""
    left: dict[Any, Definition] = {d.symbol: d for d in definitions}

    def with_its_own(d: Definition) -> Iterator[Definition]:
        for symbol in sorted(d.expression.free_symbols & left.keys(), key=str):
            if symbol in left:
                yield from with_its_own(left[symbol])
        if left.pop(d.symbol, None) is not None:
            yield d

    for d in definitions:
        yield from with_its_own(d)


def _divided(expression: Any, ratio: Definition) -> Any:
    """An expression with powers of a ratio in its products, where these become no longer."""
    if not expression.args or not ratio.expression.free_symbols <= expression.free_symbols:
        return expression
    expression = expression.func(*(_divided(part, ratio) for part in expression.args))
    if not isinstance(expression, sp.Mul):
        return expression
    part = tuple(ratio.expression.as_powers_dict().items())
    left = _taken_out(_powers(expression), part)
    if part not in left:
        return expression
    left[ratio.symbol] = left.pop(part)
    # The number stays in front: 1/4 in a sum of roots would be longer.
    factors = [base**power for base, power in left.items()]
    other = sp.Mul(expression.as_coeff_Mul()[0], *factors)
    return min(expression, other, key=_operations)


def _most_useful(written: Written, components: set[Any], refused: set[Any]) -> Any:
    """The ratio or moment whose name saves most operations; None where none does.

    A length below all results, and nothing else, is a factor in front of them: 1/L^2.
    """
    of_names = [x for d in written.definitions for x in _products(d.expression)]
    products = [x for result in written.results for x in _products(result)] + of_names
    each = [_powers(sp.factor_terms(x)) for x in written.results]
    in_front = {b for b in set().union(*each) if all(own.get(b, 0) < 0 for own in each)}
    best, most = None, 1
    for found in dict.fromkeys(x for own in products for x in _parts_of(own, components)):
        if any(base in in_front for base, _ in found) and not any(
            found in _taken_out(own, found) for own in of_names
        ):
            continue
        saved = sum(max(0, _cost(own) - _cost(_taken_out(own, found))) for own in products)
        product = sp.Mul(*(base**power for base, power in found))
        if saved > most and product not in refused:
            best, most = product, saved
    return best


def _products(formula: Any) -> list[_Powers]:
    """The products that occur in a formula."""
    parts = sp.preorder_traversal(formula)
    return [_powers(part) for part in parts if isinstance(part, sp.Mul)]


_Powers = dict[Any, Any]  # powers of the factors of a product
_Part = tuple[tuple[Any, int], ...]  # two factors with their powers


def _parts_of(powers: _Powers, components: set[Any]) -> Iterator[_Part]:
    """Ratios of two lengths, one of them with a name, and levers times components."""
    bases = sorted((b for b in powers if b.is_Symbol and _may_be_a_length(b)), key=str)
    for a, b in combinations(bases, 2):
        is_named = any(x.name.startswith(("L_", "d_")) for x in (a, b))
        are_components = sum(x in components for x in (a, b))
        if powers[a] == -powers[b] and is_named and not are_components:
            yield ((a, 1), (b, -1)) if powers[a] > 0 else ((a, -1), (b, 1))
        elif powers[a] == powers[b] and are_components == 1:
            yield (a, 1), (b, 1)


def _powers(product: Any) -> _Powers:
    return dict(product.as_coeff_Mul()[1].as_powers_dict())


def _taken_out(powers: _Powers, part: _Part) -> _Powers:
    """Powers after as many parts as there are have become one factor."""
    fits = [powers.get(base, 0) / power for base, power in part]
    if not all(sp.sympify(x).is_Integer for x in fits) or min(fits) * max(fits) <= 0:
        return powers
    times = min(fits, key=abs)
    left = {**powers, part: times}
    for base, power in part:
        left[base] = left[base] - times * power
    return {base: power for base, power in left.items() if power != 0}


def _cost(powers: _Powers) -> int:
    return sum(1 if power in (1, -1) else 2 for power in powers.values())


def _may_be_a_length(symbol: Any) -> bool:
    return not symbol.name.startswith(("c_", "k", "K", "E", "G", "e_", "theta"))


def _name_of(product: Any, others: Sequence[Any], components: Sequence[str], used: set[str]) -> str:
    """The name of the entry of a wrench that it is, up to its sign, or a letter with a number."""
    matrices = [x for x in others if isinstance(x, sp.MatrixBase)]
    for matrix in matrices:
        for name, entry in zip(components, matrix.flat(), strict=False):
            if entry in (product, -product) and name not in used:
                return name
    number = 0
    while f"s_{suffix(number)}" in used:
        number += 1
    return f"s_{suffix(number)}"


def _operations(expression: Any) -> int:
    return int(expression.count_ops()) if expression.free_symbols else 0
