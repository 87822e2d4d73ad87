"""Frames in MuJoCo's numbers."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.spatial import Frame


def frame_of(position: np.ndarray, quaternion: np.ndarray) -> Frame:
    """Frame from a position and a quaternion (w, x, y, z).

    Examples
    --------
    >>> frame_of(np.zeros(3), np.array([0.0, 0, 0, 1])).R @ [1, 0, 0]
    array([-1.,  0.,  0.])
    """
    w, x, y, z = (float(part) for part in quaternion)
    return Frame(Rotation.from_quat([x, y, z, w]).as_matrix(), np.array(position, dtype=float))
