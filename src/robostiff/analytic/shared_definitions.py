"""Definitions of a whole, told where they are needed first."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sympy as sp

from robostiff.analytic.derivation import Definition


def shared_out(
    definitions: Sequence[Definition], parts: Sequence[Iterable[sp.Expr]]
) -> list[tuple[Definition, ...]]:
    """For each part the definitions that it is the first to need, in order.

    Examples
    --------
    >>> a, b, c = sp.symbols("a b c")
    >>> definitions = (Definition(b, a + 1), Definition(c, b**2))
    >>> [[str(d.symbol) for d in own] for own in shared_out(definitions, [[b], [c], [a]])]
    [['b'], ['c'], []]
    """
    by_symbol: dict[sp.Basic, Definition] = {d.symbol: d for d in definitions}
    left = dict(by_symbol)
    shared = []
    for results in parts:
        needed: set[sp.Basic] = set()
        waiting = {s for result in results for s in result.free_symbols}
        while waiting:
            symbol = waiting.pop()
            if symbol in by_symbol and symbol not in needed:
                needed.add(symbol)
                waiting |= by_symbol[symbol].expression.free_symbols
        own = tuple(d for symbol, d in left.items() if symbol in needed)
        for definition in own:
            del left[definition.symbol]
        shared.append(own)
    return shared
