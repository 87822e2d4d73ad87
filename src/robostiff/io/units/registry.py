"""Units, and quantities with units.

A *quantity* is a number, or a formula, with a unit in base units (m, kg, s, rad). Quantities of
pint are converted where they come from outside; reading a file takes no package for units.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType
from typing import Any

from robostiff.spatial.quantities import is_pint

Powers = tuple[float, float, float, float]
_BASE = ("m", "kg", "s", "rad")


@dataclass(frozen=True)
class Unit:
    """A unit: so many times a product of powers of m, kg, s and rad.

    Examples
    --------
    >>> print(make_unit({"kN": 1, "mm": -1}).base)
    kg/s^2
    """

    powers: Powers = (0, 0, 0, 0)  # of m, kg, s and rad
    ratio: Fraction = Fraction(1)  # times pi to the power `pi`: the number of base units
    pi: float = 0

    def __mul__(self, other: Unit) -> Unit:
        m, kg, s, rad = (a + b for a, b in zip(self.powers, other.powers, strict=True))
        return Unit((m, kg, s, rad), self.ratio * other.ratio, self.pi + other.pi)

    def __truediv__(self, other: Unit) -> Unit:
        return self * other**-1

    def __pow__(self, exponent: float) -> Unit:
        m, kg, s, rad = (power * exponent for power in self.powers)
        ratio = self.ratio if self.ratio == 1 else Fraction(self.ratio**exponent)
        return Unit((m, kg, s, rad), ratio, self.pi * exponent)

    def __str__(self) -> str:
        words = sorted(zip(_BASE, self.powers, strict=True))
        above = "*".join(_to_power(word, power) for word, power in words if power > 0)
        below = "".join(f"/{_to_power(word, -power)}" for word, power in words if power < 0)
        return f"{above or '1'}{below}"

    @property
    def base(self) -> Unit:
        """The unit of the same powers that counts one."""
        return self if self.ratio == 1 and not self.pi else Unit(self.powers)


@dataclass(frozen=True)
class Quantity:
    """A number or a formula of base units, made by `make_quantity`."""

    magnitude: Any  # a float or a formula of SymPy
    units: Unit  # a product of powers of m, kg, s and rad

    # Three methods of quantities of pint, so that these are taken wherever those are.

    def to(self, unit: str) -> Quantity:
        """The quantity itself in SI units, the only ones that are asked for; rad is a number."""
        from robostiff.io.units.text import read_unit

        wanted = read_unit(unit, 0)[0] or _ONE
        if wanted.powers[:3] != self.units.powers[:3] or wanted.base != wanted:
            raise ValueError(f"{self.units} is no {unit}")
        return self

    def to_root_units(self) -> Quantity:
        """The quantity itself: in base units."""
        return self

    def unit_items(self) -> Iterator[tuple[str, float]]:
        """Base units and their powers."""
        return (pair for pair in zip(_BASE, self.units.powers, strict=True) if pair[1])


def _to_power(word: str, power: float) -> str:
    return word if power == 1 else f"{word}^{power:g}"


def _decimal(text: str, powers: Powers) -> Unit:
    return Unit(powers, Fraction(text))


_LENGTH, _MASS, _ANGLE = (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1)
_FORCE, _MOMENT, _PRESSURE = (1, 1, -2, 0), (2, 1, -2, 0), (-1, 1, -2, 0)
_PSI = Fraction("4.4482216152605") / Fraction("0.0254") ** 2

_UNITS = MappingProxyType(
    {
        "m": Unit(_LENGTH),
        "kg": Unit(_MASS),
        "s": Unit((0, 0, 1, 0)),
        "rad": Unit(_ANGLE),
        "mm": _decimal("1e-3", _LENGTH),
        "cm": _decimal("1e-2", _LENGTH),
        "um": _decimal("1e-6", _LENGTH),
        "km": _decimal("1e3", _LENGTH),
        "in": _decimal("0.0254", _LENGTH),
        "ft": _decimal("0.3048", _LENGTH),
        "g": _decimal("1e-3", _MASS),
        "N": Unit(_FORCE),
        "mN": _decimal("1e-3", _FORCE),
        "kN": _decimal("1e3", _FORCE),
        "MN": _decimal("1e6", _FORCE),
        "lbf": _decimal("4.4482216152605", _FORCE),
        "Nm": Unit(_MOMENT),
        "Nmm": _decimal("1e-3", _MOMENT),
        "kNm": _decimal("1e3", _MOMENT),
        "J": Unit(_MOMENT),
        "Pa": Unit(_PRESSURE),
        "kPa": _decimal("1e3", _PRESSURE),
        "MPa": _decimal("1e6", _PRESSURE),
        "GPa": _decimal("1e9", _PRESSURE),
        "psi": Unit(_PRESSURE, _PSI),
        "ksi": Unit(_PRESSURE, 1000 * _PSI),
        "mrad": _decimal("1e-3", _ANGLE),
        "urad": _decimal("1e-6", _ANGLE),
        "deg": Unit(_ANGLE, Fraction(1, 180), 1),
        "arcmin": Unit(_ANGLE, Fraction(1, 10_800), 1),
        "arcsec": Unit(_ANGLE, Fraction(1, 648_000), 1),
    }
)
OTHER_SPELLINGS = MappingProxyType(
    {"µm": "um", "μm": "um", "µrad": "urad", "μrad": "urad", "°": "deg"}
)

UNIT_WORDS: tuple[str, ...] = tuple(_UNITS)
"""Every unit word, one spelling each."""

_ONE = Unit()


def make_quantity(magnitude: Any, unit: Unit | None = None) -> Quantity:
    """The quantity in base units (m, kg, s, rad); without a unit, a plain number.

    Examples
    --------
    >>> make_quantity(29.0, make_unit({"mm": 1})).magnitude  # right to the last bit
    0.029
    """
    unit = unit or _ONE
    if unit.pi:
        # as radians(1.0) and its powers are rounded
        factor = math.pi**unit.pi
        above, below = unit.ratio.numerator, unit.ratio.denominator
        return Quantity(magnitude * (factor * above / below), unit.base)
    if unit.ratio.numerator == 1:
        below = unit.ratio.denominator
        return Quantity(magnitude if below == 1 else magnitude / below, unit.base)
    return Quantity(magnitude * float(unit.ratio), unit.base)


def exact_quantity(magnitude: Any, unit: Unit | None = None) -> Quantity:
    """The quantity in base units with a SymPy magnitude, by exact factors; degrees make pi.

    Examples
    --------
    >>> import sympy as sp
    >>> exact_quantity(sp.Integer(120), make_unit({"deg": 1})).magnitude
    2*pi/3
    """
    import sympy as sp

    unit = unit or _ONE
    ratio = sp.Rational(unit.ratio.numerator, unit.ratio.denominator)
    return Quantity(magnitude * ratio * sp.pi**unit.pi, unit.base)


def make_unit(powers: Mapping[str, int]) -> Unit:
    """The product of unit words, each to its power."""
    unit = _ONE
    for word, power in powers.items():
        unit = unit * _UNITS[word] ** power
    return unit


def is_unit_word(word: str) -> bool:
    """Whether the word names a unit."""
    return word in _UNITS or word in OTHER_SPELLINGS


def is_quantity(value: object) -> bool:
    """Whether the value is a quantity of this module."""
    return isinstance(value, Quantity)


def own_quantity(value: Any) -> Quantity | None:
    """A quantity of pint, of any registry, in base units; None for other values.

    Examples
    --------
    >>> import pint
    >>> own_quantity(pint.UnitRegistry().Quantity(1.5, "kN")).magnitude, own_quantity(1.5)
    (1500.0, None)
    """
    if not is_pint(value):
        return None
    base = {"[length]": "m", "[mass]": "kg", "[time]": "s"}
    powers = {str(name): power for name, power in value.dimensionality.items()}
    if not powers.keys() <= base.keys() or getattr(value.magnitude, "shape", ()) != ():
        return None
    powers = {base[name]: power for name, power in powers.items()}
    roots = {str(name): power for name, power in value.to_root_units().unit_items()}
    powers["rad"] = roots.get("rad", roots.get("radian", 0))
    unit = " * ".join(f"{name} ** {power}" for name, power in powers.items() if power)
    number = float(value.to(unit or "dimensionless").magnitude)
    m, kg, s, rad = (float(powers.get(name, 0)) for name in _BASE)
    return Quantity(number, Unit((m, kg, s, rad)))


def exponents(quantity: Quantity) -> Powers:
    """The powers of m, kg, s and rad in the unit of a quantity."""
    return quantity.units.powers
