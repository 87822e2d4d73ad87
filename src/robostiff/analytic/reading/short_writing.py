"""The shortest way to write formulas: one search over names more, names less, and other names.

Its cost is that of a reader: operations, one for each name, and more for each line beyond ten. Two
laws keep formulas those of a person. No move adds a pole: what stands below a fraction bar, names
written out, may only become less. And a name has one dimension: a ratio of lengths, a lever times
a component, a difference, a square, an angle, but never a stiffness times a length.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import combinations, permutations
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import spend
from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.exact.element import root_of
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.exact.operation_count import symbols_in
from robostiff.analytic.reading.combinations import free_names
from robostiff.analytic.reading.rewriting import (
    by_difference,
    divided,
    facts_of,
    in_squares,
    multiple_of,
    over_a_name,
    powers,
    third_side,
    with_multiple,
    with_sum,
    written_out,
)

_LINES = 10  # lines that are read at a glance
_A_NAME, _A_NEW_NAME = 1, 3  # operations that a name costs, and one that the search gives
_A_LINE = 6  # and each line beyond ten
_FOLLOWED, _ALIKE = 66, 2  # lines of all ways that are followed, and ways of as many lines
_WIDTH = 6  # the most ways
_ROUNDS = 30
_PATIENCE = 1  # rounds that may find nothing shorter
_SAME = 1e-10
_NO_LENGTHS = ("c_", "k", "K", "E", "G", "e_", "theta")  # how their names begin
_SPRINGS = ("c_", "k_", "EA", "EI", "GJ", "theta")  # names that the search does not write out
_LETTERS = ("c", "d", "e", "k", "p", "s", "theta")  # of names that count
_PAIRS, _DIFFERENCES, _SUMS = 12, 6, 8  # the most frequent ones, which are tried


@dataclass(frozen=True)
class Written:
    """Expressions in names, and what the names stand for."""

    results: tuple[Any, ...]  # what is counted, and printed one a line
    definitions: tuple[Definition, ...]
    # Gives what is written in the same names, and not counted.
    others: Callable[[], tuple[tuple[Any, ...], ...]] = field(default=tuple, compare=False)
    given: Set[Any] = frozenset()  # names that a search gives

    @cached_property
    def formulas(self) -> tuple[Any, ...]:
        """Results, and formulas of names."""
        return (*self.results, *(d.expression for d in self.definitions))

    @cached_property
    def operations(self) -> int:
        """Of all of them."""
        return sum(facts_of(x).operations for x in self.formulas)

    @property
    def lines(self) -> int:
        """Results, and names that are formulas."""
        return len(self.results) + sum(bool(symbols_in(d.expression)) for d in self.definitions)

    @cached_property
    def cost(self) -> int:
        """Operations, and those that names and lines are worth."""
        names = [d.symbol for d in self.definitions if symbols_in(d.expression)]
        new = sum(x in self.given for x in names)
        of_names = _A_NAME * (len(names) - new) + _A_NEW_NAME * new
        return self.operations + of_names + _A_LINE * max(0, self.lines - _LINES)

    @property
    def has_rooted_names(self) -> bool:
        """Whether the root of a named sum stands somewhere: it should have a name itself."""
        given = [d for d in self.definitions if d.symbol in self.given]
        named = {x for d in given for x in (d.symbol, d.expression)}
        return any(not facts_of(f).rooted.isdisjoint(named) for f in self.formulas)

    @cached_property
    def below(self) -> frozenset[Any]:
        """Given symbols below fraction bars; names that are positive are no pole."""
        found = frozenset[Any]().union(*(facts_of(f).below for f in self.formulas))
        names = {d.symbol: d for d in self.definitions}
        pending = [x for x in found if x in names and not x.is_positive]
        while pending:
            own = symbols_in(names[pending.pop()].expression) - found
            pending += own & names.keys()
            found |= own
        return found - names.keys()


def shortest(
    written: Written,
    taken: Iterable[str],
    samples: Mapping[Any, np.ndarray],
    components: Sequence[str] = (),
) -> Written:
    """The same formulas in the names that make them shortest to read.

    Parameters
    ----------
    written : Written
    taken : iterable of str
        Names that stand for something else.
    samples : mapping of symbols to arrays (count,)
        Values of the given symbols, at which x^2 + y^2 = 1 is seen.
    components : sequence of str
        Names for what is an entry of a matrix among the others, a name a row.

    Examples
    --------
    >>> a, b, d, k = sp.symbols("a b d k", real=True)
    >>> L = sp.Symbol("L_a", positive=True)
    >>> area = -(d - a - b) * (d - a + b) * (d + a - b) * (d + a + b)
    >>> K = k * L**2 / (4 * a**2 * b**2), 1 / k + (d**2 - a**2 - b**2) ** 2 / (4 * a**2), L**2 / k
    >>> at = {x: np.array([1.1, 1.2]) + 0.1 * i for i, x in enumerate((a, b, d, k))}
    >>> found = shortest(Written(K, (Definition(L, sp.sqrt(area)),)), {"a", "b", "d", "k"}, at)
    >>> found.definitions[0].expression, found.results[:2]
    (acos((-a**2 - b**2 + d**2)/(2*a*b)), (k*sin(theta_a)**2, b**2*cos(theta_a)**2 + 1/k))
    """
    search = _Search(written, {*taken}, dict(samples))
    found = in_letters(search.best(), {*taken})
    return _as_components(found, components, {*taken})


class _Search:
    """Formulas of equal value, the shortest first; each name has one meaning in all of them."""

    def __init__(self, start: Written, taken: set[str], at: dict[Any, Any]) -> None:
        self.start = start
        self.at = at  # values of symbols and names at the samples
        self.taken = taken | {d.symbol.name for d in start.definitions}
        self.kept = {d.symbol for d in start.definitions if d.symbol.name.startswith(_SPRINGS)}
        self.given: dict[Any, sp.Symbol] = {}  # names by what they stand for
        self.names: set[Any] = set()  # all of these
        for d in start.definitions:
            (at[d.symbol],) = values_of([d.expression], at)

    def best(self) -> Written:
        """The shortest of all that are followed."""
        best = self.start
        states, seen, stale = [best], set[Any](), 0
        width = min(_WIDTH, max(2, _FOLLOWED // best.lines))
        for _ in range(_ROUNDS):
            found: list[Written] = []
            for own in states:
                for one in self.moves(own):
                    key = one.cost, one.lines, frozenset(d.symbol for d in one.definitions)
                    if key in seen or one.has_rooted_names or not one.below <= own.below:
                        continue
                    seen.add(key)
                    found.append(one)
            states, stale = _shortest_of_each_length(found, width), stale + 1
            if states and states[0].cost < best.cost:
                best, stale = states[0], 0
            if not states or stale > _PATIENCE:
                break
        return best

    def moves(self, w: Written) -> Iterator[Written]:
        """All formulas that are one step from these."""
        for d in w.definitions:
            if symbols_in(d.expression) and d.symbol not in self.kept:
                yield from self.without(w, d)
        yield from self.by_ratios(w)
        yield from self.by_sums(w)
        yield from self.by_unit_lengths(w)
        yield from self.by_angles(w)
        yield from self.by_compliances(w)

    def without(self, w: Written, d: Definition) -> Iterator[Written]:
        """A name written out, in squares, or as a ratio times what it is divided by."""
        name, expression = d.symbol, d.expression
        yield self.changed(w, lambda x: written_out(x, name, expression), {name}, out=d)
        is_squared = any(name in facts_of(f).powers for f in w.formulas)
        if is_squared and self.start.lines > _LINES and not name.name.startswith("L_"):
            square = self.name("p", expression**2, positive=True)
            by = name, square.symbol, expression
            yield self.changed(w, lambda x, by=by: in_squares(x, *by), {name}, square, d)
        for ratio in () if d.parts else w.definitions:  # a modulus is no length
            if ratio.expression.is_Mul and name in ratio.expression.args:
                below = name / ratio.expression
                if any(name in needed_for(x, w.definitions) for x in symbols_in(below)):
                    continue
                new = Definition(ratio.symbol, expression / below)
                left = replace(w, definitions=tuple(x for x in w.definitions if x is not ratio))
                by = name, ratio.symbol * below
                change = lambda x, by=by: with_multiple(x, *by)  # noqa: E731
                yield self.changed(left, change, {name}, new, d)

    def by_ratios(self, w: Written) -> Iterator[Written]:
        """A name for a ratio of lengths that recurs: a component of a unit vector.

        A length below all results is a factor in front of them: 1/L^2.
        """
        below = ({x for x, power in powers(f).items() if power < 0} for f in w.results)
        in_front = set.intersection(*below) if w.results else set()
        pairs: Counter[Any] = Counter()
        for factors in (powers(x) for f in w.formulas for x in facts_of(f).products):
            bases = (b for b in factors if b.is_Symbol and not b.name.startswith(_NO_LENGTHS))
            for a, b in combinations(sorted(bases, key=str), 2):
                is_named = any(x.name.startswith(("L_", "d_")) for x in (a, b))
                if is_named and factors[a] == -factors[b] and in_front.isdisjoint((a, b)):
                    pairs[(a, b) if factors[a] > 0 else (b, a)] += 1
        for (a, b), times in pairs.most_common(_PAIRS):
            if times > 1:
                if a.name[:2] == b.name[:2] == "L_":
                    yield from self.by_cosine(w, a, b)
                new = self.name("s", a / b)
                yield self.changed(w, lambda x, new=new: divided(x, new), {a, b}, new)

    def by_cosine(self, w: Written, above: Any, below: Any) -> Iterator[Written]:
        """For s = L_a/L_b with L_a^2 = L_b^2 - x^2: sqrt(1 - (x/L_b)^2), and s L_b for L_a."""
        full = {d.symbol: d for d in w.definitions}
        if not {above, below} <= full.keys() or above in needed_for(below, w.definitions):
            return
        squares = [full[length].expression ** 2 for length in (above, below)]
        if not (squares[0].is_Add and squares[1].is_Add):
            return
        rest: Any = sp.factor_terms(sp.expand(squares[1] - squares[0]))
        for turn in rest.atoms(sp.cos):
            rest = rest.xreplace({1 - turn**2: sp.sin(turn.args[0]) ** 2})
        if rest.is_Add:
            return
        new = self.name("s", root_of(1 - rest / below**2), positive=True)
        put = {above: new.symbol * below}
        yield self.changed(w, lambda x: x.xreplace(put), {above}, new, full[above])

    def by_sums(self, w: Written) -> Iterator[Written]:
        """A name for a difference, a sum or an angle that recurs; named sums in other sums."""
        names = {d.symbol for d in w.definitions}
        parts = [x for f in w.formulas for x in facts_of(f).parts]
        angles = {x.args[0] for x in parts if isinstance(x, sp.sin | sp.cos)}
        sums = Counter(x for x in parts if x.is_Add)
        differences: Counter[Any] = Counter()
        for total, times in sums.items():
            plus = sorted((x for x in total.args if x.is_Symbol and x not in names), key=str)
            minus = sorted((-x for x in total.args if (-x).is_Symbol and -x not in names), key=str)
            for a, b in ((a, b) for a in plus for b in minus):
                differences[a, b] += times
        for (a, b), times in differences.most_common(_DIFFERENCES):
            if times > 1:
                new = self.name("d", a - b)
                change = lambda x, by=(new, a, b): by_difference(x, *by)  # noqa: E731
                yield self.changed(w, change, {a, b}, new)
        for total, times in sums.most_common(_SUMS):
            if times > 1 and total.free_symbols:
                yield self.with_name(w, total, "theta" if total in angles else "p")
        for d in w.definitions:
            is_sum = d.expression.is_Add
            total, name = (d.expression if is_sum else d.expression**2), d.symbol ** (2 - is_sum)
            terms = frozenset(total.args)
            if total.is_Add and any(terms <= {*x.args} for x in sums if x != total):
                change = lambda x, by=(terms, name): with_sum(x, *by)  # noqa: E731
                yield self.changed(w, change, symbols_in(total), d)

    def with_name(self, w: Written, total: Any, letter: str) -> Written:
        """With a name for a sum as it stands, or for its root where that occurs."""
        root = root_of(total)
        has_root = any(total in facts_of(f).rooted for f in w.formulas)
        new = self.name("s", root) if has_root else self.name(letter, total)
        square = new.symbol**2 if has_root else new.symbol
        put = {root: new.symbol, 1 / root: 1 / new.symbol, total: square, -total: -square}
        return self.changed(w, lambda x: x.xreplace(put), symbols_in(total), new)

    def by_unit_lengths(self, w: Written) -> Iterator[Written]:
        """What x^2 + y^2 = 1 makes of names: x^2 for 1 - y^2, sqrt(1 - y^2) for x, or neither."""
        real = [d for d in w.definitions if not d.symbol.name.startswith(("L_", *_SPRINGS))]
        sums = {x for f in w.formulas for x in facts_of(f).sums}
        for a, b in permutations(real, 2):
            x, y = a.symbol, b.symbol
            if not self.are_equal(self.at[x] ** 2, 1 - self.at[y] ** 2):
                continue
            if 1 - y**2 in sums:
                yield self.changed(w, lambda f, x=x, y=y: f.xreplace({1 - y**2: x**2}), {y}, a)
            if x in needed_for(y, w.definitions):
                continue
            root = Definition(x, root_of(1 - y**2))
            if root != a and self.are_equal(self.at[x], np.sqrt(1 - self.at[y] ** 2)):
                names = tuple(root if d is a else d for d in w.definitions)
                yield _used(replace(w, definitions=names), self.kept)
            if len(needed_for(y, w.definitions)) > 1:
                by = x, 1 - y**2, a.expression
                yield self.changed(w, lambda f, by=by: in_squares(f, *by), {x}, out=a)

    def by_angles(self, w: Written) -> Iterator[Written]:
        """The angle of a triangle of three known sides, b sin(theta) = sqrt(b^2 - a^2)."""
        parts = dict.fromkeys(x for f in w.formulas for x in facts_of(f).parts)
        roots = (x.base for x in parts if x.is_Pow and abs(x.exp) is sp.S.Half)
        squared = [x.base for x in parts if x.is_Pow and x.exp == 2 and x.base.is_Add]
        for radicand in (x for x in roots if x.is_Mul):
            for above in squared:
                side = third_side(radicand, above)
                if side is None:
                    continue
                new = self.name("theta", sp.acos(above / side))
                sine = side * sp.sin(new.symbol)
                put = {above: side * sp.cos(new.symbol), radicand: sine**2}
                put |= {radicand**half: sine ** (2 * half) for half in (sp.S.Half, -sp.S.Half)}
                yield self.changed(w, lambda x, put=put: x.xreplace(put), (), new)

    def by_compliances(self, w: Written) -> Iterator[Written]:
        """Ratios of compliances where moduli are multiplied out below a fraction bar."""
        parts = dict.fromkeys(x for f in w.formulas for x in facts_of(f).parts)
        below = [x.base for x in parts if x.is_Pow and x.exp is sp.S.NegativeOne and x.base.is_Add]
        for d in w.definitions if below else ():
            if d.symbol in self.kept and d.expression.is_Add:
                for total in below:
                    factor = multiple_of(total, d.expression)
                    if factor is not None and total != d.expression:
                        by = total, d.symbol, factor
                        symbols = symbols_in(total)
                        yield self.changed(w, lambda x, by=by: over_a_name(x, *by), symbols, d)

    def name(self, letter: str, expression: Any, *, positive: bool = False) -> Definition:
        """A name for an expression in names, the same wherever it is given."""
        if expression not in self.given:
            name = next(free_names(letter, self.taken))
            self.taken.add(name)
            assumed = {"positive": True} if positive else {"real": True}
            symbol = self.given[expression] = sp.Symbol(name, **assumed)
            self.names.add(symbol)
            (self.at[symbol],) = values_of([expression], self.at)
        return Definition(self.given[expression], expression)

    def are_equal(self, a: Any, b: Any) -> bool:
        """Whether values are equal at all samples, relative to one."""
        return bool(np.all(np.abs(a - b) < _SAME))

    def changed(
        self,
        w: Written,
        change: Callable[[Any], Any],
        symbols: Iterable[Any],
        new: Definition | None = None,
        out: Definition | None = None,
    ) -> Written:
        """The same with all formulas changed that have some symbols.

        `new`: a name that comes in, or stays; that and what computes it are not changed; `out`:
        the name that goes.
        """
        spend()
        wanted = frozenset(symbols)

        def own(x: Any) -> Any:
            return change(x) if wanted <= facts_of(x).symbols else x

        names = [d for d in w.definitions if d is not out]
        if new is not None:
            names = [new, *(d for d in names if d.symbol != new.symbol)]
        first = needed_for(new.symbol, names) if new else ()
        found = Written(
            tuple(map(own, w.results)),
            tuple(
                d if d.symbol in first else replace(d, expression=own(d.expression)) for d in names
            ),
            cache(lambda: tuple(tuple(map(own, one)) for one in w.others())),
            self.names,
        )
        return _used(found, self.kept)


def _shortest_of_each_length(found: Iterable[Written], width: int) -> list[Written]:
    """The shortest ways, a few of them of the same number of lines."""
    left, states = Counter[int](), []
    for one in sorted(found, key=lambda one: one.cost):
        if left[one.lines] < _ALIKE and len(states) < width:
            left[one.lines] += 1
            states.append(one)
    return states


def _used(written: Written, kept: Iterable[Any]) -> Written:
    """Without names that are in no result and no other name; these are written out elsewhere."""
    names = {d.symbol: d for d in written.definitions}
    pending = [*kept, *frozenset[Any]().union(*map(symbols_in, written.results))]
    wanted = set[Any]()
    while pending:
        symbol = pending.pop()
        if symbol in names and symbol not in wanted:
            wanted.add(symbol)
            pending += symbols_in(names[symbol].expression)
    idle = [d for d in written.definitions if d.symbol not in wanted]
    if not idle:
        return written

    def others() -> tuple[tuple[Any, ...], ...]:
        found = written.others()
        for d in reversed([*in_order(written.definitions)]):
            if d.symbol not in wanted:
                by = d.symbol, d.expression
                found = tuple(tuple(written_out(x, *by) for x in one) for one in found)
        return found

    left = tuple(d for d in written.definitions if d.symbol in wanted)
    return Written(written.results, left, cache(others), written.given)


def needed_for(symbol: Any, definitions: Sequence[Definition]) -> set[Any]:
    """All symbols by which a name is computed."""
    names = {d.symbol: d for d in definitions}
    found, pending = {symbol}, [symbol]
    while pending:
        d = names.get(pending.pop())
        new = symbols_in(d.expression) - found if d else ()
        found |= {*new}
        pending += new
    return found


def in_letters(written: Written, taken: Iterable[str]) -> Written:
    """The same in order, with letters in that order: e_a before e_b; lengths keep theirs.

    Examples
    --------
    >>> R, h, first, last = sp.symbols("R h c_b c_d")
    >>> names = Definition(first, h * last), Definition(last, 1 / R)
    >>> [(str(d.symbol), d.expression) for d in in_letters(Written((), names), {"c_a"}).definitions]
    [('c_b', 1/R), ('c_c', c_b*h)]
    """
    definitions = [*in_order(written.definitions)]
    given = {*taken} - {d.symbol.name for d in definitions}
    put: dict[Any, Any] = {}
    letters: dict[str, Iterator[str]] = {}
    for symbol in (d.symbol for d in definitions):
        letter, _, own = symbol.name.partition("_")
        if letter in _LETTERS and own and not own.isdigit():
            name = next(letters.setdefault(letter, free_names(letter, given)))
            if name != symbol.name:
                put[symbol] = sp.Symbol(name, **symbol.assumptions0)
    return _renamed(replace(written, definitions=tuple(definitions)), put)


def _renamed(written: Written, put: Mapping[Any, Any]) -> Written:
    """The same with other symbols."""
    if not put:
        return written
    return Written(
        tuple(x.xreplace(put) for x in written.results),
        tuple(
            replace(d, symbol=put.get(d.symbol, d.symbol), expression=d.expression.xreplace(put))
            for d in written.definitions
        ),
        cache(lambda: tuple(tuple(x.xreplace(put) for x in one) for one in written.others())),
    )


def _as_components(written: Written, components: Sequence[str], taken: set[str]) -> Written:
    """Names of ratios that are entries of a wrench, up to their sign: u_x, u_z."""
    used = taken | {d.symbol.name for d in written.definitions}
    put: dict[Any, Any] = {}
    for symbol in (d.symbol for d in written.definitions if d.symbol.name.startswith("s_")):
        for wrench in (x for x in written.others() if len(x) > 1):
            for name, entry in zip(components, wrench, strict=False):
                if entry in (symbol, -symbol) and name not in used and symbol not in put:
                    used.add(name)
                    put[symbol] = sp.Symbol(name, real=True)
    return in_letters(_renamed(written, put), taken) if put else written


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
