"""Pages of results, and their blocks: numbers, tables and matrices as text, HTML and Typst.

``blocks`` defines them; ``in_text``, ``in_html`` and ``in_typst`` write them, their numbers as
``numbers`` decides.
"""

from robostiff.markup.blocks import (
    COMPLIANCE_UNITS,
    STIFFNESS_UNITS,
    Block,
    Bullets,
    Cell,
    Facts,
    Folded,
    Heading,
    LabelledMatrix,
    Number,
    Page,
    Paragraph,
    Section,
    SideBySide,
    Table,
    Tone,
    Verbatim,
    inner_blocks,
)
from robostiff.markup.in_html import (
    InNotebooks,
    block_html,
    blocks_html,
    element,
    escaped,
    in_words,
    page_html,
)
from robostiff.markup.in_text import page_text, text_of
from robostiff.markup.in_typst import (
    TYPST_BLOCKS,
    block_typst,
    blocks_typst,
    typst_string,
    typst_text,
)
from robostiff.markup.numbers import number, percent, prefixed, quantity, row, short

__all__ = [
    "COMPLIANCE_UNITS",
    "STIFFNESS_UNITS",
    "TYPST_BLOCKS",
    "Block",
    "Bullets",
    "Cell",
    "Facts",
    "Folded",
    "Heading",
    "InNotebooks",
    "LabelledMatrix",
    "Number",
    "Page",
    "Paragraph",
    "Section",
    "SideBySide",
    "Table",
    "Tone",
    "Verbatim",
    "block_html",
    "block_typst",
    "blocks_html",
    "blocks_typst",
    "element",
    "escaped",
    "in_words",
    "inner_blocks",
    "number",
    "page_html",
    "page_text",
    "percent",
    "prefixed",
    "quantity",
    "row",
    "short",
    "text_of",
    "typst_string",
    "typst_text",
]
