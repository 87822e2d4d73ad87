"""A sparse matrix, gathered block by block."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array, csc_array


@dataclass
class BlockEntries:
    """Blocks of a sparse matrix; those at one place add up.

    Examples
    --------
    >>> blocks = BlockEntries()
    >>> blocks.add(np.ones((1, 2)), np.array([1]), np.array([0, 2]))
    >>> blocks.matrix((2, 3)).toarray()
    array([[0., 0., 0.],
           [1., 0., 1.]])
    """

    rows: list[np.ndarray] = field(default_factory=list)
    columns: list[np.ndarray] = field(default_factory=list)
    values: list[np.ndarray] = field(default_factory=list)

    def add(self, block: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> None:
        """Add a block (r, c) at these rows (r,) and columns (c,)."""
        self.rows.append(np.repeat(rows, len(columns)))
        self.columns.append(np.tile(columns, len(rows)))
        self.values.append(block.ravel())

    def matrix(self, shape: tuple[int, int]) -> csc_array:
        """The matrix, by columns."""
        none = np.zeros(0, dtype=int)
        rows = np.concatenate([none, *self.rows])
        columns = np.concatenate([none, *self.columns])
        values = np.concatenate([np.zeros(0), *self.values])
        return coo_array((values, (rows, columns)), shape=shape).tocsc()
