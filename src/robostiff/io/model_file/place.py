"""A place in a model file: numbers, vectors, directions and frames there, and where errors are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from robostiff.errors import FileError
from robostiff.io.document import Document, DocumentPlace
from robostiff.io.expression import FLOATS, Mathematics, ParameterError, parameter_values, parse
from robostiff.io.model_file.written_parts import (
    WrittenAxes,
    WrittenFrame,
    WrittenMapping,
    WrittenRotation,
)
from robostiff.io.plausibility import question
from robostiff.io.suggest import Words
from robostiff.io.units import (
    Dimension,
    SIQuantity,
    describe,
    is_bare,
    make_quantity,
    make_unit,
    same_dimension,
    to_si,
)
from robostiff.model.checks import rotation_matrix, unit_vector
from robostiff.spatial import Frame, is_formula
from robostiff.spatial.formula import exact_array, exact_arrays, is_above, length_of
from robostiff.spatial.rotation import matrix_of_rotation

_LARGEST = 1e30  # far beyond any robot, and far from overflow
_LARGEST_OF = {Dimension.LENGTH: 1e9, Dimension.AREA: 1e18, Dimension.ANGLE: 1e9}
# The smallest positive value, below the size of an atom.
_LEAST = 1e-30
_LEAST_OF = {Dimension.LENGTH: 1e-12, Dimension.AREA: 1e-24, Dimension.SECOND_MOMENT: 1e-48}
_parsed = lru_cache(maxsize=4096)(parse)


@dataclass(frozen=True, kw_only=True)
class Place(DocumentPlace):
    """A location in a document, with the values of names there."""

    names: Mapping[str, SIQuantity]  # parameters and, in repeated legs, the variables of the copy
    leg: str = ""  # the copy of a repeated leg that is being built
    mathematics: Mathematics = FLOATS  # of floats, or of exact formulas

    @property
    def is_exact(self) -> bool:
        """Whether numbers here come as exact formulas."""
        return self.mathematics is not FLOATS

    def number(self, value: str | float, dimension: Dimension) -> Any:
        """What is written here, in SI units."""
        number, has_unit = self._number(value, dimension)
        return self._question(number, dimension, has_unit)

    def number_at(self, written: WrittenMapping, key: str, dimension: Dimension) -> Any:
        """The number under a key of what is written here, in SI units; None without one."""
        value = getattr(written, key)
        return None if value is None else (self / key).number(value, dimension)

    def _number(self, value: str | float, dimension: Dimension) -> tuple[Any, bool]:
        """What is written here, and whether it has a unit."""
        has_unit = False
        with self.complaints():
            if isinstance(value, str):
                quantity = _parsed(value).evaluate(self.names, self.mathematics)
                number = to_si(quantity, dimension, got=self._came(value))
                has_unit = not is_bare(quantity)
            else:
                number = self.mathematics.bare(to_si(value, dimension))
        largest = _LARGEST_OF.get(dimension, _LARGEST)
        if is_above(abs(number), largest):
            expected = f"at most {largest:g} in SI units"
            raise self.error(dimension.noun, got=self._came(value), expected=expected)
        return number, has_unit

    def _question(self, number: Any, dimension: Dimension, has_unit: bool) -> Any:
        """The number itself, with a warning when it is probably wrong."""
        if not self.is_exact:
            question(number, dimension, self.document.location, self.path, has_unit=has_unit)
        return number

    def positive(self, value: str | float, dimension: Dimension, hint: str | None = None) -> Any:
        """What is written here, which must be positive, in SI units; the hint says what else."""
        number, has_unit = self._number(value, dimension)
        if is_above(0, number, or_at=True):
            got = self._came(value)
            raise self.error(dimension.noun, got=got, expected="a positive one", hint=hint)
        least = _LEAST_OF.get(dimension, _LEAST)
        if is_above(least, number):
            expected = f"at least {least:g} in SI units"
            raise self.error(dimension.noun, got=self._came(value), expected=expected)
        return self._question(number, dimension, has_unit)

    def is_length(self, value: str | float) -> bool:
        """Whether the value here is a length with a unit."""
        if not isinstance(value, str):
            return False
        with self.complaints():
            quantity = _parsed(value).evaluate(self.names, self.mathematics)
        return same_dimension(quantity, make_quantity(1.0, make_unit({"m": 1})))

    def error(self, subject: str, **words: Any) -> FileError:
        """An error about the value here, or about its key."""
        in_leg = self.leg and self.leg not in subject
        return super().error(f"{subject} (in {self.leg})" if in_leg else subject, **words)

    def _as_given(self, got: Any) -> Any:
        return got

    def _came(self, value: str | float) -> Any:
        """What is written here; with its value, where the text is more than a quantity."""
        if not isinstance(value, str):
            return value
        expression = _parsed(value)
        if expression.is_quantity:
            return value
        return Words(
            f"{value!r}, which is {describe(expression.evaluate(self.names, self.mathematics))}"
        )


def top_place(
    document: Document,
    parameters: Mapping[str, Any],
    overrides: Mapping[str, Any],
    mathematics: Mathematics = FLOATS,
) -> Place:
    """The whole of a document, where its parameters have values, some of them `overrides`.

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
    return Place(document, names=names, mathematics=mathematics)


_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
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


def point(place: Place, written: list | None) -> np.ndarray:
    """Three lengths (3,) [m]; zero when nothing is written."""
    return np.zeros(3) if written is None else vector(place, written, Dimension.LENGTH)


def vector(place: Place, written: list, dimension: Dimension) -> np.ndarray:
    """Numbers of one dimension."""
    return np.array([(place / i).number(value, dimension) for i, value in enumerate(written)])


def direction(place: Place, written: str | list) -> np.ndarray:
    """Unit vector (3,) of a direction: the name of an axis, or three numbers or lengths."""
    if isinstance(written, str):
        sign = -1.0 if written.startswith("-") else 1.0
        return sign * np.array(_AXES[written[-1]]) + 0.0
    # Lengths, when any of them is one: the direction from one point to another.
    lengths = any((place / i).is_length(value) for i, value in enumerate(written))
    numbers = vector(place, written, Dimension.LENGTH if lengths else Dimension.NUMBER)
    with place.complaints():
        return unit_vector("direction", numbers.tolist())


def transform(place: Place, written: WrittenFrame) -> Frame:
    """The frame, seen from the one in which it is written."""
    origin = point(place / "at", written.at)
    return Frame(axes_of(place, written), origin)


def axes_of(place: Place, written: WrittenRotation) -> np.ndarray:
    """Columns (3, 3): the axes turned by the rotation that is written, if any is."""
    turned = rotation(place, written)
    return np.eye(3) if turned is None else turned


def rotation(place: Place, written: WrittenRotation) -> np.ndarray | None:
    """The rotation that is written, its columns the turned axes (3, 3), if any is."""
    ways = [way for way in _WAYS if getattr(written, way) is not None]
    if len(ways) > 1:
        raise (place / ways[1]).error(
            "second rotation",
            got=Words(f"{ways[1]} beside {ways[0]}"),
            expected=f"one of {', '.join(_WAYS)}",
            key=True,
        )
    if written.turn is not None:
        return _turns(place / "turn", written.turn)
    if written.rotation_vector is not None:
        angles = vector(place / "rotation_vector", written.rotation_vector, Dimension.ANGLE)
        return turned_axes(angles, exact=place.is_exact)
    if written.matrix is not None:
        here = place / "matrix"
        rows = [vector(here / i, row, Dimension.NUMBER) for i, row in enumerate(written.matrix)]
        with here.complaints():
            return _of_kind(place, rotation_matrix("rotation", [row.tolist() for row in rows]))
    if written.axes is not None:
        return _of_kind(place, _axes(place / "axes", written.axes))
    return None


def _of_kind(place: Place, matrix: np.ndarray) -> np.ndarray:
    return exact_array(matrix) if place.is_exact else matrix


def _turns(place: Place, turns: list) -> np.ndarray:
    total = _of_kind(place, np.eye(3))
    for i, turn in enumerate(turns):
        about = [axis for axis in _AXES if getattr(turn, axis) is not None]
        if len(about) != 1:
            raise (place / i).error(
                "turn",
                got=Words(" and ".join(about) if about else "no axis"),
                expected="one axis, such as {z: 30 deg}",
                hint="write each turn as an entry of its own" if about else None,
            )
        angle = (place / i / about[0]).number(getattr(turn, about[0]), Dimension.ANGLE)
        axis = np.array(_AXES[about[0]], dtype=int if is_formula(angle) else float)
        total = total @ turned_axes(angle * axis, exact=place.is_exact)
    return total


def _axes(place: Place, written: WrittenAxes) -> np.ndarray:
    given = {
        axis: direction(place / axis, getattr(written, axis))
        for axis in _AXES
        if getattr(written, axis) is not None
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
        raise place.error(
            "axes of the frame",
            got=Words(f"{np.degrees(np.arccos(np.clip(cosine, -1, 1))):.6g} deg between them"),
            expected="two perpendicular directions",
        )
    (missing,) = (axis for axis in _AXES if axis not in given)
    before, after = _THE_OTHER_TWO[missing]
    one, two = exact_arrays(given[before], given[after])
    given[missing] = np.cross(one, two)
    columns = np.stack([given[axis] for axis in _AXES], axis=-1)
    return rotation_matrix("axes of the frame", columns)
