"""The shortest way to write formulas: one search over names more, names less, and other names.

Its cost is that of a reader: operations, one for each name, and more for each line beyond ten. Two
laws keep formulas those of a person. No move adds a pole: what stands below a fraction bar, names
written out, may only become less. And a name has one dimension: a ratio of lengths, a lever times
a component, a difference, a square, an angle, but never a stiffness times a length.

A move keeps what it makes of each formula, so that what it costs is known from the formulas that it
touches, most of them written before.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import permutations, product
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import spend
from robostiff.analytic.exact.definition import Definition, operations_in, symbols_in
from robostiff.analytic.exact.element import root_of
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.reading.rewriting import (
    CountedFormula,
    Move,
    Writing,
    Written,
    as_components,
    by_difference,
    divide,
    free_names,
    in_letters,
    in_order,
    in_squares,
    multiple_of,
    over_a_name,
    put_in,
    rest_of_squares,
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
_LONGER = 6  # by how much a way that is followed may cost more than the best one
_ROUNDS = 30
_PATIENCE = 1  # rounds that may find nothing shorter
_SAME = 1e-10
_SPRINGS = ("c_", "k_", "EA", "EI", "GJ", "theta")  # names that the search does not write out
_PAIRS, _DIFFERENCES, _SUMS = 12, 3, 8  # the most frequent ones, which are tried


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
    """
    search = _Search(written, {*taken}, samples)
    found = in_letters(search.written(search.best()), {*taken})
    return as_components(found, components, {*taken})


class _Search:
    """Formulas of equal value, the shortest first; each name has one meaning in all of them."""

    def __init__(self, start: Written, taken: set[str], samples: Mapping[Any, np.ndarray]) -> None:
        self.start = start
        self.at = dict(samples)  # values of symbols and names at the samples
        self.taken = taken | {d.symbol.name for d in start.definitions}
        self.of = {d.symbol: d for d in start.definitions}
        self.kept = {s for s in self.of if s.name.startswith(_SPRINGS)}
        self.given: dict[Any, Definition] = {}  # names by what they stand for
        for d in start.definitions:
            self.give_value(d)
        self.is_long = len(start.results) + len(start.definitions) > _LINES
        self.bits: dict[Any, int] = {}
        self.squares = 0  # names of squares
        self.moves: dict[Any, Move] = {}
        self.units: dict[Any, bool] = {}  # whether x^2 + y^2 = 1, and x >= 0
        self.known: dict[Any, CountedFormula] = {}
        self.triangles: dict[Any, list[Move]] = {}

    def formula(self, expression: Any) -> CountedFormula:
        """One and the same for an expression."""
        found = self.known.get(expression)
        if found is None:
            parts, pending = {expression: None}, [expression]
            while pending:
                new = [x for x in pending.pop().args if x not in parts]
                parts |= dict.fromkeys(new)
                pending += new
            powers = [x for x in parts if x.is_Pow]
            below = [x.base for x in powers if x.exp.is_Rational and x.exp.is_negative]
            found = self.known[expression] = CountedFormula(
                expression,
                tuple(parts),
                operations_in(expression),
                self.bits_of(x for x in parts if x.is_Symbol),
                self.bits_of(s for x in below for s in symbols_in(x)),
                frozenset(x.base for x in powers if abs(x.exp) is sp.S.Half),
            )
        return found

    def bits_of(self, symbols: Iterable[Any]) -> int:
        """A set of symbols as a number."""
        found = 0
        for symbol in symbols:
            found |= self.bits.setdefault(symbol, 1 << len(self.bits))
        return found

    def needed(self, symbols: int, names: Mapping[Any, CountedFormula]) -> int:
        """Some symbols, and all by which names among them are computed."""
        while True:
            before = symbols
            for name, formula in names.items():
                if self.bits[name] & symbols:
                    symbols |= formula.symbols
            if symbols == before:
                return symbols

    def way(
        self,
        results: tuple[CountedFormula, ...],
        names: dict[Any, CountedFormula],
        begin: tuple[Writing, Move] | None = None,
    ) -> Writing:
        """A way without names that are in no result and no other name."""
        bits, wanted, every = self.bits, self.bits_of(self.kept), dict(names)
        if begin is not None:
            for x in results:
                wanted |= x.symbols
            wanted = self.needed(wanted, names)
            names = {s: x for s, x in names.items() if bits[s] & wanted}
        cost, lines, own_names, below, soft = 0, len(results), 0, 0, 0
        for x in results:
            cost += x.operations
            below |= x.below
        for s, x in names.items():
            own_names |= bits[s]
            soft |= 0 if s.is_positive else bits[s]
            below |= x.below
            if x.symbols:
                cost += x.operations + (_A_NAME if s in self.of else _A_NEW_NAME)
                lines += 1
        below = (below | self.needed(below & soft, names)) & ~own_names
        cost += _A_LINE * max(0, lines - _LINES)
        return Writing(results, names, cost, lines, own_names, below, every, begin)

    def best(self) -> Writing:
        """The shortest of all that are followed."""
        results, names = self.start.results, self.start.definitions
        best = self.way(
            tuple(map(self.formula, results)),
            {d.symbol: self.formula(d.expression) for d in names if self.bits_of([d.symbol])},
        )
        ways, seen, stale, least = [best], set[Any](), 0, best.cost
        width = min(_WIDTH, max(2, _FOLLOWED // best.lines))
        for _ in range(_ROUNDS):
            found: list[Writing] = []
            self.most = least + _LONGER
            for way in ways:
                for move in self.moves_from(way):
                    one = self.moved(way, move)
                    key = one.cost, one.lines, one.own
                    if key in seen or one.cost > self.most or one.below & ~way.below:
                        continue
                    if not self.has_rooted_names(one):
                        seen.add(key)
                        found.append(one)
            places, ways = Counter[int](), []  # a few ways of the same number of lines
            for one in sorted(found, key=lambda one: one.cost):
                if places[one.lines] < _ALIKE and len(ways) < width:
                    places[one.lines] += 1
                    ways.append(one)
            stale += 1
            if ways and ways[0].cost < least:
                least, stale = ways[0].cost, 0
            read = (x for x in found if x.cost <= best.cost and not self.has_rooted_squares(x))
            best = min((best, *read), key=lambda x: (x.cost, (x.own & self.squares).bit_count()))
            if not ways or stale > _PATIENCE:
                break
        return best

    def moved(self, w: Writing, move: Move) -> Writing:
        """The same after a move."""
        spend()
        wanted, made = move.symbols, move.made

        def changed(x: CountedFormula) -> CountedFormula:
            if wanted & ~x.symbols:
                return x
            found = made.get(x)
            if found is None:
                found = made[x] = self.formula(move.change(x.expression, *move.by))
            return found

        names = {s: x for s, x in w.names.items() if s is not move.out}
        first = 0
        if move.new is not None:
            symbol = move.new.symbol
            names = {symbol: self.formula(move.new.expression)} | {
                s: x for s, x in names.items() if s is not symbol
            }
            first = self.needed(self.bits[symbol], names)
        names = {s: x if self.bits[s] & first else changed(x) for s, x in names.items()}
        return self.way(tuple(map(changed, w.results)), names, (w, move))

    def has_rooted_names(self, w: Writing) -> bool:
        """Whether the root of a named sum stands somewhere: it should have a name itself."""
        roots = frozenset[Any]().union(*(x.rooted for x in w.formulas if x.rooted))
        given = (name for name in w.names.items() if roots and name[0] not in self.of)
        return any(s in roots or x.expression in roots for s, x in given)

    def has_rooted_squares(self, w: Writing) -> bool:
        """Whether a root has a named square in it: what is squared should have the name."""
        roots = (x for f in w.formulas for x in f.rooted)
        return any(self.bits_of(symbols_in(x)) & self.squares for x in roots)

    def moves_from(self, w: Writing) -> Iterator[Move]:
        """All that lead one step from a way."""
        for symbol, formula in w.names.items():
            # What has an angle that is computed is longer without.
            is_angle = isinstance(formula.expression, sp.acos)
            if formula.symbols and symbol not in self.kept and not is_angle:
                yield from self.without(w, symbol, formula.expression)
        yield from self.by_ratios(w)
        yield from self.by_sums(w)
        yield from self.by_unit_lengths(w)
        yield from self.by_angles(w)
        yield from self.by_compliances(w)

    def move(
        self,
        change: Callable[..., Any],
        *by: Any,
        of: Iterable[Any] = (),
        new: Definition | None = None,
        out: Any = None,
    ) -> Move:
        """One and the same for what it does; `of`: symbols of the formulas that it changes."""
        key = change, by, new, out
        if key not in self.moves:
            self.moves[key] = Move(change, by, self.bits_of(of), new, out)
        return self.moves[key]

    def without(self, w: Writing, name: Any, expression: Any) -> Iterator[Move]:
        """A name written out, in squares, or as a ratio times what it is divided by."""
        # A root may vanish in a square, which is two operations less.
        more, room = w.names[name].operations - 2, self.most - w.cost
        uses = sum(x.uses[name] for x in w.formulas)
        if (uses - 1) * more <= room:
            yield self.move(written_out, name, expression, of=[name], out=name)
        powers = sum(x.uses[name, 2] for x in w.formulas)
        is_shorter = powers and (uses - powers - 1) * more <= room
        if is_shorter and self.is_long and not name.name.startswith("L_"):
            square = self.name("p", expression**2, positive=True)
            self.squares |= self.bits[square.symbol]
            by = name, square.symbol, expression
            yield self.move(in_squares, *by, of=[name], new=square, out=name)
        if name in self.of and self.of[name].parts:
            return  # a modulus is no length
        for symbol, ratio in w.names.items():
            if ratio.expression.is_Mul and name in ratio.expression.args:
                below = name / ratio.expression
                if self.needed(self.bits_of(symbols_in(below)), w.names) & self.bits[name]:
                    continue
                new = Definition(symbol, expression / below)
                yield self.move(with_multiple, name, symbol * below, of=[name], new=new, out=name)

    def by_ratios(self, w: Writing) -> Iterator[Move]:
        """A name for a ratio of lengths that recurs: a component of a unit vector.

        A length below all results is a factor in front of them: 1/L^2.
        """
        in_front = frozenset[Any]()
        if w.results:
            in_front = w.results[0].divisors.intersection(*(x.divisors for x in w.results))
        pairs = Counter(p for x in w.formulas for p in x.ratios if in_front.isdisjoint(p))
        for (a, b), times in pairs.most_common(_PAIRS):
            if times > 1:
                if a.name[:2] == b.name[:2] == "L_":
                    yield from self.by_cosine(w, a, b)
                new = self.name("s", a / b)
                yield self.move(divide, new, of=(a, b), new=new)

    def by_cosine(self, w: Writing, above: Any, below: Any) -> Iterator[Move]:
        """For s = L_a/L_b with L_a^2 = L_b^2 - x^2: sqrt(1 - (x/L_b)^2), and s L_b for L_a."""
        if not {above, below} <= w.names.keys():
            return
        if self.needed(self.bits[below], w.names) & self.bits[above]:
            return
        rest = rest_of_squares(*(w.names[length].expression ** 2 for length in (above, below)))
        if rest is not None:
            new = self.name("s", root_of(1 - rest / below**2), positive=True)
            put = ((above, new.symbol * below),)
            yield self.move(put_in, put, of=[above], new=new, out=above)

    def by_sums(self, w: Writing) -> Iterator[Move]:
        """A name for a difference, a sum or an angle that recurs; named sums in other sums."""
        sums = Counter(x for f in w.formulas for x in f.sums)
        both = (ab for f in w.formulas for ab in f.differences)
        differences = Counter((a, b) for a, b in both if not (a in w.names or b in w.names))
        for (a, b), times in differences.most_common(_DIFFERENCES):
            if times > 1:
                new = self.name("d", a - b)
                yield self.move(by_difference, new, a, b, of=(a, b), new=new)
        angles = {x.args[0] for f in w.formulas for x in f.parts if isinstance(x, sp.sin | sp.cos)}
        for total, times in sums.most_common(_SUMS):
            if times > 1 and total.free_symbols:
                yield self.with_name(w, total, "theta" if total in angles else "p")
        terms_of = {x: (frozenset(x.args), self.bits_of(symbols_in(x))) for x in sums}
        for name, formula in w.names.items():
            expression = formula.expression
            around = [
                terms
                for x, (terms, symbols) in terms_of.items()
                if not formula.symbols & ~symbols and x not in formula.sums
            ]
            new, powers = Definition(name, expression), [(expression, name)] if around else []
            if around and not name.name.startswith(_SPRINGS):
                powers.append((formula.square, name**2))
            for total, power in powers:
                terms = frozenset(total.args)
                if total.is_Add and any(terms < x for x in around):
                    yield self.move(with_sum, terms, power, of=symbols_in(total), new=new)

    def with_name(self, w: Writing, total: Any, letter: str) -> Move:
        """A name for a sum as it stands, or for its root where that occurs."""
        root = root_of(total)
        has_root = any(total in x.rooted for x in w.formulas)
        new = self.name("s", root) if has_root else self.name(letter, total)
        square = new.symbol**2 if has_root else new.symbol
        put = (root, new.symbol), (1 / root, 1 / new.symbol), (total, square), (-total, -square)
        return self.move(put_in, put, of=symbols_in(total), new=new)

    def by_unit_lengths(self, w: Writing) -> Iterator[Move]:
        """What x^2 + y^2 = 1 makes of names: x^2 for 1 - y^2, sqrt(1 - y^2) for x, or neither."""
        real = [s for s in w.names if not s.name.startswith(("L_", *_SPRINGS))]
        for x, y in permutations(real, 2):
            if not self.is_unit(x, y):
                continue
            formula = w.names[x].expression
            rest = 1 - y**2
            if any(rest in f.sums for f in w.formulas):
                put = ((rest, x**2),)
                yield self.move(put_in, put, of=[y], new=Definition(x, formula))
            needed = self.needed(self.bits[y], w.names)
            if needed & self.bits[x]:
                continue
            root = root_of(rest)
            if root != formula and np.all(self.at[x] > -_SAME):
                yield Move(put_in, (), -1, Definition(x, root))
            if needed != self.bits[y]:
                yield self.move(in_squares, x, rest, formula, of=[x], out=x)

    def by_angles(self, w: Writing) -> Iterator[Move]:
        """The angle of a triangle of three known sides, b sin(theta) = sqrt(b^2 - a^2)."""
        roots = dict.fromkeys(x for f in w.formulas for x in f.rooted if x.is_Mul)
        parts = (x for f in w.formulas if roots for x in f.parts if x.is_Pow and x.exp == 2)
        squared = dict.fromkeys(x.base for x in parts if x.base.is_Add)
        for pair in product(roots, squared):
            if pair not in self.triangles:
                self.triangles[pair] = [*self.by_triangle(*pair)]
            yield from self.triangles[pair]

    def by_triangle(self, radicand: Any, above: Any) -> Iterator[Move]:
        """The angle of two sides of which one is below a root, where they make a third side."""
        side = third_side(radicand, above)
        if side is None:
            return
        new = self.name("theta", sp.acos(above / side))
        sine = side * sp.sin(new.symbol)
        put = [(above, side * sp.cos(new.symbol)), (radicand, sine**2)]
        halves = (sp.S.Half, sine), (-sp.S.Half, 1 / sine)
        put += [(sp.Pow(radicand, x, evaluate=False), whole) for x, whole in halves]
        yield self.move(put_in, tuple(put), new=new)

    def by_compliances(self, w: Writing) -> Iterator[Move]:
        """Ratios of compliances where moduli are multiplied out below a fraction bar."""
        parts = (x for f in w.formulas for x in f.parts if x.is_Pow)
        powers = dict.fromkeys(x for x in parts if x.exp is sp.S.NegativeOne and x.base.is_Add)
        for name, formula in w.names.items() if powers else ():
            if name in self.kept and formula.expression.is_Add:
                for total in (x.base for x in powers):
                    if not self.bits_of(symbols_in(total)) & formula.below:
                        continue  # no modulus
                    factor = multiple_of(total, formula.expression)
                    if factor is not None and total != formula.expression:
                        new = Definition(name, formula.expression)
                        by = total, name, factor
                        yield self.move(over_a_name, *by, of=symbols_in(total), new=new)

    def name(self, letter: str, expression: Any, *, positive: bool = False) -> Definition:
        """A name for an expression in names, the same wherever it is given."""
        if expression not in self.given:
            name = next(free_names(letter, self.taken))
            self.taken.add(name)
            symbol = sp.Symbol(name, **({"positive": True} if positive else {"real": True}))
            self.given[expression] = Definition(symbol, expression)
            self.give_value(self.given[expression])
            self.bits_of([symbol])
        return self.given[expression]

    def give_value(self, d: Definition) -> None:
        """Of a name at the samples."""
        at = {s: self.at[s] for s in symbols_in(d.expression)}
        (self.at[d.symbol],) = values_of([d.expression], at)

    def is_unit(self, x: Any, y: Any) -> bool:
        """Whether x^2 + y^2 = 1 at all samples."""
        if (x, y) not in self.units:
            squares = self.at[x] ** 2 + self.at[y] ** 2
            is_unit = bool(np.all(np.abs(squares - 1) < _SAME))
            self.units[x, y] = self.units[y, x] = is_unit
        return self.units[x, y]

    def written(self, w: Writing) -> Written:
        """A way as it is written; the others go the same way."""
        names = [Definition(s, x.expression) for s, x in w.names.items()]
        names = [replace(self.of.get(d.symbol, d), expression=d.expression) for d in names]
        ways = [w]
        while ways[-1].begin is not None:
            ways.append(ways[-1].begin[0])
        others = self.start.others
        for way in reversed(ways[:-1]):
            move = way.begin and way.begin[1]
            every = [Definition(s, x.expression) for s, x in way.all_names.items()]
            idle = [d for d in reversed([*in_order(every)]) if d.symbol not in way.names]

            def changed(x: Any, move: Any = move, idle: Any = idle) -> Any:
                if not move.symbols & ~self.bits_of(symbols_in(x)):
                    x = move.change(x, *move.by)
                for d in idle:
                    x = written_out(x, d.symbol, d.expression)
                return x

            others = tuple(tuple(map(changed, one)) for one in others)
        return Written(tuple(x.expression for x in w.results), tuple(names), others)
