"""A matrix in HTML, its rows and columns named, with the units of its blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.markup.html import element, escaped
from robostiff.markup.numbers import number_html, shown_matrix

_CELL = "text-align: right; padding: 0.15em 0.7em; font-variant-numeric: tabular-nums;"
_NAME = "font-weight: 600; padding: 0.15em 0.7em; text-align: center;"
_LEFT = "border-left: 2px solid currentColor;"
_RIGHT = "border-right: 2px solid currentColor;"
_BLOCK = "border-left: 1px dotted currentColor;"
_BELOW = "border-top: 1px dotted currentColor;"


@dataclass(frozen=True)
class BlockUnits:
    """Units of the blocks of a matrix between twists and wrenches.

    Attributes
    ----------
    translation, coupling, rotation : str
        Of the upper left block, both off-diagonal blocks, and the lower right block.
    """

    translation: str
    coupling: str
    rotation: str

    def __str__(self) -> str:
        return f"{self.translation}, {self.coupling}, {self.rotation}"


STIFFNESS_UNITS = BlockUnits("N/m", "N/rad", "N m/rad")
COMPLIANCE_UNITS = BlockUnits("m/N", "rad/N", "rad/(N m)")


def labelled_matrix(
    symbol: str,
    matrix: np.ndarray,
    rows: Sequence[str],
    columns: Sequence[str],
    units: BlockUnits,
) -> str:
    """A matrix as an HTML table with brackets; a dotted line parts translation from rotation.

    Parameters
    ----------
    symbol : str
    matrix : (n, n) array
        Symmetric, semidefinite. What is rounding beside its row and column is shown as 0.
    rows, columns : sequences of n str
    units : BlockUnits

    Examples
    --------
    >>> K = np.diag([2e6, 3.0])
    >>> html = labelled_matrix("K", K, ["Fx", "Mz"], ["dx", "rz"], STIFFNESS_UNITS)
    >>> "2·10<sup>6</sup>" in html, "N/m, N/rad, N m/rad" in html
    (True, True)
    """
    n = len(rows)
    first_turn = next((i for i, name in enumerate(columns) if name.startswith("r")), n)
    first_moment = next((i for i, name in enumerate(rows) if name.startswith("M")), n)
    names = "".join(element("td", escaped(name), style=_NAME) for name in columns)
    lines = [element("tr", element("td", escaped(symbol), style=_NAME) + names)]
    for i, (name, values) in enumerate(zip(rows, shown_matrix(matrix), strict=True)):
        above = _BELOW if i == first_moment and i else ""
        cells = [element("td", escaped(name), style=_NAME)]
        for j, value in enumerate(values):
            side = _LEFT if j == 0 else _BLOCK if j == first_turn else ""
            side += _RIGHT if j == n - 1 else ""
            cells.append(element("td", number_html(value), style=_CELL + side + above))
        lines.append(element("tr", "".join(cells)))
    caption = element("caption", escaped(f"[{units}]"), style="caption-side: bottom; opacity: 0.7;")
    style = "border-collapse: collapse; border: none; background: none;"
    return element("table", caption + "".join(lines), class_="robostiff-matrix", style=style)
