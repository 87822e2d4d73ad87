"""Vectors (3, ...) of recorded entries, or of numbers with poses in the last axis.

Sums and products of components are NumPy's for both. What stands here needs to know which it is:
entries are arrays (3,) and (3, 3) of objects, poses are arrays (3, N) and (3, 3, N) of floats.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.kinematics.turn import Turn
from robostiff.record import Entry, arc_tangent, least, shortened, square_root
from robostiff.spatial import cross as cross_of_entries

_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def dot(a: np.ndarray, b: np.ndarray) -> Any:
    """Scalar product of two vectors, an entry or (N,)."""
    if a.ndim == 1 and b.ndim == 1:
        return a @ b
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product of two vectors, both of entries or both at poses."""
    if a.ndim == 1:
        return cross_of_entries(a, b)
    return a[_NEXT] * b[_LAST] - a[_LAST] * b[_NEXT]


def frame(*columns: np.ndarray) -> np.ndarray:
    """Three vectors as the columns of a matrix."""
    if columns[0].ndim == 1:
        return np.stack(columns, axis=-1)
    R = np.empty((3, *np.broadcast_shapes(*(column.shape for column in columns))))
    for i, column in enumerate(columns):
        R[:, i] = column
    return R


def times(R: np.ndarray, local: np.ndarray) -> np.ndarray:
    """R v for a constant vector v (3,), zeros of which cost nothing."""
    if R.ndim == 2:
        return R @ local
    found: Any = None
    for i, x in enumerate(local.tolist()):
        if x:
            part = R[:, i] if x == 1 else R[:, i] * x
            found = part if found is None else found + part
    return R[:, 0] * 0.0 if found is None else found


def spun(R: np.ndarray, axis: np.ndarray, angle: Any) -> np.ndarray:
    """R after a turn about a unit vector."""
    if R.ndim == 2:
        return Turn.by(angle).about(axis) @ R
    c, s = np.cos(angle), np.sin(angle)
    columns = (R[:, i] for i in range(3))
    return frame(*(c * v + s * cross(axis, v) + (1.0 - c) * dot(axis, v) * axis for v in columns))


def quotient(a: Any, b: Any) -> Any:
    """A / b; at poses where b is 0, a itself."""
    if isinstance(b, np.ndarray):
        return a / np.where(b == 0, 1.0, b)
    value = a / b
    of_floats = isinstance(value, np.ndarray) and value.dtype != object
    return value if of_floats else shortened(value)


def positive_part(value: Any) -> Any:
    """The larger one of a value and 0."""
    if isinstance(value, np.ndarray):
        return np.maximum(value, 0.0)
    return -least(-value, 0) if isinstance(value, Entry) else max(value, 0)


def root(value: Any) -> Any:
    """Square root of what is not negative."""
    return np.sqrt(value) if isinstance(value, np.ndarray) else square_root(value)


def angle_of(sine: Any, cosine: Any) -> Any:
    """Angle of a point (cosine, sine), -pi to pi [rad]."""
    if isinstance(sine, np.ndarray):
        return np.arctan2(sine, cosine)
    return arc_tangent(sine, cosine)
