"""Values of recorded entries at the samples of their record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from robostiff.record import Entry


def sample(x: Any, k: int) -> float:
    """A number, or an entry at a sample."""
    return float(x.sample[k]) if isinstance(x, Entry) else float(x)


def samples(column: Sequence[Any] | np.ndarray, k: int) -> np.ndarray:
    """A column at a sample."""
    return np.array([sample(x, k) for x in column])


def symmetric(K: Mapping[tuple[int, int], Any], size: int, k: int = 0) -> np.ndarray:
    """A matrix at a sample, from its upper triangle."""
    return np.array(
        [[sample(K[min(i, j), max(i, j)], k) for j in range(size)] for i in range(size)]
    )
