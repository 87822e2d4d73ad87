"""Parts of model files: values, frames, masses, heads."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np
from annotated_types import MaxLen, MinLen
from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    StringConstraints,
    Tag,
    WithJsonSchema,
)

from robostiff.errors import FileError, InputError
from robostiff.io.document import Document
from robostiff.io.model_file.place import AXES, Place
from robostiff.io.suggest import Words, shown
from robostiff.io.units import Dimension
from robostiff.model import Mass, gravity_vector
from robostiff.model.checks import rotation_matrix
from robostiff.spatial import Frame, is_formula
from robostiff.spatial.formula import exact_array, exact_arrays, is_above, length_of
from robostiff.spatial.rotation import matrix_of_rotation


class WrittenMapping(BaseModel):
    """A mapping in a model file: its keys and no others, kept as they were written."""

    model_config: ClassVar[ConfigDict] = ConfigDict(
        extra="forbid", frozen=True, strict=True, defer_build=True
    )


def either(kind: type, tag: str, other: str) -> Discriminator:
    """Members of a union that differ in the kind of what is written."""
    return Discriminator(lambda value: tag if isinstance(value, kind) else other)


def with_key(key: str, tag: str, other: str) -> Discriminator:
    """Mappings that differ in a key."""
    return Discriminator(lambda value: tag if isinstance(value, dict) and key in value else other)


def _value(value: Any) -> Any:
    if isinstance(value, (str, int, float)) and not isinstance(value, bool):
        return value
    raise InputError(
        "wrong value", got=shown(value), expected="a number, or a text such as 300 mm or 2*R"
    )


Value = Annotated[Any, PlainValidator(_value), WithJsonSchema({"type": ["number", "string"]})]
"""A number in SI units, or an expression."""

Name = Annotated[str, Field(min_length=1)]
Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Vector = Annotated[list[Value], MinLen(3), MaxLen(3)]
Pair = Annotated[list[Value], MinLen(2), MaxLen(2)]

AxisWord = Literal["x", "y", "z", "-x", "-y", "-z"]


Mapped = TypeVar("Mapped", bound=WrittenMapping)
WordOr = Annotated[
    Annotated[Text, Tag("word")] | Annotated[Mapped, Tag("mapping")],
    either(str, "word", "mapping"),
]
"""A name, or what it would stand for."""

Direction = Annotated[
    Annotated[AxisWord, Tag("word")] | Annotated[Vector, Tag("vector")],
    either(str, "word", "vector"),
]
"""An axis of the present frame by name, or three numbers; its length does not matter."""


_THE_OTHER_TWO = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y")}
_WAYS = ("turn", "rotation_vector", "matrix", "axes")


def turned_axes(vector: np.ndarray, *, exact: bool) -> np.ndarray:
    """Columns (3, 3): the axes turned about a vector (3,) by its length [rad].

    In exact arithmetic after Rodrigues.

    Examples
    --------
    >>> import sympy as sp
    >>> turned_axes(np.array([0, 0, sp.pi / 2]), exact=True)
    array([[0, -1, 0],
           [1, 0, 0],
           [0, 0, 1]], dtype=object)
    """
    if not exact:
        return matrix_of_rotation(np.asarray(vector, dtype=float))
    import sympy as sp

    vector, unturned = exact_array(vector), exact_array(np.eye(3))
    turned = [i for i in range(3) if vector[i] != 0]
    if not turned:
        return unturned
    if len(turned) == 1:  # about an axis of the frame, either way: no absolute value
        angle, axis = vector[turned[0]], unturned[turned[0]]
    else:
        angle = length_of(vector)
        axis = vector / angle
    sine, cosine = sp.sin(angle), sp.cos(angle)
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=object)
    matrix: Any = cosine * unturned + sine * cross + (1 - cosine) * np.outer(axis, axis)
    return matrix


class WrittenTurn(WrittenMapping):
    """A turn about one current axis; exactly one of the three is written."""

    x: Value | None = None
    y: Value | None = None
    z: Value | None = None

    def build(self, place: Place) -> np.ndarray:
        """Columns (3, 3): the turned axes."""
        about = [axis for axis in AXES if getattr(self, axis) is not None]
        if len(about) != 1:
            raise place.error(
                "turn",
                got=Words(" and ".join(about) if about else "no axis"),
                expected="one axis, such as {z: 30 deg}",
                hint="write each turn as an entry of its own" if about else None,
            )
        angle = place.number_at(self, about[0], Dimension.ANGLE)
        axis = np.array(AXES[about[0]], dtype=int if is_formula(angle) else float)
        return turned_axes(angle * axis, exact=place.is_exact)


class WrittenAxes(WrittenMapping):
    """The directions of two axes of a frame; the third follows by the right hand."""

    x: Direction | None = None
    y: Direction | None = None
    z: Direction | None = None

    def build(self, place: Place) -> np.ndarray:
        """Columns (3, 3): the axes."""
        given = {
            axis: (place / axis).direction(getattr(self, axis))
            for axis in AXES
            if getattr(self, axis) is not None
        }
        if len(given) != 2:
            raise place.error(
                "axes of the frame",
                got=Words(f"{' and '.join(given) or 'none'} of the three"),
                expected="two of x, y, z; the third follows",
            )
        first, second = given.values()
        cosine = first @ second
        # Formulas have been checked at their nominal values.
        if not is_formula(cosine) and abs(cosine) > 1e-6:
            between = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
            raise place.error(
                "axes of the frame",
                got=Words(f"{between:.6g} deg between them"),
                expected="two perpendicular directions",
            )
        (missing,) = (axis for axis in AXES if axis not in given)
        before, after = _THE_OTHER_TWO[missing]
        one, two = exact_arrays(given[before], given[after])
        given[missing] = np.cross(one, two)
        columns = np.stack([given[axis] for axis in AXES], axis=-1)
        return rotation_matrix("axes of the frame", columns)


class WrittenRotation(WrittenMapping):
    """A rotation, in at most one of four ways."""

    turn: list[WrittenTurn] | None = None
    rotation_vector: Vector | None = None
    matrix: Annotated[list[Vector], MinLen(3), MaxLen(3)] | None = None
    axes: WrittenAxes | None = None

    def rotation(self, place: Place) -> np.ndarray | None:
        """Its columns (3, 3), the turned axes; None where no rotation is written."""
        ways = [way for way in _WAYS if getattr(self, way) is not None]
        if len(ways) > 1:
            raise (place / ways[1]).error(
                "second rotation",
                got=Words(f"{ways[1]} beside {ways[0]}"),
                expected=f"one of {', '.join(_WAYS)}",
                key=True,
            )
        kind = exact_array if place.is_exact else np.asarray
        if self.turn is not None:
            total = kind(np.eye(3))
            for i, turn in enumerate(self.turn):
                total = total @ turn.build(place / "turn" / i)
            return total
        if self.rotation_vector is not None:
            angles = (place / "rotation_vector").vector(self.rotation_vector, Dimension.ANGLE)
            return turned_axes(angles, exact=place.is_exact)
        if self.matrix is not None:
            here = place / "matrix"
            rows = [(here / i).vector(row, Dimension.NUMBER) for i, row in enumerate(self.matrix)]
            with here.complaints():
                return kind(rotation_matrix("rotation", [row.tolist() for row in rows]))
        return None if self.axes is None else kind(self.axes.build(place / "axes"))

    def turned(self, place: Place) -> np.ndarray:
        """Columns (3, 3): the axes turned by the rotation, if one is written."""
        turned = self.rotation(place)
        return np.eye(3) if turned is None else turned


class WrittenFrame(WrittenRotation):
    """A frame: where its origin is, and how its axes are turned."""

    at: Vector | None = None

    def build(self, place: Place) -> Frame:
        """The frame, seen from the one in which it is written."""
        origin = (place / "at").point(self.at)
        return Frame(self.turned(place), origin)


def read_mass(place: Place, written: Value | None) -> Any:
    """The mass that is written at a place [kg]; None where there is none."""
    if written is None:
        return None
    value = place.number(written, Dimension.MASS)
    if is_above(0, value):
        raise place.error("mass", got=written, expected="zero or more, such as 2 kg")
    return value


class WrittenMass(WrittenMapping):
    """Mass of a part, and where it is."""

    mass: Value | None = None
    centre: Vector | None = None

    def masses(self, place: Place) -> tuple[Mass, ...]:
        """The mass of the part, as far as it is written."""
        if self.mass is None and self.centre is not None:
            raise (place / "centre").error(
                "centre of mass",
                got=Words("no mass beside it"),
                expected="mass: beside centre:",
                hint="a beam has its mass from the density of its material, in its middle",
                key=True,
            )
        value = read_mass(place / "mass", self.mass)
        if value is None:
            return ()
        return (
            Mass(value, None if self.centre is None else (place / "centre").point(self.centre)),
        )


class WrittenPlatformMass(WrittenMapping):
    """The mass of the platform, or of something that it carries."""

    name: Text | None = None
    mass: Value = Field(description="the mass, such as 25 kg")
    centre: Vector | None = None


def build_platform_masses(place: Place, written: list[WrittenPlatformMass]) -> tuple[Mass, ...]:
    """Masses of a platform and of what it carries."""
    return tuple(
        Mass(
            read_mass(place / i / "mass", own.mass),
            None if own.centre is None else (place / i / "centre").point(own.centre),
            name=own.name or f"platform{i + 1}",
        )
        for i, own in enumerate(written)
    )


def build_gravity(place: Place, written: str | list[Value] | None) -> np.ndarray | None:
    """Acceleration of free fall (3,) [m/s^2]; None where none is written."""
    if written is None or isinstance(written, str):
        return None if written is None else gravity_vector("gravity", written)
    return place.vector(written, Dimension.ACCELERATION)


class WrittenHead(WrittenMapping):
    """Name, source and parameters of a robot."""

    robostiff: Literal[1]
    name: Text = Field(description="the name of the robot")
    title: str = ""
    source: Text = Field(description="where the numbers come from, in a sentence")
    notes: str = ""
    parameters: dict[str, Value] = Field(default_factory=dict)


VERSION = 1
"""Of the file format."""


def check_version(
    document: Document,
    what: str = "model file",
    subject: str = "version of the model file format",
    expected: str = f"robostiff: {VERSION} at the top, the version of the format",
    hint: str | None = None,
) -> None:
    """Raise unless a document begins with the version of its format."""
    data = document.data
    if not isinstance(data, dict) or "robostiff" not in data:
        raise FileError(document.location(), what, expected=expected, hint=hint)
    version = data["robostiff"]
    if version != VERSION or isinstance(version, bool):
        newer = isinstance(version, int) and version > VERSION
        raise FileError(
            document.location(("robostiff",)),
            subject,
            got=version,
            expected=str(VERSION),
            hint="this file needs a newer robostiff" if newer else None,
        )
