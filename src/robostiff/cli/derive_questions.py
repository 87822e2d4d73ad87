"""Questions to the formula of a robot, answered in text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic import (
    Part,
    RobotDerivation,
    eigenvalue_formulas,
    fixed_point_formula,
    free_motion_formulas,
    rank_formula,
)
from robostiff.errors import InputError
from robostiff.markup import text_of
from robostiff.spatial import Space


@dataclass(frozen=True)
class Questions:
    """What is asked about a formula."""

    rank: bool
    free_motions: bool
    eigenvalues: bool

    @property
    def any(self) -> bool:
        """Whether anything is asked."""
        return self.rank or self.free_motions or self.eigenvalues

    def answered(self, derivation: RobotDerivation) -> str:
        """The answers, one or more lines each.

        Raises
        ------
        InputError
            When the formula is not in closed form.
        """
        if not derivation.is_closed:
            raise InputError(
                "questions about a formula",
                got="named steps",
                expected="a closed form",
                hint="ask at home, or write --closed",
            )
        lines = [f"{derivation.name}, {derivation.where}"]
        if self.rank:
            lines += _rank(derivation.K)
        if self.free_motions:
            lines += _free_motions(derivation.K)
        if self.eigenvalues:
            lines += _eigenvalues(derivation.K)
        return text_of(lines) + "\n"


def _rank(K: sp.ImmutableMatrix) -> list[str]:
    found = rank_formula(K)
    line = f"rank {found.rank} of {K.rows}"
    if found.exceptions:
        line += f"; lower where one of these is zero: {_listed(found.exceptions)}"
    return [line]


def _free_motions(K: sp.ImmutableMatrix) -> list[str]:
    motions = free_motion_formulas(K)
    if not motions:
        return ["no free motion"]
    names = ", ".join(Space.of_size(K.rows).twist_order)
    lines = [f"free motion ({names}) = ({_listed(t.flat())})" for t in motions]
    point = fixed_point_formula(K)
    if point is not None:
        place = _listed(point.flat())
        lines.append(f"all of them leave one point at rest, from the reference point: ({place})")
    return lines


def _eigenvalues(K: sp.ImmutableMatrix) -> list[str]:
    lines = []
    for part, unit in ((Part.TRANSLATION, "N/m"), (Part.ROTATION, "N m/rad")):
        found = eigenvalue_formulas(K, part)
        lines.append(f"stiffness in {part.value} [{unit}]: {found.answer}")
        for e in found.values:
            times = f" ({e.multiplicity} times)" if e.multiplicity > 1 else ""
            lines.append(f"  {sp.sstr(e.value)}{times}")
    return lines


def _listed(expressions: Iterable[Any]) -> str:
    return ", ".join(map(sp.sstr, expressions))
