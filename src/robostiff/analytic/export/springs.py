"""Stiffnesses of springs and moduli of materials in the nomenclature, with their values."""

from __future__ import annotations

from collections.abc import Sequence

from robostiff.analytic.export.outline import (
    Block,
    Nomenclature,
    OutlineHeading,
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
