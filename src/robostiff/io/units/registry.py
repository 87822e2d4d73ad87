"""Units, and quantities with units.

A *quantity* is a pint quantity in base units (m, kg, s, rad). The registry holds the units below
and nothing else; pint never sees text from outside.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from robostiff.spatial.quantities import is_pint

if TYPE_CHECKING:
    from pint import Quantity, Unit
    from pint.facets.plain import PlainUnit
else:  # pint takes a quarter of a second to import: only where a quantity is made
    Quantity = Unit = PlainUnit = object

_BASE = ("m = [length]", "kg = [mass]", "s = [time]", "rad = []")

# word: (value, in terms of units above it)
_DERIVED = MappingProxyType(
    {
        "mm": (1e-3, "m"),
        "cm": (1e-2, "m"),
        "um": (1e-6, "m"),
        "km": (1e3, "m"),
        "in": (0.0254, "m"),
        "ft": (0.3048, "m"),
        "g": (1e-3, "kg"),
        "N": (1.0, "kg * m / s ** 2"),
        "mN": (1e-3, "kg * m / s ** 2"),
        "kN": (1e3, "kg * m / s ** 2"),
        "MN": (1e6, "kg * m / s ** 2"),
        "lbf": (4.4482216152605, "kg * m / s ** 2"),
        "Nm": (1.0, "kg * m ** 2 / s ** 2"),
        "Nmm": (1e-3, "kg * m ** 2 / s ** 2"),
        "kNm": (1e3, "kg * m ** 2 / s ** 2"),
        "J": (1.0, "kg * m ** 2 / s ** 2"),
        "Pa": (1.0, "kg / m / s ** 2"),
        "kPa": (1e3, "kg / m / s ** 2"),
        "MPa": (1e6, "kg / m / s ** 2"),
        "GPa": (1e9, "kg / m / s ** 2"),
        "psi": (4.4482216152605 / 0.0254**2, "kg / m / s ** 2"),
        "ksi": (4448.2216152605 / 0.0254**2, "kg / m / s ** 2"),
        "mrad": (1e-3, "rad"),
        "urad": (1e-6, "rad"),
        "deg": (math.pi / 180, "rad"),
        "arcmin": (math.pi / 10_800, "rad"),
        "arcsec": (math.pi / 648_000, "rad"),
    }
)
# The values above that are no decimal number.
_PARTS_OF_PI = MappingProxyType({"deg": 180, "arcmin": 10_800, "arcsec": 648_000})
_PER_SQUARE_INCH = MappingProxyType({"psi": "4.4482216152605", "ksi": "4448.2216152605"})
OTHER_SPELLINGS = MappingProxyType(
    {"µm": "um", "μm": "um", "µrad": "urad", "μrad": "urad", "°": "deg"}
)

_BASE_WORDS = frozenset(("m", "kg", "s", "rad"))

UNIT_WORDS: tuple[str, ...] = ("m", "kg", "s", "rad", *_DERIVED)
"""Every unit word, one spelling each."""


def make_quantity(magnitude: Any, unit: PlainUnit | None = None) -> Quantity:
    """The quantity in base units (m, kg, s, rad); without a unit, a plain number.

    Examples
    --------
    >>> make_quantity(29.0, make_unit({"mm": 1})).magnitude  # right to the last bit
    0.029
    """
    units = registry()
    if unit is None:
        unit = make_unit({})
    if {word for word, _ in units.Quantity(1, unit).unit_items()} <= _BASE_WORDS:
        return units.Quantity(magnitude, unit)
    factor, base = units.get_base_units(unit)
    inverse = round(1 / factor) if factor < 1 else 0
    if inverse and abs(inverse * factor - 1) < 1e-12:
        return units.Quantity(magnitude / inverse, base)
    return units.Quantity(magnitude * factor, base)


def exact_quantity(magnitude: Any, unit: PlainUnit | None = None) -> Quantity:
    """The quantity in base units with a SymPy magnitude, by exact factors; degrees make pi.

    Examples
    --------
    >>> import sympy as sp
    >>> exact_quantity(sp.Integer(120), make_unit({"deg": 1})).magnitude
    2*pi/3
    """
    if unit is None:
        return make_quantity(magnitude)
    units = registry()
    factor: Any = 1
    for word, power in units.Quantity(1, unit).unit_items():
        factor *= _exact_factor(word) ** int(power)
    return units.Quantity(magnitude * factor, units.get_base_units(unit)[1])


@functools.cache
def _exact_factor(word: str) -> Any:
    import sympy as sp

    if word in _BASE_WORDS:
        return sp.Integer(1)
    if word in _PARTS_OF_PI:
        return sp.pi / _PARTS_OF_PI[word]
    if word in _PER_SQUARE_INCH:
        return sp.Rational(_PER_SQUARE_INCH[word]) / sp.Rational("0.0254") ** 2
    return sp.Rational(repr(_DERIVED[word][0]))


def make_unit(powers: Mapping[str, int]) -> Unit:
    """The product of unit words, each to its power."""
    units = registry()
    return units.Unit(
        units.UnitsContainer({word: power for word, power in powers.items() if power})
    )


def is_unit_word(word: str) -> bool:
    """Whether the word names a unit."""
    return word in UNIT_WORDS or word in OTHER_SPELLINGS


def is_quantity(value: object) -> bool:
    """Whether the value is a quantity of this module's own units."""
    return getattr(value, "_REGISTRY", None) is registry()


def own_quantity(value: Any) -> Quantity | None:
    """A quantity of another registry of pint in base units of this one; None for other values.

    Examples
    --------
    >>> import pint
    >>> own_quantity(pint.UnitRegistry().Quantity(1.5, "kN")).magnitude, own_quantity(1.5)
    (1500.0, None)
    """
    if not is_pint(value):
        return None
    units, base = registry(), {"[length]": "m", "[mass]": "kg", "[time]": "s"}
    powers = {str(name): power for name, power in value.dimensionality.items()}
    if not powers.keys() <= base.keys() or getattr(value.magnitude, "shape", ()) != ():
        return None
    powers = {base[name]: power for name, power in powers.items()}
    roots = {str(name): power for name, power in value.to_root_units().unit_items()}
    powers["rad"] = roots.get("rad", roots.get("radian", 0))
    unit = " * ".join(f"{name} ** {power}" for name, power in powers.items() if power)
    number = float(value.to(unit or "dimensionless").magnitude)
    return units.Quantity(number, units.UnitsContainer({k: v for k, v in powers.items() if v}))


def exponents(quantity: Quantity) -> tuple[float, float, float, float]:
    """The powers of m, kg, s and rad in the unit of a quantity."""
    powers: dict[str, Any] = dict(quantity.unit_items())
    if not powers.keys() <= _BASE_WORDS:
        powers = dict(quantity.to_base_units().unit_items())
    m, kg, s, rad = (float(powers.get(base, 0)) for base in ("m", "kg", "s", "rad"))
    return m, kg, s, rad


@functools.cache
def registry() -> Any:
    """The pint registry, made on first use."""
    import pint

    no_file: Any = None
    units = pint.UnitRegistry(no_file)
    for definition in _BASE:
        units.define(definition)
    for word, (factor, unit) in _DERIVED.items():
        units.define(f"{word} = {factor!r} * {unit}")
    return units
