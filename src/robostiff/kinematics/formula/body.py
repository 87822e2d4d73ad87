"""A rigid body of a leg: at coordinates zero, and at its recorded place; rounding removed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.record import Entry, is_zero, square_root
from robostiff.record.entry import is_exact
from robostiff.spatial import cross

#: Of a cosine: what a few operations leave of an exact zero.
ROUNDING = 4e-15


def tidied(values: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """The same entries, those that are 0 or +-1 up to rounding as integers.

    Parameters
    ----------
    values : array of entries or numbers
    scale : float
        Size against which a number counts as zero.

    Returns
    -------
    array of objects

    Examples
    --------
    >>> tidied(np.array([6e-17, 1.0, 0.5]))
    array([0, 1, 0.5], dtype=object)
    """
    out = np.empty(values.shape, dtype=object)
    for place in np.ndindex(values.shape):
        out[place] = _tidy(values[place], scale)
    return out


def tidied_point(p: np.ndarray) -> np.ndarray:
    """The same point; components of the size of rounding beside the largest become 0.

    Examples
    --------
    >>> tidied_point(np.array([0.3, 2e-17, 0.0]))
    array([0.3, 0, 0], dtype=object)
    """
    return tidied(p, max(size_of(x) for x in p))


def size_of(value: Any) -> float:
    """Largest size of an entry at the samples, or the size of a number."""
    return float(np.max(np.abs(value.sample))) if isinstance(value, Entry) else abs(float(value))


def _tidy(value: Any, scale: float) -> Any:
    if isinstance(value, Entry):
        return value.record.simplified(value, scale)
    if is_exact(value):
        return value
    if abs(value) <= ROUNDING * scale:
        return 0
    for unit in (1, -1):
        if abs(value - unit) <= ROUNDING:
            return unit
    return float(value)


@dataclass(frozen=True)
class LegBody:
    """A frame of a body at zero coordinates and now; all else of the body moves along.

    Attributes
    ----------
    R_zero, p_zero : (3, 3) and (3,) arrays
        At zero coordinates, in the leg's base frame.
    R, p : (3, 3) and (3,) arrays
        Now, in the world, recorded.
    """

    R_zero: np.ndarray
    p_zero: np.ndarray
    R: np.ndarray
    p: np.ndarray

    def point(self, x: np.ndarray) -> np.ndarray:
        """Where a point of the body is that was at x."""
        return self.p + self.R @ self._local(x)

    def direction(self, e: np.ndarray) -> np.ndarray:
        """The present direction of the body that was e."""
        return self.R @ tidied(self.R_zero.T @ e)

    def axes(self, R: np.ndarray) -> np.ndarray:
        """The present axes of the body that were the columns of R."""
        return self.R @ tidied(self.R_zero.T @ R)

    def at(self, x: np.ndarray, p: np.ndarray) -> LegBody:
        """A body of the same orientation, whose point x is at p."""
        return LegBody(self.R_zero, x, self.R, p)

    def _local(self, x: np.ndarray) -> np.ndarray:
        size = max(size_of(c) for c in (*x, *self.p_zero))
        return tidied(self.R_zero.T @ (x - self.p_zero), size)


def body_of_directions(
    zero: tuple[np.ndarray, np.ndarray, np.ndarray],
    now: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> LegBody:
    """The body that carries a point and two directions u, v at a constant angle.

    Parameters
    ----------
    zero : (point, u, v)
        At zero coordinates.
    now : (point, u, v)
        In the world.
    """
    (x, u0, v0), (p, u, v) = zero, now
    c = constant_cosine(u0, v0)
    return LegBody(_axes(u0, v0, c), x, _axes(u, v, c), p)


def constant_cosine(u: np.ndarray, v: np.ndarray) -> Any:
    """Cosine of the angle of two unit vectors that keep it, 0 where they are perpendicular."""
    return tidied(np.array([u @ v], dtype=object))[0]


def direction_across(axis: np.ndarray) -> np.ndarray:
    """Some unit vector across an axis.

    Examples
    --------
    >>> direction_across(np.array([0, 0, 1]))
    array([1, 0, 0], dtype=object)
    """
    start = np.eye(3, dtype=int)[int(np.argmin([size_of(x) for x in axis]))]
    v = start - axis * (start @ axis)
    return tidied(v / square_root(v @ v))


def _axes(u: np.ndarray, v: np.ndarray, c: Any) -> np.ndarray:
    """Columns u, the part of v across u made unit, and their vector product."""
    if not is_zero(c):
        v = (v - u * c) / square_root(1 - c * c)
    return np.stack([u, v, cross(u, v)], axis=-1)
