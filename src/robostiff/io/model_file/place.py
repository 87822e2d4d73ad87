"""A place in a model file: evaluates the value there, and locates errors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from robostiff.errors import FileError, InputError
from robostiff.io.document import Document
from robostiff.io.expression import FLOATS, Mathematics, ParameterError, Parameters, parse
from robostiff.io.expression.parser import Literal, Negative
from robostiff.io.plausibility import question
from robostiff.io.suggest import Words
from robostiff.io.units import (
    Dimension,
    Quantity,
    describe,
    is_bare,
    make_quantity,
    make_unit,
    same_dimension,
    to_si,
)
from robostiff.spatial.formula import is_above

_LARGEST = 1e30  # far beyond any robot, and far from overflow
_LARGEST_OF = {Dimension.LENGTH: 1e9, Dimension.AREA: 1e18, Dimension.ANGLE: 1e9}
# The smallest positive value, below the size of an atom.
_LEAST = 1e-30
_LEAST_OF = {Dimension.LENGTH: 1e-12, Dimension.AREA: 1e-24, Dimension.SECOND_MOMENT: 1e-48}
_parsed = lru_cache(maxsize=4096)(parse)


@dataclass(frozen=True)
class Place:
    """A location in a document, with the values of names there."""

    document: Document
    names: Mapping[str, Quantity]  # parameters and, in repeated legs, the variables of the copy
    path: tuple[str | int, ...] = ()
    leg: str = ""  # the copy of a repeated leg that is being built
    mathematics: Mathematics = FLOATS  # of floats, or of exact formulas

    def __truediv__(self, step: str | int) -> Place:
        """The place of an entry."""
        return replace(self, path=(*self.path, step))

    @property
    def is_exact(self) -> bool:
        """Whether numbers here come as exact formulas."""
        return self.mathematics is not FLOATS

    def number(self, value: str | float, dimension: Dimension) -> Any:
        """What is written here, in SI units."""
        number, has_unit = self._number(value, dimension)
        return self._question(number, dimension, has_unit)

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
            raise self.error(
                dimension.with_article.split(" ", 1)[1],
                got=self._came(value),
                expected=f"at most {largest:g} in SI units",
            )
        return number, has_unit

    def _question(self, number: Any, dimension: Dimension, has_unit: bool) -> Any:
        """The number itself, with a warning when it is probably wrong."""
        if not self.is_exact:
            question(number, dimension, self.document.location, self.path, has_unit=has_unit)
        return number

    def positive(self, value: str | float, dimension: Dimension) -> Any:
        """What is written here, which must be positive, in SI units."""
        number, has_unit = self._number(value, dimension)
        if is_above(0, number, or_at=True):
            words = dimension.with_article.split(" ", 1)[1]
            raise self.error(words, got=self._came(value), expected="a positive one")
        least = _LEAST_OF.get(dimension, _LEAST)
        if is_above(least, number):
            words = dimension.with_article.split(" ", 1)[1]
            raise self.error(
                words, got=self._came(value), expected=f"at least {least:g} in SI units"
            )
        return self._question(number, dimension, has_unit)

    def is_length(self, value: str | float) -> bool:
        """Whether the value here is a length with a unit."""
        if not isinstance(value, str):
            return False
        with self.complaints():
            quantity = _parsed(value).evaluate(self.names, self.mathematics)
        return same_dimension(quantity, make_quantity(1.0, make_unit({"m": 1})))

    def error(
        self,
        subject: str,
        *,
        got: Any = None,
        expected: str | None = None,
        hint: str | None = None,
        key: bool = False,
    ) -> FileError:
        """An error about the value here, or about its key."""
        document = self.document
        place = document.key_location(self.path) if key else document.location(self.path)
        if self.leg and self.leg not in subject:
            subject = f"{subject} (in {self.leg})"
        if isinstance(got, np.ndarray):
            got = got.tolist()
        return FileError(place, subject, got=got, expected=expected, hint=hint)

    def _came(self, value: str | float) -> Any:
        """What is written here; with its value, where the text is more than a quantity."""
        if not isinstance(value, str):
            return value
        expression = _parsed(value)
        root = expression.root.operand if isinstance(expression.root, Negative) else expression.root
        if isinstance(root, Literal):
            return value
        return Words(
            f"{value!r}, which is {describe(expression.evaluate(self.names, self.mathematics))}"
        )

    @contextmanager
    def complaints(self, hint: str | None = None) -> Iterator[None]:
        """Give errors from within this location, unless they have one.

        Their hint is for Python; `hint` replaces it for files.
        """
        try:
            yield
        except FileError:
            raise
        except InputError as error:
            raise self.error(
                error.subject, got=error.got, expected=error.expected, hint=hint or error.hint
            ) from None


def top_place(
    document: Document,
    parameters: Mapping[str, Any],
    overrides: Mapping[str, Any],
    mathematics: Mathematics = FLOATS,
) -> Place:
    """The whole of a document, where its parameters have values, some of them other ones.

    Parameters
    ----------
    document : Document
    parameters : mapping of str to (str or float)
        As they are written in the document.
    overrides : mapping of str to (str, float or quantity)
        Values in place of those written.
    mathematics : Mathematics

    Raises
    ------
    FileError
        At a parameter that cannot be computed as it is written.
    ParameterError
        When it is a value of `overrides` that does not fit.
    """
    try:
        names = Parameters(parameters, overrides, mathematics).values
    except ParameterError as error:
        if error.name in overrides:
            raise  # the error is not in the file
        raise (Place(document, {}) / "parameters" / error.name).error(
            error.subject, got=error.got, expected=error.expected, hint=error.hint
        ) from None
    return Place(document, names, mathematics=mathematics)
