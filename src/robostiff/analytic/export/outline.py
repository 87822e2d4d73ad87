"""The contents of an exported formula in order, independent of its format."""

from __future__ import annotations

from typing import Any

import sympy as sp

from robostiff.analytic.cable_formula import CableFormula
from robostiff.analytic.calculus import ComplianceSteps, FormulaDerivative, derivative_name
from robostiff.analytic.derivation import Derivation, RobotDerivation
from robostiff.analytic.exact.definition import used_definitions
from robostiff.analytic.export.cable_outline import cable_outline
from robostiff.analytic.export.entries import EntryNames, readable_matrix
from robostiff.analytic.export.nomenclature import (
    OF_T,
    meanings_of_legs,
    nomenclature_of,
    with_conditions,
    with_springs,
)
from robostiff.analytic.export.notation import (
    OWN_AXES,
    Block,
    EquationRows,
    MatrixEquation,
    Meaning,
    Nomenclature,
    Sentences,
    Title,
    column_equation,
    equation,
    equations,
    meanings_of_given,
    own_axes,
    scalar_unless_name,
    stiffness_equation,
    transport,
    unless_long,
)
from robostiff.analytic.export.robot_outline import outline_in_vectors, robot_outline, vector_level
from robostiff.analytic.legs import LegElimination
from robostiff.analytic.reading.combinations import name_combinations
from robostiff.analytic.vectors.forms import VectorForm
from robostiff.analytic.vectors.vector_expressions import Vector
from robostiff.kept import kept
from robostiff.spatial import Space


@kept
def outline_of(derivation: Any) -> tuple[Block, ...]:
    """The blocks of an exported derivation, of a robot, or of a derivative."""
    outline: Any = _chain
    for kind, outline_of_kind in (
        (FormulaDerivative, _derivative),
        (RobotDerivation, robot_outline),
        (LegElimination, _leg),
        (ComplianceSteps, _compliance),
        (VectorForm, outline_in_vectors),
        (CableFormula, cable_outline),
    ):
        outline = outline_of_kind if isinstance(derivation, kind) else outline
    return with_conditions(with_springs(outline(derivation)), derivation)


def _chain(derivation: Derivation) -> list[Block]:
    """The start, each passive joint, and the result; of all formulas that are but a matrix."""
    names, stages = EntryNames(derivation), getattr(derivation, "stages", ())
    blocks: list[Block] = [Title(names.title, level=1)]
    rows: list[Meaning] = []
    staged = {d.symbol for stage in stages for d in stage.definitions}
    definitions = [d for d in derivation.definitions if d.symbol not in staged]
    if stages:
        joints = "one passive joint" if len(stages) == 1 else f"{len(stages)} passive joints"
        form = "in closed form" if derivation.is_closed else "in named steps"
        start = names.of("K", 0)
        blocks += [
            Sentences(f"Elimination of {joints}, eq. (15), {form}."),
            *(Title("Definitions"), equations(definitions)),
            Title("Start: stiffness without passive joints"),
            *unless_long(start, derivation.K0),
            *_joints(derivation, names),
        ]
        rows += [((Vector(start),), "stiffness without passive joints")]
        rows += _meanings_of_joints(derivation, names, without_reactions=False)
        definitions = []
    else:
        blocks.append(Sentences("Stiffness as a formula."))
    K = derivation.K
    if derivation.is_closed:
        named = name_combinations(K, names.given)
        K, definitions = named.matrix, named.definitions
    blocks += [Title("Result"), equations(definitions), stiffness_equation(names.result, K)]
    return [*blocks, nomenclature_of(derivation, names, rows)]


def _joints(derivation: Derivation, names: EntryNames) -> list[Block]:
    """Each passive joint: its twist, what it takes away, eq. (15), and what remains.

    Of a leg, of which the axes are chosen for it, a trivial joint is written by the entries of K,
    eq. (19).
    """
    of_leg, blocks, before = isinstance(derivation, LegElimination), [], derivation.K0
    for number, stage in enumerate(derivation.stages, start=1):
        J, u, mu, after = (names.of(x, number) for x in ("J", "u", "mu", "K"))
        earlier = names.of("K", number - 1)
        rule = stage.rule.replace("the reference point", "the origin") if of_leg else stage.rule
        blocks += [
            Title(f"Joint {number}: {stage.joint}"),
            Sentences(f"{rule[:1].upper()}{rule[1:]}."),
            column_equation(J, stage.J),
        ]
        alone = [p for p, x in enumerate(stage.J.flat()) if x != 0]
        if of_leg and not stage.is_redundant and len(alone) == 1:
            blocks += [_by_entries(alone[0], earlier, after, before), equations(stage.definitions)]
        elif not (of_leg and stage.is_redundant):
            blocks += [equations(stage.definitions), column_equation(u, stage.u)]
            blocks += scalar_unless_name(mu, stage.mu)
            if not stage.is_redundant:
                blocks.append(equation(after, f"{earlier} - {u} {u}^T / {mu}"))
        if stage.is_redundant:
            blocks.append(equation(after, earlier))
        if number == len(derivation.stages) and not of_leg and stage.K == derivation.K:
            blocks.append(equation(after, names.result))
        elif not stage.is_redundant:
            blocks += unless_long(after, stage.K)
        before = stage.K
    return blocks


def _by_entries(place: int, earlier: str, after: str, before: Any) -> Block:
    """Rule (19) in symbols, for any row j and column k."""
    p = place + 1
    if all(j == place or before[place, j] == 0 for j in range(before.rows)):
        words = f"Row and column {p} hold no other entry: they are struck, and all others stay."
        return Sentences(words)
    whole, across, *sides = (
        sp.Symbol(f"{earlier}_{x}") for x in ("jk", f"{p}{p}", f"j{p}", f"k{p}")
    )
    return equation(f"{after}_jk", whole - sides[0] * sides[1] / across)


def _meanings_of_joints(
    derivation: Derivation, names: EntryNames, *, without_reactions: bool
) -> list[Meaning]:
    """Of the names of `_joints`."""
    count = len(derivation.stages)
    numbers = sorted({1, min(2, count), count})

    def listed(letter: str) -> tuple[Vector | str, ...]:
        found = [names.of(letter, i) for i in numbers]
        bold: list[Any] = found if letter == "mu" else list(map(Vector, found))
        return (*bold[:-1], *["..."] * (count > 3), bold[-1])

    rows: list[Meaning] = [(listed("J"), "twist of a passive joint, eq. (17)")]
    if not without_reactions:
        rows += [
            (
                listed("u"),
                "reaction to its unit motion, stiffness before the joint times its twist",
            ),
            (listed("mu"), "stiffness against its unit motion"),
        ]
    return [*rows, (listed("K"), "stiffness after the joint")]


def _leg(derivation: LegElimination) -> list[Block]:
    """Compliance, K^0, each joint, transport to the reference point."""
    names, count = EntryNames(derivation), len(derivation.stages)
    first, C = names.of("K", 0), Vector("C")
    joints = "no passive joint" if not count else "one passive joint"
    order = ""
    if count > 1:
        joints = f"{count} passive joints, eliminated one after the other by the recursion (15)"
        order = (
            " The joints stand in the order that keeps the matrices short; the result does not "
            "depend on it."
        )
    summary = (
        f"The leg {derivation.where}: its stiffness {{}} without passive joints is the inverse of "
        f"its compliance {{}}; it has {joints}.{order}"
    )
    of_stages = {d.symbol for stage in derivation.stages for d in stage.definitions}
    before = [d for d in derivation.definitions if d.symbol not in of_stages]
    blocks: list[Block] = [
        Title(f"Stiffness of {derivation.leg}, joint by joint", level=1),
        Sentences(summary, (Vector(first), C)),
        Title("Names"),
        equations(before),
        Title("Axes"),
        Sentences(
            "All matrices are in axes of the leg, in which its joints are simplest: columns of "
            "{}, in world axes. Their origin lies at {} from the reference point.",
            OWN_AXES,
        ),
        *own_axes(derivation),
        Title("Compliance without passive joints"),
        Sentences(f"Springs: {', '.join(derivation.elastic)}; all joints are held."),
        MatrixEquation(C.name, readable_matrix(derivation.C)),
        equation(first, "C^-1"),
        *unless_long(first, derivation.K0),
        *_joints(derivation, names),
        Title("About the reference point, world axes"),
        Sentences("The leg's part of the sum over the legs, eq. (11) to (13):"),
        transport(names.result, names.of("K", count)),
    ]
    form, of_vectors = derivation.at_vector_level, list[Meaning]()
    if form is not None:
        taken = {*names.given, *(d.symbol.name for d in derivation.definitions)}
        for b in vector_level(form, names.result, taken):
            is_rows = isinstance(b, EquationRows)  # what is defined above is not said again
            rest = tuple(e for e in b.rows if e.name not in taken) if is_rows else ()
            blocks.append(EquationRows(rest, b.springs) if is_rows else b)
        of_vectors = meanings_of_legs(derivation, form, names)
    wrench = ", ".join(Space.of_size(derivation.K.rows).wrench_order)
    rows: list[Meaning] = [
        ((C,), f"compliance of the elastic parts: twist for wrench ({wrench})"),
        ((Vector(first),), "stiffness without passive joints"),
        (OWN_AXES, "axes of the leg in the world, and their origin"),
        ((Vector("T"),), OF_T),
    ]
    if count:
        by_entries = (s.is_redundant or sum(x != 0 for x in s.J) < 2 for s in derivation.stages)
        rows += _meanings_of_joints(derivation, names, without_reactions=all(by_entries))
    given = names.given
    listed = dict.fromkeys((*(x for x in derivation.coordinates if x in given), *given))
    rows += of_vectors
    return [*blocks, Nomenclature((*rows, *meanings_of_given(listed, derivation.meanings)))]


def _compliance(found: ComplianceSteps) -> list[Block]:
    """Its steps, and the matrix in their names."""
    names = EntryNames(found)
    C = names.free("C")
    space = Space.of_size(found.C.rows)
    wrench, twist = ", ".join(space.wrench_order), ", ".join(space.twist_order)
    meaning = f"compliance about the reference point: twist ({twist}) for wrench ({wrench})"
    return [
        Title(f"Cartesian {found.name}", level=1),
        Sentences("The inverse of the stiffness matrix, in named steps."),
        equations(found.definitions),
        MatrixEquation(C, readable_matrix(found.C)),
        Nomenclature((((Vector(C),), meaning), *meanings_of_given(names.given, found.meanings))),
    ]


def _derivative(derivative: FormulaDerivative) -> list[Block]:
    """Definitions, the derivative of the stiffness matrix, and its nomenclature."""
    names, symbol = EntryNames(derivative.derivation), derivative.symbol
    result = derivative_name(names.result, symbol)
    (_, dK), definitions = derivative.as_printed
    if not definitions:
        named = name_combinations(dK, names.given)
        definitions, dK = named.definitions, named.matrix
    form = "in closed form" if derivative.is_closed else "in named steps, each with its derivative"
    meaning = f"derivative of {names.result} by {symbol.name}, all other given symbols held"
    given = meanings_of_given(names.given, derivative.meanings)
    return [
        Title(f"Derivative of the stiffness matrix {names.result} by {symbol.name}", level=1),
        Sentences(f"Derivative {form}."),
        Title("Result"),
        equations(used_definitions(definitions, dK.flat())),
        stiffness_equation(result, dK),
        Nomenclature((((Vector(result),), meaning), *given)),
    ]
