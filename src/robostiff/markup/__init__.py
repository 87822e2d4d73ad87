"""Pages of results, and their blocks: numbers, tables and matrices as text, HTML and Typst.

``blocks`` defines them; ``in_text``, ``in_html`` and ``in_typst`` write them.
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
    Page,
    Paragraph,
    Table,
    Tone,
    number,
    number_html,
    row,
    shown_matrix,
)
from robostiff.markup.in_html import (
    InNotebooks,
    block_html,
    blocks_html,
    element,
    escaped,
    listing,
    page_html,
)
from robostiff.markup.in_text import page_text, text_of
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
    "Page",
    "Paragraph",
    "Table",
    "Tone",
    "block_html",
    "block_typst",
    "blocks_html",
    "element",
    "escaped",
    "listing",
    "number",
    "number_html",
    "page_html",
    "page_text",
    "row",
    "shown_matrix",
    "text_of",
    "typst_text",
]
