"""Numbers with few digits and without rounding errors, and lines of text."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from robostiff.errors import printable

_ROUNDING = 1e-12


def text_of(lines: Iterable[str]) -> str:
    r"""Lines of text; control characters in names are escaped.

    Examples
    --------
    >>> print(text_of(["robot a\nstatus: ok", "rank 3"]))
    robot a\nstatus: ok
    rank 3
    """
    return "\n".join(map(printable, lines))


def number(value: float) -> str:
    """A number with five digits; zero without a sign.

    Examples
    --------
    >>> number(1234567.0), number(-0.0)
    ('1.2346e+06', '0')
    """
    return f"{value:.5g}" if value else "0"


def number_html(value: float) -> str:
    """A number with five digits in HTML, powers of ten raised.

    Examples
    --------
    >>> number_html(-1234567.0), number_html(0.25)
    ('−1.2346·10<sup>6</sup>', '0.25')
    """
    digits, _, exponent = number(value).partition("e")
    power = f"·10<sup>{int(exponent)}</sup>" if exponent else ""
    return f"{digits}{power}".replace("-", "−")


def row(values: np.ndarray) -> str:
    """Numbers of a short vector; rounding errors beside metres and radians are shown as zero.

    Examples
    --------
    >>> row(np.array([0.5, 1e-17, -2.0]))
    '0.5, 0, -2'
    """
    return ", ".join(number(value if abs(value) > _ROUNDING else 0.0) for value in values)


def shown_matrix(K: np.ndarray) -> np.ndarray:
    """A semidefinite matrix; rounding errors beside row and column are shown as zero.

    Examples
    --------
    >>> shown_matrix(np.array([[4e6, 1e-9], [1e-9, 1.0]]))
    array([[4.e+06, 0.e+00],
           [0.e+00, 1.e+00]])
    """
    size = np.sqrt(np.maximum(np.abs(np.diag(K)), np.finfo(float).tiny))
    # A zero diagonal means a zero row: its entries are rounding beside the whole block.
    size = np.maximum(size, 1e-9 * size.max())
    return np.where(np.abs(K) < 1e-10 * np.outer(size, size), 0.0, K)
