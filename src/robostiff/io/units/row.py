"""Rows of quantities on a command line: ``10 mm 0 0.5 0 0 10 deg``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from robostiff.errors import InputError
from robostiff.io.suggest import Words
from robostiff.io.units.dimension import Dimension, to_si
from robostiff.io.units.text import after_space, bounded, read_quantity

if TYPE_CHECKING:
    from pint import Quantity
else:
    Quantity = object


def parse_quantities(
    text: str, dimensions: Sequence[Dimension], names: Sequence[str], subject: str = "values"
) -> list[float]:
    """Read a row of numbers with optional units, as a command line has it.

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
    items: list[tuple[Quantity, str]] = []
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
