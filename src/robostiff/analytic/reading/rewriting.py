"""Formulas in names, and ways to write one shorter: a name for what recurs, or less of names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import combinations, count, product
from string import ascii_lowercase
from types import MappingProxyType
from typing import Any

import sympy as sp
from sympy.core.cache import cacheit
from sympy.simplify.fu import TR8, TR10i

from robostiff.analytic.exact.closed import factored_fraction
from robostiff.analytic.exact.definition import (
    Definition,
    count_of,
    operations_in,
    parts_of,
    symbols_in,
)
from robostiff.analytic.exact.element import made_of, root_of
from robostiff.frozen import field, frozen, replace

_LETTERS = ("c", "d", "e", "k", "p", "s", "theta")  # of names that count


@frozen
class Written:
    """Expressions in names, and what the names stand for."""

    results: tuple[Any, ...]  # what is counted, and printed one a line
    definitions: tuple[Definition, ...]
    others: tuple[tuple[Any, ...], ...] = ()  # in the same names, and not counted


def free_names(letter: str, taken: Container[str]) -> Iterator[str]:
    """Names with a letter that stand for nothing else: L_a, L_b, ..., L_z, L_aa, ..."""
    each = (x for n in count(1) for x in product(ascii_lowercase, repeat=n))
    return (name for x in each if (name := f"{letter}_{''.join(x)}") not in taken)


def in_letters(written: Written, taken: Iterable[str]) -> Written:
    """The same in order, with letters in that order: e_a before e_b; lengths keep theirs."""
    definitions = [*in_order(written.definitions)]
    given = {*taken} - {d.symbol.name for d in definitions}
    put: dict[Any, Any] = {}
    letters: dict[str, Iterator[str]] = {}
    for symbol in (d.symbol for d in definitions):
        letter, _, ending = symbol.name.partition("_")
        if letter in _LETTERS and ending and not ending.isdigit():
            name = next(letters.setdefault(letter, free_names(letter, given)))
            if name != symbol.name:
                put[symbol] = sp.Symbol(name, **symbol.assumptions0)
    return _rename(replace(written, definitions=tuple(definitions)), put)


def _rename(written: Written, put: Mapping[Any, Any]) -> Written:
    """The same with other symbols."""
    if not put:
        return written
    return Written(
        tuple(x.xreplace(put) for x in written.results),
        tuple(
            replace(d, symbol=put.get(d.symbol, d.symbol), expression=d.expression.xreplace(put))
            for d in written.definitions
        ),
        tuple(tuple(x.xreplace(put) for x in one) for one in written.others),
    )


def as_components(written: Written, components: Sequence[str], taken: set[str]) -> Written:
    """Names of ratios that are entries of a wrench, up to their sign: u_x, u_z."""
    used = taken | {d.symbol.name for d in written.definitions}
    put: dict[Any, Any] = {}
    for symbol in (d.symbol for d in written.definitions if d.symbol.name.startswith("s_")):
        for wrench in (x for x in written.others if len(x) > 1):
            for name, entry in zip(components, wrench, strict=False):
                if entry in (symbol, -symbol) and name not in used and symbol not in put:
                    used.add(name)
                    put[symbol] = sp.Symbol(name, real=True)
    return in_letters(_rename(written, put), taken) if put else written


def in_order(definitions: Sequence[Definition]) -> Iterator[Definition]:
    """Definitions so that each uses those before, otherwise as they came."""
    remaining: dict[Any, Definition] = {d.symbol: d for d in definitions}

    for d in definitions:
        waiting = [d] if d.symbol in remaining else []
        while waiting:
            before = symbols_in(waiting[-1].expression) & remaining.keys()
            if before:
                waiting.append(remaining[min(before, key=str)])
            else:
                yield remaining.pop(waiting.pop().symbol)


_NO_LENGTHS = ("c_", "k", "K", "E", "G", "e_", "theta")  # how their names begin
_LONGEST_SUM = 60  # operations of a sum in which two symbols may stand as their difference


@cacheit
def multiple_of(total: Any, compliance: Any) -> Any:
    """The factor by which a sum is a compliance times moduli and lengths; None of others."""
    above, below = sp.fraction(sp.together(compliance))
    ratio = sp.factor_terms(total).as_coeff_Mul()[0] / sp.factor_terms(above).as_coeff_Mul()[0]
    return ratio * below if sp.expand(total - ratio * above) == 0 else None


@cacheit
def over_a_name(expression: Any, total: Any, name: Any, factor: Any) -> Any:
    """An expression with a name times a factor for a sum below its fraction bars."""
    if total not in parts_of(expression):
        return expression
    parts = [over_a_name(x, total, name, factor) for x in expression.args]
    if not (expression.is_Mul and 1 / total in parts):
        return made_of(expression, parts) if parts else expression
    parts.remove(1 / total)
    sums = [x for x in parts if x.is_Add]
    rest = [x for x in parts if not x.is_Add]
    inside, outside = (sums[0], sums[1:]) if sums else (sp.S.One, [])
    return sp.Mul(*rest, *outside, sp.factor_terms(sp.expand(inside / factor))) / name


def put_in(expression: Any, pairs: tuple[tuple[Any, Any], ...]) -> Any:
    """An expression with others for some of its parts."""
    return _replace(expression, dict(pairs))


def _replace(expression: Any, put: dict[Any, Any]) -> Any:
    if expression in put:
        return put[expression]
    return _with_parts(expression, lambda x: _replace(x, put))


def _with_parts(expression: Any, change: Callable[[Any], Any]) -> Any:
    """An expression with another for each of its parts."""
    parts = [change(x) for x in expression.args]
    are_same = all(a is b for a, b in zip(parts, expression.args, strict=True))
    return expression if are_same else made_of(expression, parts)


@cacheit
def rest_of_squares(above: Any, below: Any) -> Any:
    """What the square of a length is more than that of another, where that is no sum."""
    if not (above.is_Add and below.is_Add):
        return None
    rest: Any = sp.factor_terms(sp.expand(below - above))
    for turn in rest.atoms(sp.cos):
        rest = rest.xreplace({1 - turn**2: sp.sin(turn.args[0]) ** 2})
    return None if rest.is_Add else rest


@cacheit
def third_side(radicand: Any, above: Any) -> Any:
    """The product b for which b^2 is a radicand and a square a^2; None where b is no product."""
    square = factored_fraction(radicand + above**2)
    if square.has(sp.Add):
        return None  # before SymPy looks for the signs of sums
    side = root_of(square).replace(sp.Abs, lambda size: size)
    return None if side.atoms(sp.Pow) else side


@cacheit
def divide(expression: Any, ratio: Definition) -> Any:
    """An expression with powers of a ratio in its products, where these become no longer."""
    if not expression.args or not symbols_in(ratio.expression) <= symbols_in(expression):
        return expression
    expression = _with_parts(expression, lambda x: divide(x, ratio))
    if not isinstance(expression, sp.Mul):
        return expression
    rest, part = dict(powers(expression)), powers(ratio.expression)
    fits = [rest.get(base, 0) / power for base, power in part.items()]
    are_whole = all(isinstance(x, Fraction) and x.denominator == 1 for x in fits)
    if not are_whole or min(fits) * max(fits) <= 0:
        return expression
    times = min(fits, key=abs)
    for base, power in part.items():
        rest[base] -= times * power
    rest[ratio.symbol] = times
    # The number stays in front: 1/4 in a sum of roots would be longer.
    other = sp.Mul(expression.as_coeff_Mul()[0], *(base**power for base, power in rest.items()))
    return min(expression, other, key=operations_in)


@cacheit
def powers(product: Any) -> Mapping[Any, Any]:
    """Powers of the factors of a product; numbers of Python, as SymPy's take ten times as long."""
    exponents = product.as_coeff_Mul()[1].as_powers_dict()
    return MappingProxyType(
        {b: Fraction(int(x.p), int(x.q)) if x.is_Rational else x for b, x in exponents.items()}
    )


@cacheit
def by_difference(expression: Any, difference: Definition, a: Any, b: Any) -> Any:
    """An expression with the difference in its sums, where that leaves less of them."""
    if not expression.args or not {a, b} <= symbols_in(expression):
        return expression
    expression = _with_parts(expression, lambda x: by_difference(x, difference, a, b))
    if not (expression.is_Add and {a, b} <= symbols_in(expression)):
        return expression
    if count_of(expression) > _LONGEST_SUM:
        return expression
    first = difference.symbol + b
    other = expression.xreplace({a: first})
    inside = {x for x in parts_of(other) - {other} if x.is_Add}
    if inside and inside <= {first}:
        other = sp.expand(other)
    return other if count_of(other) < count_of(expression) else expression


@cacheit
def with_multiple(expression: Any, length: Any, multiple: Any) -> Any:
    """An expression with a multiple for a length, which comes out of the sums inside."""
    found = _replace(expression, {length: multiple})
    sums = (x for x in parts_of(expression) if x.is_Add and x != expression)
    return sp.factor_terms(found) if any(length in symbols_in(x) for x in sums) else found


@cacheit
def with_sum(expression: Any, terms: frozenset[Any], name: Any) -> Any:
    """An expression with a name for some terms of its sums."""
    expression = _with_parts(expression, lambda x: with_sum(x, terms, name))
    if expression.is_Add and terms <= {*expression.args}:
        return name + sp.Add(*(x for x in expression.args if x not in terms))
    return expression


@cacheit
def written_out(formula: Any, symbol: Any, expression: Any) -> Any:
    """A formula with what a name stands for."""
    if symbol not in symbols_in(formula):
        return formula
    if formula == symbol:
        return expression
    if formula.is_Pow and formula.base == symbol and expression.is_Pow:
        power = formula.exp * expression.exp
        if power.is_Integer:
            return expression.base**power
    return made_of(formula, [written_out(x, symbol, expression) for x in formula.args])


@cacheit
def in_squares(expression: Any, symbol: Any, square: Any, once: Any) -> Any:
    """An expression with a name for the square of a symbol, and what stands for an odd factor."""
    powers: dict[Any, Any] = {symbol: once}
    for power in parts_of(expression):
        if power.is_Pow and power.base == symbol and power.exp.is_Integer:
            half, odd = divmod(int(power.exp), 2)
            powers[power] = square**half * once**odd
    return _replace(expression, powers)


@frozen(eq=False)
class CountedFormula:
    """A formula and what it consists of; sets of symbols are numbers, a bit each."""

    expression: Any
    parts: tuple[Any, ...]  # in the order of the formula, the same in every run
    operations: int
    symbols: int
    below: int  # symbols below its fraction bars
    rooted: frozenset[Any]  # what stands below its roots

    @cached_property
    def sums(self) -> tuple[Any, ...]:
        """Its sums."""
        return tuple(x for x in self.parts if x.is_Add)

    @cached_property
    def square(self) -> Any:
        """Its square, multiplied out where it is no product of several sums."""
        square = self.expression**2
        sums = [x for x in sp.Mul.make_args(square) if x.as_base_exp()[0].is_Add]
        return square if len(sums) > 1 else sp.expand(square)

    @cached_property
    def uses(self) -> Counter[Any]:
        """How often its symbols are used, and how often of these in powers (symbol, 2)."""
        uses = Counter[Any](y for x in self.parts for y in x.args if y.is_Symbol)
        uses.update((x.base, 2) for x in self.parts if x.is_Pow and x.base.is_Symbol)
        return uses

    @cached_property
    def divisors(self) -> frozenset[Any]:
        """What it is divided by as a whole."""
        return frozenset(x for x, power in powers(self.expression).items() if power < 0)

    @cached_property
    def ratios(self) -> tuple[tuple[Any, Any], ...]:
        """Lengths a, b of its products that have a/b, one of them with a name, or a power of it."""
        found = []
        for factors in (powers(x) for x in self.parts if x.is_Mul):
            bases = (b for b in factors if b.is_Symbol and not b.name.startswith(_NO_LENGTHS))
            for a, b in combinations(sorted(bases, key=lambda x: x.name), 2):
                is_named = any(x.name.startswith(("L_", "d_")) for x in (a, b))
                if is_named and factors[a] == -factors[b]:
                    found.append((a, b) if factors[a] > 0 else (b, a))
        return tuple(found)

    @cached_property
    def differences(self) -> tuple[tuple[Any, Any], ...]:
        """Symbols a, b of its sums that have a - b."""
        found = []
        for total in self.sums:
            plus = sorted((x for x in total.args if x.is_Symbol), key=str)
            minus = sorted((x for t in total.args if t.is_Mul and (x := -t).is_Symbol), key=str)
            found += [(a, b) for a in plus for b in minus]
        return tuple(found)


@frozen(eq=False)
class Move:
    """What is done to all formulas that have some symbols."""

    change: Callable[..., Any]  # of an expression
    by: tuple[Any, ...]  # its further arguments
    symbols: int
    new: Definition | None = None  # a name that comes in, or stays; what computes it does, too
    out: Any = None  # the name that goes
    made: dict[CountedFormula, CountedFormula] = field(default_factory=dict)


@frozen(eq=False)
class Writing:
    """One way to write all of them."""

    results: tuple[CountedFormula, ...]
    names: dict[Any, CountedFormula]  # by symbol
    cost: int
    lines: int  # results, and names that are formulas
    own: int  # its names
    below: int  # given symbols below fraction bars; names that are positive are no pole
    # Those with idle ones, which are in no result and no other name
    all_names: dict[Any, CountedFormula]
    begin: tuple[Writing, Move] | None = None

    @property
    def formulas(self) -> Iterator[CountedFormula]:
        """Results, and formulas of names."""
        yield from self.results
        yield from self.names.values()


# Operations, and terms of a sum, beyond which no shorter form is looked for.
_LONGEST, _TERMS = 60, 60


def shortest_trigonometry(expression: Any, longest: int = _LONGEST) -> Any:
    """An expression or matrix with sines and cosines in their shortest form.

    Products of sines become sines of multiples and of sums, ``a sin x + b cos x`` a sine with a
    phase, and ``cos a cos b - sin a sin b`` becomes ``cos(a + b)``. What would be longer stays, and
    so do sums with more than the `longest` operations.
    """
    if isinstance(expression, sp.MatrixBase):
        entries = [_shortest(x, longest) for x in expression.flat()]
        return sp.ImmutableMatrix(*expression.shape, entries)
    return _shortest(expression, longest)


@cacheit
def _shortest(expression: Any, longest: int) -> Any:
    if not expression.has(sp.sin, sp.cos) or count_of(expression) > longest:
        return expression
    return _first_shortest([expression, sp.factor_terms(_walked(expression))])


def _first_shortest(forms: list[Any]) -> Any:
    """That of the fewest operations; of several, the one that prints shortest."""
    least = min(map(count_of, forms))
    found = [x for x in dict.fromkeys(forms) if count_of(x) == least]
    return found[0] if len(found) == 1 else min(found, key=lambda x: len(str(x)))


@cacheit
def _walked(expression: Any) -> Any:
    """The same with each sum and product in its shortest form, inner ones first."""
    if not expression.has(sp.sin, sp.cos) or isinstance(expression, sp.sin | sp.cos):
        return expression
    forms = [walked := expression.func(*map(_walked, expression.args))]
    bases = (f.as_base_exp()[0] for f in expression.args)
    both = [f.args[0] for f in bases if isinstance(f, sp.sin | sp.cos)]
    # A product of functions of different angles is longer as a sum.
    is_open = expression.is_Add or (
        len(both) > 1 and (len({*both}) < len(both) or any(x.has(sp.Add) for x in expression.args))
    )
    for form in dict.fromkeys([expression, walked]) if is_open else ():
        plain = sp.expand(form)
        if len(plain.args) <= _TERMS:
            # Sums of angles may have names.
            are_plain = all(x.args[0].is_Symbol for x in plain.atoms(sp.sin, sp.cos))
            other = _of_sums(sp.expand(TR8(plain))) if are_plain else plain
            each = dict.fromkeys([_of_sums(plain), other])
            forms += [*each, *map(sp.factor_terms, each)]
    return _first_shortest(forms)


def _of_sums(plain: Any) -> Any:
    """With functions of sums of angles, which take sine and cosine of one and the same angle."""
    angles = ({x.args[0] for x in plain.atoms(kind)} for kind in (sp.sin, sp.cos))
    return plain if next(angles).isdisjoint(next(angles)) else TR10i(plain)
