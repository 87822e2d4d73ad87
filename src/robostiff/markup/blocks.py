"""Blocks of a page, independent of its format, and as text for terminals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol

from robostiff.errors import printable
from robostiff.frozen import field, frozen
from robostiff.markup.numbers import number, shown_matrix

if TYPE_CHECKING:
    import numpy as np


_NARROW, _LONG = 3, 12  # columns and rows


@frozen
class Number:
    """A number with its unit; pages show five digits and keep all of them."""

    value: float
    unit: str = ""


Cell = str | Number


class Tone(Enum):
    """Emphasis of a paragraph."""

    PLAIN = "plain"
    QUIET = "quiet"
    WARNING = "warning"


@frozen
class Paragraph:
    """A paragraph."""

    text: str
    tone: Tone = Tone.PLAIN


@frozen
class Heading:
    """A heading inside a section."""

    text: str


@frozen
class Bullets:
    """A list of sentences; warnings stand out."""

    items: tuple[str, ...]
    tone: Tone = Tone.PLAIN


@frozen
class Facts:
    """A list of names and values."""

    rows: tuple[tuple[str, str], ...]


@frozen
class Table:
    """A table; the first cell of each row names it."""

    header: Sequence[str]  #: names of the columns; empty for a list that its title explains
    rows: Sequence[Sequence[Cell]]
    title: str = ""  #: what it is of

    @property
    def is_long(self) -> bool:
        """Whether it is narrow and long, and printed in two columns."""
        return len(self.header) <= _NARROW and len(self.rows) > _LONG

    @property
    def of_numbers(self) -> tuple[bool, ...]:
        """Which columns have numbers: they stand at the right, with words between them."""
        columns = zip(*self.rows, strict=True)
        numeric = tuple(any(isinstance(cell, Number) for cell in column) for column in columns)
        return numeric or (False,) * len(self.header)


@frozen
class BlockUnits:
    """Units of the blocks of a matrix between twists and wrenches."""

    translation: str  # of the upper left block
    coupling: str  # of both off-diagonal blocks
    rotation: str  # of the lower right block

    def __str__(self) -> str:
        return f"{self.translation}, {self.coupling}, {self.rotation}"


STIFFNESS_UNITS = BlockUnits("N/m", "N/rad", "N m/rad")
COMPLIANCE_UNITS = BlockUnits("m/N", "rad/N", "rad/(N m)")


@frozen
class LabelledMatrix:
    """A symmetric, semidefinite matrix between twists and wrenches."""

    symbol: str
    values: np.ndarray  #: (n, n); what is rounding beside its row and column is shown as 0
    rows: Sequence[str]
    columns: Sequence[str]
    units: BlockUnits

    @property
    def first_rotation(self) -> int:
        """Row and column at which the second blocks begin."""
        turns = (i for i, name in enumerate(self.columns) if name[0] in "rM")
        return next(turns, len(self.columns))


@frozen
class Verbatim:
    """Text as it is, line by line."""

    text: str


@frozen
class Folded:
    """Blocks that are collapsed below a title: shown on paper, left out of text."""

    title: str
    blocks: tuple[Block, ...]


@frozen
class SideBySide:
    """Columns of blocks beside each other if there is room."""

    columns: tuple[Block | tuple[Block, ...], ...]


@frozen
class Section:
    """Blocks below a title, with a name in links; those that are None are left out."""

    anchor: str
    title: str
    blocks: Sequence[Block | None]


class Drawn(Protocol):
    """What writes itself, such as a figure; it is no text."""

    def html(self) -> str:
        """As HTML."""
        ...

    def typst(self) -> str:
        """As Typst."""
        ...


Block = (
    Paragraph
    | Heading
    | Bullets
    | Facts
    | Table
    | LabelledMatrix
    | Verbatim
    | Folded
    | SideBySide
    | Section
    | Drawn
)


def inner_blocks(block: Block) -> tuple[Block, ...]:
    """Blocks inside a block, one after the other."""
    match block:
        case SideBySide(columns):
            return tuple(x for c in columns for x in (c if isinstance(c, tuple) else (c,)))
        case Folded(_, blocks):
            return blocks
        case Section(_, _, blocks):
            return tuple(inner for inner in blocks if inner is not None)
    return ()


@frozen
class Page:
    """What is said of a result, in every format."""

    name: str  #: of the robot
    place: str = ""  #: what follows the name in the first line, such as ``, pose [...] (m, rad)``
    status: object = None  #: what happened; None where nothing is computed
    blocks: Sequence[Block | None] = ()  #: those that are None are left out
    advice: Sequence[str] = ()
    #: all of it for programs, with what nobody would read
    data: Mapping[str, Any] = field(default_factory=dict)
    before: str = ""  #: what stands before the name
    posture: str = ""  #: a second line, on the coordinates of joints


def page_text(page: Page) -> str:
    r"""A page as text: a blank line around matrices and tables, advice at the end.

    Control characters in names are escaped.
    """
    lines = [page.before + page.name + page.place, *filter(None, [page.posture])]
    lines += [] if page.status is None else [f"status: {page.status}"]
    stood_alone = False
    for block in page.blocks:
        written = [] if block is None else _lines(block)
        if written:
            alone = isinstance(block, LabelledMatrix | Table)
            lines += [""] if alone or stood_alone else []
            lines += written
            stood_alone = alone
    return "\n".join(map(printable, [*lines, *(f"advice: {advice}" for advice in page.advice)]))


def _lines(block: Block) -> list[str]:  # noqa: PLR0911
    match block:
        case Paragraph(text) | Heading(text):
            return [text]
        case Bullets(items):
            return list(items)
        case Facts(rows):
            return [f"{name}: {value}" for name, value in rows]
        case Table():
            return [*filter(None, [block.title]), *_columns(block)]
        case LabelledMatrix():
            lines = ["    " + "".join(f"{name:>12}" for name in block.columns)]
            for name, values in zip(block.rows, shown_matrix(block.values), strict=True):
                lines.append(f"{name:>4}" + "".join(f"{number(value):>12}" for value in values))
            return [f"{block.symbol} [{block.units}]:", *lines]
        case Verbatim(text):
            return text.splitlines()
        case Folded():
            return []
        case _:
            head = [block.title] if isinstance(block, Section) else []
            return head + [line for inner in inner_blocks(block) for line in _lines(inner)]


def _columns(block: Table) -> Iterator[str]:
    """Rows of a table in columns as wide as their cells; numbers at the right."""
    sides = block.of_numbers
    rows = [block.header] if any(block.header) else []
    rows += [
        [
            f"{number(cell.value)} {cell.unit}".rstrip() if isinstance(cell, Number) else cell
            for cell in row
        ]
        for row in block.rows
    ]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = zip(row, widths, sides, strict=True)
        padded = (cell.rjust(width) if right else cell.ljust(width) for cell, width, right in cells)
        yield "  ".join(padded).rstrip()
