"""Sources of the poses of a map: the interface of grids, lists and random poses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial import Space, as_floats, holds_quantities

#: SI unit of each pose coordinate.
POSE_UNITS: dict[str, str] = dict(
    zip(("x", "y", "z", "rx", "ry", "rz"), Space.SPATIAL.twist_units, strict=True)
)


@runtime_checkable
class PoseSource(Protocol):
    """Poses made block by block, never all at once."""

    @property
    def names(self) -> tuple[str, ...]:
        """The coordinates that it gives; the others stay at home."""
        ...

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the dimensions of the map."""
        ...

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the dimensions of the map."""
        ...

    def values(self, part: tuple[slice, ...]) -> np.ndarray:
        """Coordinates of the poses of a block (names, ...) [m, rad]."""
        ...

    def axis_values(self) -> Mapping[str, np.ndarray]:
        """Values along a dimension named like its coordinate; none where each pose has its own."""
        ...

    def parameter(self) -> tuple[str, str, np.ndarray] | None:
        """Name, unit and values of what runs along the poses, such as time; or None."""
        ...

    def description(self) -> Mapping[str, Any]:
        """A description that identifies the source."""
        ...


def read_coordinate(
    subject: str, values: Any, expected: str, name: str = ""
) -> tuple[np.ndarray, str | None]:
    """Values of a coordinate in SI units, and their unit if they came with one.

    Parameters
    ----------
    subject, expected : str
        Words for messages.
    values : array-like
        Numbers [m, rad] or quantities.
    name : str
        Of the coordinate; of a joint lengths and angles are taken, and the robot decides.

    Raises
    ------
    InputError

    Examples
    --------
    >>> read_coordinate("values of x", [0.1, 0.2], "lengths", "x")
    (array([0.1, 0.2]), None)
    """
    if name in POSE_UNITS or not holds_quantities(values):
        return as_floats(subject, values, expected, POSE_UNITS.get(name)), None
    for unit in ("m", "rad"):
        try:
            return as_floats(subject, values, expected, unit), unit
        except InputError:
            continue
    raise InputError(subject, got=str(values), expected=f"{expected}: lengths or angles")


def check_units(source: PoseSource, units: Mapping[str, str]) -> None:
    """Raise where a coordinate came in a unit that is not of its kind.

    Parameters
    ----------
    source : PoseSource
    units : mapping of str to str
        SI unit of each coordinate of the robot.

    Raises
    ------
    InputError
    """
    for name, unit in getattr(source, "units_given", {}).items():
        if unit != units[name]:
            kinds = {"m": "lengths", "rad": "angles"}
            raise InputError(
                f"values of {name!r}",
                got=kinds[unit],
                expected=f"{kinds[units[name]]} [{units[name]}]",
            )
