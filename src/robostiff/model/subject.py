"""What a machine of any kind says of itself."""

from __future__ import annotations

from enum import Enum
from typing import Any, ClassVar, Self

from robostiff.markup import InNotebooks
from robostiff.spatial import Space


class Coordinate(Enum):
    """Coordinates of the platform pose."""

    X = "x"
    Y = "y"
    Z = "z"
    RX = "rx"
    RY = "ry"
    RZ = "rz"

    @property
    def unit(self) -> str:
        """SI unit: m of a place, rad of a rotation vector."""
        return "rad" if self.value[0] == "r" else "m"


ALL_COORDINATES = tuple(Coordinate)


def pose_coordinates(space: Space) -> tuple[Coordinate, ...]:
    """All coordinates of a pose: six, or three in the plane."""
    return (Coordinate.X, Coordinate.Y, Coordinate.RZ) if space is Space.PLANAR else ALL_COORDINATES


class Subject(InNotebooks):
    """A robot, a linkage, a cable robot, a snapshot or a network."""

    #: In words.
    kind: ClassVar[str]
    #: Whether it stands still, at the pose that it was made at.
    is_frozen: ClassVar[bool] = False
    #: The pose coordinates that can be chosen freely.
    coordinates: Any

    def __getstate__(self) -> dict[str, Any]:
        """All but the answers that are kept."""
        return {name: value for name, value in vars(self).items() if not name.startswith("_")}

    @property
    def coordinate_places(self) -> list[int]:
        """Places of its free coordinates among x, y, z, rx, ry, rz."""
        return [ALL_COORDINATES.index(coordinate) for coordinate in self.coordinates]


class FrozenSubject(Subject):
    """A machine at one pose, or at some, that was written down or placed there."""

    is_frozen: ClassVar[bool] = True
    #: It has none that it is moved by.
    coordinates: Any = ()
    #: A model file names where its values come from; these name that in their description.
    source: ClassVar[str] = ""
    description: str

    @property
    def title(self) -> str:
        """What it is."""
        return self.description

    @property
    def numeric(self) -> Self:
        """Itself: it has numbers alone."""
        return self
