"""Short numbers: SI prefixes in front of the units of results."""

from __future__ import annotations

import math

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}


def prefixed(largest: float, unit: str) -> tuple[float, str]:
    """Factor and unit that bring a number below 1000, and to 1 or more where a prefix can.

    The unit is in SI base units, such as ``N/m``; a plain number, empty or ``1``, gets no prefix.

    Examples
    --------
    >>> prefixed(3.2e7, "N/m")
    (1e-06, 'MN/m')
    >>> prefixed(0.0, "rad")
    (1.0, 'rad')
    """
    if unit in {"", "1"}:
        return 1.0, ""
    if not (math.isfinite(largest) and largest > 0):
        return 1.0, unit
    exponent = 3 * math.floor(math.log10(largest * (1 + 1e-9)) / 3)
    exponent = min(max(exponent, min(_PREFIXES)), max(_PREFIXES))
    first = f"({unit})" if unit.startswith("1/") else unit
    return 10.0**-exponent, f"{_PREFIXES[exponent]}{first}" if exponent else unit


def short(value: float, digits: int = 3) -> str:
    """A number with few digits and a true minus sign.

    Examples
    --------
    >>> short(-12.345), short(1.2345e-5), short(0.0)
    ('−12.3', '1.23e−5', '0')
    """
    text = f"{value:.{digits}g}"
    mantissa, e, exponent = text.partition("e")
    if e and 0 <= int(exponent) < 6:
        text = f"{float(text):.0f}"
    elif e:
        text = f"{mantissa}e{int(exponent)}"
    return text.replace("-", "−")
