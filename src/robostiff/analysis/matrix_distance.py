"""How far apart two stiffness matrices are."""

from __future__ import annotations

import numpy as np

from robostiff.spatial import Space

# Below this part of what the other block suggests a block is without stiffness.
_EMPTY = 1e-20
# Below this part it is the square of a lever arm of 1e-6, of which coordinates that are rounded a
# few times (1e-15) have fewer than nine digits.
_LEAST = 1e-12


def matrix_distance(K: np.ndarray, K_ref: np.ndarray, length: float) -> float:
    """Largest entry of K - K_ref in units of its block, ``max |dK_ij| / s_ij``.

    Parameters
    ----------
    K, K_ref : (n, n) arrays
        n = 6 in space, 3 in the plane; stiffness, or compliance with 1 / `length`.
    length : float
        Size of the robot [m], for a block of `K_ref` that is empty: there the other block, times or
        over its square, is the unit.

    Returns
    -------
    float
        s is the largest entry of the translation block, of the rotation block, and for the coupling
        blocks the root of their product. 0 between two zero matrices.

    Examples
    --------
    >>> stiff = np.diag([1.0, 1, 1, 4, 4, 4])
    >>> round(matrix_distance(np.diag([1.0, 1, 1, 4, 4, 4.4]), stiff, length=1.0), 12)
    0.1
    """
    t = Space.of_size(len(K_ref)).translations
    translation, rotation = np.abs(K_ref[:t, :t]).max(), np.abs(K_ref[t:, t:]).max()
    if max(translation, rotation) == 0:
        return 0.0 if not np.any(K) else float("inf")
    if rotation <= _EMPTY * translation * length**2:
        rotation = translation * length**2
    if translation <= _EMPTY * rotation / length**2:
        translation = rotation / length**2
    rotation = max(rotation, _LEAST * translation * length**2)
    translation = max(translation, _LEAST * rotation / length**2)
    size = np.sqrt(np.where(np.arange(len(K_ref)) < t, translation, rotation))
    return float((np.abs(K - K_ref) / np.outer(size, size)).max())
