"""How far apart two stiffness matrices are."""

from __future__ import annotations

import numpy as np

from robostiff.spatial import Space

# Below this part of what the other block suggests, a block of a reference matrix is without
# stiffness: 60 digits leave less, and no robot has so little.
_EMPTY = 1e-20


def distance(K: np.ndarray, K_ref: np.ndarray, length: float = 1.0, least: float = 0.0) -> float:
    """Largest entry of |K - K_ref| in units of its block, max |dK_ij| / s_ij.

    Parameters
    ----------
    K, K_ref : (n, n) arrays
        n = 6 in space, 3 in the plane (x, y, rz).
    length : float
        Size of the robot [m]. It matters for a block of `K_ref` without any stiffness only (a leg
        seen from its spherical joint): there the other block, times or over length^2, is the unit.
    least : float
        A block that is smaller than this part of what the other suggests is measured in that part.

    Returns
    -------
    float
        s is the largest entry of the translation block, of the rotation block, and for the coupling
        blocks the root of their product.

    Examples
    --------
    >>> distance(np.diag([1.0, 1, 1, 4, 4, 4.4]), np.diag([1.0, 1, 1, 4, 4, 4]))
    0.1...
    """
    t = Space.of_size(len(K_ref)).translations
    translation, rotation = np.abs(K_ref[:t, :t]).max(), np.abs(K_ref[t:, t:]).max()
    if rotation <= _EMPTY * translation * length**2:
        rotation = translation * length**2
    if translation <= _EMPTY * rotation / length**2:
        translation = rotation / length**2
    rotation = max(rotation, least * translation * length**2)
    translation = max(translation, least * rotation / length**2)
    size = np.sqrt(np.where(np.arange(len(K_ref)) < t, translation, rotation))
    return float((np.abs(K - K_ref) / np.outer(size, size)).max())
