"""Quantities with units: their dimensions, reading, conversion to SI units, and doubts about them.

A *quantity* is a number, or a formula, with a unit in base units (m, kg, s, rad). Quantities of
pint are converted where they come from outside; reading a file takes no package for units. A bare
number stands for SI wherever a dimension is asked for. Radian counts as a number in products, as in
mechanics, but ``10 deg`` is never taken for a plain number nor ``10 N m/rad`` for a moment.
"""

from __future__ import annotations

import contextlib
import functools
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import Enum
from fractions import Fraction
from numbers import Real
from typing import Any

from robostiff.errors import InputError, Location, Words, warn_of_slip
from robostiff.frozen import frozen
from robostiff.io.suggest import did_you_mean, listing
from robostiff.io.units.unit import BASE, NUMBER, UNIT_WORDS, WORD, Unit, after_space, read_unit
from robostiff.model.checks import FARTHEST, FULL_TURN
from robostiff.spatial.formula import is_formula, is_possible
from robostiff.spatial.quantities import is_pint, si_number

_LONGEST_TEXT = 1000


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

    @classmethod
    def of(cls, si_unit: str) -> Dimension:
        """The first dimension with a unit: a length with m, a moment with N m."""
        return next(dimension for dimension in cls if dimension.si_unit == si_unit)

    def __str__(self) -> str:
        return f"{self.with_article}, such as {self.example}"

    @property
    def noun(self) -> str:
        """Name without article, such as ``length``."""
        return self.with_article.split(" ", 1)[1]

    @functools.cached_property
    def unit(self) -> Unit:
        """What a bare number stands for."""
        return read_unit(self.si_unit, 0)[0] or Unit()


# Powers of rad that a quantity of a dimension does not have.
_REFUSED_RAD = {Dimension.NUMBER: 1, Dimension.MOMENT: -1, Dimension.ADVANCE_PER_TURN: -1}


@frozen
class SIQuantity:
    """A number or a formula of base units, made by `make_quantity`."""

    magnitude: Any  # a float or a formula of SymPy
    units: Unit  # a product of powers of m, kg, s and rad

    @property
    def is_bare(self) -> bool:
        """Whether it has no unit at all, not even rad."""
        return self.units.is_like(Unit(), rad=True)

    def measures(self, dimension: Dimension) -> bool:
        """Whether it has this dimension; rad matters only where it distinguishes two of them.

        Angles are no plain numbers; other products with rad are.
        """
        rad = abs(self.units.powers[3] - _REFUSED_RAD.get(dimension, math.inf))
        return self.units.is_like(dimension.unit) and rad > 1e-9

    @property
    def dimension(self) -> Dimension | None:
        """The first dimension with its unit; None where it has none, or another one."""
        alike = (kind for kind in Dimension if self.units.is_like(kind.unit, rad=True))
        return None if self.is_bare else next(alike, None)

    def __str__(self) -> str:
        magnitude, dimension = self.magnitude, self.dimension
        number = f"{float(magnitude):.6g}" if isinstance(magnitude, Real) else str(magnitude)
        if self.is_bare:
            return f"the plain number {number}"
        if dimension is None:
            return f"{number} {self.units}"
        return f"{number} {dimension.si_unit} ({dimension.with_article})"

    # Three methods of quantities of pint, so that these are taken wherever those are.

    def to(self, unit: str) -> SIQuantity:
        """The quantity itself in SI units, the only ones that are asked for; rad is a number."""
        wanted = read_unit(unit, 0)[0] or Unit()
        if wanted.powers[:3] != self.units.powers[:3] or wanted.base != wanted:
            raise ValueError(f"{self.units} is no {unit}")
        return self

    def to_root_units(self) -> SIQuantity:
        """The quantity itself: in base units."""
        return self

    def unit_items(self) -> Iterator[tuple[str, float]]:
        """Base units and their powers."""
        return (pair for pair in zip(BASE, self.units.powers, strict=True) if pair[1])


def make_quantity(magnitude: Any, unit: Unit | None = None) -> SIQuantity:
    """The quantity in base units (m, kg, s, rad); without a unit, a plain number."""
    unit = unit or Unit()
    if unit.pi:
        # as radians(1.0) and its powers are rounded
        factor = math.pi**unit.pi
        above, below = unit.ratio.numerator, unit.ratio.denominator
        return SIQuantity(magnitude * (factor * above / below), unit.base)
    if unit.ratio == 1 or not math.isfinite(magnitude):
        return SIQuantity(magnitude, unit.base)
    try:
        return SIQuantity(float(Fraction(repr(float(magnitude))) * unit.ratio), unit.base)
    except OverflowError:
        return SIQuantity(math.copysign(math.inf, magnitude), unit.base)


def exact_quantity(magnitude: Any, unit: Unit | None = None) -> SIQuantity:
    """The quantity in base units with a SymPy magnitude, by exact factors; degrees make pi."""
    import sympy as sp

    unit = unit or Unit()
    ratio = sp.Rational(unit.ratio.numerator, unit.ratio.denominator)
    return SIQuantity(magnitude * ratio * sp.pi**unit.pi, unit.base)


def own_quantity(value: Any) -> SIQuantity | None:
    """A quantity of pint, of any registry, in base units; None for other values."""
    if not is_pint(value) or getattr(value.magnitude, "shape", ()) != ():
        return None
    try:
        number = float(si_number("quantity", value))
    except InputError:  # of electricity, or the like
        return None
    powers = {str(name): power for name, power in value.dimensionality.items()}
    roots = {str(name): power for name, power in value.to_root_units().unit_items()}
    powers["[rad]"] = roots.get("rad", roots.get("radian", 0))
    m, kg, s, rad = (
        float(powers.get(name, 0)) for name in ("[length]", "[mass]", "[time]", "[rad]")
    )
    return SIQuantity(number, Unit((m, kg, s, rad)))


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
    """
    subject = subject or dimension.noun
    value: Any = quantity
    if isinstance(quantity, str):
        got = quantity if got is None else got
        value = parse_quantity(quantity, dimension)
    if isinstance(value, SIQuantity):
        if not (value.is_bare or value.measures(dimension)):
            got = Words(value) if got is None else got
            raise InputError(subject, got=got, expected=str(dimension))
        value = value.magnitude
    elif isinstance(value, bool) or not (isinstance(value, Real) or is_formula(value)):
        raise InputError(subject, got=value if got is None else got, expected=str(dimension))
    if is_formula(value) and is_possible(value):
        return value
    try:
        number = float(value)
    except (OverflowError, TypeError):  # too large, or complex
        number = math.inf
    if not math.isfinite(number):
        got = value if got is None else got
        expected = f"a finite number that stands for {dimension}"
        raise InputError(subject, got=got, expected=expected)
    return number


def parse_quantity(text: str, dimension: Dimension = Dimension.LENGTH) -> SIQuantity:
    """Read one number with an optional unit; `dimension` is for an example in messages alone.

    Raises
    ------
    InputError
        If the text is anything else, with the nearest unit if a unit is misspelt.

    Examples
    --------
    >>> print(parse_quantity("2.5 kN/mm").magnitude)
    2500000.0
    """
    quantity, end = read_quantity(
        of_allowed_length(text), after_space(text, 0), "quantity", dimension
    )
    if (end := after_space(text, end)) < len(text):
        raise InputError(
            "quantity", got=text, expected=f"one number with a unit, but {text[end:]!r} follows"
        )
    return quantity


_NO_NUMBERS = ("nan", "inf", "infinity")


def read_quantity(
    text: str, start: int, subject: str, dimension: Dimension
) -> tuple[SIQuantity, int]:
    """One signed number with an optional unit; a word after it that is no unit is an error."""
    sign = text[start : start + 1]
    match = NUMBER.match(text, start + 1 if sign and sign in "+-" else start)
    if not match:
        expected = f"a number with an optional unit, such as {dimension.example}"
        hint = "write -" if sign and sign in "−–" else None
        raise InputError(subject, got=text[start:], expected=expected, hint=hint)
    try:
        unit, end = read_unit(text, match.end())
    except InputError as error:
        raise InputError(
            f"{subject}: {error.subject}", got=error.got, expected=error.expected, hint=error.hint
        ) from None
    word = WORD.match(text, after_space(text, end))
    if word and word[0].lower() not in _NO_NUMBERS:  # those are the next value, and wrong there
        expected, hint = f"one of {listing(UNIT_WORDS)}", did_you_mean(word[0], UNIT_WORDS)
        raise InputError(f"{subject}: unknown unit", got=word[0], expected=expected, hint=hint)
    quantity = make_quantity(float(text[start : match.end()]), unit)
    if not math.isfinite(quantity.magnitude):
        raise InputError(subject, got=text[start:end], expected="a finite number")
    return quantity, end


def of_allowed_length(text: str) -> str:
    """The text itself, if it is not too long."""
    if len(text) > _LONGEST_TEXT:
        got = Words(f"a text of {len(text)} characters")
        raise InputError("quantity", got=got, expected=f"at most {_LONGEST_TEXT}")
    return text


def parse_quantities(
    text: str,
    dimensions: Sequence[Dimension],
    names: Sequence[str],
    subject: str = "values",
    *,
    are_ends: bool = False,
) -> list[float]:
    """Read a row of numbers with optional units, as on a command line.

    A number without a unit is refused before one of the same dimension with another unit than that
    of SI, as ``-100 100 mm`` can be read in two ways.

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
    are_ends : bool
        Whether they are ends of a range; then a number without a unit is refused after one with
        such a unit, too.

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
    of_allowed_length(text)
    if re.search(r"\d,\d", text) and re.search(r"[^\s,;]\s+[-+.\d]", text):  # 0,5 0,2: decimals?
        expected = "decimals with a point, and commas or spaces between numbers, not both"
        raise InputError(f"commas in {subject}", got=text, expected=expected)
    items: list[tuple[SIQuantity, str]] = []
    called = [f"{subject}, item {k} ({name})" for k, name in enumerate(names, 1)]
    if len(names) == 1:
        called = [subject if subject.endswith(names[0]) else f"{subject} ({names[0]})"]
    start = after_space(text, 0)
    while start < len(text):
        item, dimension = f"{subject}, item {len(items) + 1}", Dimension.LENGTH
        if len(items) < len(names):
            item, dimension = called[len(items)], dimensions[len(items)]
        quantity, end = read_quantity(text, start, item, dimension)
        items.append((quantity, text[start:end]))
        start = after_space(text, end)
        if text.startswith((",", ";"), start):
            start = after_space(text, start + 1)
        elif start == end < len(text):
            raise InputError(item, got=text[end:], expected="a space or a comma before it")
    if len(items) != len(dimensions):
        came = "1 number" if len(items) == 1 else f"{len(items)} numbers"
        raise InputError(subject, got=Words(came), expected=f"{len(dimensions)}: {' '.join(names)}")
    rows = list(zip(items, dimensions, called, strict=True))
    for i, ((quantity, written), dimension, item) in enumerate(rows):
        others = rows if are_ends else rows[i + 1 :]
        alike = [text for (q, text), kind, _ in others if kind is dimension and q.measures(kind)]
        for beside in alike if quantity.is_bare and quantity.magnitude else ():
            unit = NUMBER.sub("", beside, 1).strip(" +-")
            if unit and parse_quantity(f"1 {unit}").magnitude != 1:
                expected = f"a unit, as {beside!r} has one"
                hint = f"write {written} {unit}, or {written} {dimension.si_unit}"
                raise InputError(item, got=written, expected=expected, hint=hint)
    return [
        to_si(quantity, dimension, subject=item, got=written)
        for (quantity, written), dimension, item in rows
    ]


def question(
    number: float,
    dimension: Dimension,
    location: Callable[[Sequence[str | int]], Location],
    path: Sequence[str | int] = (),
    *,
    has_unit: bool = False,
    in_si: bool = False,
    got: object = None,
    beside: Iterable[object] = (),
) -> None:
    """Warn when a number, in SI units, is probably meant in another unit.

    Where it is written is looked up for a warning only; `in_si` says that no unit can be written
    there. Without a unit, it is compared with the quantities `beside` it: 50 is nearer to 3 mm as
    50 mm than as 50 m. `got` is what is written.
    """
    number = float(number)
    words, unit = "", ""
    if dimension in _LARGEST:
        largest, called, unit = _LARGEST[dimension]
        meant = has_unit and dimension is Dimension.ANGLE  # turns that are written in degrees
        words = "" if meant or abs(number) <= largest else called
    elif dimension in _LEAST_BARE:
        least, called, unit = _LEAST_BARE[dimension]
        words = called if 0 < number < least and not has_unit else ""
    elif dimension is Dimension.MODULUS:
        softest = _SOFTEST if has_unit else _SOFTEST_BARE
        words = "" if softest <= number <= _HARDEST else "an elastic modulus of {:g} Pa"
        unit = "GPa" if number < _SOFTEST else "MPa"
        if number > _HARDEST:
            words, unit = f"{words}, harder than diamond", ""
    words = words.format(number)
    if words and unit:
        words += f"; in {'degrees' if unit == 'deg' else unit}?"
        if not has_unit:
            words += " numbers here are in SI units" if in_si else f" write {number:g} {unit}"
    near = (math.inf, "", "")
    for other in beside if number and dimension.si_unit and not (words or has_unit) else ():
        if isinstance(other, str):
            at, (si, own, of) = math.log(abs(number)), _logarithms(other, dimension)
            near = min(near, (abs(at - si), "", ""), (abs(at - own), other, of))
    *_, text, unit = near
    if unit:
        words = f"{got} without a unit beside {text}; write {number:g} {unit}"
        words += f", or {number:g} {dimension.si_unit}"
    if words:
        warn_of_slip(f"{location(path)}: {words}")


@functools.lru_cache(maxsize=4096)
def _logarithms(text: str, dimension: Dimension) -> tuple[float, float, str]:
    """Those of a quantity in SI units and in its own unit, and that unit; infinite of others."""
    match = _QUANTITY.fullmatch(text)
    with contextlib.suppress(InputError):  # it has an error of its own
        value = parse_quantity(text) if match else None
        if match and value and value.measures(dimension) and value.magnitude:
            return math.log(abs(value.magnitude)), math.log(float(match[1])), match[2]
    return math.inf, math.inf, ""


# Elastic moduli [Pa]: with a unit, and as bare numbers, which are often in another unit.
_SOFTEST, _SOFTEST_BARE, _HARDEST = 1e3, 1e6, 1e13
_QUANTITY = re.compile(rf"[-+]?({NUMBER.pattern}) *(\D.*)")
# Beyond it a number is probably a slip; what it is called, and the unit that is probably meant.
_LARGEST = {
    Dimension.LENGTH: (FARTHEST, "a length of {:g} m", "mm"),
    Dimension.ADVANCE_PER_TURN: (2.0, "an advance of {:g} m in one turn", "mm"),
    Dimension.ANGLE: (FULL_TURN, "an angle of {:g} rad", "deg"),
}
# The same for numbers without a unit below it.
_LEAST_BARE = {
    Dimension.DENSITY: (25.0, "a density of {:g} kg/m^3", "g/cm^3"),  # of a foam
    Dimension.TRANSLATIONAL_STIFFNESS: (1e4, "a stiffness of {:g} N/m", "N/um"),
}
