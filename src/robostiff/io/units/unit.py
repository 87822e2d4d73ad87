"""Units: a table of words, products of their powers, and the reading of these."""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from types import MappingProxyType

from robostiff.errors import InputError
from robostiff.frozen import frozen

Powers = tuple[float, float, float, float]
BASE = ("m", "kg", "s", "rad")


@frozen
class Unit:
    """A unit: so many times a product of powers of m, kg, s and rad."""

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

    def is_like(self, other: Unit, *, rad: bool = False) -> bool:
        """Whether both have the same powers of m, kg and s, and of `rad` where that counts."""
        if self.powers == other.powers:
            return True
        pairs = list(zip(self.powers, other.powers, strict=True))[: 4 if rad else 3]
        return all(abs(a - b) < 1e-9 for a, b in pairs)  # of roots, 0.9999999999999999

    def __str__(self) -> str:
        words = sorted(zip(BASE, self.powers, strict=True))
        above = "*".join(_to_power(word, power) for word, power in words if power > 0)
        below = "".join(f"/{_to_power(word, -power)}" for word, power in words if power < 0)
        return f"{above or '1'}{below}"

    @property
    def base(self) -> Unit:
        """The unit of the same powers that counts one."""
        return self if self.ratio == 1 and not self.pi else Unit(self.powers)


def _to_power(word: str, power: float) -> str:
    return word if power == 1 else f"{word}^{power:g}"


_LENGTH, _MASS, _ANGLE = (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1)
_FORCE, _MOMENT, _PRESSURE = (1, 1, -2, 0), (2, 1, -2, 0), (-1, 1, -2, 0)
_PSI = Fraction("4.4482216152605") / Fraction("0.0254") ** 2

# Words of one dimension, and how many base units each is.
_RATIOS = (
    (_LENGTH, {"mm": "1e-3", "cm": "1e-2", "um": "1e-6", "km": "1e3", "in": "0.0254"}),
    (_LENGTH, {"ft": "0.3048"}),
    (_MASS, {"g": "1e-3"}),
    (_FORCE, {"N": 1, "mN": "1e-3", "kN": "1e3", "MN": "1e6", "daN": 10}),
    (_FORCE, {"kgf": "9.80665", "lbf": "4.4482216152605"}),
    (_MOMENT, {"Nm": 1, "Nmm": "1e-3", "mNm": "1e-3", "kNm": "1e3", "MNm": "1e6", "J": 1}),
    (_PRESSURE, {"Pa": 1, "kPa": "1e3", "MPa": "1e6", "GPa": "1e9"}),
    (_PRESSURE, {"psi": _PSI, "ksi": 1000 * _PSI}),
    (_ANGLE, {"mrad": "1e-3", "urad": "1e-6"}),
)
_DEGREES = {"deg": 180, "arcmin": 10_800, "arcsec": 648_000}  # in half a turn
_UNITS = MappingProxyType(
    {"m": Unit(_LENGTH), "kg": Unit(_MASS), "s": Unit((0, 0, 1, 0)), "rad": Unit(_ANGLE)}
    | {word: Unit(powers, Fraction(x)) for powers, of in _RATIOS for word, x in of.items()}
    | {word: Unit(_ANGLE, Fraction(1, count), 1) for word, count in _DEGREES.items()}
)
_SPELLINGS = MappingProxyType({"µm": "um", "μm": "um", "µrad": "urad", "μrad": "urad", "°": "deg"})

UNIT_WORDS: tuple[str, ...] = tuple(_UNITS)
"""Every unit word, one spelling each."""


def make_unit(powers: Mapping[str, int]) -> Unit:
    """The product of unit words, each to its power."""
    unit = Unit()
    for word, power in powers.items():
        unit = unit * _UNITS[word] ** power
    return unit


def is_unit_word(word: str) -> bool:
    """Whether the word names a unit."""
    return word in _UNITS or word in _SPELLINGS


NUMBER = re.compile(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
"""An unsigned decimal number."""

_SPACE = re.compile(r"[ \t\r\n]*")
WORD = re.compile(r"[A-Za-zµμ°_][A-Za-z0-9µμ°_]*")
_JOINT = re.compile(r"[ \t\r\n]*(\*(?!\*)|[·⋅/])?[ \t\r\n]*")
_POWER = re.compile(r"[ \t\r\n]*(?:\^|\*\*)[ \t\r\n]*([+-]?[0-9]{1,2})(?![0-9.A-Za-z_])")
_POWER_SIGN = re.compile(r"[ \t\r\n]*(?:\^|\*\*|[⁻¹²³⁴⁵⁶⁷⁸⁹⁰])")
_SUPERSCRIPT = re.compile(r"(⁻?[¹²³⁴⁵⁶⁷⁸⁹])(?![⁻¹²³⁴⁵⁶⁷⁸⁹⁰])")
_PLAIN_DIGITS = str.maketrans("⁻¹²³⁴⁵⁶⁷⁸⁹", "-123456789")
_HIGHEST_POWER = 24  # GPa^24 is still a finite number of SI units


# unit   = ["/"] factor { ("*" | "·" | "/" | space) factor }
# factor = word [("^" | "**") integer] | "(" unit ")"
#
# A slash divides by the one factor after it, brackets stand only after a slash and hold no
# brackets, and the unit runs on as long as the words are names of units.


def read_unit(text: str, start: int, *, leading_slash: bool = True) -> tuple[Unit | None, int]:
    """Read the longest unit at `start`: the unit and where it ends, or None and `start`.

    Raises InputError if a unit begins but cannot be understood: a power that is no whole number, a
    product after a quotient (``N/m rad``), or a product with an angle (``N m deg``).
    """
    factors, end = _read_product(text, start, leading_slash=leading_slash)
    if not factors:
        return None, start
    powers: dict[str, int] = {}
    for word, power in factors:
        powers[word] = powers.get(word, 0) + power
    got = text[start:end].strip()
    if sum(map(abs, powers.values())) > _HIGHEST_POWER:
        raise InputError("unit", got=got, expected=f"powers up to {_HIGHEST_POWER} in all")
    unit = make_unit(powers)
    if unit.powers[3] > 0 and sum(power for power in powers.values() if power > 0) > 1:
        expected, hint = "an angle by itself above the line", "write N m/deg, or 300 mm*30 deg"
        raise InputError("unit", got=got, expected=expected, hint=hint)
    return unit, end


def after_space(text: str, start: int) -> int:
    """Where the white space at `start` ends."""
    match = _SPACE.match(text, start)
    return match.end() if match else start


def _read_product(
    text: str, start: int, *, leading_slash: bool, in_brackets: bool = False
) -> tuple[list[tuple[str, int]], int]:
    """The words at `start` with their powers, and where they end."""
    factors: list[tuple[str, int]] = []
    end, divided = start, False
    while match := _JOINT.match(text, end):
        joint, begin = match[1], match.end()
        inverse = joint == "/"
        if not factors and (joint not in (None, "/") or (inverse and not leading_slash)):
            break
        if inverse and not in_brackets and text.startswith("(", begin):
            pairs, inner = _read_product(text, begin + 1, leading_slash=False, in_brackets=True)
            after = after_space(text, inner) + 1
            if not pairs or text[after - 1 : after] != ")":
                break
        else:
            word = WORD.match(text, begin)
            if not word or not is_unit_word(word[0]):
                break
            pairs, after = [(_SPELLINGS.get(word[0], word[0]), 1)], word.end()
            if power := _POWER.match(text, after) or _SUPERSCRIPT.match(text, after):
                pairs, after = [(pairs[0][0], int(power[1].translate(_PLAIN_DIGITS)))], power.end()
            if again := _POWER_SIGN.match(text, after):
                got = text[word.end() : again.end() + 8].strip()
                hint = "for the power of a quantity write (300 mm)^2"
                expected = "one whole number, as in mm^2"
                raise InputError("power of a unit", got=got, expected=expected, hint=hint)
        if joint is None and divided:
            got = text[start:after].strip()
            hint = "write a product below the line as N/(m rad), one above it as N m/rad"
            raise InputError("unit", got=got, expected="only one meaning", hint=hint)
        factors += [(word, -power if inverse else power) for word, power in pairs]
        end, divided = after, divided or inverse
    return factors, end
