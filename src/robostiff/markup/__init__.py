"""Numbers, tables and matrices as text, HTML and Typst.

``blocks`` defines the blocks; ``in_html`` and ``in_typst`` write them.
"""

from robostiff.markup.blocks import (
    COMPLIANCE_UNITS,
    STIFFNESS_UNITS,
    Block,
    BlockUnits,
    Bullets,
    Cell,
    Facts,
    Heading,
    LabelledMatrix,
    Number,
    Paragraph,
    Table,
    Tone,
    number,
    number_html,
    row,
    shown_matrix,
    text_of,
)
from robostiff.markup.in_html import InNotebooks, block_html, element, escaped, listing
from robostiff.markup.in_typst import TYPST_BLOCKS, block_typst, typst_text

__all__ = [
    "COMPLIANCE_UNITS",
    "STIFFNESS_UNITS",
    "TYPST_BLOCKS",
    "Block",
    "BlockUnits",
    "Bullets",
    "Cell",
    "Facts",
    "Heading",
    "InNotebooks",
    "LabelledMatrix",
    "Number",
    "Paragraph",
    "Table",
    "Tone",
    "block_html",
    "block_typst",
    "element",
    "escaped",
    "listing",
    "number",
    "number_html",
    "row",
    "shown_matrix",
    "text_of",
    "typst_text",
]
