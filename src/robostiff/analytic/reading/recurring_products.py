"""Names for ratios of lengths that recur, such as u_x = d_a/L_a, and names that are not worth it.

A ratio of lengths is a component of a unit vector. Where it occurs in several places, it has the
name of that component; a name that is used little is written out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import combinations, permutations
from typing import Any

import sympy as sp
from sympy.core.cache import cacheit

from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.exact.element import made_of, quotient_of, root_of
from robostiff.analytic.exact.operation_count import operations_in, parts_of, symbols_in
from robostiff.analytic.reading.combinations import free_names
from robostiff.analytic.reading.names_written_out import (
    Written,
    changed,
    in_few_lines,
    in_letters,
    in_order,
    needed_for,
    with_differences,
    with_shared_sums,
    without_idle_names,
)

_NAMES = 6  # that are given at most
_A_LINE = 3  # operations that a line for a component costs: its name says what it is
_NO_LENGTHS = ("c_", "k", "K", "E", "G", "e_", "theta")  # how their names begin
_WORTH = 0.95  # of the length before, for which names are exchanged


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
    found = found if found.length(_A_LINE) <= _WORTH * written.length(_A_LINE) else written
    found = in_few_lines(found, taken, are_one)
    found = with_shared_sums(with_differences(found, taken))
    rooted = _with_roots(found, are_one)
    found = found if rooted is found else without_idle_names(rooted)
    return in_letters(found, taken)


def with_components(
    written: Written, taken: Iterable[str], components: Sequence[str] = ()
) -> Written:
    """The same with names for ratios that recur and their moments, while that makes it shorter.

    `taken`: names that stand for something else; `components`: names for what is an entry of a
    matrix among the others, a name a row.

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
        name = _name_of(product, written.others(), components, used)
        if product.as_numer_denom()[1] == 1 and name not in components:
            refused.add(product)  # a moment is the entry of a wrench
            continue
        used.add(name)
        symbol = sp.Symbol(name, real=True)
        ours.add(symbol)
        written = _with_cosine(written, Definition(symbol, product), ours)
        best = min(best, written, key=lambda own: own.length(_A_LINE))
    return best


def with_angles(written: Written, taken: Iterable[str]) -> Written:
    """The same with a name for a sum of angles whose sines and cosines recur.

    Examples
    --------
    >>> a, b, c = sp.symbols("q1 q2 c")
    >>> K = sp.cos(a + b) ** 2 / c, sp.sin(a + b) * sp.cos(a + b) / c, sp.sin(a + b) ** 2 / c
    >>> found = with_angles(Written(K, ()), {"c"})
    >>> found.definitions[0].expression, found.results[0]
    (q1 + q2, cos(theta_a)**2/c)
    """
    used = {*taken, *(d.symbol.name for d in written.definitions)}
    formulas = (*written.results, *(d.expression for d in written.definitions))
    turns = (x for formula in formulas for x in parts_of(formula))
    turned: Any = (x.args[0] for x in turns if isinstance(x, sp.sin | sp.cos))
    angles = [angle for angle in turned if angle.is_Add]
    for angle in dict.fromkeys(sorted(angles, key=str)):
        own = Definition(sp.Symbol(next(free_names("theta", used)), real=True), angle)
        found = changed(written, lambda x, own=own: x.xreplace({own.expression: own.symbol}))
        found = replace(found, definitions=tuple(in_order([own, *found.definitions])))
        if found.operations < written.operations:
            used.add(own.symbol.name)
            written = found
    return written


def _with_cosine(written: Written, new: Definition, ours: set[Any]) -> Written:
    """The same with a further name; of a ratio of roots by its sine where that is a product.

    For s = L_a/L_b with L_a^2 = L_b^2 - x^2 it is sqrt(1 - (x/L_b)^2), and L_a becomes s L_b.
    """
    full: dict[Any, Any] = {d.symbol: d.expression for d in written.definitions}
    above, below = new.expression.as_numer_denom()
    squares = [full.get(length, sp.Integer(0)) ** 2 for length in (above, below)]
    if not (squares[0].is_Add and squares[1].is_Add):
        return _with_name(written, new)
    rest: Any = sp.factor_terms(sp.expand(squares[1] - squares[0]))
    for turn in rest.atoms(sp.cos):
        rest = rest.xreplace({1 - turn**2: sp.sin(turn.args[0]) ** 2})
    if rest.is_Add:
        return _with_name(written, new)
    left = tuple(d for d in written.definitions if d.symbol != above)
    put = {above: new.symbol * below}
    written = changed(replace(written, definitions=left), lambda x: x.xreplace(put), above)
    sine: Any = rest / below**2
    for symbol in sorted(ours - {new.symbol}, key=str):
        own = next(d for d in written.definitions if d.symbol == symbol)
        others = tuple(d for d in written.definitions if d is not own)
        written = _with_name(replace(written, definitions=others), own)
        sine = _divided(sine, own)
    return _with_name(written, Definition(new.symbol, root_of(1 - sine)))


def by_unit_length(written: Written, are_one: Callable[[Written, Any], bool]) -> Written:
    """The same with x^2 in place of 1 - y^2 where x and y have names and x^2 + y^2 = 1.

    `are_one`: of these formulas and an expression in their names: whether it is one, always.
    """
    lengths = [d.symbol for d in written.definitions if d.symbol.is_positive is None]
    for a, b in permutations(lengths, 2):
        put = {1 - b**2: a**2}
        needed = needed_for(a, written.definitions)
        first = [d for d in written.definitions if d.symbol in needed]
        left = tuple(d for d in written.definitions if d.symbol not in needed)
        later = replace(written, definitions=left)
        found = changed(later, lambda x, put=put: x.xreplace(put))
        if found != later and are_one(written, a**2 + b**2):
            written = replace(found, definitions=tuple(in_order([*first, *found.definitions])))
    return written


def _with_roots(written: Written, are_one: Callable[[Written, Any], bool]) -> Written:
    """The same with x = sqrt(1 - y^2) where that is so, and shorter than how x is defined."""
    named = [d for d in written.definitions if d.symbol.is_positive is None]
    roots = {d.symbol: root_of(1 - d.symbol**2) for d in named}
    for a, b in permutations(named, 2):
        root = Definition(a.symbol, roots[b.symbol])
        if (
            operations_in(root.expression) < operations_in(a.expression)
            and a.symbol not in needed_for(b.symbol, written.definitions)
            and are_one(written, quotient_of(a.symbol, root.expression))
        ):
            names = (root if d == a else d for d in written.definitions)
            written = replace(written, definitions=tuple(in_order([*names])))
    return written


def _with_name(written: Written, new: Definition) -> Written:
    """The same with a further name in all later formulas, where that is no longer."""
    found = changed(written, lambda x: _divided(x, new))
    return replace(found, definitions=tuple(in_order([new, *found.definitions])))


@cacheit
def _divided(expression: Any, ratio: Definition) -> Any:
    """An expression with powers of a ratio in its products, where these become no longer."""
    if not expression.args or not symbols_in(ratio.expression) <= symbols_in(expression):
        return expression
    expression = made_of(expression, [_divided(part, ratio) for part in expression.args])
    if not isinstance(expression, sp.Mul):
        return expression
    part = tuple(_powers(ratio.expression).items())
    left = _taken_out(_powers(expression), part)
    if part not in left:
        return expression
    left[ratio.symbol] = left.pop(part)
    # The number stays in front: 1/4 in a sum of roots would be longer.
    factors = [base**power for base, power in left.items()]
    other = sp.Mul(expression.as_coeff_Mul()[0], *factors)
    return min(expression, other, key=operations_in)


def _most_useful(written: Written, components: set[Any], refused: set[Any]) -> Any:
    """The ratio or moment whose name saves most operations; None where none does.

    A length below all results, and nothing else, is a factor in front of them: 1/L^2.
    """
    of_names = [x for d in written.definitions for x in _products(d.expression)]
    products = [x for result in written.results for x in _products(result)] + of_names
    lengths = frozenset[Any]().union(*map(symbols_in, written.results))
    in_front = {b for b in lengths if all(_power_in_front(x, b) < 0 for x in written.results)}
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


@cacheit
def _power_in_front(formula: Any, symbol: Any) -> Any:
    """The power in which a symbol is a factor of all terms, the highest one."""
    if symbol not in symbols_in(formula):
        return 0
    if formula.is_Add:
        return max(_power_in_front(x, symbol) for x in formula.args)
    if formula.is_Mul:
        return sum(_power_in_front(x, symbol) for x in formula.args)
    base, power = formula.as_base_exp()
    return power * _power_in_front(base, symbol) if base is not formula else int(base is symbol)


def _products(formula: Any) -> list[_Powers]:
    """The products that occur in a formula."""
    found, pending = [], [formula]
    while pending:
        part = pending.pop()
        pending += reversed(part.args)
        if part.is_Mul:
            found.append(_powers(part))
    return found


_Powers = dict[Any, Any]  # powers of the factors of a product
_Part = tuple[tuple[Any, int], ...]  # two factors with their powers


def _parts_of(powers: _Powers, components: set[Any]) -> Iterator[_Part]:
    """Ratios of two lengths, one of them with a name, and levers times components."""
    symbols = (b for b in powers if b.is_Symbol and not b.name.startswith(_NO_LENGTHS))
    bases = sorted(symbols, key=str)
    for a, b in combinations(bases, 2):
        is_named = any(x.name.startswith(("L_", "d_")) for x in (a, b))
        are_components = sum(x in components for x in (a, b))
        if powers[a] == -powers[b] and is_named and not are_components:
            yield ((a, 1), (b, -1)) if powers[a] > 0 else ((a, -1), (b, 1))
        elif powers[a] == powers[b] and are_components == 1:
            yield (a, 1), (b, 1)


def _powers(product: Any) -> _Powers:
    powers = product.as_coeff_Mul()[1].as_powers_dict()
    # Numbers of Python: SymPy's take ten times as long.
    return {b: Fraction(int(x.p), int(x.q)) if x.is_Rational else x for b, x in powers.items()}


def _taken_out(powers: _Powers, part: _Part) -> _Powers:
    """Powers after as many parts as there are have become one factor."""
    fits = [powers.get(base, 0) / power for base, power in part]
    are_whole = all(isinstance(x, Fraction) and x.denominator == 1 for x in fits)
    if not are_whole or min(fits) * max(fits) <= 0:
        return powers
    times = min(fits, key=abs)
    left = {**powers, part: times}
    for base, power in part:
        left[base] = left[base] - times * power
    return {base: power for base, power in left.items() if power != 0}


def _cost(powers: _Powers) -> int:
    return sum(1 if power in (1, -1) else 2 for power in powers.values())


def _name_of(
    product: Any, others: Sequence[Sequence[Any]], components: Sequence[str], used: set[str]
) -> str:
    """The name of the entry of a wrench that it is, up to its sign, or a letter with a number."""
    for wrench in (x for x in others if len(x) > 1):
        for name, entry in zip(components, wrench, strict=False):
            if entry in (product, -product) and name not in used:
                return name
    return next(free_names("s", used))
