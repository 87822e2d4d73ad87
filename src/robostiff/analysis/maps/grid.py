"""Regular grids of poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robostiff.analysis.maps.pose_source import read_coordinate
from robostiff.errors import InputError

_MOST_VALUES = 10**8


@dataclass(frozen=True)
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
        ends, unit = read_coordinate(
            "start and stop of an axis", [self.start, self.stop], "two finite numbers"
        )
        if ends.shape != (2,):
            raise InputError(
                "start and stop of an axis",
                got=(self.start, self.stop),
                expected="two finite numbers",
            )
        for name, value in zip(("start", "stop"), ends.tolist(), strict=True):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "unit_given", unit)
        if not isinstance(self.count, int | np.integer) or self.count < 1:
            raise InputError(
                "count of an axis", got=self.count, expected="a whole number from 1 on"
            )
        if self.count > _MOST_VALUES:
            raise InputError(
                "count of an axis", got=self.count, expected=f"at most {_MOST_VALUES} values"
            )
        if (self.start == self.stop) != (self.count == 1):
            raise InputError(
                "axis",
                got=f"{self.count} values from {self.start:g} to {self.stop:g}",
                expected="several values between different ends, or one value and equal ends",
                hint=f"write Axis({self.start:g}, {self.start:g}, 1) for a single value",
            )

    @property
    def values(self) -> np.ndarray:
        """All of them (count,)."""
        return np.linspace(self.start, self.stop, self.count)


@dataclass(frozen=True, init=False)
class Grid:
    """All combinations of the values of some coordinates; the other coordinates stay at home.

    Parameters
    ----------
    axes : mapping of str to Axis, optional
        For names that are no Python words, such as ``joint 1``.
    **more : Axis
        Pose coordinates ``x y z rx ry rz`` [m, rad], or joints of a serial arm.

    Raises
    ------
    InputError

    Examples
    --------
    >>> grid = Grid(x=Axis(-0.1, 0.1, 20), rz=Axis(0, 0.5, 6))
    >>> grid.shape
    (20, 6)
    """

    axes: Mapping[str, Axis]

    def __init__(self, axes: Mapping[str, Axis] | None = None, /, **more: Axis) -> None:
        every = {**(axes or {}), **more}
        if not every:
            raise InputError(
                "grid", got="no axis", expected="at least one", hint="write Grid(x=Axis(0, 1, 11))"
            )
        for name, axis in every.items():
            if not isinstance(axis, Axis):
                raise InputError(
                    f"axis {name!r} of a grid",
                    got=axis,
                    expected="an Axis",
                    hint=f"write {name}=Axis(-0.1, 0.1, 21)",
                )
        object.__setattr__(self, "axes", every)

    @property
    def names(self) -> tuple[str, ...]:
        """Its coordinates."""
        return tuple(self.axes)

    @property
    def dims(self) -> tuple[str, ...]:
        """Its coordinates are its dimensions."""
        return tuple(self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """How many values each coordinate takes."""
        return tuple(int(axis.count) for axis in self.axes.values())

    def values(self, part: tuple[slice, ...]) -> np.ndarray:
        """Coordinates of the poses of a block (names, ...)."""
        own = [axis.values[where] for axis, where in zip(self.axes.values(), part, strict=True)]
        block = np.empty((len(own), *(len(v) for v in own)))
        for k, values in enumerate(own):
            shape = [1] * len(own)
            shape[k] = len(values)
            block[k] = values.reshape(shape)
        return block

    def axis_values(self) -> Mapping[str, np.ndarray]:
        """Values of each coordinate."""
        return {name: axis.values for name, axis in self.axes.items()}

    def parameter(self) -> None:
        """None: a grid has no parameter."""

    @property
    def units_given(self) -> Mapping[str, str]:
        """SI units of coordinates that came as quantities."""
        return {name: axis.unit_given for name, axis in self.axes.items() if axis.unit_given}

    def description(self) -> Mapping[str, Any]:
        """Its axes."""
        axes = {name: [axis.start, axis.stop, axis.count] for name, axis in self.axes.items()}
        return {"kind": "grid", "axes": axes}
