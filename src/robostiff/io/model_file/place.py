"""Places in a model file, and values, frames, masses and heads at them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np
from annotated_types import MaxLen, MinLen
from pydantic import BaseModel, ConfigDict, Discriminator, Field, StringConstraints, Tag
from pydantic_core import core_schema

from robostiff.errors import FileError, InputError, Words
from robostiff.frozen import field, frozen
from robostiff.io.document import Document, DocumentPlace
from robostiff.io.expression import FLOATS, Mathematics, ParameterError, parameter_values, parse
from robostiff.io.suggest import as_in_a_file
from robostiff.io.units import Dimension, SIQuantity, question, to_si
from robostiff.io.validation import plain
from robostiff.model import Mass
from robostiff.model.checks import rotation_matrix, unit_vector
from robostiff.spatial import Frame, is_formula
from robostiff.spatial.formula import exact_array, exact_arrays, is_above, length_of
from robostiff.spatial.rotation import matrix_of_rotation

_LARGEST = 1e30  # far beyond any robot, and far from overflow
_LARGEST_OF = {Dimension.LENGTH: 1e9, Dimension.AREA: 1e18, Dimension.ANGLE: 1e9}
# The smallest positive value, below the size of an atom.
_LEAST = 1e-30
_LEAST_OF = {Dimension.LENGTH: 1e-12, Dimension.AREA: 1e-24, Dimension.SECOND_MOMENT: 1e-48}
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
"""Unit vectors of a frame by name."""


@frozen(kw_only=True)
class Place(DocumentPlace):
    """A location in a document, with the values of names there, and what stands ready by name."""

    shows_lists: ClassVar[bool] = False  # of expressions, but of their values
    names: Mapping[str, SIQuantity]  # parameters and, in repeated legs, the variables of the copy
    materials: Mapping[str, Any] = field(default_factory=dict)
    # As they are written: shear factors depend on the material, so each beam builds its own.
    sections: Mapping[str, Any] = field(default_factory=dict)
    leg: str = ""  # the copy of a repeated leg that is being built
    mathematics: Mathematics = FLOATS  # of floats, or of exact formulas
    nominal: Mapping[str, float] = field(default_factory=dict)  # of the symbols in formulas
    # The file of a shipped robot that a module names; None where none has that name.
    shipped: Callable[[str], Path | None] = lambda _: None
    open: tuple[Path, ...] = ()  # files that are being read: none may be a module of itself

    @property
    def is_exact(self) -> bool:
        """Whether numbers here come as exact formulas."""
        return self.mathematics is not FLOATS

    def number(
        self,
        value: Value,
        dimension: Dimension,
        *,
        positive: bool = False,
        hint: str | None = None,
        beside: Iterable[Any] = (),
    ) -> Any:
        """What is written here, in SI units; the hint says what else, where it must be positive.

        Warns of a number that was probably meant in the unit of what is written `beside` it, or
        beside a parameter.
        """
        has_unit = False
        with self.complaints():
            if isinstance(value, str):
                quantity = parse(value).evaluate(self.names, self.mathematics)
                has_unit = not quantity.is_bare
                fits = not has_unit or quantity.measures(dimension)
                number = to_si(quantity, dimension, got=None if fits else self._as_written(value))
            else:
                number = self.mathematics.bare(to_si(value, dimension))
        if self.is_exact:  # checked at its nominal value
            return number
        expected, least = None, _LEAST_OF.get(dimension, _LEAST)
        if abs(number) > (largest := _LARGEST_OF.get(dimension, _LARGEST)):
            expected, hint = f"at most {largest:g} in SI units", None
        elif positive and number < least:
            low = f"at least {least:g} in SI units"
            expected, hint = ("a positive one", hint) if number <= 0 else (low, None)
        if expected is not None:
            got = self._as_written(value)
            raise self.error(dimension.noun, got=got, expected=expected, hint=hint)
        if isinstance(value, str):  # names of parameters
            beside = self.document.data.get("parameters", {}).values()
        where = self.document.location
        question(number, dimension, where, self.path, has_unit=has_unit, got=value, beside=beside)
        return number

    def plain_vector(self, written: list[Any], dimension: Dimension) -> list[float]:
        """Numbers of one dimension; formulas at the nominal values of their symbols."""
        formulas = self.vector(written, dimension)
        if not self.is_exact:
            return formulas.tolist()
        return [float(x.subs({s: self.nominal[s.name] for s in x.free_symbols})) for x in formulas]

    def any_number(self, subject: str, value: object, dimension: Dimension) -> Any:
        """What is written here, which may be anything, in SI units."""
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise self.error(subject, got=as_in_a_file(value), expected="a number or an expression")
        return self.number(value, dimension)

    def number_at(
        self, written: object, key: str, dimension: Dimension, *, positive: bool = False
    ) -> Any:
        """The number under a key of what is written here, in SI units; None without one."""
        if (value := getattr(written, key)) is None:
            return None
        beside = vars(written).values()
        return (self / key).number(value, dimension, positive=positive, beside=beside)

    def vector(self, written: list[Any], dimension: Dimension) -> np.ndarray:
        """Numbers of one dimension."""
        return np.array(
            [(self / i).number(x, dimension, beside=written) for i, x in enumerate(written)]
        )

    def point(self, written: list[Any] | None) -> np.ndarray:
        """Three lengths (3,) [m]; zero when nothing is written."""
        return np.zeros(3) if written is None else self.vector(written, Dimension.LENGTH)

    def direction(self, written: str | list[Any]) -> np.ndarray:
        """Unit vector (3,) of a direction: the name of an axis, or three numbers or lengths."""
        if isinstance(written, str):
            sign = -1.0 if written.startswith("-") else 1.0
            return sign * np.array(AXES[written[-1]]) + 0.0
        # Lengths, when any of them is one: the direction from one point to another.
        dimension = Dimension.NUMBER
        for i, value in enumerate(written):
            with (self / i).complaints():
                text = value if isinstance(value, str) else "0"
                if parse(text).evaluate(self.names, self.mathematics).measures(Dimension.LENGTH):
                    dimension = Dimension.LENGTH
        numbers = self.vector(written, dimension)
        with self.complaints():
            return unit_vector("direction", numbers.tolist())

    def error(self, subject: str, **words: Any) -> FileError:
        """An error about the value here, or about its key."""
        in_leg = self.leg and self.leg not in subject
        return super().error(f"{subject} (in {self.leg})" if in_leg else subject, **words)

    def _as_written(self, value: str | float) -> Any:
        """What is written here; with its value, where the text is more than a quantity."""
        if not isinstance(value, str):
            return value
        expression = parse(value)
        if expression.is_quantity:
            return value
        return Words(f"{value!r}, which is {expression.evaluate(self.names, self.mathematics)}")


def top_place(
    document: Document,
    parameters: Mapping[str, Any],
    overrides: Mapping[str, Any],
    mathematics: Mathematics = FLOATS,
    **more: Any,
) -> Place:
    """The whole of a document, where its parameters have values, some of them `overrides`.

    `more` are further attributes of the place.

    Raises a FileError at a parameter that cannot be computed as it is written, a ParameterError
    for an override that does not fit.
    """
    try:
        names = parameter_values(parameters, overrides, mathematics)
    except ParameterError as error:
        if error.name in overrides:
            raise  # the error is not in the file
        with (Place(document, names={}) / "parameters" / error.name).complaints():
            raise
    return Place(document, names=names, mathematics=mathematics, **more)


class WrittenMapping(BaseModel):
    """A mapping in a model file: its keys and no others, kept as they were written."""

    model_config: ClassVar[ConfigDict] = ConfigDict(
        extra="forbid", frozen=True, strict=True, defer_build=True
    )

    def numbers(self, place: Place, *, positive: bool = False) -> dict[str, Any]:
        """What is written under keys that have a dimension, in SI units; None where nothing is."""
        dimensions = _dimensions(type(self)).items()
        return {key: place.number_at(self, key, dim, positive=positive) for key, dim in dimensions}


@cache
def _dimensions(mapping: type[WrittenMapping]) -> dict[str, Dimension]:
    return {
        key: dimension
        for key, field in mapping.model_fields.items()
        for dimension in plain(field.annotation, tuple(field.metadata))[1]
        if isinstance(dimension, Dimension)
    }


def either(kind: type, tag: str, other: str) -> Discriminator:
    """Members of a union that differ in the kind of what is written."""
    return Discriminator(lambda value: tag if isinstance(value, kind) else other)


def with_key(key: str, tag: str, other: str) -> Discriminator:
    """Mappings that differ in a key."""
    return Discriminator(lambda value: tag if isinstance(value, dict) and key in value else other)


class _NumberOrText:
    """Without a function as a validator, whose signature would be looked at for every key."""

    def __get_pydantic_core_schema__(self, *_: Any) -> Any:
        def checked(value: Any) -> Any:
            if isinstance(value, (str, int, float)) and not isinstance(value, bool):
                return value
            expected = "a number, or a text such as 300 mm or 2*R"
            raise InputError("wrong value", got=as_in_a_file(value), expected=expected)

        return core_schema.no_info_plain_validator_function(checked)

    def __get_pydantic_json_schema__(self, *_: Any) -> dict[str, Any]:
        return {"type": ["number", "string"]}


Value = Annotated[Any, _NumberOrText()]
"""A number in SI units, or an expression."""

# Values of one dimension, which `WrittenMapping.numbers` computes.
Number = Annotated[Value, Dimension.NUMBER]
Length = Annotated[Value, Dimension.LENGTH]
Angle = Annotated[Value, Dimension.ANGLE]
Area = Annotated[Value, Dimension.AREA]
SecondMoment = Annotated[Value, Dimension.SECOND_MOMENT]
Modulus = Annotated[Value, Dimension.MODULUS]
Density = Annotated[Value, Dimension.DENSITY]
Force = Annotated[Value, Dimension.FORCE]
Stiffness = Annotated[Value, Dimension.TRANSLATIONAL_STIFFNESS]

Name = Annotated[str, Field(min_length=1)]
Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Vector = Annotated[list[Value], MinLen(3), MaxLen(3)]
Pair = Annotated[list[Value], MinLen(2), MaxLen(2)]

Mapped = TypeVar("Mapped", bound=WrittenMapping)
WordOr = Annotated[
    Annotated[Text, Tag("word")] | Annotated[Mapped, Tag("mapping")], either(str, "word", "mapping")
]
"""A name, or what it would stand for."""

_Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
Direction = Annotated[
    Annotated[_Axis, Tag("word")] | Annotated[Vector, Tag("vector")], either(str, "word", "vector")
]
"""An axis of the present frame by name, or three numbers; its length does not matter."""


_WAYS = ("turn", "rotation_vector", "matrix", "axes")


def turned_axes(vector: np.ndarray, *, exact: bool) -> np.ndarray:
    """Columns (3, 3): the axes turned about a vector (3,) by its length [rad].

    In exact arithmetic after Rodrigues.
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

    x: Angle | None = None
    y: Angle | None = None
    z: Angle | None = None

    def build(self, place: Place) -> np.ndarray:
        """Columns (3, 3): the turned axes."""
        about = [axis for axis in AXES if getattr(self, axis) is not None]
        if len(about) != 1:
            got = Words(" and ".join(about) if about else "no axis")
            hint = "write each turn as an entry of its own" if about else None
            raise place.error("turn", got=got, expected="one axis, such as {z: 30 deg}", hint=hint)
        angle = self.numbers(place)[about[0]]
        axis = np.array(AXES[about[0]], dtype=int if is_formula(angle) else float)
        return turned_axes(angle * axis, exact=place.is_exact)


class WrittenAxes(WrittenMapping):
    """The directions of two axes of a frame; the third follows by the right hand."""

    x: Direction | None = None
    y: Direction | None = None
    z: Direction | None = None

    def build(self, place: Place) -> np.ndarray:
        """Columns (3, 3): the axes."""
        directions = {
            axis: (place / axis).direction(getattr(self, axis))
            for axis in AXES
            if getattr(self, axis) is not None
        }
        if len(directions) != 2:
            got = Words(f"{' and '.join(directions) or 'none'} of the three")
            expected = "two of x, y, z; the third follows"
            raise place.error("axes of the frame", got=got, expected=expected)
        first, second = directions.values()
        cosine = first @ second
        # Formulas have been checked at their nominal values.
        if not is_formula(cosine) and abs(cosine) > 1e-6:
            between = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
            got = Words(f"{between:.6g} deg between them")
            raise place.error("axes of the frame", got=got, expected="two perpendicular directions")
        (missing,) = (i for i, axis in enumerate("xyz") if axis not in directions)
        before, after = ("xyz"[(missing + k) % 3] for k in (1, 2))
        u, v = exact_arrays(directions[before], directions[after])
        directions["xyz"[missing]] = np.cross(u, v)
        columns = np.stack([directions[axis] for axis in AXES], axis=-1)
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
            got = Words(f"{ways[1]} beside {ways[0]}")
            expected = f"one of {', '.join(_WAYS)}"
            raise (place / ways[1]).error("second rotation", got=got, expected=expected, key=True)
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
        return np.eye(3) if (turned := self.rotation(place)) is None else turned


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

    def masses(self, place: Place, name: str = "mass") -> tuple[Mass, ...]:
        """The mass of the part, as far as it is written."""
        if self.mass is None and self.centre is not None:
            got = Words("no mass beside it")
            hint = "a beam has its mass from the density of its material, in its middle"
            raise (place / "centre").error(
                "centre of mass", got=got, expected="mass: beside centre:", hint=hint, key=True
            )
        value = read_mass(place / "mass", self.mass)
        if value is None:
            return ()
        centre = None if self.centre is None else (place / "centre").point(self.centre)
        return (Mass(value, centre, name=name),)


class WrittenPlatformMass(WrittenMass):
    """The mass of the platform, or of something that it carries."""

    name: Text | None = None
    mass: Value = Field(description="the mass, such as 25 kg")


def build_platform_masses(place: Place, written: list[WrittenPlatformMass]) -> tuple[Mass, ...]:
    """Masses of a platform and of what it carries."""
    names = [part.name or f"platform{i + 1}" for i, part in enumerate(written)]
    return tuple(m for i, part in enumerate(written) for m in part.masses(place / i, names[i]))


class WrittenHead(WrittenMapping):
    """Name, source and parameters of a robot."""

    robostiff: Literal[1]
    name: Text = Field(description="the name of the robot")
    title: str = ""
    source: Text = Field(description="where the numbers come from, in a sentence")
    notes: str = ""
    parameters: dict[str, Value] = Field({})


VERSION = 1  # of the file format


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
        hint = "this file needs a newer robostiff" if newer else None
        place = document.location(("robostiff",))
        raise FileError(place, subject, got=version, expected=str(VERSION), hint=hint)
