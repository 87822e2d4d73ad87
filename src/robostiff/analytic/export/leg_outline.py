"""The contents of an exported elimination of a leg's passive joints, in order."""

from __future__ import annotations

from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Stage
from robostiff.analytic.export.entries import (
    EntryNames,
    MatrixName,
    operations,
    readable,
    readable_matrix,
)
from robostiff.analytic.export.outline import (
    LONGEST_STAGE,
    Block,
    EqualMatrices,
    Inverse,
    MatrixEquation,
    Nomenclature,
    OutlineHeading,
    OutlineText,
    Recursion,
    ScalarEquations,
    Transport,
    column_equation,
    equations,
    matrix_equation,
    meanings_of_given,
    stiffness_equation,
)
from robostiff.analytic.legs.leg_elimination import LegElimination
from robostiff.spatial import Space

_C = MatrixName("C")
_AXES = MatrixName("R_0")
_ARM = MatrixName("v_0")


def leg_outline(derivation: LegElimination) -> tuple[Block, ...]:
    """The blocks of the elimination of a leg's joints: compliance, K^0, each joint, transport.

    Examples
    --------
    >>> import robostiff as rs
    >>> leg = rs.derive("gough-stewart-a-beams", symbols=("h",), leg="leg1")
    >>> [b.text for b in leg_outline(leg) if isinstance(b, OutlineHeading)][:5]
    ['Stiffness of leg1 of gough-stewart-a-beams, joint by joint', 'Names', 'Axes', 'Compliance \
without passive joints', 'Joint 1: platform joint[0]']
    """
    names = EntryNames(derivation)
    first = names.stiffness(0)
    of_stages = {d.symbol for stage in derivation.stages for d in stage.definitions}
    before = [d for d in derivation.definitions if d.symbol not in of_stages]
    blocks: list[Block] = [
        OutlineHeading(f"Stiffness of {derivation.leg}, joint by joint", level=1),
        OutlineText(_summary(derivation), (first, _C)),
        OutlineHeading("Names"),
        equations(before),
        OutlineHeading("Axes"),
        OutlineText(
            "All matrices are in axes of the leg, in which its joints are simplest: columns of "
            "{}, in world axes. Their origin lies at {} from the reference point.",
            (_AXES, _ARM),
        ),
        _matrix(derivation.axes, _AXES),
        column_equation(_ARM.name, derivation.arm),
        OutlineHeading("Compliance without passive joints"),
        OutlineText(f"Springs: {', '.join(derivation.elastic)}; all joints are held."),
        _matrix(derivation.C, _C),
        Inverse(first, _C),
        _stiffness(derivation.K0, first, names),
    ]
    previous = derivation.K0
    for number, stage in enumerate(derivation.stages, start=1):
        blocks += _stage(stage, number, previous, names)
        previous = stage.K
    last = names.stiffness(len(derivation.stages))
    blocks += [
        OutlineHeading("About the reference point, world axes"),
        OutlineText("The leg's part of the sum over the legs, eq. (11) to (13):"),
        Transport(names.result, last, _AXES, _ARM),
        _nomenclature(derivation, names),
    ]
    return tuple(blocks)


def _summary(derivation: LegElimination) -> str:
    count = len(derivation.stages)
    order = (
        " The joints stand in the order that keeps the matrices short; the result does not depend "
        "on it."
    )
    joints = (
        "no passive joint"
        if not count
        else "one passive joint"
        if count == 1
        else (f"{count} passive joints, eliminated one after the other by the recursion (15)")
    )
    return (
        f"The leg {derivation.where}: its stiffness {{}} without passive joints is the inverse of "
        f"its compliance {{}}; it has {joints}." + order * (count > 1)
    )


def _stage(stage: Stage, number: int, before: Any, names: EntryNames) -> list[Block]:
    J, u, mu = names.column("J", number), names.column("u", number), names.scalar("mu", number)
    earlier, after = names.stiffness(number - 1), names.stiffness(number)
    blocks: list[Block] = [
        OutlineHeading(f"Joint {number}: {stage.joint}"),
        OutlineText(f"{stage.rule.replace('the reference point', 'the origin')}."),
        column_equation(J.name, stage.J),
    ]
    if stage.is_redundant:
        return [*blocks, EqualMatrices(after, earlier)]
    alone = [p for p, x in enumerate(stage.J.flat()) if x != 0]
    if len(alone) == 1:
        (p,) = alone
        if any(j != p and before[p, j] != 0 for j in range(before.rows)):
            K = earlier.name  # rule (19) in symbols, for any row j and column k
            whole, across = sp.Symbol(f"{K}_jk"), sp.Symbol(f"{K}_{p + 1}{p + 1}")
            sides = sp.Symbol(f"{K}_j{p + 1}") * sp.Symbol(f"{K}_k{p + 1}")
            blocks.append(ScalarEquations(((f"{after.name}_jk", whole - sides / across),)))
        else:
            words = f"Row and column {p + 1} hold no other entry: they are struck, and all others "
            blocks.append(OutlineText(f"{words}stay."))
        blocks.append(equations(stage.definitions))
    else:
        blocks += [equations(stage.definitions), column_equation(u.name, stage.u)]
        if stage.mu != sp.Symbol(mu):
            blocks.append(ScalarEquations(((mu, readable(stage.mu)),)))
        blocks.append(Recursion(after, earlier, u, mu))
    return [*blocks, _stiffness(stage.K, after, names)]


def _stiffness(K: Any, name: MatrixName, names: EntryNames) -> Block:
    if operations(K) > LONGEST_STAGE:
        return OutlineText("{} is too long to be written out.", (name,))
    return stiffness_equation(K, name, names)


def _matrix(M: Any, name: MatrixName) -> MatrixEquation:
    return matrix_equation(name, readable_matrix(M), lambda i, j: f"{name.name}_{i + 1}{j + 1}")


def _nomenclature(derivation: LegElimination, names: EntryNames) -> Nomenclature:
    wrench = ", ".join(Space.of_size(derivation.K.rows).wrench_order)
    count = len(derivation.stages)
    rows: list[tuple[tuple[MatrixName | str, ...], str]] = [
        ((_C,), f"compliance of the elastic parts: twist for wrench ({wrench})"),
        ((names.stiffness(0),), "stiffness without passive joints"),
        ((_AXES, _ARM), "axes of the leg in the world, and their origin"),
    ]
    if count:
        rows += [
            ((names.column("J", 1), "..."), "twist of a passive joint, eq. (17)"),
            ((names.stiffness(1), "..."), "stiffness after the joint"),
        ]
    if any(sum(x != 0 for x in s.J.flat()) > 1 and not s.is_redundant for s in derivation.stages):
        rows += [
            ((MatrixName("u"),), "reaction to the unit motion of a joint, K J"),
            (("mu",), "stiffness against this motion, J^T K J"),
        ]
    given = {str(symbol) for symbol in derivation.given_symbols}
    pose = [name for name in derivation.coordinates if name in given]
    listed = dict.fromkeys((*pose, *sorted(given)))
    return Nomenclature((*rows, *meanings_of_given(listed, derivation.meanings)))
