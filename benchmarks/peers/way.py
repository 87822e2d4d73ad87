"""What all peers share: the shape of their answers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

#: From rows of pose coordinates (x, y, z, rotation vector; 6, N) to the 21 entries of K_C (21, N).
Way = Callable[[np.ndarray], np.ndarray]

#: Rows and columns of the 21 entries.
PLACES = np.triu_indices(6)


class PeerMissing(Exception):
    """The peer cannot run here; says what it lacks."""
