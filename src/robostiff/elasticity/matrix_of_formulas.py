"""Springs given by a 6x6 matrix of formulas: its inverse, and where it is that of a spring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.elasticity.bounds import Bounds
from robostiff.errors import InputError
from robostiff.spatial import Space

_TWIST, _WRENCH = Space.SPATIAL.twist_order, Space.SPATIAL.wrench_order


@dataclass(frozen=True)
class MatrixKind:
    """Name, units and order of rows and columns of one kind of 6x6 matrix."""

    name: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    unit: str

    def entry(self, matrix: np.ndarray, i: int, j: int) -> str:
        """An entry as text: ``[Fx, dy] = 3``."""
        return f"[{self.rows[i]}, {self.columns[j]}] = {matrix[i, j]:.10g}"


STIFFNESS = MatrixKind("stiffness matrix", rows=_WRENCH, columns=_TWIST, unit="N/m")
COMPLIANCE = MatrixKind("compliance matrix", rows=_TWIST, columns=_WRENCH, unit="m/N")


def symmetric_formulas(matrix: np.ndarray, kind: MatrixKind) -> tuple[Bounds, ...]:
    """What is positive where it is semidefinite; InputError unless it is 6x6 and symmetric."""
    import sympy as sp

    if matrix.shape != (6, 6):
        raise InputError(f"shape of the {kind.name}", got=matrix.shape, expected="(6, 6)")
    for i, j in np.ndindex(6, 6):
        difference: Any = matrix[i, j] - matrix[j, i]
        if sp.simplify(difference) != 0:
            raise InputError(
                f"{kind.name}, entries [{kind.rows[i]}, {kind.columns[j]}] = {matrix[i, j]} and "
                f"[{kind.rows[j]}, {kind.columns[i]}] = {matrix[j, i]}",
                expected="a symmetric matrix",
            )
    expected = "no negative eigenvalue: a spring does not push in the direction it is pulled"
    bounds = []
    for block in _blocks(matrix):
        held: list[int] = []
        for i in block:
            rows = [*held, i]
            minor: Any = sp.Matrix(matrix[np.ix_(rows, rows)]).det(method="berkowitz")
            if sp.simplify(minor) != 0:
                names = ", ".join(kind.rows[j] for j in rows)
                words = f"determinant of the rows {names} of the {kind.name}"
                may_vanish = kind is COMPLIANCE and not held  # a rigid direction
                bounds.append(Bounds(words, minor, expected=expected, or_at=may_vanish))
                held = rows
            elif not held and len(block) > 1:
                entry = f"entry [{kind.rows[i]}, {kind.columns[i]}] = 0"
                raise InputError(f"{kind.name}, {entry}", expected=expected)
    return tuple(bounds)


def inverse_of_formulas(K: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Compliance (6, 6) and freedoms (6, k) of K; None where a coupled block is singular."""
    import sympy as sp

    zero = sp.Integer(0)
    C, free = np.full((6, 6), zero, dtype=object), []
    for block in _blocks(K):
        if len(block) == 1 and K[block[0], block[0]] == 0:
            free.append(block[0])
            continue
        part = sp.Matrix(K[np.ix_(block, block)])
        determinant: Any = part.det(method="berkowitz")
        if sp.simplify(determinant) == 0:
            return None
        inverse = part.inv(method="ADJ").applyfunc(sp.cancel)
        C[np.ix_(block, block)] = np.array(inverse.tolist(), dtype=object)
    freedoms = np.full((6, len(free)), zero, dtype=object)
    for column, row in enumerate(free):
        freedoms[row, column] = sp.Integer(1)
    return C, freedoms


def _blocks(K: np.ndarray) -> list[list[int]]:
    """Rows that are coupled with each other, block by block."""
    left, blocks = list(range(6)), []
    while left:
        block: list[int] = []
        reached: list[Any] = [left[0]]
        while reached:
            i = reached.pop()
            if i in left:
                left.remove(i)
                block.append(i)
                reached += [j for j in left if K[i, j] != 0]
        blocks.append(sorted(block))
    return blocks
