"""Stiffnesses of springs and moduli of materials in the nomenclature, with their values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy as sp

from robostiff.analytic.exact.definition import Condition
from robostiff.analytic.export.outline import (
    Block,
    Nomenclature,
    OutlineHeading,
    OutlineText,
    ScalarEquations,
    is_value,
)

_MEANINGS = {
    "E": ("Young's modulus", "GPa"),
    "G": ("shear modulus", "GPa"),
    "k": ("stiffness", ""),
    "EA": ("axial stiffness E A", "N"),
    "EI": ("bending stiffness E I", "N m²"),
    "EI_y": ("bending stiffness E I about y", "N m²"),
    "EI_z": ("bending stiffness E I about z", "N m²"),
    "GJ": ("torsional stiffness G J", "N m²"),
}


def with_springs(blocks: Sequence[Block]) -> tuple[Block, ...]:
    """The same blocks with a line for each stiffness in the nomenclature, the last of them."""
    *others, last = blocks
    if not isinstance(last, Nomenclature):
        return tuple(blocks)
    named = {
        d.symbol.name: d
        for block in others
        if isinstance(block, ScalarEquations)
        for d in block.of_springs
    }
    rows = list(last.rows)
    for name in sorted(named, key=_place_in_list):
        d = named[name]
        words, unit = _MEANINGS[_letter_and_number(name)[0]]
        size = 1e9 if unit == "GPa" else 1.0
        value = f", {float(d.expression) / size:.12g} {unit or d.unit}" if is_value(d) else ""
        rows.append(((d.symbol.name,), f"{words} of {', '.join(d.parts)}{value}"))
    shown = [b for b in others if not isinstance(b, ScalarEquations) or b.rows]
    after = [*shown[1:], last]
    kept = [b for b, then in zip(shown, after, strict=True) if not _is_bare(b, then)]
    return (*kept, Nomenclature(tuple(rows)))


def _letter_and_number(name: str) -> tuple[str, int]:
    letter, _, number = name.rpartition("_")
    return (letter.replace("'", ""), int(number)) if letter else (name, 0)


def _place_in_list(name: str) -> tuple[bool, int, str]:
    """Moduli first, then the stiffnesses of one beam after the other."""
    letter, number = _letter_and_number(name)
    return len(letter) > 1, number, letter


def _is_bare(block: Block, after: Block) -> bool:
    """Whether a heading has nothing below it."""
    if not (isinstance(block, OutlineHeading) and isinstance(after, OutlineHeading)):
        return False
    return block.level >= after.level


_LONG = 20  # operations: such a condition is in words, and only programs have it in full
_LETTER = "Delta"
_LEGS = "{legs}"


def with_conditions(blocks: Sequence[Block], derivation: Any) -> tuple[Block, ...]:
    """The blocks of a derivation and, before its nomenclature, where the formula holds."""
    conditions, legs = derivation.conditions, _legs_of(derivation)
    *before, last = blocks
    beside = [c for c in conditions if not c.equations and c.expression.free_symbols]
    beside = [c for c in beside if not c.expression.is_Symbol]  # a symbol that is positive
    if not beside or not isinstance(last, Nomenclature):
        return tuple(blocks)
    taken = {str(name) for names, _ in last.rows for name in names}
    letter = _LETTER
    while any(name.startswith(letter) for name in taken):
        letter += "'"
    short = [c for c in beside if _operations(c.expression) <= _LONG]
    # What is short for some legs alone is in words for all of them.
    of_legs = {(_of_any_leg(c), c.leg) for c in short}
    in_words = {_of_any_leg(c) for c in beside if (_of_any_leg(c), c.leg) not in of_legs}
    short = [c for c in short if _of_any_leg(c) not in in_words]
    groups: dict[Any, list[Condition]] = {}  # of legs alike one
    for c in short:
        groups.setdefault(_multiplied_out(c.expression), []).append(c)
    named = [(f"{letter}_{i}", own) for i, own in enumerate(groups.values(), start=1)]
    section: list[Block] = [OutlineHeading("Where the formula holds")]
    if named:
        section.append(OutlineText("It holds where these differences are positive."))
        section.append(ScalarEquations(tuple((x, own[0].expression) for x, own in named)))
    rest = [c for c in beside if c not in short]
    if rest:
        section.append(OutlineText(f"It holds only where {_words(rest, legs)}."))
    rows = (((name,), f"positive where {_words(own, legs)}") for name, own in named)
    return (*before, *section, Nomenclature((*last.rows, *rows)))


def in_programs(derivation: Any) -> list[tuple[str, Any]]:
    """Words and expressions of the conditions of a derivation, once of legs alike."""
    legs = _legs_of(derivation)
    groups: dict[str, list[Condition]] = {}
    for c in derivation.conditions:
        groups.setdefault(_of_any_leg(c), []).append(c)
    found: dict[Any, tuple[str, Any]] = {}
    for own in groups.values():
        words = _words(own, legs)
        for c in own:
            found.setdefault(_multiplied_out(c.expression), (words, c.expression))
    return list(found.values())


def _legs_of(derivation: Any) -> list[str]:
    """Names of all legs of a robot; none of other formulas."""
    whole = getattr(derivation, "derivation", derivation)
    return [leg.name for leg in getattr(whole, "legs", ())]


def _words(conditions: Sequence[Condition], legs: Sequence[str]) -> str:
    """Of conditions, those of several legs together."""
    groups: dict[str, dict[str, None]] = {}
    for c in conditions:
        groups.setdefault(_of_any_leg(c), {})[c.leg] = None
    return "; ".join(words.replace(_LEGS, _named(list(own), legs)) for words, own in groups.items())


def _named(own: Sequence[str], legs: Sequence[str]) -> str:
    if len(own) == 1:
        return f"leg {own[0]!r}"
    return "each leg" if set(own) == set(legs) else f"each of {', '.join(map(repr, own))}"


def _of_any_leg(condition: Condition) -> str:
    """Its words, with a mark in place of the leg."""
    return condition.words.replace(f"leg {condition.leg!r}", _LEGS)


def _multiplied_out(expression: Any) -> Any:
    """What is the same of conditions alike, where that is found at once."""
    return sp.expand(expression) if _operations(expression) <= _LONG else expression


def _operations(expression: Any) -> int:
    return int(expression.count_ops())
