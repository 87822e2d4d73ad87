"""Sources of poses: regular grids, lists and random poses."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.maps.pose_columns import POSE_UNITS, read_coordinate
from robostiff.analysis.record_file import plain
from robostiff.compiled import uniform_rows
from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen
from robostiff.spatial import as_floats, check_order, holds_quantities


class PoseSource(ABC):
    """Poses made block by block, never all at once."""

    names: tuple[str, ...]  #: the coordinates that it gives; the others stay at home
    dims: tuple[str, ...] = ("pose",)  #: names of the dimensions of the map
    shape: tuple[int, ...]  #: sizes of these
    units_given: Mapping[str, str]  #: SI units of joint coordinates that came as quantities

    @abstractmethod
    def values(self, part: tuple[slice, ...]) -> np.ndarray:
        """Coordinates of the poses of a block (names, ...) [m, rad]."""

    @abstractmethod
    def description(self) -> Mapping[str, Any]:
        """All on which its poses depend."""

    def axis_values(self) -> Mapping[str, np.ndarray]:
        """Values along a dimension named like its coordinate; none where each pose has its own."""
        return {}

    def parameter(self) -> tuple[str, str, np.ndarray] | None:
        """Name, unit and values of what runs along the poses, such as time; or None."""
        return None

    def check_units(self, units: Mapping[str, str]) -> None:
        """Raise where a coordinate came in another unit than it has in the robot."""
        for name, unit in self.units_given.items():
            if unit != units[name]:
                kinds = {"m": "lengths", "rad": "angles"}
                expected = f"{kinds[units[name]]} [{units[name]}]"
                raise InputError(f"values of {name!r}", got=kinds[unit], expected=expected)

    def __eq__(self, other: object) -> bool:
        """Whether the other gives the same poses in the same order."""
        if not isinstance(other, PoseSource):
            return NotImplemented
        mine, others = (plain([x.names, x.units_given, x.description()]) for x in (self, other))
        return bool(mine == others)

    def __hash__(self) -> int:
        return hash((self.names, self.shape))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {math.prod(self.shape)} poses: {' '.join(self.names)}>"


class PoseList(PoseSource):
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

    Examples
    --------
    >>> PoseList(["x", "z"], [[0, 0.8], [0.1, 0.8]], time=[0, 0.5]).shape
    (2,)
    """

    def __init__(
        self,
        names: Sequence[str],
        poses: ArrayLike,
        *,
        time: ArrayLike | None = None,
        path_length: ArrayLike | None = None,
    ) -> None:
        self.names: tuple[str, ...] = (names,) if isinstance(names, str) else tuple(names)
        subject = "list of poses"
        if not self.names or len(set(self.names)) < len(self.names):
            raise InputError(f"coordinates of a {subject}", got=[*names], expected="each name once")
        columns = f"{len(self.names)} columns ({' '.join(self.names)})"
        check_order(subject, poses, self.names)
        rows, units = self._read(poses, f"rows of {columns}")
        self.units_given: Mapping[str, str] = units
        if rows.ndim != 2 or rows.shape[1] != len(self.names) or not len(rows):
            expected = f"(N, {len(self.names)}), of one pose at least"
            raise InputError(f"shape of a {subject}", got=rows.shape, expected=expected)
        self._columns = np.ascontiguousarray(rows.T)
        self.shape: tuple[int, ...] = (len(rows),)
        if time is not None and path_length is not None:
            raise InputError("time and path_length", expected="one of them")
        self._parameter: tuple[str, str, np.ndarray] | None = None
        for name, unit, numbers in (("time", "s", time), ("s", "m", path_length)):
            if numbers is not None:
                label = f"{name} of a {subject}"
                values = as_floats(label, numbers, "finite numbers", unit)
                if values.shape != (len(rows),):
                    raise InputError(label, got=values.shape, expected=f"({len(rows)},)")
                self._parameter = (name, unit, values)

    def parameter(self) -> tuple[str, str, np.ndarray] | None:
        """Time [s] or path length [m] of each pose."""
        return self._parameter

    def description(self) -> Mapping[str, Any]:
        """All of its numbers."""
        numbers = {"poses": self._columns, "parameter": self._parameter}
        return {"kind": "list", "names": self.names, **numbers}

    def _read(self, poses: ArrayLike, expected: str) -> tuple[np.ndarray, Mapping[str, str]]:
        """Rows in SI units, and the units of joints that came as quantities."""
        subject = "list of poses"
        units = [POSE_UNITS[name] for name in self.names if name in POSE_UNITS]
        if len(units) == len(self.names) or not holds_quantities(poses):
            return as_floats(subject, poses, expected, units), {}
        rows: Any = poses
        try:
            columns = list(zip(*rows, strict=True))
        except (TypeError, ValueError):
            raise InputError(subject, got=str(poses), expected=expected) from None
        if len(columns) != len(self.names):
            raise InputError(subject, got=Words(f"{len(columns)} columns"), expected=expected)
        readings = [
            read_coordinate(f"{subject}, column {name!r}", list(column), "finite numbers", name)
            for name, column in zip(self.names, columns, strict=True)
        ]
        joint_units = {n: unit for n, (_, unit) in zip(self.names, readings, strict=True) if unit}
        return np.stack([values for values, _ in readings], axis=-1), joint_units

    def values(self, part: tuple[slice, ...]) -> np.ndarray:
        """Coordinates of some of the poses (names, N)."""
        return self._columns[:, part[0]]


_MOST = 2**63


class RandomPoses(PoseSource):
    """Independent, uniformly distributed poses; coordinates left out stay at home.

    Pose i depends on the seed and on i alone (a counter-based generator), so that blocks can be
    made in any order, on any machine.

    Parameters
    ----------
    count : int
    ranges : mapping of str to (float, float)
        Lowest and highest value of each coordinate [m, rad], or quantities.
    seed : int

    Examples
    --------
    >>> poses = RandomPoses(1000, {"x": (-0.1, 0.1)}, seed=1)
    >>> some = poses.values((slice(2, 5),))
    >>> bool((some == poses.values((slice(0, 1000),))[:, 2:5]).all())
    True
    """

    def __init__(
        self, count: int, ranges: Mapping[str, tuple[float, float]], seed: int = 0
    ) -> None:
        for name, value, least in (("count", count, 1), ("seed", seed, 0)):
            if not isinstance(value, int | np.integer) or not least <= value < _MOST:
                expected = f"a whole number from {least} on"
                raise InputError(f"{name} of random poses", got=value, expected=expected)
        if not ranges:
            raise InputError(
                "ranges of random poses",
                got=Words("none"),
                expected="at least one coordinate",
                hint='write {"x": (-0.1, 0.1)}',
            )
        self.count: int = int(count)
        self.seed: int = int(seed)
        self.ranges: dict[str, tuple[float, float]] = {}
        units: dict[str, str] = {}
        for name, bounds in ranges.items():
            subject, expected = f"range of {name!r}", "lowest and highest value"
            ends, unit = read_coordinate(subject, bounds, expected, name)
            if ends.shape != (2,) or ends[0] > ends[1]:
                raise InputError(subject, got=bounds, expected=expected)
            self.ranges[name] = (float(ends[0]), float(ends[1]))
            units |= {name: unit} if unit else {}
        self.names: tuple[str, ...] = tuple(self.ranges)
        self.shape: tuple[int, ...] = (self.count,)
        self.units_given: Mapping[str, str] = units

    def description(self) -> Mapping[str, Any]:
        """Count, ranges and seed."""
        return {"kind": "random", "count": self.count, "ranges": self.ranges, "seed": self.seed}

    def values(self, part: tuple[slice, ...]) -> np.ndarray:
        """Coordinates of some of the poses (names, N)."""
        start, stop, _ = part[0].indices(self.count)
        low, high = np.array(list(self.ranges.values())).T
        return uniform_rows(self._keys, start, stop - start, low, high)

    @cached_property
    def _keys(self) -> np.ndarray:
        """One for each coordinate, a pose is a place in its sequence."""
        seeds = [np.random.SeedSequence(self.seed, spawn_key=(k,)) for k in range(len(self.names))]
        return np.array([seed.generate_state(1, np.uint64)[0] for seed in seeds])


_MOST_VALUES = 10**8


@frozen
class Axis:
    """Equally spaced values of a coordinate, both ends included.

    Parameters
    ----------
    start, stop : float
        [m or rad], or quantities.
    count : int

    Raises
    ------
    InputError
        When there is no value, or several at one place.

    Examples
    --------
    >>> Axis(-0.1, 0.1, 3).values
    array([-0.1,  0. ,  0.1])
    """

    start: float
    stop: float
    count: int
    unit_given: str | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        subject, expected = "start and stop of an axis", "two finite numbers"
        ends, unit = read_coordinate(subject, [self.start, self.stop], expected)
        if ends.shape != (2,):
            raise InputError(subject, got=(self.start, self.stop), expected=expected)
        for name, value in (("start", float(ends[0])), ("stop", float(ends[1]))):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "unit_given", unit)
        whole = isinstance(self.count, int | np.integer)
        if not (whole and 1 <= self.count <= _MOST_VALUES):
            expected = f"a whole number from 1 to {_MOST_VALUES}"
            raise InputError("count of an axis", got=self.count, expected=expected)
        if (self.start == self.stop) != (self.count == 1):
            raise InputError(
                "axis",
                got=Words(f"{self.count} values from {self.start:g} to {self.stop:g}"),
                expected="several values between different ends, or one value and equal ends",
                hint=f"write Axis({self.start:g}, {self.start:g}, 1) for a single value",
            )

    @property
    def values(self) -> np.ndarray:
        """All of them (count,)."""
        return self.at(slice(0, self.count))

    def at(self, part: slice) -> np.ndarray:
        """Some of them, to the last bit those of ``numpy.linspace``."""
        step = (self.stop - self.start) / max(self.count - 1, 1)
        values = np.arange(part.start, part.stop, dtype=float) * step + self.start
        if part.stop == self.count > 1:
            values[-1:] = self.stop
        return values


class Grid(PoseSource):
    """All combinations of the values of some coordinates; the other coordinates stay at home.

    Parameters
    ----------
    axes : mapping of str to Axis, optional
        For names that are no Python words, such as ``joint 1``.
    **more : Axis
        Pose coordinates ``x y z rx ry rz`` [m, rad], or joints of a serial arm.

    Examples
    --------
    >>> grid = Grid(x=Axis(-0.1, 0.1, 20), rz=Axis(0, 0.5, 6))
    >>> grid.shape
    (20, 6)
    """

    def __init__(self, axes: Mapping[str, Axis] | None = None, /, **more: Axis) -> None:
        self.axes: dict[str, Axis] = {**(axes or {}), **more}
        if not self.axes:
            raise InputError(
                "grid",
                got=Words("no axis"),
                expected="at least one",
                hint="write Grid(x=Axis(0, 1, 11))",
            )
        for name, axis in self.axes.items():
            if not isinstance(axis, Axis):
                raise InputError(
                    f"axis {name!r} of a grid",
                    got=axis,
                    expected="an Axis",
                    hint=f"write {name}=Axis(-0.1, 0.1, 21)",
                )
        items = self.axes.items()
        self.names: tuple[str, ...] = tuple(self.axes)
        self.dims: tuple[str, ...] = self.names
        self.shape: tuple[int, ...] = tuple(int(axis.count) for _, axis in items)
        self.units_given: Mapping[str, str] = {
            name: axis.unit_given for name, axis in items if axis.unit_given
        }

    def description(self) -> Mapping[str, Any]:
        """Its axes."""
        axes = {name: [axis.start, axis.stop, axis.count] for name, axis in self.axes.items()}
        return {"kind": "grid", "axes": axes}

    def axis_values(self) -> Mapping[str, np.ndarray]:
        """Values of each coordinate."""
        return {name: axis.values for name, axis in self.axes.items()}

    def values(self, part: tuple[slice, ...]) -> np.ndarray:
        """Coordinates of the poses of a block (names, ...)."""
        coordinates = [axis.at(where) for axis, where in zip(self.axes.values(), part, strict=True)]
        return np.stack(np.broadcast_arrays(*np.ix_(*coordinates)))
