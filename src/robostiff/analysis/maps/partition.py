"""How a map is cut into blocks: runs of poses in memory order that are chunks of the store, too."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

# Small enough for the cache, large enough to hide the cost of a block.
_BLOCK_BYTES = 8 * 2**20


@dataclass(frozen=True)
class Partition:
    """Blocks of a map.

    Whole trailing axes, a piece of one axis, single values of those before: such a block is one
    run of poses in memory and one chunk of every array of a store.

    Attributes
    ----------
    shape : tuple of int
        Of the map.
    block : tuple of int
        Of a block; the last one along an axis may be shorter.

    Examples
    --------
    >>> cut = Partition.of((4, 10, 3), most=12)
    >>> cut.block, len(cut), cut.slices(1)
    ((1, 4, 3), 12, (slice(0, 1, None), slice(4, 8, None), slice(0, 3, None)))
    >>> cut.run(1)
    (12, 24)
    """

    shape: tuple[int, ...]
    block: tuple[int, ...]

    @classmethod
    def of(cls, shape: tuple[int, ...], most: int) -> Partition:
        """The fewest blocks of at most so many poses."""
        block = [1] * len(shape)
        room = max(most, 1)
        for k in reversed(range(len(shape))):
            if shape[k] > room:
                pieces = -(-shape[k] // room)
                block[k] = -(-shape[k] // pieces)
                break
            block[k] = shape[k]
            room //= shape[k]
        return cls(shape, tuple(block))

    @property
    def pieces(self) -> tuple[int, ...]:
        """How many blocks lie along each axis."""
        return tuple(-(-n // b) for n, b in zip(self.shape, self.block, strict=True))

    @property
    def poses(self) -> int:
        """How many poses there are."""
        return math.prod(self.shape)

    def __len__(self) -> int:
        return math.prod(self.pieces)

    def place(self, index: int) -> tuple[int, ...]:
        """Which block along each axis."""
        return tuple(int(i) for i in np.unravel_index(index, self.pieces))

    def slices(self, index: int) -> tuple[slice, ...]:
        """Where a block lies."""
        starts = [i * b for i, b in zip(self.place(index), self.block, strict=True)]
        return tuple(
            slice(start, min(start + b, n))
            for start, b, n in zip(starts, self.block, self.shape, strict=True)
        )

    def run(self, index: int) -> tuple[int, int]:
        """First pose of a block in memory order, and the first after it."""
        part = self.slices(index)
        start = int(np.ravel_multi_index([s.start for s in part], self.shape))
        return start, start + math.prod(s.stop - s.start for s in part)


def poses_in_a_block(bytes_a_pose: int, most: int) -> int:
    """How many poses make a block of about 8 MiB, and no more than `most`."""
    return max(1, min(most, _BLOCK_BYTES // max(bytes_a_pose, 1)))
