"""What is said of each leg of a derivation beside its formulas."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Definition
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring


def passive_freedoms(leg: PlacedLeg) -> tuple[str, ...]:
    """Names of the passive freedoms of a leg, those of its springs and blocks included.

    Blocks after the first add one for what they leave free together with it.
    """
    names = []
    for element in leg.own_parts:
        if isinstance(element, PlacedFreedom):
            if element.is_passive:
                names.append(element.name)
        else:
            count = element.elasticity.freedoms.shape[1]
            names += [f"{element.name}.free[{i}]" for i in range(count)]
    for block in leg.blocks:
        for branch in block.branches:
            names += passive_freedoms(branch)
    return (*names, *(f"{block.name}.free" for block in leg.blocks[1:]))


def elastic_parts(leg: PlacedLeg) -> tuple[str, ...]:
    """Names of the springs and of the drives with a stiffness."""
    return tuple(
        part.name
        for part in leg.parts
        if isinstance(part, PlacedSpring) or part.stiffness is not None
    )


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


def facts_of(placed: PlacedLeg, redundant: Sequence[bool]) -> dict[str, Any]:
    """Names of a leg, its passive freedoms, which of them are redundant, and its elastic parts."""
    names = passive_freedoms(placed)
    lost = zip(names, redundant, strict=True)
    return {
        "name": placed.name,
        "joints": names,
        "redundant": tuple(name for name, is_lost in lost if is_lost),
        "elastic": elastic_parts(placed),
    }


def facts_of_all(
    name: str, legs: Sequence[PlacedLeg], redundant: Sequence[bool], further: Sequence[str]
) -> dict[str, Any]:
    """The same of several legs as one, with names of further elastic parts."""
    each = [facts_of(leg, [False] * len(passive_freedoms(leg))) for leg in legs]
    joints = tuple(f"{own['name']}/{joint}" for own in each for joint in own["joints"])
    elastic = tuple(f"{own['name']}/{part}" for own in each for part in own["elastic"])
    lost = zip(joints, redundant, strict=True)
    return {
        "name": name,
        "joints": joints,
        "redundant": tuple(joint for joint, is_lost in lost if is_lost),
        "elastic": (*elastic, *further),
    }
