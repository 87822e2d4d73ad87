"""The coordinates in which stiffness is written: six in space, three in the plane."""

from __future__ import annotations

from enum import Enum

import numpy as np

from robostiff.errors import InputError

_ROUNDING = 1e-9  # of the largest


class Space(Enum):
    """Spatial (x, y, z, rx, ry, rz) or planar (x, y, rz) coordinates.

    Attributes
    ----------
    translations : int
        How many leading coordinates are translations; the rest are rotations.
    rows : tuple of int
        The coordinates among the six spatial ones.

    Examples
    --------
    >>> Space.PLANAR.twist_order
    ('dx', 'dy', 'rz')
    >>> Space.of_size(6)
    <Space.SPATIAL: (0, 1, 2, 3, 4, 5)>
    """

    SPATIAL = (0, 1, 2, 3, 4, 5)
    PLANAR = (0, 1, 5)

    @classmethod
    def of_size(cls, size: int) -> Space:
        """The space whose matrices have `size` rows (3 or 6)."""
        for space in cls:
            if space.size == size:
                return space
        subject = "matrix size"
        raise InputError(subject, got=size, expected="6 (x, y, z, rx, ry, rz) or 3 (x, y, rz)")

    @property
    def rows(self) -> tuple[int, ...]:
        """The coordinates among the six spatial ones."""
        return self.value

    @property
    def size(self) -> int:
        """Number of coordinates: 6 or 3."""
        return len(self.value)

    @property
    def translations(self) -> int:
        """Number of translations, which are the leading coordinates."""
        return 3 if self is Space.SPATIAL else 2

    @property
    def twist_units(self) -> tuple[str, ...]:
        """SI units of displacements, and of pose coordinates: m or rad."""
        return tuple("m" if row < 3 else "rad" for row in self.value)

    @property
    def wrench_units(self) -> tuple[str, ...]:
        """SI units of loads: N or N m."""
        return tuple("N" if row < 3 else "N m" for row in self.value)

    @property
    def twist_order(self) -> tuple[str, ...]:
        """Names of the displacement coordinates [m, rad]."""
        return tuple(("dx", "dy", "dz", "rx", "ry", "rz")[row] for row in self.value)

    @property
    def wrench_order(self) -> tuple[str, ...]:
        """Names of the load coordinates [N, N m]."""
        return tuple(("Fx", "Fy", "Fz", "Mx", "My", "Mz")[row] for row in self.value)

    def spatial(self, values: np.ndarray) -> np.ndarray:
        """All six coordinates (..., 6) of a twist or a wrench (..., n); zero for those it lacks."""
        whole = np.zeros((*values.shape[:-1], 6))
        whole[..., list(self.value)] = values
        return whole

    def without_rounding(self, twist: np.ndarray, length: float = 1.0) -> np.ndarray:
        """A twist (n,) [m, rad] with zero for what is rounding, rotations times a length [m]."""
        shifts = np.arange(self.size) < self.translations
        sizes = np.abs(twist) * np.where(shifts, 1.0, length)
        return np.where(sizes < _ROUNDING * np.max(sizes), 0.0, twist)
