"""Matrices of balls (numbers with a radius that holds their rounding)."""

from __future__ import annotations

import numpy as np
from flint import arb, arb_mat


def of_rank(C: np.ndarray, U: np.ndarray, soft: np.ndarray) -> arb_mat:
    """C without what rounding of its entries adds in directions in which it is rigid.

    ``C V (V^T C V)^-1 V^T C`` has exactly the rank of V, and is C where C has that rank; else a
    rank-one spring of 1e-3 would hold 1e-19 across it, and decide where nothing else is compliant.
    """
    whole = arb_mat((0.5 * (C + C.T)).tolist())
    if U.shape[1] in (0, np.count_nonzero(soft)):
        return whole if U.shape[1] else arb_mat(6, 6)
    size = np.sqrt(np.where(soft, np.diag(C), 1.0))
    V = arb_mat((U / size[:, None]).tolist())
    CV = whole * V
    return CV * (V.transpose() * CV).solve(CV.transpose())


def cross(a: list[arb], b: list[arb]) -> list[arb]:
    """Cross product of two vectors."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def put(matrix: arb_mat, part: arb_mat, row: int, column: int) -> None:
    """Write a part into a matrix, its first entry at (row, column)."""
    for i in range(part.nrows()):
        for j in range(part.ncols()):
            matrix[row + i, column + j] = part[i, j]


def cut(matrix: arb_mat, rows, columns) -> arb_mat:
    """Some rows and some columns."""
    rows, columns = list(rows), list(columns)
    entries = [matrix[i, j] for i in rows for j in columns]
    return arb_mat(len(rows), len(columns), entries)


def stacked(rows: list[arb_mat], chosen: list[int], columns: list[int]) -> arb_mat:
    """Chosen rows, one matrix each, and some columns of them."""
    entries = [rows[i][0, j] for i in chosen for j in columns]
    return arb_mat(len(chosen), len(columns), entries)


def certain(matrix: arb_mat) -> np.ndarray:
    """Entries as floats; 0 where no digit of them is certain, as where all is rigid."""
    return np.where(
        [[matrix[i, j].contains(0) for j in range(matrix.ncols())] for i in range(matrix.nrows())],
        0.0,
        floats(matrix),
    )


def floats(matrix: arb_mat) -> np.ndarray:
    """Middles of the balls."""
    return np.array(
        [[float(matrix[i, j]) for j in range(matrix.ncols())] for i in range(matrix.nrows())]
    ).reshape(matrix.nrows(), matrix.ncols())
