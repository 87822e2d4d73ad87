"""The contents of the exported formula of a robot: one leg and a table, or all legs, and K."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import InNames, LegDerivation, RobotDerivation
from robostiff.analytic.exact.definition import Definition, used_definitions
from robostiff.analytic.export.entries import DIGITS, EntryNames, in_decimals, readable_matrix
from robostiff.analytic.export.nomenclature import (
    OF_STRUTS,
    letters_of_beam,
    meanings_of_legs,
    nomenclature_of,
)
from robostiff.analytic.export.notation import (
    OWN_AXES,
    Block,
    EquationRows,
    FormulaTable,
    MatrixEquation,
    Meaning,
    Sentences,
    Title,
    equation,
    equations,
    own_axes,
    scalar_unless_name,
    stiffness_equation,
    transport,
    unless_long,
)
from robostiff.analytic.placement.agreement import turn_in_words
from robostiff.analytic.reading.combinations import name_combinations
from robostiff.analytic.vectors.forms import InSeries, VectorForm, beam_compliances
from robostiff.analytic.vectors.vector_expressions import Coordinates, Equation, Sum, Vector
from robostiff.spatial import Space

_MOST_LINES = 15  # of entries of K and of names, beside which one leg and the table are enough


def robot_outline(derivation: RobotDerivation) -> list[Block]:
    """The blocks of the derivation of a robot: its legs, their sum, and the nomenclature."""
    names = EntryNames(derivation)
    found, rows = _contents(derivation, names)
    blocks = [Title(names.title, level=1), _summary(derivation, names), *found]
    return [*blocks, nomenclature_of(derivation, names, rows, derivation.coordinates, blocks)]


def _contents(derivation: RobotDerivation, names: EntryNames) -> tuple[list[Block], list[Meaning]]:
    """Its legs and their sum, or its modules and theirs; and what names mean."""
    blocks: list[Block] = [Sentences(derivation.remark)] * bool(derivation.remark)
    rows: list[Meaning] = []
    form, alone, taken = derivation.vectors, is_vectors_alone(derivation), set(names.given)
    defined = {d.symbol for x in (form, *form.others) for d in x.names} if form else set()
    named = _names_of(derivation, {*names.given, *map(str, defined)})
    definitions = list(named.definitions)
    # Wrenches in names are shorter than one leg by its springs.
    in_names = bool(form and form.passive) and not alone and derivation.named is not None
    form = None if in_names else form
    if form is not None:
        if derivation.is_closed or not alone:
            form = replace(form, average=None)  # K is written out
        taken |= set() if alone else {d.symbol.name for d in derivation.definitions}
        blocks += vector_level(form, names.result, taken)
        definitions = [d for d in definitions if d.symbol not in defined]
    series = derivation.in_series
    if alone:
        blocks += _legs_in_words(derivation, kinds=True)
    elif series is not None:
        # K as the inverse of C is the whole formula: wrenches of an arm say no more.
        found, rows = _modules(series)
        blocks += found
        blocks += _series(series, names.result, taken)
        if not series.modules:
            blocks.append(Sentences(f"Springs of the arm: {_in_words(derivation.legs[0])}"))
    else:
        closing = tuple(Equation("0", x) for c in derivation.conditions for x in c.equations)
        blocks += [Title("Where the legs close"), EquationRows(closing)]
        if form is not None and derivation.is_closed:
            # One leg and the table have said what all legs transmit, and how they add up.
            used = used_definitions(definitions, named.K.flat())
            together = [Title("All legs together"), equations(used)]
            blocks += [*_legs_in_words(derivation, kinds=True), *together]
        else:
            blocks += [Title("Names for recurring expressions"), equations(definitions)]
            blocks += _leg_by_leg(derivation, named.legs, names)
        blocks.append(stiffness_equation(names.result, named.K))
    level = None if in_names else derivation.at_vector_level
    by_components = alone or (series is not None and series.modules)
    steps = () if by_components else derivation.definitions
    return blocks, [*rows, *meanings_of_legs(derivation, level, names, steps)]


def _modules(machine: VectorForm) -> tuple[list[Block], list[Meaning]]:
    """The robots in an arm, its links that are given by a matrix, and what their names mean."""
    blocks, rows = list[Block](), list[Meaning]()
    for number, (words, *_, module) in enumerate(machine.modules, start=1):
        K, C, J = (f"{letter}_{number}" for letter in "KCJ")
        of_module: list[Meaning] = []
        if isinstance(module, sp.ImmutableMatrix):
            of_C = f"compliance of {words} about its end, in its own axes"
            blocks += [Title(f"Link {number}: {words}"), MatrixEquation(C, readable_matrix(module))]
        else:
            of_C, of_K = "its compliance", f"stiffness of {words} about the origin of its platform"
            names, found = EntryNames(module), [equation(K, module.name)]
            names.result = module.name
            if module.name == K:  # no other one is equal
                found, of_module = _contents(module, names)
            inner = (replace(x, level=x.level + 1) if isinstance(x, Title) else x for x in found)
            blocks += [Title(f"Module {number}: {words}"), *inner, equation(C, f"{K}^-1")]
            rows.append(((Vector(K),), f"{of_K}, in axes of its base"))
        of_J = "moves twists of it to the reference point, world axes"
        rows += [((Vector(C),), of_C), ((Vector(J),), of_J), *of_module]
    return blocks, rows


def outline_in_vectors(form: VectorForm) -> list[Block]:
    """The blocks of a vector level alone."""
    names = EntryNames(form)
    blocks, rows = _modules(form)
    of_level = _series if form.is_arm else vector_level
    blocks += of_level(form, names.result, set(names.given))
    rows += meanings_of_legs(form, form, names)
    last = nomenclature_of(form, names, rows, blocks=blocks)
    return [Title(names.title, level=1), *blocks, last]


def is_vectors_alone(derivation: RobotDerivation) -> bool:
    """Whether one leg, the table and the sum are all: where the entries of K are long."""
    if derivation.vectors is None or derivation.steps_asked:
        return False
    if not derivation.is_closed or derivation.named is None:
        return not derivation.is_closed
    K, definitions = derivation.named.K, derivation.named.definitions
    entries = {max(x, -x, key=str) for x in K.flat() if x != 0}
    used = [d for d in used_definitions(definitions, K.flat()) if d.expression.free_symbols]
    return len(entries) + len(used) > _MOST_LINES


def _names_of(derivation: RobotDerivation, taken: set[str]) -> InNames:
    """Names for K and the wrenches together, so that a name has one meaning; none in steps."""
    K, legs = derivation.K, derivation.legs
    if derivation.named is not None:
        return derivation.named
    if not derivation.is_closed:
        return InNames(K, legs, ())
    upper = [K[i, j] for i in range(K.rows) for j in range(i, K.rows)]
    columns = [[*w, c] for leg in legs for w, c in zip(leg.wrenches, leg.compliances, strict=True)]
    every = [*upper, *(entry for column in columns for entry in column)]
    named = name_combinations(sp.ImmutableMatrix([every]), taken)
    written = dict(zip(every, named.matrix.flat(), strict=True))
    found = [
        replace(
            leg,
            wrenches=tuple(w.applyfunc(written.__getitem__) for w in leg.wrenches),
            compliances=tuple(written[c] for c in leg.compliances),
        )
        for leg in legs
    ]
    return InNames(K.applyfunc(written.__getitem__), tuple(found), named.definitions)


def _summary(derivation: RobotDerivation, names: EntryNames) -> Sentences:
    start = f"Stiffness about the reference point in world axes, {derivation.where}"
    if derivation.in_series is not None and derivation.in_series.modules:
        return Sentences(
            f"{start}. The machine has modules in series, whose compliances add at this point."
        )
    if derivation.in_series is not None:
        return Sentences(
            f"{start}. No joint is passive: the stiffness is the inverse of the compliance, to "
            "which each spring adds what it feels of a unit wrench."
        )
    count = len(derivation.legs)
    form = "in closed form" if derivation.is_closed else "in named steps"
    share_of_leg = "made conjugate to one another; each has a compliance {}"
    if is_vectors_alone(derivation):
        form = "leg by leg"
        if derivation.vectors and derivation.vectors.passive:
            return Sentences(
                f"{start}, {form}. The stiffness is a sum over {count} legs, eq. (12)."
            )
        if derivation.vectors and derivation.vectors.coupled:
            share_of_leg = "and which share the compliances {}"
    legs = "one leg" if count == 1 else f"{count} legs"
    return Sentences(
        f"{start}, {form}. Passive joints leave each chain the wrenches {{}} that they transmit, "
        f"{share_of_leg}. The stiffness is a sum over {legs}, eq. (12).",
        (Vector(names.generic("w")), names.generic("c")),
    )


def _legs_in_words(derivation: RobotDerivation, *, kinds: bool = False) -> list[Block]:
    """What is elastic and passive in each leg, where all are alike or `kinds` are asked for."""
    alike: dict[str, list[str]] = {}
    for leg in derivation.legs:
        alike.setdefault(_in_words(leg), []).append(leg.name)
    count = len(derivation.legs)
    if count == 1 or (len(alike) > 1 and not kinds):
        return []
    of = [f"each of the {count} legs"] if len(alike) == 1 else map(", ".join, alike.values())
    texts = [Sentences(f"Springs of {x}: {words}") for x, words in zip(of, alike, strict=True)]
    return [Title("The legs"), *texts]


def _in_words(leg: LegDerivation) -> str:
    words = (
        f"{_names_in_words(leg.elastic)}; passive joints: {_names_in_words(leg.joints) or 'none'}"
    )
    if leg.redundant:
        words += f"; of these add no freedom to those before: {_names_in_words(leg.redundant)}"
    return f"{words}."


def _names_in_words(names: Sequence[str]) -> str:
    """Names in a sentence; the freedoms of one joint together."""
    counts: dict[str, int] = {}
    for name in names:
        bare = re.sub(r"\[\d+\]$", "", name)
        counts[bare] = counts.get(bare, 0) + 1
    return ", ".join(
        f"{name} ({count} freedoms)" if count > 1 else name for name, count in counts.items()
    )


def _leg_by_leg(
    derivation: RobotDerivation, in_names: Sequence[LegDerivation], names: EntryNames
) -> list[Block]:
    """Wrenches and compliances of each leg, and the beginning of their sum."""
    blocks = _legs_in_words(derivation)
    alike = len(derivation.legs) > 1 and len({*map(_in_words, derivation.legs)}) == 1
    # By the number of a leg: those that are turns of it, and the turns in words.
    of_others: dict[int, dict[int, str]] = {}
    words = [*map(_in_words, derivation.legs)]
    for j, leg in enumerate(in_names):
        if leg.definitions:
            continue
        for i in (i for i in range(j) if not any(i + 1 in turns for turns in of_others.values())):
            first = in_names[i]
            if words[i] != words[j] or [*leg.compliances] != [*first.compliances]:
                continue
            turn = turn_in_words(leg.wrenches, first.wrenches)
            if turn is not None:
                of_others.setdefault(i + 1, {})[j + 1] = turn
                break
    for number, leg in enumerate(in_names, start=1):
        if any(number in turns for turns in of_others.values()):
            continue
        blocks.append(Title(f"Leg {number}: {' '.join(leg.name.split())}"))
        if not alike:
            blocks.append(Sentences(f"Springs: {_in_words(derivation.legs[number - 1])}"))
        blocks.append(equations(leg.definitions))
        if not leg.wrenches:
            blocks.append(Sentences("It transmits no wrench."))
        for k, (w, c) in enumerate(zip(leg.wrenches, leg.compliances, strict=True), start=1):
            index = f"{number}_{k}" if len(leg.wrenches) > 1 else f"{number}"
            blocks += unless_long(f"w_{index}", sp.ImmutableMatrix([*w, c]), w)
            if not isinstance(blocks[-1], Sentences):
                blocks += scalar_unless_name(f"c_{index}", c)
        turned = (
            f"{turn} it is leg {other}, {' '.join(in_names[other - 1].name.split())}"
            for other, turn in of_others.get(number, {}).items()
        )
        if number in of_others:
            blocks.append(Sentences(f"Turned {'; '.join(turned)}."))
    of_legs = {d.symbol for leg in derivation.legs for d in leg.definitions}
    rest = [d for d in derivation.definitions if d.symbol not in of_legs]
    w, c = map(names.generic, "wc")
    total = equation(names.result, f"sum of {w} {w}^T / {c}")
    return [*blocks, Title("Sum of the legs"), total, equations(rest)]


def vector_level(found: VectorForm, result: str, taken: set[str]) -> list[Block]:
    """The generic leg, the table of what differs, and the sum over the legs.

    `result`: name of the stiffness; `taken`: names that stand for something else.
    """
    alone = len(found.legs) == 1 and not found.others
    words = (
        f"{'The' if alone else 'A'} leg transmits forces and couples, written as [force; moment], "
        "between a point of the base and a point of the platform."
    )
    if found.passive:
        words = f"{_SPRINGS_ADD} The first table has what differs between the legs."
    elif not alone:
        words += " The table has what differs between the legs."
    forms = (found, *found.others)
    if found.space is Space.PLANAR:
        words += " In the plane only F_x, F_y and M_z of them count."
    formulas: tuple[Any, ...] = ()
    if found.passive:
        p = "p_i" if any(e.name == "p_i" for e in found.leg) else "p"
        formulas = tuple(map(Vector, ("t", p, "m", p, "Q")))
    elif not alone and all({e.name for e in form.leg} == OF_STRUTS for form in forms):
        words += " The sum is eq. (25) with {} = {}; {} and {} are {} and {} of eq. (26)."
        d, b, u, v = (Vector(f"{x}_i") for x in "dbuv")
        formulas = ("K_11", 1 / sp.Symbol("c_i"), d, Sum((-1, b)), u, v)
    title = "In vectors" if alone else "One leg, and what differs between the legs"
    blocks: list[Block] = [Title(title), Sentences(words, formulas)]
    several = len(forms) > 1
    stem = "K" if result[-1].isalpha() else result  # of a robot, or of a module
    parts = [f"{stem}_{k + 1}" for k in range(len(forms))] if several else [result]
    written: set[Any] = set()
    for k, (form, part) in enumerate(zip(forms, parts, strict=True)):
        if several:
            of = "Leg" if len(form.legs) == 1 else "Legs"
            blocks.append(Title(f"{of}: {', '.join(form.legs)}", level=3))
        new = [d for d in form.names if d.symbol not in written]
        blocks += _kind_of_leg(form, part, new, () if k else form.pose, taken)
        written |= {d.symbol for d in form.names}
    blocks += [Title("All legs", level=3)] * several
    if found.passive:
        whole: Any = "W_i (W_i^T C_i W_i)^-1 W_i^T"
        words = (
            "The columns of {} are wrenches that do no work on the twists {} of the passive "
            "joints, as many as there are."
        )
        closing = " Legs close where they hold the platform alike: {} and {} are those of all legs."
        closed = [Vector(x) for x in ("p_i", "R_i") if x in {e.name for e in found.leg}]
        listed = [Vector("W_i"), Vector("J_i"), *(closed if len(closed) > 1 else ())]
        blocks += [
            *_compliance_of_springs(found, "C_i", taken, Equation("K_i", whole)),
            Sentences(words + closing * (len(listed) > 2), tuple(listed)),
            equation(result, "sum over i of K_i"),
        ]
    elif several:
        blocks.append(equation(result, " + ".join(parts)))
    if found.average is not None:
        blocks += [
            Sentences(
                "The wrenches are turns of the first about z, or mirror images, and meet the same "
                "compliance. With the entries ({}, {}, {}, {}, {}, {}) of {} the sum is",
                ("u_x", "u_y", "u_z", "m_x", "m_y", "m_z", Vector("w_1")),
            ),
            MatrixEquation(result, found.average),
        ]
    return blocks


def _kind_of_leg(
    found: VectorForm,
    result: str,
    names: Sequence[Definition],
    pose: Sequence[Equation],
    taken: set[str],
) -> list[Block]:
    """One leg of a kind, the table of what differs, and the sum over these legs."""

    def equations_of(rows: Sequence[Equation]) -> list[Equation]:
        return [replace(e, expression=in_decimals(e.expression)) for e in rows]

    columns: dict[str, list[Any]] = {}
    same: list[Equation] = []  # what differs by rounding alone
    for name, column in found.columns.items():
        # Joint coordinates are the given ones, with the number of the leg in place of i.
        if not all(re.fullmatch(name.replace("_i_", r"_\d+_"), str(x)) for x in column):
            columns[name] = [*map(in_decimals, column)]
            decimals = {x.evalf(DIGITS) if x.is_number else x for x in columns[name]}
            if len(decimals) < min(2, len(column)):
                value = columns.pop(name)[0]
                same.append(Equation(name, value))
    leg = [*equations_of(found.leg), *same]
    of_wrench = [e.name.startswith(("w_", "c_", "o_")) for e in leg]
    first = [e for e, is_later in zip(leg, of_wrench, strict=True) if not is_later]
    rest = [e for e, is_later in zip(leg, of_wrench, strict=True) if is_later]
    J: Any = f"[{', '.join(found.passive)}]"
    twists = (Equation("J_i", J),) * bool(found.passive)
    # What a name stands for, before it is used.
    first.sort(key=lambda e: e not in same)
    blocks: list[Block] = [
        EquationRows((*equations_of(pose), *first, *twists)),
        equations(names),
        EquationRows(tuple(rest)),
    ]
    if columns:
        rows = zip(found.legs, zip(*columns.values(), strict=True), strict=True)
        head = (Vector(x) if isinstance(c[0], Coordinates) else x for x, c in columns.items())
        blocks.append(FormulaTable(tuple(head), tuple(rows)))
    if found.turned:
        turned = "; ".join(", ".join(group) for group in found.turned)
        blocks.append(Sentences(f"Legs that are turns of one another about z: {turned}."))
    if not found.wrenches:
        return [*blocks, *_tables_of_springs(found, taken)]
    terms = [f"{w} {w}^T / {c}" for w, c in found.wrenches]
    if found.rods:
        couple, compliance = equations_of(found.of_rod)
        blocks += [
            Sentences(
                "Rods of a leg are parallel. They act as one rod at their middle, and each turns "
                "the middle by a couple; the vectors from there to their ends sum to zero."
            ),
            EquationRows((couple, compliance)),
            FormulaTable(
                ("r_ijx", "r_ijy", "r_ijz"),
                tuple((name, tuple(map(in_decimals, arm))) for _, name, arm in found.rods),
                "rod",
            ),
        ]
        v = couple.name
        terms.append(f"sum over j of {v} {v}^T / {compliance.name}")
    total = "sum over i of " * (len(found.legs) > 1)
    if not found.coupled:
        each = " + ".join(terms)
        each = f"({each})" if total and len(terms) > 1 else each
        return [*blocks, equation(result, total + each)]
    W = f"[{', '.join(w for w, _ in found.wrenches)}]"
    C = "; ".join(", ".join(f"${c}" if c else "0" for c in row) for row in found.coupled)
    K = f"{total}W_i C_i^-1 W_i^T"
    each: Any = (("W_i", W), ("C_i", f"[{C}]"), (result, K))
    return [*blocks, EquationRows(tuple(Equation(*row) for row in each))]


def _series(found: Any, result: str, taken: set[str]) -> list[Block]:
    """The compliance of a serial arm, in vectors or by its entries, and its inverse."""
    title = Title("Compliance: a sum over the springs")
    if isinstance(found, InSeries):
        return [
            title,
            Sentences(
                "Springs in series add their compliances. These are in axes of the arm, in which "
                "they are simplest: columns of {}, in world axes, with their origin at {} from the "
                "reference point.",
                OWN_AXES,
            ),
            equations(found.names),
            *own_axes(found),
            MatrixEquation("C", found.C.applyfunc(in_decimals)),
            equation("K_0", "C^-1"),
            transport(result, "K_0"),
        ]
    p, printed = Vector("p_C" if found.modules else "p"), set[Any]()
    for module in (x for *_, x in found.modules if isinstance(x, RobotDerivation)):
        level = module.vectors if is_vectors_alone(module) else module.named or module
        printed |= {d.symbol for d in getattr(level, "names", level.definitions)}
    names = [d for d in found.names if d.symbol not in printed]
    before = names if found.modules else []
    words = _SPRINGS_ADD if found.beams else f"{_SPRINGS_ADD.split(', and', maxsplit=1)[0]}."
    listed = (Vector("t"), p, Vector("m"), p, Vector("Q"))[: words.count("{}")]
    return [
        Title("All modules") if found.modules else title,
        *[Sentences(words, listed)] * bool(found.beams or found.drives),
        equations(before),
        *_kind_of_leg(found, result, () if before else names, (), taken),
        *_compliance_of_springs(found, "C", taken),
        equation(result, "C^-1"),
    ]


_SPRINGS_ADD = (
    "Springs in series add their compliances: a drive that of its unit motion, of which {} is the "
    "twist [translation; rotation] about the reference point {}, and a beam that about its middle, "
    "at {} from {}, in its own axes, the columns of {}, x along it."
)


def _tables_of_springs(found: VectorForm, taken: set[str]) -> list[Block]:
    """Drives and beams of an arm or of a generic leg."""
    drives = tuple((joint, (Vector(t), in_decimals(c))) for joint, t, c in found.drives)
    beams = tuple(
        (beam, (Vector(Q), Vector(m), *map(in_decimals, sizes)))
        for beam, Q, m, sizes in found.beams
    )
    head = (Vector("Q"), Vector("m"), *letters_of_beam(taken))
    blocks: list[Block] = [FormulaTable((Vector("t"), "c"), drives, "joint")] * bool(drives)
    return [*blocks, *[FormulaTable(head, beams, "beam")] * bool(beams)]


def _compliance_of_springs(
    found: VectorForm, name: str, taken: set[str], *after: Equation
) -> list[Block]:
    """The compliance as a sum over modules, drives and beams, and the equations after it."""
    C = " + ".join(
        [f"J_{k} C_{k} J_{k}^T" for k in range(1, len(found.modules) + 1)]
        + ["sum of $c t t^T"] * bool(found.drives)
        + ["sum of T D T^T"] * bool(found.beams)
    )
    moved = [
        (f"J_{k}", f"[{B}, ({v} ×) {B}; 0, {B}]".replace(") 1", ")"))
        for k, (_, B, v, _) in enumerate(found.modules, start=1)
    ]
    rows: list[tuple[str, Any]] = [(name, C), *moved]
    if found.beams:
        compliances = beam_compliances(*map(sp.Symbol, letters_of_beam(taken)))
        rows += [("T", "[Q, (m ×) Q; 0, Q]"), ("D", sp.Function("diag")(*compliances))]
    return [EquationRows((*(Equation(*row) for row in rows), *after))]
