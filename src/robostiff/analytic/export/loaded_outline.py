"""The contents of an exported stiffness under load, in order."""

from __future__ import annotations

from typing import Any

import sympy as sp

from robostiff.analytic.combinations import name_combinations
from robostiff.analytic.export.entries import EntryNames, MatrixName
from robostiff.analytic.export.outline import (
    Block,
    Nomenclature,
    OutlineHeading,
    OutlineText,
    column_equation,
    equations,
    meaning_of_result,
    stiffness_equation,
    title_of,
)
from robostiff.analytic.stiffness_under_load import StiffnessUnderLoad


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
        f"order in the wrench on the platform: {names.result.name} = {unloaded.name} + "
        f"{added.name}. {added.name} is linear in the wrench {load.name}, which acts at the "
        "reference point and does not turn with the platform."
    )
    K0, K1, definitions = loaded.K0, loaded.K1, loaded.definitions
    if loaded.is_closed:
        named = name_combinations(sp.ImmutableMatrix([[*K0, *K1]]), names.given)
        entries = iter(named.matrix)
        K0, K1 = (sp.ImmutableMatrix(K.rows, K.cols, lambda *_: next(entries)) for K in (K0, K1))
        definitions = named.definitions
    blocks: list[Block] = [
        OutlineHeading(title_of(whole), level=1),
        OutlineText(words),
        column_equation(load.name, loaded.wrench),
    ]
    if definitions:
        blocks.append(equations(definitions))
    for title, K, name in (("Without load", K0, unloaded), ("What the load adds", K1, added)):
        blocks += [OutlineHeading(title), stiffness_equation(K, name, names)]
    rows: list[tuple[tuple[MatrixName | str, ...], Any]] = [
        ((names.result,), meaning_of_result(whole)),
        ((unloaded, added), "its part without load, and what the load adds"),
        ((load,), "wrench on the platform"),
        (names.given, "given"),
    ]
    return (*blocks, Nomenclature(tuple(row for row in rows if row[0])))


def _free(name: str, taken: tuple[str, ...]) -> MatrixName:
    while name in taken:
        name = f"{name[0]}'{name[1:]}"
    return MatrixName(name)
