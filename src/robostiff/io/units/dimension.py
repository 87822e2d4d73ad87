"""Dimensions of quantities, and conversion to SI units.

A bare number stands for SI wherever a dimension is asked for. Radian counts as a number in
products, as in mechanics, but ``10 deg`` is never taken for a plain number nor ``10 N m/rad`` for a
moment.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from enum import Enum
from numbers import Real
from typing import Any

from robostiff.errors import InputError
from robostiff.io.suggest import Words
from robostiff.io.units.registry import (
    SIQuantity,
    after_space,
    bounded,
    make_quantity,
    parse_quantity,
    read_quantity,
    read_unit,
)
from robostiff.spatial.formula import is_formula, is_possible


class Dimension(Enum):
    """Dimension of a quantity.

    Attributes
    ----------
    with_article : str
        Name with article, such as ``a length``.
    si_unit : str
        What a bare number stands for, as in ``N m/rad``; empty for a plain number.
    example : str
        A quantity of this dimension, as a user would write it.

    Examples
    --------
    >>> Dimension.MODULUS.si_unit
    'Pa'
    >>> print(Dimension.LENGTH)
    a length, such as 300 mm
    """

    NUMBER = ("a plain number", "", "0.3")
    LENGTH = ("a length", "m", "300 mm")
    ADVANCE_PER_TURN = ("an advance per turn", "m", "5 mm")
    AREA = ("an area", "m^2", "120 mm^2")
    SECOND_MOMENT = ("a second moment of area", "m^4", "4.9e4 mm^4")
    ANGLE = ("an angle", "rad", "10 deg")
    MASS = ("a mass", "kg", "2 kg")
    MOMENT_OF_INERTIA = ("a moment of inertia", "kg m^2", "0.2 kg m^2")
    DENSITY = ("a density", "kg/m^3", "2700 kg/m^3")
    ACCELERATION = ("an acceleration", "m/s^2", "9.81 m/s^2")
    FORCE = ("a force", "N", "200 N")
    MOMENT = ("a moment", "N m", "10 N m")
    MODULUS = ("an elastic modulus", "Pa", "70 GPa")
    TRANSLATIONAL_STIFFNESS = ("a translational stiffness", "N/m", "1e8 N/m")
    ROTATIONAL_STIFFNESS = ("a rotational stiffness", "N m/rad", "1e5 N m/rad")
    COUPLING_STIFFNESS = ("a coupling stiffness", "N/rad", "1e5 N/rad")
    TRANSLATIONAL_COMPLIANCE = ("a translational compliance", "m/N", "1e-8 m/N")
    ROTATIONAL_COMPLIANCE = ("a rotational compliance", "rad/(N m)", "1e-5 rad/(N m)")
    COUPLING_COMPLIANCE = ("a coupling compliance", "rad/N", "1e-5 rad/N")
    FORCE_PER_LENGTH = ("a force per length", "N/m", "20 N/m")

    def __init__(self, with_article: str, si_unit: str, example: str) -> None:
        self.with_article = with_article
        self.si_unit = si_unit
        self.example = example

    def __str__(self) -> str:
        return f"{self.with_article}, such as {self.example}"

    @property
    def noun(self) -> str:
        """Name without article, such as ``length``."""
        return self.with_article.split(" ", 1)[1]


def to_si(
    quantity: SIQuantity | float | str,
    dimension: Dimension,
    *,
    subject: str | None = None,
    got: Any = None,
) -> Any:
    """The number of SI units (m, N, Pa, rad) in a quantity of the given dimension.

    A formula stays one; any other number comes as a float.

    Parameters
    ----------
    quantity : quantity, float or str
        A bare number, or a quantity that came out as a bare number, counts as SI.
    dimension : Dimension
        What it must be.
    subject, got : optional
        How an error calls the value, and what it shows as having come.

    Raises
    ------
    InputError
        If the quantity measures something else or is not finite.

    Examples
    --------
    >>> to_si("300 mm", Dimension.LENGTH)
    0.3
    >>> to_si("10 mm", Dimension.ANGLE)
    Traceback (most recent call last):
    robostiff.errors.InputError: angle: got '10 mm', expected an angle, such as 10 deg
    """
    subject = subject or dimension.noun
    value: Any = quantity
    if isinstance(quantity, str):
        got = quantity if got is None else got
        value = parse_quantity(quantity)
    if not isinstance(value, SIQuantity) and is_formula(value) and is_possible(value):
        return value
    if isinstance(value, Real) and not isinstance(value, bool):
        return _finite(value, subject, dimension, got)
    if not isinstance(value, SIQuantity):
        raise InputError(subject, got=value if got is None else got, expected=str(dimension))
    if not (is_bare(value) or _measures(value, dimension)):
        got = Words(describe(value)) if got is None else got
        raise InputError(subject, got=got, expected=str(dimension))
    if is_formula(value.magnitude) and is_possible(value.magnitude):
        return value.magnitude
    return _finite(value.magnitude, subject, dimension, got)


def is_bare(quantity: SIQuantity) -> bool:
    """Whether the quantity has no unit at all, not even rad."""
    return _equal(quantity.units.powers, (0, 0, 0, 0))


def is_number(quantity: SIQuantity) -> bool:
    """Whether the quantity is a number; angles are not, other products with rad are."""
    return _measures(quantity, Dimension.NUMBER)


def same_dimension(first: SIQuantity, second: SIQuantity) -> bool:
    """Whether two quantities can be added; rad counts as a number."""
    return _equal(first.units.powers[:3], second.units.powers[:3])


def describe(quantity: SIQuantity) -> str:
    """The quantity as text.

    Examples
    --------
    >>> describe(parse_quantity("0.5 kN m/rad"))
    '500 N m/rad (a rotational stiffness)'
    >>> describe(parse_quantity("2 m/s"))
    '2 m/s'
    """
    magnitude = quantity.magnitude
    number = f"{float(magnitude):.6g}" if isinstance(magnitude, Real) else str(magnitude)
    if is_bare(quantity):
        return f"the plain number {number}"
    dimension = dimension_of(quantity)
    if dimension is None:
        return f"{number} {quantity.units}"
    return f"{number} {dimension.si_unit} ({dimension.with_article})"


def dimension_of(quantity: SIQuantity) -> Dimension | None:
    """The first dimension with the unit of a quantity; None where it has none, or another one.

    Examples
    --------
    >>> dimension_of(parse_quantity("70 GPa"))
    <Dimension.MODULUS: ('an elastic modulus', 'Pa', '70 GPa')>
    """
    if is_bare(quantity):
        return None
    powers = quantity.units.powers
    return next((own for own in Dimension if _equal(powers, _powers(own))), None)


def _measures(quantity: SIQuantity, dimension: Dimension) -> bool:
    """Same powers of m, kg and s; rad matters only where it distinguishes two dimensions."""
    *came, rad = quantity.units.powers
    *wanted, _ = _powers(dimension)
    if not _equal(came, wanted):
        return False
    refused = {Dimension.NUMBER: 1, Dimension.MOMENT: -1, Dimension.ADVANCE_PER_TURN: -1}.get(
        dimension
    )
    return refused is None or not _equal((rad,), (refused,))


@functools.cache
def _powers(dimension: Dimension) -> tuple[float, float, float, float]:
    unit, _ = read_unit(dimension.si_unit, 0)
    return make_quantity(1.0, unit).units.powers


def _equal(first: Sequence[float], second: Sequence[float]) -> bool:
    # roots leave powers such as 0.9999999999999999
    return all(abs(a - b) < 1e-9 for a, b in zip(first, second, strict=True))


def _finite(number: Any, subject: str, dimension: Dimension, got: Any) -> float:
    try:
        value = float(number)
    except (OverflowError, TypeError):  # too large, or complex
        value = math.inf
    if not math.isfinite(value):
        raise InputError(
            subject,
            got=number if got is None else got,
            expected=f"a finite number that stands for {dimension}",
        )
    return value


def parse_quantities(
    text: str, dimensions: Sequence[Dimension], names: Sequence[str], subject: str = "values"
) -> list[float]:
    """Read a row of numbers with optional units, as on a command line.

    Parameters
    ----------
    text : str
        Numbers, each with an optional unit, separated by spaces or commas. A unit runs on over
        unit words until the next number.
    dimensions : sequence of Dimension
        What each number must be.
    names : sequence of str
        What each number is called in messages.
    subject : str
        What all of them together are called in messages.

    Returns
    -------
    list of float
        In SI units.

    Raises
    ------
    InputError
        Naming the first item at fault.

    Examples
    --------
    >>> parse_quantities("10 mm, 20 N m", (Dimension.LENGTH, Dimension.MOMENT), ("x", "Mx"))
    [0.01, 20.0]
    """
    bounded(text)
    items: list[tuple[SIQuantity, str]] = []
    start = after_space(text, 0)
    while start < len(text):
        item = f"{subject}, item {len(items) + 1}"
        if len(items) < len(names):
            item += f" ({names[len(items)]})"
        quantity, end = read_quantity(text, start, item)
        items.append((quantity, text[start:end]))
        start = after_space(text, end)
        if text.startswith((",", ";"), start):
            start = after_space(text, start + 1)
        elif start == end < len(text):
            raise InputError(item, got=text[end:], expected="a space or a comma before it")
    if len(items) != len(dimensions):
        came = "1 number" if len(items) == 1 else f"{len(items)} numbers"
        raise InputError(subject, got=Words(came), expected=f"{len(dimensions)}: {' '.join(names)}")
    return [
        to_si(quantity, dimension, subject=f"{subject}, item {number} ({name})", got=written)
        for number, ((quantity, written), dimension, name) in enumerate(
            zip(items, dimensions, names, strict=True), start=1
        )
    ]
