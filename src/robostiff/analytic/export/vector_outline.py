"""The section of an exported derivation at vector level: one leg, a table, and the sum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import sympy as sp

from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.export.entries import (
    EntryNames,
    MatrixName,
    in_decimals,
    readable_matrix,
)
from robostiff.analytic.export.outline import (
    Block,
    FormulaTable,
    Inverse,
    LegSum,
    OutlineHeading,
    OutlineText,
    SpringSum,
    Transport,
    VectorEquations,
    equations,
    matrix_equation,
)
from robostiff.analytic.robot_derivation import InSeries
from robostiff.analytic.vectors.vector_expressions import (
    ArmOfSprings,
    Coordinates,
    Cross,
    Dot,
    Equation,
    Norm,
    Sum,
    Vector,
    VectorForm,
    with_formulas_changed,
)

_MEANINGS = {
    "p": "point of the platform",
    "R": "rotation of the platform",
    "Q": "rotation of the platform",
    "r_0": "reference point, in the axes of the platform",
    "a_i": "joint of leg i on the base",
    "b_i": "its joint on the platform, in the platform's axes",
    "d_i": "from this joint of the leg to that on the platform",
    "L_i": "length of this vector",
    "u_i": "unit vector along the leg",
    "e_i": "first axis of the joint on the base",
    "j_i": "axis of the leg's last joint",
    "g_i": "unit vector across the first axis of the joint and the leg",
    "n_i": "unit vector across both axes of the joint",
    "k_i": "stiffness of the spring that differs between the legs",
    "C_i": "compliances c_i_jk that the wrenches j and k of leg i share",
    "o_i": "what of the couple comes with the force, so that both share no energy",
    "r_ij": "from the middle of the rods to the end of rod j, in the platform's axes",
    "v_ij": "couple by which rod j of leg i turns its middle",
    "c_r": "compliance of a rod",
}
_OF_STRUTS = {"a_i", "b_i", "d_i", "L_i", "u_i", "w_i", "c_i"}
_OF_RODS = {
    "b_i": "joint of its rod on the platform, in the platform's axes",
    "u_i": "unit vector along its rod",
    "j_i": "first axis of the joint at the rod's foot",
}
_OF_SLIDES = {
    **_OF_RODS,
    "a_i": "foot of the rod of leg i where its slide is at zero",
    "e_i": "direction of the slide",
    "d_i": "from this foot to the joint on the platform",
    "y_i": "distance of this joint from the line of the slide",
    "x_i": "how far along the slide it is",
    "q_i": "coordinate of the slide",
    "f_i": "force along the slide, of a unit force in the rod",
}
_OF_CRANKS = {
    **_OF_RODS,
    "a_i": "point of the axis of leg i's crank, in the crank's plane",
    "e_i": "axis of the crank",
    "d_i": "from this point to the joint on the platform",
    "y_i": "distance of this joint from the axis",
    "x_i": "cosine of the angle between the crank and this vector, seen along the axis",
    "m_i": "unit vector across this axis and the platform joint",
    "v_i": "unit vector along the crank",
    "f_i": "force along the crank, of a unit force in the rod",
    "h_i": "force across the crank",
    "z_i": "force along the axis of the crank",
}
_OF_LINKS = {
    **_OF_CRANKS,
    "a_i": "first joint of leg i where its slide is at zero",
    "b_i": "its last joint, in the platform's axes",
    "e_i": "direction of the slide and of the joints",
    "d_i": "from a_i to the last joint",
    "q_i": "coordinate of the slide",
    "y_i": "distance of the last joint from the first one",
    "x_i": "cosine of the angle between the first link and n_i",
    "m_i": "unit vector across the slide and n_i",
    "n_i": "unit vector from the first joint to the last one",
    "g_i": "unit vector across the slide and the second link",
    "u_i": "unit vector along the second link",
    "v_i": "unit vector along the first link",
    "f_i": "cosine of the angle between the links",
    "h_i": "its sine",
}
_ABOUT_A_CENTRE = {
    "e_i": "axis of the motor of leg i",
    "j_i": "axis of its platform joint, in the platform's axes",
    "u_i": "the same in the world",
    "v_i": "axis of its elbow",
    "g_i": "unit vector across both passive axes",
    "b_i": "centre of all axes, in the platform's axes",
    "z_i": "cosine of the angle between the axes of motor and platform joint",
    "h_i": "its sine",
}


def vector_blocks(
    found: VectorForm, result: MatrixName, known: Sequence[Definition], taken: set[str]
) -> tuple[tuple[Block, ...], set[Any]]:
    """The generic leg, the table of what differs, and the sum over the legs.

    Also the known names that it defines.

    `result`: name of the stiffness; `known`: names that the rest of the derivation has;
    `taken`: names that stand for something else.
    """
    words = (
        "A leg transmits forces and couples, written as [force; moment], between a point of the "
        "base and a point of the platform. The table has what differs between the legs."
    )
    forms = (found, *found.others)
    formulas: tuple[Any, ...] = ()
    if all({e.name for e in form.leg} == _OF_STRUTS for form in forms):
        words += " The sum is eq. (25) with {} = {}; {} and {} are {} and {} of eq. (26)."
        d, b, u, v = (MatrixName(f"{x}_i") for x in "dbuv")
        opposite = Sum(((-1, Vector(b.name)),))
        formulas = ("K_11", 1 / sp.Symbol("c_i"), d, opposite, u, v)
    blocks: list[Block] = [
        OutlineHeading("One leg, and what differs between the legs"),
        OutlineText(words, formulas),
    ]
    parts = [result] if len(forms) == 1 else [MatrixName(f"K_{k + 1}") for k in range(len(forms))]
    written: set[Any] = set()
    for k, (form, part) in enumerate(zip(forms, parts, strict=True)):
        renamed, names = _in_known_names(form.names, known, taken)
        if len(forms) > 1:
            of = "Leg" if len(form.legs) == 1 else "Legs"
            blocks.append(OutlineHeading(f"{of}: {', '.join(form.legs)}", level=3))
        new = [d for d in names if d.symbol not in written]
        blocks += _of_kind(form, part, renamed, new, () if k else form.pose)
        written |= {d.symbol for d in names}
    if len(forms) > 1:
        total = Sum(tuple((1, Vector(part.name)) for part in parts))
        blocks.append(OutlineHeading("All legs", level=3))
        blocks.append(VectorEquations((Equation(result.name, total),)))
    if found.average is not None:
        blocks += [
            OutlineText(
                "The wrenches are turns of the first about z, or mirror images, and meet the same "
                "compliance. With the entries ({}, {}, {}, {}, {}, {}) of {} the sum is",
                ("u_x", "u_y", "u_z", "m_x", "m_y", "m_z", MatrixName("w_1")),
            ),
            matrix_equation(result, found.average, lambda i, j: f"{result.name}_{i + 1}{j + 1}"),
        ]
    return tuple(blocks), written


def _of_kind(
    found: VectorForm,
    result: MatrixName,
    renamed: Mapping[Any, Any],
    names: Sequence[Definition],
    pose: Sequence[Equation],
) -> list[Block]:
    """One leg of a kind, the table of what differs, and the sum over these legs."""

    def in_names(part: Any) -> Any:
        return with_formulas_changed(part, lambda x: x.xreplace(dict(renamed)))

    leg = in_names(found.leg)
    first = [e for e in leg if not e.name.startswith(("w_", "c_", "o_"))]
    rest = [e for e in leg if e.name.startswith(("w_", "c_", "o_"))]
    of_rod = in_names(found.of_rod)
    blocks: list[Block] = [
        VectorEquations((*pose, *first)),
        equations(names),
        VectorEquations(tuple(rest)),
    ]
    if found.columns:
        columns = [in_names(c) for c in found.columns.values()]
        rows = [(leg, tuple(c[i] for c in columns)) for i, leg in enumerate(found.legs)]
        of_vectors = [isinstance(c[0], Coordinates) for c in columns]
        pairs = zip(found.columns, of_vectors, strict=True)
        head = tuple(MatrixName(name) if is_vector else name for name, is_vector in pairs)
        blocks.append(FormulaTable(head, tuple(rows)))
    if found.turned:
        same = "; ".join(", ".join(group) for group in found.turned)
        blocks.append(OutlineText(f"Legs that are turns of one another about z: {same}."))
    if found.rods:
        blocks += [
            OutlineText(
                "Rods of a leg are parallel. They act as one rod at their middle, and each turns "
                "the middle by a couple; the vectors from there to their ends sum to zero."
            ),
            VectorEquations(tuple(of_rod)),
            FormulaTable(
                ("r_ijx", "r_ijy", "r_ijz"),
                tuple((name, arm) for _, name, arm in found.rods),
                "rod",
            ),
        ]
    rods = (found.of_rod[0].name, found.of_rod[1].name) if found.rods else None
    blocks.append(LegSum(result, found.wrenches, rods, found.coupled))
    return blocks


def series_blocks(
    found: InSeries | ArmOfSprings, names: EntryNames, known: Sequence[Definition], taken: set[str]
) -> list[Block]:
    """The compliance of a serial arm, its inverse, and where that is moved to."""
    if isinstance(found, ArmOfSprings):
        return _arm_blocks(found, names.result, taken)
    renamed, new = _in_known_names(found.definitions, known, taken)
    C, axes, arm, in_axes = map(MatrixName, ("C", "R_0", "v_0", "K_0"))
    return [
        OutlineHeading("Compliance: a sum over the springs"),
        OutlineText(
            "Springs in series add their compliances. These are in axes of the arm, in which they "
            "are simplest: columns of {}, in world axes, with their origin at {} from the "
            "reference point.",
            (axes, arm),
        ),
        equations([d for d in new if d not in known]),
        matrix_equation(
            axes, readable_matrix(found.axes.xreplace(renamed)), names.entries_of(axes)
        ),
        matrix_equation(
            arm, readable_matrix(found.arm.xreplace(renamed)).T, lambda _, j: f"v_0_{j + 1}"
        ),
        matrix_equation(C, found.C.xreplace(renamed).applyfunc(in_decimals), names.entries_of(C)),
        Inverse(in_axes, C),
        Transport(names.result, in_axes, axes, arm),
    ]


def _arm_blocks(found: ArmOfSprings, result: MatrixName, taken: set[str]) -> list[Block]:
    C = MatrixName("C")
    drives = [(joint, (MatrixName(t), c)) for joint, t, c in found.drives]
    beams = [(beam, (*map(MatrixName, (Q, m)), *own)) for beam, Q, m, own in found.beams]
    letters = [x + "'" * (x in taken) for x in ("L", "EA", "EI_y", "EI_z", "GJ")]
    L, EA, EI_y, EI_z, GJ = map(sp.Symbol, letters)
    D = [L / EA, L**3 / (12 * EI_z), L**3 / (12 * EI_y), L / GJ, L / EI_y, L / EI_z]
    blocks: list[Block] = [
        OutlineHeading("Compliance: a sum over the springs"),
        OutlineText(
            "Springs in series add their compliances: a drive that of its unit motion, of which {} "
            "is the twist [translation; rotation] about the reference point {}, and a beam that "
            "about its middle, at {} from {}, in its own axes, the columns of {}, x along it.",
            tuple(map(MatrixName, "tpmpQ")),
        ),
        VectorEquations(found.equations),
        equations(found.names),
    ]
    if drives:
        blocks.append(FormulaTable((MatrixName("t"), "c"), tuple(drives), "joint"))
    if beams:
        blocks.append(
            FormulaTable((MatrixName("Q"), MatrixName("m"), *letters), tuple(beams), "beam")
        )
        own = sp.ImmutableMatrix(sp.diag(*D))
        blocks.append(matrix_equation(MatrixName("D"), own, lambda i, _: f"D_{i + 1}"))
    return [*blocks, SpringSum(C, bool(drives), bool(beams)), Inverse(result, C)]


def vector_meanings(found: VectorForm) -> list[tuple[tuple[MatrixName | str, ...], str]]:
    """Names of the vector form and their meanings, for the nomenclature."""
    all_legs = [e for form in (found, *found.others) for e in form.leg]
    names = {e.name: e.is_vector for e in (*found.pose, *all_legs, *found.of_rod)}
    names |= {"r_ij": True} if found.rods else {}
    columns = [pair for form in (found, *found.others) for pair in form.columns.items()]
    names |= {name: isinstance(c[0], Coordinates) for name, c in columns if name in _MEANINGS}
    of_slides = _OF_SLIDES if "q_i" in names else {}
    of_carrier = (_OF_LINKS if of_slides else _OF_CRANKS) if "v_i" in names else of_slides
    of_carrier = of_carrier if "d_i" in names else _ABOUT_A_CENTRE
    names |= {"C_i": True} if found.coupled else {}
    listed = {**_MEANINGS, **of_carrier}
    listed |= _of_angles(all_legs, listed, "rod" if of_carrier else "leg")
    return [
        ((MatrixName(name) if names[name] else name,), text)
        for name, text in listed.items()
        if name in names
    ]


def _of_angles(
    equations: Sequence[Equation], meanings: Mapping[str, str], along: str
) -> dict[str, str]:
    """Meanings of the cosine a . u and the sine |a x u| of the angle of a vector and a leg."""
    found = {}
    for equation in (e for e in equations if e.name in ("s_i", "t_i")):
        match equation.expression:
            case Dot(Vector(name), _):
                function = "cosine"
            case Norm(Cross(Vector(name), _)):
                function = "sine"
            case _:
                continue
        other = f"the {meanings[name]}" if name in meanings else name
        found[equation.name] = f"{function} of the angle between the {along} and {other}"
    return found


def arm_meanings(found: ArmOfSprings) -> list[tuple[tuple[MatrixName | str, ...], str]]:
    """Names of the vectors of an arm and their meanings, for the nomenclature."""
    kinds = {
        "R": "rotations of the parts of the arm, one after the other",
        "p": "points between these parts",
        "Q": "axes of a beam",
        "m": "from the reference point to the middle of a beam",
        "t": "twist of the unit motion of a drive",
    }
    names = [e.name for e in found.equations]
    rows: list[tuple[tuple[MatrixName | str, ...], str]] = [((MatrixName("p"),), "reference point")]
    for letter, meaning in kinds.items():
        own = [MatrixName(x) for x in names if x.startswith(f"{letter}_")]
        listed = own if len(own) < 3 else [own[0], "...", own[-1]]
        rows += [(tuple(listed), meaning)] if own else []
    rows += [(("c",), "compliance of a drive")] if found.drives else []
    if found.beams:
        rows += [
            ((MatrixName("D"),), "compliance of a beam about its middle, in its own axes"),
            ((MatrixName("T"),), "turns it to world axes and moves it to the reference point"),
        ]
    return rows


def _in_known_names(
    names: Sequence[Definition], known: Sequence[Definition], taken: set[str]
) -> tuple[dict[Any, Any], tuple[Definition, ...]]:
    """Names that the rest of the derivation has for the same formulas, otherwise free ones."""
    by_formula = {d.expression: d.symbol for d in known}
    same = {(d.symbol, d.expression) for d in known}
    used = taken | {d.symbol.name for d in known}
    renamed: dict[Any, Any] = {}
    new = []
    for definition in names:
        own = by_formula.get(definition.expression)
        if (definition.symbol, definition.expression) in same:
            own = definition.symbol
        if own is None:
            name = definition.symbol.name
            while name in used:
                letter, _, number = name.partition("_")
                name = f"{letter}'_{number}"
            own = sp.Symbol(name, positive=True)
        expression: Any = definition.expression.xreplace(renamed)
        new.append(replace(definition, symbol=own, expression=expression))
        renamed[definition.symbol] = own
    return renamed, tuple(new)
