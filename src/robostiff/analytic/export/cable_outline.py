"""The contents of the exported formula of a cable robot: one cable, what differs, and the sum."""

from __future__ import annotations

from typing import Any, cast

import sympy as sp

from robostiff.analytic.cable_formula import CableFormula
from robostiff.analytic.export.entries import DIGITS, EntryNames, in_decimals, operations
from robostiff.analytic.export.nomenclature import nomenclature_of
from robostiff.analytic.export.notation import (
    LONGEST,
    Block,
    EquationRows,
    FormulaTable,
    Meaning,
    Sentences,
    Title,
    equations,
    stiffness_equation,
)
from robostiff.analytic.vectors.vector_expressions import Coordinates, Equation, Vector
from robostiff.frozen import replace
from robostiff.spatial import Space

_VECTORS = {
    "p": "place of the platform's origin",
    "R": "rotation of the platform",
    "r_0": "reference point, in axes of the platform",
    "o": "reference point",
    "a_i": "exit point of a cable",
    "b_i": "its attachment from the reference point, in axes of the platform",
    "r_i": "the same in world axes",
    "d_i": "from exit point to attachment",
    "u_i": "its direction",
    "w_i": "wrench of a unit of tension",
    "V_i": "wrenches of unit forces at the attachment",
    "M_i": "twice the symmetric part of direction times arm",
    "N_i": "what turning the platform adds",
    "f": "weight [N]",
    "c": "its point from the reference point, in axes of the platform",
    "m": "the same in world axes",
    "M_0": "twice the symmetric part of weight times arm",
    "N_0": "what turning the platform under its weight takes away",
}
_SCALARS = {
    "L_i": "length of a cable",
    "k_i": "its stiffness, with guide and winch [N/m]",
    "q_i": "its tension over its length [N/m]",
    "s_i": "its direction times the arm [m]",
    "t_i": "its tension [N]",
    "g_i": "its guide length [m]",
    "e_i": "its axial compliance, 1/EA [1/N]",
    "EA_i": "its axial rigidity [N]",
    "c_i": "compliance of its winch [m/N]",
    "k_w_i": "stiffness of its winch [N/m]",
    "s_0": "weight times its arm [N m]",
}


def cable_outline(formula: CableFormula) -> list[Block]:
    """One generic cable, a table of what differs, the sum, and K where it is short."""
    names, vectors = EntryNames(formula), formula.vectors

    def decimals(x: Any) -> Any:
        parts = x.args if isinstance(x, Coordinates) else ()
        is_fraction = [v.is_Rational and not v.is_Integer for v in parts]
        each = (
            sp.Float(v, DIGITS) if own else v for v, own in zip(parts, is_fraction, strict=True)
        )
        return in_decimals(Coordinates(*each) if parts else x)

    def shown(rows: tuple[Equation, ...]) -> tuple[Equation, ...]:
        return tuple(replace(e, expression=decimals(e.expression)) for e in rows)

    total = "sum over i of (($k_i - $q_i) w_i w_i^T + $q_i V_i V_i^T + $t_i N_i)"
    rows = {
        "V_i": "[I; (r_i ×)]",
        "M_i": "u_i r_i^T + r_i u_i^T",
        "N_i": "[0, 0; 0, M_i / 2 - $s_i I]",
    }
    if vectors.weight:
        total += " - N_0"
        rows |= {"M_0": "f m^T + m f^T", "N_0": "[0, 0; 0, M_0 / 2 - $s_0 I]"}
    rows[names.result] = total
    words = (
        f"Stiffness about the reference point in world axes, {formula.where}. All cables are "
        "taut, and their tensions are given; those that balance the weight are among them."
    )
    if vectors.space is Space.PLANAR:
        words += " In the plane only F_x, F_y and M_z count."
    columns = {
        name: [*map(decimals, column)]
        for name, column in vectors.columns.items()
        if name != "t_i" or any(not x.is_Symbol for x in column)
    }
    head = (Vector(x) if isinstance(c[0], Coordinates) else x for x, c in columns.items())
    table = zip(vectors.cables, zip(*columns.values(), strict=True), strict=True)
    blocks: list[Block] = [
        Title(names.title, level=1),
        Sentences(words),
        Title("One cable, and what differs between the cables"),
        EquationRows((*shown(vectors.pose), *shown(vectors.weight))),
        EquationRows(shown(vectors.cable)),
        FormulaTable(tuple(head), tuple(table), "cable"),
        EquationRows(tuple(Equation(name, cast("Any", text)) for name, text in rows.items())),
    ]
    is_short = not formula.coordinates and operations(formula.K) <= LONGEST
    if formula.steps_asked or is_short:
        blocks += [Title("By entries"), equations(formula.definitions)]
        blocks.append(stiffness_equation(names.result, formula.K))
    used = {"t_i", *columns, *rows}
    used |= {e.name for e in (*vectors.pose, *vectors.weight, *vectors.cable)}
    meanings: list[Meaning] = [
        ((name if is_scalar else Vector(name),), words)
        for kind, is_scalar in ((_VECTORS, False), (_SCALARS, True))
        for name, words in kind.items()
        if name in used
    ]
    return [*blocks, nomenclature_of(formula, names, meanings, formula.coordinates, blocks)]
