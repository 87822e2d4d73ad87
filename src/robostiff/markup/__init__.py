"""Pages of results, and their blocks: numbers, tables and matrices as text, HTML and Typst.

``blocks`` defines them and their text; ``writers`` has HTML and Typst, ``numbers`` how numbers are
written.
"""

from robostiff.markup.blocks import COMPLIANCE_UNITS as COMPLIANCE_UNITS
from robostiff.markup.blocks import STIFFNESS_UNITS as STIFFNESS_UNITS
from robostiff.markup.blocks import Block as Block
from robostiff.markup.blocks import Bullets as Bullets
from robostiff.markup.blocks import Cell as Cell
from robostiff.markup.blocks import Facts as Facts
from robostiff.markup.blocks import Folded as Folded
from robostiff.markup.blocks import Heading as Heading
from robostiff.markup.blocks import LabelledMatrix as LabelledMatrix
from robostiff.markup.blocks import Number as Number
from robostiff.markup.blocks import Page as Page
from robostiff.markup.blocks import Paragraph as Paragraph
from robostiff.markup.blocks import Section as Section
from robostiff.markup.blocks import SideBySide as SideBySide
from robostiff.markup.blocks import Table as Table
from robostiff.markup.blocks import Tone as Tone
from robostiff.markup.blocks import Verbatim as Verbatim
from robostiff.markup.blocks import inner_blocks as inner_blocks
from robostiff.markup.blocks import page_text as page_text
from robostiff.markup.numbers import number as number
from robostiff.markup.numbers import percent as percent
from robostiff.markup.numbers import prefixed as prefixed
from robostiff.markup.numbers import quantity as quantity
from robostiff.markup.numbers import row as row
from robostiff.markup.numbers import short as short
from robostiff.markup.writers import TYPST_BLOCKS as TYPST_BLOCKS
from robostiff.markup.writers import InNotebooks as InNotebooks
from robostiff.markup.writers import block_html as block_html
from robostiff.markup.writers import block_typst as block_typst
from robostiff.markup.writers import blocks_html as blocks_html
from robostiff.markup.writers import blocks_typst as blocks_typst
from robostiff.markup.writers import element as element
from robostiff.markup.writers import escaped as escaped
from robostiff.markup.writers import in_words as in_words
from robostiff.markup.writers import page_html as page_html
from robostiff.markup.writers import typst_string as typst_string
from robostiff.markup.writers import typst_text as typst_text
