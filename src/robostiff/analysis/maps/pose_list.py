"""Lists of poses and trajectories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.maps.pose_source import POSE_UNITS, read_coordinate
from robostiff.errors import InputError
from robostiff.spatial import as_floats, holds_quantities


class PoseList:
    """Poses one after another, such as a trajectory; coordinates left out stay at home.

    Parameters
    ----------
    names : sequence of str
        What the columns are: ``x y z rx ry rz`` or joints.
    poses : (N, len(names)) array
        [m, rad], or quantities: one array, or rows of them.
    time : (N,) array, optional
        When each pose is passed [s].
    path_length : (N,) array, optional
        Or how far along the path it lies [m].

    Raises
    ------
    InputError

    Examples
    --------
    >>> PoseList(["x", "z"], [[0, 0.8], [0.1, 0.8]], time=[0, 0.5]).shape
    (2,)
    """

    dims = ("pose",)

    def __init__(
        self,
        names: Sequence[str],
        poses: ArrayLike,
        *,
        time: ArrayLike | None = None,
        path_length: ArrayLike | None = None,
    ) -> None:
        self.names = (names,) if isinstance(names, str) else tuple(names)
        if not self.names or len(set(self.names)) < len(self.names):
            raise InputError(
                "coordinates of a list of poses", got=list(names), expected="each name once"
            )
        columns = f"{len(self.names)} columns ({' '.join(self.names)})"
        rows, self.units_given = self._read(poses, f"rows of {columns}")
        if rows.ndim != 2 or rows.shape[1] != len(self.names) or not len(rows):
            raise InputError(
                "shape of a list of poses", got=rows.shape, expected=f"(N, {len(self.names)})"
            )
        self._columns = np.ascontiguousarray(rows.T)
        if time is not None and path_length is not None:
            raise InputError("time and path_length", expected="one of them")
        self._parameter: tuple[str, str, np.ndarray] | None = None
        for name, unit, given in (("time", "s", time), ("s", "m", path_length)):
            if given is not None:
                values = as_floats(f"{name} of a list of poses", given, "finite numbers", unit)
                if values.shape != (len(rows),):
                    raise InputError(
                        f"{name} of a list of poses", got=values.shape, expected=f"({len(rows)},)"
                    )
                self._parameter = (name, unit, values)

    def _read(self, poses: ArrayLike, expected: str) -> tuple[np.ndarray, Mapping[str, str]]:
        """Rows in SI units, and the units of joints that came as quantities."""
        subject = "list of poses"
        units = [POSE_UNITS[name] for name in self.names if name in POSE_UNITS]
        if len(units) == len(self.names) or not holds_quantities(poses):
            return as_floats(subject, poses, expected, units), {}
        every: Any = poses
        try:
            columns = list(zip(*every, strict=True))
        except (TypeError, ValueError):
            raise InputError(subject, got=str(poses), expected=expected) from None
        if len(columns) != len(self.names):
            raise InputError(subject, got=f"{len(columns)} columns", expected=expected)
        found = [
            read_coordinate(f"{subject}, column {name!r}", list(column), "finite numbers", name)
            for name, column in zip(self.names, columns, strict=True)
        ]
        given = {n: unit for n, (_, unit) in zip(self.names, found, strict=True) if unit}
        return np.stack([values for values, _ in found], axis=-1), given

    @property
    def shape(self) -> tuple[int, ...]:
        """How many poses there are."""
        return (self._columns.shape[1],)

    def values(self, part: tuple[slice, ...]) -> np.ndarray:
        """Coordinates of some of the poses (names, N)."""
        return self._columns[:, part[0]]

    def axis_values(self) -> Mapping[str, np.ndarray]:
        """Each pose has coordinates of its own."""
        return {}

    def parameter(self) -> tuple[str, str, np.ndarray] | None:
        """Time [s] or path length [m] of each pose."""
        return self._parameter

    def description(self) -> Mapping[str, Any]:
        """All of its numbers."""
        return {
            "kind": "list",
            "names": self.names,
            "poses": self._columns,
            "parameter": self._parameter,
        }

    def __repr__(self) -> str:
        return f"<PoseList of {self.shape[0]} poses: {' '.join(self.names)}>"
