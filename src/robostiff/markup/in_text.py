"""Pages as lines of text, for terminals."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from robostiff.errors import printable
from robostiff.markup.blocks import (
    Block,
    Bullets,
    Facts,
    Folded,
    Heading,
    LabelledMatrix,
    Number,
    Page,
    Paragraph,
    Section,
    Table,
    Verbatim,
    inner_blocks,
)
from robostiff.markup.numbers import number, shown_matrix


def text_of(lines: Iterable[str]) -> str:
    r"""Lines of text; control characters in names are escaped.

    Examples
    --------
    >>> print(text_of(["robot a\nstatus: ok", "rank 3"]))
    robot a\nstatus: ok
    rank 3
    """
    return "\n".join(map(printable, lines))


def page_text(page: Page) -> str:
    """A page as text: a blank line around matrices and tables, advice at the end.

    Examples
    --------
    >>> page = Page("arm", " under load", "ok", [Facts((("rank", "6"),))], ["Hold the platform"])
    >>> print(page_text(page))
    arm under load
    status: ok
    rank: 6
    advice: Hold the platform
    """
    lines = [page.before + page.name + page.place, *filter(None, [page.posture])]
    lines += [] if page.status is None else [f"status: {page.status}"]
    stood_alone = False
    for block in page.blocks:
        own = [] if block is None else _lines(block)
        if own:
            alone = isinstance(block, LabelledMatrix | Table)
            lines += [""] if alone or stood_alone else []
            lines += own
            stood_alone = alone
    return text_of([*lines, *(f"advice: {advice}" for advice in page.advice)])


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
            return head + [line for own in inner_blocks(block) for line in _lines(own)]


def _columns(block: Table) -> Iterator[str]:
    """Rows of a table in columns as wide as their cells; numbers at the right."""
    sides = block.of_numbers
    rows = [block.header] if any(block.header) else []
    rows += [
        [
            f"{number(own.value)} {own.unit}".rstrip() if isinstance(own, Number) else own
            for own in row
        ]
        for row in block.rows
    ]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = zip(row, widths, sides, strict=True)
        padded = (cell.rjust(width) if right else cell.ljust(width) for cell, width, right in cells)
        yield "  ".join(padded).rstrip()
