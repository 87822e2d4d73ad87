"""Numbers, tables and matrices as people read them: text and HTML, nothing of robots."""

from robostiff.markup.html import element, escaped, listing, table
from robostiff.markup.labelled_matrix import (
    COMPLIANCE_UNITS,
    STIFFNESS_UNITS,
    BlockUnits,
    labelled_matrix,
)
from robostiff.markup.numbers import number, number_html, row, shown_matrix

__all__ = [
    "COMPLIANCE_UNITS",
    "STIFFNESS_UNITS",
    "BlockUnits",
    "element",
    "escaped",
    "labelled_matrix",
    "listing",
    "number",
    "number_html",
    "row",
    "shown_matrix",
    "table",
]
