"""A place in a model file: numbers, vectors and directions there, and where errors are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from robostiff.errors import FileError
from robostiff.io.document import Document, DocumentPlace
from robostiff.io.expression import FLOATS, Mathematics, ParameterError, parameter_values, parse
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
from robostiff.model.checks import unit_vector
from robostiff.spatial.formula import is_above

_LARGEST = 1e30  # far beyond any robot, and far from overflow
_LARGEST_OF = {Dimension.LENGTH: 1e9, Dimension.AREA: 1e18, Dimension.ANGLE: 1e9}
# The smallest positive value, below the size of an atom.
_LEAST = 1e-30
_LEAST_OF = {Dimension.LENGTH: 1e-12, Dimension.AREA: 1e-24, Dimension.SECOND_MOMENT: 1e-48}
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
"""Unit vectors of a frame by name."""

_parsed = lru_cache(maxsize=4096)(parse)


@dataclass(frozen=True, kw_only=True)
class Place(DocumentPlace):
    """A location in a document, with the values of names there, and what stands ready by name."""

    names: Mapping[str, SIQuantity]  # parameters and, in repeated legs, the variables of the copy
    materials: Mapping[str, Any] = field(default_factory=dict)
    # As they are written: shear factors depend on the material, so each beam builds its own.
    sections: Mapping[str, Any] = field(default_factory=dict)
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

    def number_at(self, written: object, key: str, dimension: Dimension) -> Any:
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

    def vector(self, written: list[Any], dimension: Dimension) -> np.ndarray:
        """Numbers of one dimension."""
        return np.array([(self / i).number(own, dimension) for i, own in enumerate(written)])

    def point(self, written: list[Any] | None) -> np.ndarray:
        """Three lengths (3,) [m]; zero when nothing is written."""
        return np.zeros(3) if written is None else self.vector(written, Dimension.LENGTH)

    def direction(self, written: str | list[Any]) -> np.ndarray:
        """Unit vector (3,) of a direction: the name of an axis, or three numbers or lengths."""
        if isinstance(written, str):
            sign = -1.0 if written.startswith("-") else 1.0
            return sign * np.array(AXES[written[-1]]) + 0.0
        # Lengths, when any of them is one: the direction from one point to another.
        lengths = any((self / i).is_length(value) for i, value in enumerate(written))
        numbers = self.vector(written, Dimension.LENGTH if lengths else Dimension.NUMBER)
        with self.complaints():
            return unit_vector("direction", numbers.tolist())

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
