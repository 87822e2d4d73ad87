"""Springs whose 6x6 matrix holds formulas: symmetry, inverse and free directions, exactly."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.elasticity._spring_matrix import MatrixKind
from robostiff.errors import InputError


def symmetric_formulas(matrix: np.ndarray, kind: MatrixKind) -> np.ndarray:
    """The matrix itself; InputError unless it is 6x6, symmetric, and may be semidefinite."""
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
    for i in range(6):
        if matrix[i, i].is_negative or (matrix[i, i] == 0 and any(matrix[i] != 0)):
            raise InputError(
                f"{kind.name}, entry [{kind.rows[i]}, {kind.columns[i]}] = {matrix[i, i]}",
                expected="no negative eigenvalue: a spring does not push in the direction it is "
                "pulled",
            )
    return matrix


def inverse_of_formulas(K: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Compliance (6, 6) and freedoms (6, k) of a stiffness; None where a coupled block is singular.

    Directions that no entry couples are taken block by block; a row of zeros is a freedom.
    """
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
