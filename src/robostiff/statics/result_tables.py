"""Equilibria and modes as tables, for notebooks and reports."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from robostiff.analysis.result_tables import (
    MOST_PARTS,
    blocks_html,
    energy_table,
    load_table,
    without_rounding,
)
from robostiff.elastostatics import Status
from robostiff.markup import (
    COMPLIANCE_UNITS,
    STIFFNESS_UNITS,
    Block,
    Bullets,
    Cell,
    LabelledMatrix,
    Number,
    Paragraph,
    Table,
    Tone,
    element,
    escaped,
)

if TYPE_CHECKING:
    from robostiff.statics.equations.problem import EquilibriumProblem
    from robostiff.statics.modes import Modes
    from robostiff.statics.result import Equilibrium

_LISTED = 8
_CANCELLED = 1e-15  # of the largest entry, rotations in lengths of the robot
KNOWN = 1e-9  # of the largest: what is smaller is rounding


def equilibrium_html(result: Equilibrium) -> str:
    """Whether it stays, displacement, K under load, and the parts with the most elastic energy."""
    blocks: list[Block | None] = [Paragraph(stability_in_words(result))]
    if result.has_answer:
        moved = without_rounding(result.displacement, result.space)
        blocks.append(load_table(result.space, result.wrench, moved))
        blocks.append(matrix_under_load(result))
        if result.energy > 0:
            blocks.append(energy_table(result.shares, MOST_PARTS))
    blocks.append(Bullets(tuple(result.advice)))
    return element("div", _head(result) + blocks_html(blocks))


def stability_in_words(result: Equilibrium) -> str:
    """Whether the robot stays where it is, and its margin."""
    if not result.has_answer:
        return "No equilibrium was found."
    words = "The robot stays there" if result.stable else "The robot does not stay there"
    return f"{words}; margin {result.margin:.3g} (1 without load, 0 at the critical load)."


def matrix_under_load(result: Equilibrium) -> LabelledMatrix | None:
    """K under load; the compliance where a direction is rigid, none beside a free motion."""
    F, t = result.space.wrench_order, result.space.twist_order
    if result.status.has_stiffness:
        # zero where terms of the size of the largest entry cancel up to rounding
        K, scale = result.K, cast("EquilibriumProblem", result.problem).scale
        sizes = np.abs(K) / np.outer(scale, scale)
        K = np.where(sizes > _CANCELLED * sizes.max(initial=0.0), K, 0.0)
        return LabelledMatrix("K under load", K, F, t, STIFFNESS_UNITS)
    if result.status & Status.FREE_MOTIONS:
        return None
    return LabelledMatrix("C under load", result.compliance, t, F, COMPLIANCE_UNITS)


def modes_html(found: Modes) -> str:
    """The slowest modes: frequency, motion, and the part with the most elastic energy."""
    blocks: list[Block | None] = [mode_table(found), other_modes(found)]
    if not found.each:
        blocks = [Bullets(tuple(found.status.advice))]
    return element("div", _head(found) + blocks_html(blocks))


def mode_table(found: Modes) -> Table:
    """The slowest modes."""
    rows: list[list[Cell]] = []
    for i, mode in enumerate(found.each[:_LISTED], start=1):
        most = mode.shares[0] if mode.shares else None
        share = "" if most is None else f"{100 * most.share:.0f}\N{NO-BREAK SPACE}%"
        part = "none" if most is None else f"{most.name}, {share}"
        rate: Cell = Number(mode.frequency, "Hz")
        if mode.growth != 0:
            rate = f"grows by {mode.growth:.4g} /s"
        rows.append([str(i), rate, mode.words, part])
    return Table(["mode", "frequency", "motion", "most energy in"], rows)


def other_modes(found: Modes) -> Paragraph | None:
    """How many modes the table leaves out; None where it has all."""
    more = len(found) - _LISTED
    return (
        Paragraph(f"{more} modes at higher frequencies are not listed.", Tone.QUIET)
        if more > 0
        else None
    )


def _head(result: Equilibrium | Modes) -> str:
    """Name and status."""
    name, status = element("b", escaped(result.name)), element("b", escaped(result.status))
    return element("p", f"{name}; status {status}")
