"""The contents of an exported derivative or robot, in order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative, derivative_name
from robostiff.analytic.exact.definition import used_definitions
from robostiff.analytic.export.entries import (
    EntryNames,
    MatrixName,
    operations,
    readable,
)
from robostiff.analytic.export.leg_outline import leg_outline
from robostiff.analytic.export.nomenclature import with_conditions, with_springs
from robostiff.analytic.export.outline import (
    LONGEST_STAGE,
    Block,
    Nomenclature,
    OutlineHeading,
    OutlineText,
    ScalarEquations,
    WrenchSum,
    column_equation,
    equations,
    meaning_of_result,
    meanings_of_given,
    outline,
    stiffness_equation,
    title_of,
)
from robostiff.analytic.export.vector_outline import (
    arm_meanings,
    series_blocks,
    vector_blocks,
    vector_meanings,
)
from robostiff.analytic.legs.leg_elimination import LegElimination
from robostiff.analytic.reading.combinations import name_combinations
from robostiff.analytic.robot_derivation import InNames, LegDerivation, RobotDerivation
from robostiff.analytic.stiffness_under_load import StiffnessUnderLoad
from robostiff.analytic.vectors.vector_expressions import ArmOfSprings
from robostiff.errors import InputError
from robostiff.spatial import Space


def loaded_outline(loaded: StiffnessUnderLoad) -> tuple[Block, ...]:
    """The wrench, the stiffness without it, and what it adds.

    Examples
    --------
    >>> k, F = sp.symbols("k F")
    >>> K, W = sp.ImmutableMatrix(sp.diag(k, k, k)), sp.ImmutableMatrix([0, -F, 0])
    >>> loaded = StiffnessUnderLoad("rod", "at home", W, K, F * K)
    >>> [block.text for block in loaded_outline(loaded) if isinstance(block, OutlineHeading)]
    ['Cartesian stiffness matrix rod', 'Without load', 'What the load adds']
    """
    whole = loaded.derivation
    names = EntryNames(whole)
    unloaded, added, load = (_free(name, names.given) for name in ("K_0", "K_1", "W"))
    form = "in closed form" if loaded.is_closed else "in named steps"
    words = (
        f"Stiffness about the reference point in world axes, {loaded.where}, {form}, to first "
        "order in the wrench on the platform: {} = {} + {}. {} is linear in the wrench {}, which "
        "acts at the reference point and does not turn with the platform."
    )
    K0, K1, definitions = loaded.K0, loaded.K1, loaded.definitions
    if loaded.is_closed:
        named = name_combinations(sp.ImmutableMatrix([[*K0, *K1]]), names.given)
        entries = iter(named.matrix)
        K0, K1 = (sp.ImmutableMatrix(K.rows, K.cols, lambda *_: next(entries)) for K in (K0, K1))
        definitions = named.definitions
    blocks: list[Block] = [
        OutlineHeading(title_of(whole), level=1),
        OutlineText(words, (names.result, unloaded, added, added, load)),
        column_equation(load.name, loaded.wrench),
        equations(definitions),
    ]
    for title, K, name in (("Without load", K0, unloaded), ("What the load adds", K1, added)):
        blocks += [OutlineHeading(title), stiffness_equation(K, name, names)]
    rows: list[tuple[tuple[MatrixName | str, ...], Any]] = [
        ((names.result,), meaning_of_result(whole)),
        ((unloaded, added), "its part without load, and what the load adds"),
        ((load,), "wrench on the platform"),
        *meanings_of_given(names.given, whole.meanings),
    ]
    return (*blocks, Nomenclature(tuple(rows)))


def _free(name: str, taken: tuple[str, ...]) -> MatrixName:
    while name in taken:
        name = f"{name[0]}'{name[1:]}"
    return MatrixName(name)


_MOST_LINES = 15  # of entries of K and of names, beside which one leg and the table are enough
_MEANINGS = {
    "L": "length of a leg",
    "d": "unit vector along a leg's rod",
    "B": "joint of a leg on the platform",
    "s": "coordinate of a slide",
}


def robot_outline(derivation: RobotDerivation) -> tuple[Block, ...]:
    """The blocks of the derivation of a robot: its legs, their sum, and the nomenclature.

    Examples
    --------
    >>> k = sp.Symbol("k")
    >>> K = sp.ImmutableMatrix(sp.diag(k, 0, 0))
    >>> wrench = sp.ImmutableMatrix([1, 0, 0])
    >>> leg = LegDerivation("rod", ("pin",), (), ("spring",), (wrench,), (1 / k,), K)
    >>> robot = RobotDerivation("robot", K, (), K, legs=(leg,), where="in the home configuration")
    >>> [block.text for block in outline_of(robot) if isinstance(block, OutlineHeading)]
    ['Cartesian stiffness matrix robot', 'Leg 1: rod', 'Sum of the legs']
    """
    names = EntryNames(derivation)
    blocks: list[Block] = [OutlineHeading(title_of(derivation), level=1), _summary(derivation)]
    if derivation.remark:
        blocks.append(OutlineText(derivation.remark))
    named = _named(derivation, names)
    definitions = list(named.definitions)
    form = derivation.vectors
    alone = is_vectors_alone(derivation)
    if form is not None and (derivation.is_closed or not alone):
        form = replace(form, average=None)  # K is written out
    taken = set(names.given)
    if not alone:
        taken |= {d.symbol.name for d in derivation.definitions}
    if form is not None:
        springs = [] if alone else [d for d in derivation.definitions if d.parts]
        section, defined = vector_blocks(form, names.result, [*definitions, *springs], taken)
        blocks += section
        definitions = [d for d in definitions if d.symbol not in defined]
    if alone:
        blocks += _in_words_of_all(derivation, kinds=True)
        return (*blocks, _nomenclature(derivation, names))
    if derivation.in_series is not None:
        # K as the inverse of C is the whole formula: wrenches of an arm say no more.
        blocks += series_blocks(derivation.in_series, names, (), set(names.given))
        blocks.append(OutlineText(f"Springs of the arm: {_in_words(derivation.legs[0])}"))
        return (*blocks, _nomenclature(derivation, names))
    closing = tuple(("0", x) for c in derivation.conditions for x in c.equations)
    blocks += [OutlineHeading("Where the legs close"), ScalarEquations(closing)]
    if form is not None and derivation.is_closed:
        # One leg and the table have said what all legs transmit, and how they add up.
        blocks += _in_words_of_all(derivation, kinds=True)
        used = used_definitions(definitions, named.K.flat())
        blocks += [OutlineHeading("All legs together"), equations(used)]
        blocks.append(stiffness_equation(named.K, names.result, names))
        return (*blocks, _nomenclature(derivation, names))
    blocks += [OutlineHeading("Names for recurring expressions"), equations(definitions)]
    blocks += _in_words_of_all(derivation)
    alike = len(derivation.legs) > 1 and len({*map(_in_words, derivation.legs)}) == 1
    for number, leg in enumerate(named.legs, start=1):
        blocks.append(OutlineHeading(f"Leg {number}: {' '.join(leg.name.split())}"))
        if not alike:
            blocks.append(OutlineText(f"Springs: {_in_words(derivation.legs[number - 1])}"))
        blocks += _leg(leg, number)
    blocks += [OutlineHeading("Sum of the legs"), WrenchSum(names.result)]
    of_legs = {d.symbol for leg in derivation.legs for d in leg.definitions}
    rest = [d for d in derivation.definitions if d.symbol not in of_legs]
    stiffness = stiffness_equation(named.K, names.result, names)
    return (*blocks, equations(rest), stiffness, _nomenclature(derivation, names))


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


def _in_words_of_all(derivation: RobotDerivation, *, kinds: bool = False) -> list[Block]:
    """What is elastic and passive in each leg, where all are alike or `kinds` are asked for."""
    alike: dict[str, list[str]] = {}
    for leg in derivation.legs:
        alike.setdefault(_in_words(leg), []).append(leg.name)
    count = len(derivation.legs)
    if count == 1 or (len(alike) > 1 and not kinds):
        return []
    of = [f"each of the {count} legs"] if len(alike) == 1 else map(", ".join, alike.values())
    texts = [
        OutlineText(f"Springs of {legs}: {words}") for legs, words in zip(of, alike, strict=True)
    ]
    return [OutlineHeading("The legs"), *texts]


def _named(derivation: RobotDerivation, names: EntryNames) -> InNames:
    """Names for K and the wrenches together, so that a name has one meaning; none in steps."""
    K, legs = derivation.K, derivation.legs
    if derivation.named is not None:
        return derivation.named
    if not derivation.is_closed:
        return InNames(K, legs, ())
    upper = [K[i, j] for i in range(K.rows) for j in range(i, K.rows)]
    columns = [[*w, c] for leg in legs for w, c in zip(leg.wrenches, leg.compliances, strict=True)]
    every = [*upper, *(entry for column in columns for entry in column)]
    named = name_combinations(sp.ImmutableMatrix([every]), names.given)
    entries = iter(named.matrix)
    written = {(i, j): next(entries) for i in range(K.rows) for j in range(i, K.rows)}
    found = []
    for leg in legs:
        own = [[next(entries) for _ in range(K.rows + 1)] for _ in leg.wrenches]
        wrenches = tuple(sp.ImmutableMatrix(column[:-1]) for column in own)
        compliances = tuple(column[-1] for column in own)
        found.append(replace(leg, wrenches=wrenches, compliances=compliances))
    matrix = sp.ImmutableMatrix(K.rows, K.rows, lambda i, j: written[min(i, j), max(i, j)])
    return InNames(matrix, tuple(found), named.definitions)


def _summary(derivation: RobotDerivation) -> OutlineText:
    if derivation.in_series is not None:
        return OutlineText(
            f"Stiffness about the reference point in world axes, {derivation.where}. No joint is "
            "passive: the stiffness is the inverse of the compliance, to which each spring adds "
            "what it feels of a unit wrench."
        )
    form = "in closed form" if derivation.is_closed else "in named steps"
    if is_vectors_alone(derivation):
        form = "leg by leg"
    count = len(derivation.legs)
    legs = "one leg" if count == 1 else f"{count} legs"
    share = "made conjugate to one another; each has a compliance {}"
    if is_vectors_alone(derivation) and derivation.vectors and derivation.vectors.coupled:
        share = "and which share the compliances {}"
    return OutlineText(
        f"Stiffness about the reference point in world axes, {derivation.where}, {form}. Passive "
        f"joints leave each chain the wrenches {{}} that they transmit, {share}. The stiffness is "
        f"a sum over {legs}, eq. (12).",
        (MatrixName("w"), "c"),
    )


def _in_words(leg: LegDerivation) -> str:
    words = f"{_listed(leg.elastic)}; passive joints: {_listed(leg.joints) or 'none'}"
    if leg.redundant:
        words += f"; of these add no freedom to those before: {_listed(leg.redundant)}"
    return f"{words}."


def _listed(names: Sequence[str]) -> str:
    """Names in a sentence; the freedoms of one joint together."""
    counts: dict[str, int] = {}
    for name in names:
        bare = re.sub(r"\[\d+\]$", "", name)
        counts[bare] = counts.get(bare, 0) + 1
    return ", ".join(
        f"{name} ({count} freedoms)" if count > 1 else name for name, count in counts.items()
    )


def _leg(leg: LegDerivation, number: int) -> list[Block]:
    """Definitions, then each wrench with its compliance."""
    blocks: list[Block] = [equations(leg.definitions)]
    if not leg.wrenches:
        return [*blocks, OutlineText("It transmits no wrench.")]
    several = len(leg.wrenches) > 1
    for k, (w, c) in enumerate(zip(leg.wrenches, leg.compliances, strict=True), start=1):
        own = f"{number}_{k}" if several else f"{number}"
        if operations(sp.ImmutableMatrix([*w, c])) > LONGEST_STAGE:
            too_long = MatrixName(f"w_{own}")
            blocks.append(OutlineText("{} is too long to be written out.", (too_long,)))
            continue
        blocks.append(column_equation(f"w_{own}", w))
        if c != sp.Symbol(f"c_{own}", real=True):
            blocks.append(ScalarEquations(((f"c_{own}", readable(c)),)))
    return blocks


def _nomenclature(derivation: RobotDerivation, names: EntryNames) -> Nomenclature:
    wrench = ", ".join(Space.of_size(derivation.K.rows).wrench_order)
    rows: list[tuple[tuple[MatrixName | str, ...], str]] = [
        ((names.result,), meaning_of_result(derivation)),
    ]
    series = derivation.in_series
    if series is None:
        rows += [
            ((MatrixName("w"),), f"wrench ({wrench}) that a leg transmits"),
            (("c",), "compliance of the leg under this wrench"),
        ]
    elif isinstance(series, ArmOfSprings):
        rows.append(((MatrixName("C"),), "compliance about the reference point, world axes"))
        rows += arm_meanings(series)
    else:
        rows += [
            ((MatrixName("C"),), "compliance in axes of the arm"),
            ((MatrixName("K_0"),), "stiffness there"),
            (
                (MatrixName("R_0"), MatrixName("v_0")),
                "axes of the arm in the world, and their origin",
            ),
        ]
    alone = is_vectors_alone(derivation)
    defined = [] if alone else [d.symbol.name for d in derivation.definitions]
    for letter, meaning in _MEANINGS.items():
        if any(name.startswith(f"{letter}_") for name in defined):
            rows.append(((letter,), meaning))
    form = derivation.vectors
    if form is not None:
        rows += vector_meanings(form)
    pose = [name for name in derivation.coordinates if name in names.given]
    given = dict.fromkeys((*pose, *names.given))
    return Nomenclature((*rows, *meanings_of_given(given, derivation.meanings)))


def outline_of(
    derivation: Derivation | FormulaDerivative | StiffnessUnderLoad,
) -> tuple[Block, ...]:
    """The blocks of an exported derivation, of a robot, of a derivative, or under load."""
    if isinstance(derivation, FormulaDerivative):
        blocks = derivative_outline(derivation)
    elif isinstance(derivation, RobotDerivation):
        blocks = robot_outline(derivation)
    elif isinstance(derivation, LegElimination):
        blocks = leg_outline(derivation)
    elif isinstance(derivation, StiffnessUnderLoad):
        blocks = loaded_outline(derivation)
    else:
        blocks = outline(derivation)
    return with_conditions(with_springs(blocks), derivation)


def refuse_derivative(derivation: Derivation) -> None:
    """For languages in which derivatives are not written.

    Raises
    ------
    InputError
        When it is a derivative.
    """
    if isinstance(derivation, FormulaDerivative):
        raise InputError(
            "derivation",
            got=f"the derivative {derivation.name}",
            expected="a derivation",
            hint="python_function and the printed forms write derivatives",
        )


def derivative_outline(derivative: FormulaDerivative) -> tuple[Block, ...]:
    """Definitions, the derivative of the stiffness matrix, and its nomenclature.

    Examples
    --------
    >>> import sympy as sp
    >>> from robostiff.analytic.derivatives import differentiate
    >>> k, L = sp.symbols("k L")
    >>> K = sp.ImmutableMatrix(sp.diag(k / L, 0, 0))
    >>> [type(b).__name__ for b in derivative_outline(differentiate(Derivation("K", K, (), K), L))]
    ['OutlineHeading', 'OutlineText', 'OutlineHeading', 'ScalarEquations', 'MatrixEquation', \
'Nomenclature']
    """
    names, symbol = EntryNames(derivative.derivation), derivative.symbol
    result = MatrixName(derivative_name(names.result.name, symbol))
    in_names = derivative.in_names
    definitions, dK = in_names.definitions, in_names.dK
    if in_names.is_closed:
        named = name_combinations(dK, names.given)
        definitions, dK = named.definitions, named.matrix
    definitions = used_definitions(definitions, dK.flat())
    form = "in closed form" if derivative.is_closed else "in named steps, each with its derivative"
    title = f"Derivative of the stiffness matrix {names.result.name} by {symbol.name}"
    meaning = f"derivative of {names.result.name} by {symbol.name}, all other given symbols held"
    given = meanings_of_given(names.given, derivative.derivation.meanings)
    return (
        OutlineHeading(title, level=1),
        OutlineText(f"Derivative {form}."),
        OutlineHeading("Result"),
        equations(definitions),
        stiffness_equation(dK, result, names),
        Nomenclature((((result,), meaning), *given)),
    )
