"""Formulas in names, and the letters of these: in order, and such as a person gives."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count, product
from string import ascii_lowercase
from typing import Any

import sympy as sp

from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.exact.operation_count import symbols_in

_LETTERS = ("c", "d", "e", "k", "p", "s", "theta")  # of names that count


@dataclass(frozen=True)
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
    return in_letters(_renamed(written, put), taken) if put else written


def in_order(definitions: Sequence[Definition]) -> Iterator[Definition]:
    """Definitions so that each uses those before, otherwise as they came."""
    left: dict[Any, Definition] = {d.symbol: d for d in definitions}

    for d in definitions:
        waiting = [d] if d.symbol in left else []
        while waiting:
            before = symbols_in(waiting[-1].expression) & left.keys()
            if before:
                waiting.append(left[min(before, key=str)])
            else:
                yield left.pop(waiting.pop().symbol)
