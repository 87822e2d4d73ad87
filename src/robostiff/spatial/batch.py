"""Memory order of batches, equal entries of all poses side by side; shapes in signatures.

All arrays are indexed ``(..., 6, 6)``. Work on many poses is several times faster when equal
entries of all poses lie side by side in memory. NumPy keeps that order through elementwise
arithmetic; new arrays are made by the functions of this module.

Shapes, as in ``Float[np.ndarray, "*batch 6 6"]``, are those of jaxtyping where a program has
imported it before, as the tests do, which check them. Elsewhere they are words for readers.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING or sys.modules.get("jaxtyping"):
    from jaxtyping import Bool, Float, Shaped
else:

    class Shaped:
        """An array; its shape is written behind it."""

        def __class_getitem__(cls, array_and_shape: tuple[Any, str]) -> Any:
            return array_and_shape[0]

    Bool = Float = Shaped


def empty_batch(batch: tuple[int, ...], matrix: tuple[int, ...], dtype: Any = float) -> np.ndarray:
    """Room for an array ``(*batch, *matrix)``, equal entries of all poses side by side.

    Entries are floats, or with ``dtype=object`` exact numbers and formulas.
    """
    inverse = (*range(len(matrix), len(matrix) + len(batch)), *range(len(matrix)))
    return np.empty((*matrix, *batch), dtype=dtype).transpose(inverse)


def poses_side_by_side(a: np.ndarray, matrix_axes: int) -> np.ndarray:
    """The same array ``(..., *matrix)``, with equal entries of all poses contiguous in memory.

    `matrix_axes` trailing axes belong to a pose: 2 for matrices, 1 for vectors.
    """
    batch_axes = a.ndim - matrix_axes
    if batch_axes == 0:
        return a
    ordered = empty_batch(a.shape[:batch_axes], a.shape[batch_axes:], a.dtype)
    ordered[...] = a
    return ordered


def product(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Matrix product A B over leading axes (..., n, m), poses side by side."""
    batch = A.shape[:-2]
    if batch != B.shape[:-2]:
        batch = np.broadcast_shapes(batch, B.shape[:-2])
    if not batch:
        return A @ B
    out = empty_batch(batch, (A.shape[-2], B.shape[-1]), np.result_type(A, B))
    return np.einsum("...ij,...jk->...ik", A, B, out=out)


def transpose(A: np.ndarray) -> np.ndarray:
    """Transpose A^T over leading axes, a view."""
    return np.swapaxes(A, -1, -2)


def block_diagonal(blocks: Sequence[np.ndarray]) -> np.ndarray:
    """Blocks (..., n, m) on the diagonal of one array, zeros elsewhere."""
    batch = np.broadcast_shapes(*(block.shape[:-2] for block in blocks))
    rows, columns = (sum(block.shape[axis] for block in blocks) for axis in (-2, -1))
    out = np.zeros((*batch, rows, columns), np.result_type(float, *blocks))
    row = column = 0
    for block in blocks:
        n, m = block.shape[-2:]
        out[..., row : row + n, column : column + m] = block
        row, column = row + n, column + m
    return out


def vector_of_entries(entries: Sequence[Any]) -> np.ndarray:
    """Array (..., n) of n entries (...), poses side by side."""
    arrays = [np.asarray(entry) for entry in entries]
    batch = np.broadcast_shapes(*(array.shape for array in arrays))
    out = empty_batch(batch, (len(entries),), np.result_type(*arrays))
    for i, array in enumerate(arrays):
        out[..., i] = array
    return out


def matrix_of_columns(
    columns: Sequence[np.ndarray], batch: tuple[int, ...], rows: int
) -> np.ndarray:
    """Array (*batch, rows, n) of n columns (..., rows), poses side by side."""
    out = empty_batch(batch, (rows, len(columns)), np.result_type(*columns))
    for i, column in enumerate(columns):
        out[..., i] = column
    return out
