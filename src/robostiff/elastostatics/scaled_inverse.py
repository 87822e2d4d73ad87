"""The compliance of a regular stiffness matrix."""

from __future__ import annotations

import numpy as np

from robostiff.elastostatics.tolerance import scaling
from robostiff.spatial import Space


def scaled_inverse(K: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Symmetric inverse of K, taken where translations and rotations are both lengths.

    Parameters
    ----------
    K : (..., n, n) array
        Regular [N/m, N, N m].
    length : (...) array
        Characteristic length [m].

    Returns
    -------
    (..., n, n) array
        [m/N, 1/N, rad/(N m)].

    Examples
    --------
    >>> scaled_inverse(np.diag([2.0, 4.0, 8.0]), np.array(0.5)).diagonal()
    array([0.5  , 0.25 , 0.125])
    """
    s = scaling(length, Space.of_size(K.shape[-1]))
    scale = s[..., :, None] * s[..., None, :]
    inverse = np.linalg.inv(K / scale)
    return 0.5 * (inverse + np.swapaxes(inverse, -1, -2)) / scale
