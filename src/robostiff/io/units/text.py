"""Reading a number with a unit: ``300 mm``, ``1e5 N m/rad``.

    unit   = ["/"] factor { ("*" | "·" | "/" | space) factor }
    factor = word [("^" | "**") integer] | "(" unit ")"

A slash divides by the one factor after it, brackets stand only after a slash and hold no brackets,
and the unit runs on as long as the words are names of units.
"""

from __future__ import annotations

import math
import re

from robostiff.errors import InputError
from robostiff.io.suggest import Words, did_you_mean, listing
from robostiff.io.units.registry import (
    OTHER_SPELLINGS,
    UNIT_WORDS,
    Quantity,
    Unit,
    is_unit_word,
    make_quantity,
    make_unit,
)

NUMBER = re.compile(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
"""An unsigned decimal number."""

_SPACE = re.compile(r"[ \t\r\n]*")
_WORD = re.compile(r"[A-Za-zµμ°_][A-Za-z0-9µμ°_]*")
_JOINT = re.compile(r"[ \t\r\n]*(\*(?!\*)|[·⋅/])?[ \t\r\n]*")
_POWER = re.compile(r"[ \t\r\n]*(?:\^|\*\*)[ \t\r\n]*([+-]?[0-9]{1,2})(?![0-9.A-Za-z_])")
_POWER_SIGN = re.compile(r"[ \t\r\n]*(?:\^|\*\*|[⁻¹²³⁴⁵⁶⁷⁸⁹⁰])")
_SUPERSCRIPT = re.compile(r"(⁻?[¹²³⁴⁵⁶⁷⁸⁹])(?![⁻¹²³⁴⁵⁶⁷⁸⁹⁰])")
_PLAIN_DIGITS = str.maketrans("⁻¹²³⁴⁵⁶⁷⁸⁹", "-123456789")
_LONGEST_TEXT = 1000
_HIGHEST_POWER = 24  # GPa^24 is still a finite number of SI units


def read_unit(text: str, start: int, *, leading_slash: bool = True) -> tuple[Unit | None, int]:
    """Read the longest unit at `start`: the unit and where it ends, or None and `start`.

    Raises
    ------
    InputError
        If a unit begins but cannot be understood: a power that is no whole number, or a product
        after a quotient (``N/m rad``), which could mean two things.

    Examples
    --------
    >>> read_unit("10 N m/rad + 2", 2)[1]
    10
    """
    powers: dict[str, int] = {}
    end = _read_product(text, start, powers, 1, leading_slash=leading_slash)
    if end == start:
        return None, start
    if sum(map(abs, powers.values())) > _HIGHEST_POWER:
        raise InputError(
            "unit", got=text[start:end].strip(), expected=f"powers up to {_HIGHEST_POWER} in all"
        )
    return make_unit(powers), end


def parse_quantity(text: str) -> Quantity:
    """Read one number with an optional unit.

    Raises
    ------
    InputError
        If the text is anything else, with the nearest unit if a unit is misspelt.

    Examples
    --------
    >>> print(parse_quantity("2.5 kN/mm").magnitude)
    2500000.0
    """
    quantity, end = read_quantity(bounded(text), after_space(text, 0), "quantity")
    if (end := after_space(text, end)) < len(text):
        raise InputError(
            "quantity", got=text, expected=f"one number with a unit, but {text[end:]!r} follows"
        )
    return quantity


_NO_NUMBERS = ("nan", "inf", "infinity")


def read_quantity(text: str, start: int, subject: str) -> tuple[Quantity, int]:
    """One signed number with an optional unit; a word after it that is no unit is an error."""
    sign = text[start : start + 1]
    found = NUMBER.match(text, start + 1 if sign and sign in "+-" else start)
    if not found:
        raise InputError(
            subject, got=text[start:], expected="a number with an optional unit, such as 300 mm"
        )
    try:
        unit, end = read_unit(text, found.end())
    except InputError as error:
        raise InputError(
            f"{subject}: {error.subject}", got=error.got, expected=error.expected, hint=error.hint
        ) from None
    word = _WORD.match(text, after_space(text, end))
    if word and word[0].lower() not in _NO_NUMBERS:  # those are the next value, and wrong there
        raise unknown_unit(word[0], subject)
    quantity = make_quantity(float(text[start : found.end()]), unit)
    if not math.isfinite(quantity.magnitude):
        raise InputError(subject, got=text[start:end], expected="a finite number")
    return quantity, end


def unknown_unit(word: str, subject: str) -> InputError:
    """The error for a word that is no unit: the nearest unit, and all units."""
    return InputError(
        f"{subject}: unknown unit",
        got=word,
        expected=f"one of {listing(UNIT_WORDS)}",
        hint=did_you_mean(word, UNIT_WORDS),
    )


def bounded(text: str) -> str:
    """The text itself, if it is not too long."""
    if len(text) > _LONGEST_TEXT:
        raise InputError(
            "quantity",
            got=Words(f"a text of {len(text)} characters"),
            expected=f"at most {_LONGEST_TEXT}",
        )
    return text


def after_space(text: str, start: int) -> int:
    """Where the white space at `start` ends."""
    found = _SPACE.match(text, start)
    return found.end() if found else start


def _read_product(
    text: str,
    start: int,
    powers: dict[str, int],
    sign: int,
    *,
    leading_slash: bool,
    brackets: bool = True,
) -> int:
    """Multiply the unit at `start`, to the power `sign`, into `powers`; return its end."""
    end, divided = start, False
    while found := _JOINT.match(text, end):
        joint = found[1]
        if end == start and (joint not in (None, "/") or (joint and not leading_slash)):
            return end
        inverse = joint == "/"
        after = _read_factor(
            text, found.end(), powers, -sign if inverse else sign, brackets=brackets and inverse
        )
        if after is None:
            return end
        if joint is None and divided:
            raise InputError(
                "unit",
                got=text[start:after].strip(),
                expected="only one meaning",
                hint="write a product below the line as N/(m rad), one above it as N rad/m",
            )
        end, divided = after, divided or inverse
    return end


def _read_factor(
    text: str, start: int, powers: dict[str, int], sign: int, *, brackets: bool
) -> int | None:
    if brackets and text.startswith("(", start):
        inner: dict[str, int] = {}
        end = _read_product(text, start + 1, inner, sign, leading_slash=False, brackets=False)
        end = after_space(text, end)
        if not inner or not text.startswith(")", end):
            return None
        for word, power in inner.items():
            powers[word] = powers.get(word, 0) + power
        return end + 1
    word = _WORD.match(text, start)
    if not word or not is_unit_word(word[0]):
        return None
    name = OTHER_SPELLINGS.get(word[0], word[0])
    power, end = _read_power(text, word.end())
    powers[name] = powers.get(name, 0) + sign * power
    return end


def _read_power(text: str, start: int) -> tuple[int, int]:
    power, end = 1, start
    if found := _POWER.match(text, start) or _SUPERSCRIPT.match(text, start):
        power, end = int(found[1].translate(_PLAIN_DIGITS)), found.end()
    if again := _POWER_SIGN.match(text, end):
        raise InputError(
            "power of a unit",
            got=text[start : again.end() + 8].strip(),
            expected="one whole number, as in mm^2",
            hint="for the power of a quantity write (300 mm)^2",
        )
    return power, end
