"""Numbers as they are shown: digits, exponents, and SI prefixes of units, decided here alone."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

_ROUNDING = 1e-12
_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}


def number(value: float, digits: int = 5) -> str:
    """A number with a few digits; zero without a sign."""
    return f"{value:.{digits}g}" if value else "0"


def numeral_html(shown: str) -> str:
    """What `number` writes, in HTML: powers of ten raised, a true minus sign."""
    digits, _, exponent = shown.partition("e")
    power = f"·10<sup>{int(exponent)}</sup>" if exponent else ""
    return f"{digits}{power}".replace("-", "−")


def numeral_typst(shown: str) -> str:
    """What `number` writes, in Typst."""
    digits, _, exponent = shown.partition("e")
    return f"${digits} dot 10^({int(exponent)})$" if exponent else f"${digits}$"


# Numbers that stand alone among words, with a sign or a power of ten, as `number` writes them.
_IN_WORDS = re.compile(
    r"((?<![^\s(\[,=])-\d+(?:\.\d+)?(?:e[+-]\d+)?|(?<![\w.-])\d+(?:\.\d+)?e[+-]\d+)(?![\w-])"
)


def typeset(text: str, words: Callable[[str], str], numeral: Callable[[str], str]) -> str:
    """Text in a format, from how its words are written, and its numbers."""
    parts = _IN_WORDS.split(text)
    return "".join(numeral(part) if i % 2 else words(part) for i, part in enumerate(parts))


def short(value: float, digits: int = 3) -> str:
    """A number in a picture: fewer digits, a true minus sign, thousands without an exponent."""
    text = number(value, digits)
    mantissa, e, exponent = text.partition("e")
    if e and 0 <= int(exponent) < 6:
        text = f"{float(text):.0f}"
    elif e:
        text = f"{mantissa}e{int(exponent)}"
    return text.replace("-", "−")


def prefixed(largest: float, unit: str) -> tuple[float, str]:
    """Factor and unit that bring a number below 1000, and to 1 or more where a prefix can.

    The unit is in SI base units, such as ``N/m``; a plain number, empty or ``1``, gets no prefix.
    """
    if unit in {"", "1"}:
        return 1.0, ""
    if not (math.isfinite(largest) and largest > 0):
        return 1.0, unit
    exponent = 3 * math.floor(math.log10(largest * (1 + 1e-9)) / 3)
    exponent = min(max(exponent, min(_PREFIXES)), max(_PREFIXES))
    first = f"({unit})" if unit.startswith("1/") else unit
    return 10.0**-exponent, f"{_PREFIXES[exponent]}{first}" if exponent else unit


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """A number with its unit, whose prefix suits it."""
    times, shown = prefixed(abs(value), unit)
    return f"{short(times * value, digits)} {shown}"


def percent(part: float, decimals: int | None = None) -> str:
    """A part of a whole with four digits, or with as many decimals, as in a column."""
    return f"{number(100 * part, 4) if decimals is None else f'{100 * part:.{decimals}f}'} %"


def row(values: Iterable[float]) -> str:
    """Numbers of a short vector; rounding errors beside metres and radians are shown as zero."""
    return ", ".join(number(value if abs(value) > _ROUNDING else 0.0) for value in values)


def shown_matrix(K: np.ndarray) -> np.ndarray:
    """A semidefinite matrix; rounding errors beside row and column are shown as zero."""
    import numpy as np

    size = np.sqrt(np.maximum(np.abs(np.diag(K)), np.finfo(float).tiny))
    # A zero diagonal means a zero row: its entries are rounding beside the whole block.
    size = np.where(size < 1e-7 * size.max(), 1e-4 * size.max(), size)
    return np.where(np.abs(K) < 1e-10 * np.outer(size, size), 0.0, K)
