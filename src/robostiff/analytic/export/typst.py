"""A derivation as a Typst document, and as a PDF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import Derivative
from robostiff.analytic.export.derivative_outline import outline_of
from robostiff.analytic.export.displays import Display, Row, displays
from robostiff.analytic.export.matrix_names import MatrixName
from robostiff.analytic.export.outline import (
    Block,
    Heading,
    Nomenclature,
    Words,
)
from robostiff.analytic.export.typst_math import TYPST
from robostiff.errors import InputError
from robostiff.markup import typst_text

# Letters of 10 pt side by side in the text of A4 upright (planar) and on its side (spatial).
_ROOM_UPRIGHT = 72.0
_ROOM_ON_ITS_SIDE = 112.0
_BETWEEN_COLUMNS = 3.0

_PREAMBLE = """\
#set document(title: "{title}", date: none)
#set page(paper: "a4", flipped: {flipped}, margin: (x: 20mm, y: 18mm), numbering: "1 / 1")
#set text(size: 10pt)
#set par(justify: false)
#show heading: set block(above: 1.5em, below: 0.9em, sticky: true)
"""

#: What a document says once, before the first piece of a derivation.
TYPST_DERIVATIONS = """\
#set math.mat(column-gap: 1.1em, row-gap: 0.55em)
#show math.equation.where(block: true): set align(left)
#show math.equation.where(block: true): set block(breakable: true)

// Whatever is wider than the page is made smaller.
#let fit(body) = block(inset: (left: 1.5em), layout(page => {
  let width = measure(body).width
  if width > page.width {
    scale(page.width / width * 100%, origin: left, reflow: true, body)
  } else { body }
}))

#let side-by-side(count, ..equations) = block(
  above: 1.4em, below: 1.4em, inset: (left: 1.5em), grid(
  columns: (1fr,) * count, row-gutter: 0.9em, align: horizon, ..equations,
))
"""


def derivation_typst(derivation: Derivation | Derivative) -> str:
    r"""A derivation as the source of a Typst document.

    Parameters
    ----------
    derivation : Derivation or Derivative

    Examples
    --------
    >>> import sympy as sp
    >>> k = sp.Symbol("k_tau")
    >>> K = sp.ImmutableMatrix(sp.diag(k / 3, k / 3, 0))
    >>> print("\n".join(derivation_typst(Derivation("K_C", K, (), K)).splitlines()[27:33]))
    == Result
    <BLANKLINE>
    #fit($ bold(upright(K))_(C) = frac(k_(tau), 3) mat(delim: "[",
      1, 0, 0;
      0, 1, 0;
      0, 0, 0) $)
    """
    title = next(block.text for block in outline_of(derivation) if isinstance(block, Heading))
    quoted = title.replace("\\", "\\\\").replace('"', '\\"')
    flipped = "true" if wants_wide_page(derivation) else "false"
    preamble = _PREAMBLE.format(title=quoted, flipped=flipped)
    return f"{preamble}\n{TYPST_DERIVATIONS}\n{derivation_in_typst(derivation)}"


def wants_wide_page(derivation: Derivation | Derivative) -> bool:
    """Whether its matrices want a page on its side: those of space, not those of a plane."""
    return derivation.K.rows > 3


def derivation_in_typst(
    derivation: Derivation | Derivative, *, first_heading: int = 1, wide: bool | None = None
) -> str:
    """A derivation as a piece of a Typst document that says `TYPST_DERIVATIONS` before.

    Parameters
    ----------
    derivation : Derivation or Derivative
    first_heading : int
        Level of its title.
    wide : bool, optional
        Whether the page lies on its side; as `wants_wide_page` says when left out.
    """
    is_wide = wants_wide_page(derivation) if wide is None else wide
    room = _ROOM_ON_ITS_SIDE if is_wide else _ROOM_UPRIGHT
    blocks = outline_of(derivation)
    written = [text for block in blocks for text in _written(block, room, first_heading)]
    return "\n\n".join(written) + "\n"


def derivation_pdf(derivation: Derivation | Derivative, path: str | Path) -> None:
    """Write a derivation as a PDF.

    Parameters
    ----------
    derivation : Derivation or Derivative
    path : str or Path
        The file to write.

    Raises
    ------
    InputError
        When the optional package typst is not installed.

    Examples
    --------
    The optional package comes with ``pip install typst``::

        derivation_pdf(derive_chain(K0, joints), "leg.pdf")
    """
    Path(path).write_bytes(typst_pdf(derivation_typst(derivation)))


def typst_pdf(source: str) -> bytes:
    """A Typst document as a PDF, with the fonts that Typst brings along.

    Raises
    ------
    InputError
        When the optional package typst is not installed.
    """
    try:
        import typst
    except ImportError as error:
        raise InputError(
            "the package typst is not installed",
            hint="install it with: pip install 'robostiff[pdf]', or choose another format",
        ) from error
    return typst.compile(source.encode(), ignore_system_fonts=True, timestamp=0)


def _written(block: Block, room: float, first: int) -> list[str]:
    match block:
        case Heading(text, level):
            return [f"{'=' * (first + level - 1)} {typst_text(text)}"]
        case Words(text):
            return [typst_text(text)]
        case Nomenclature(rows):
            return [f"{'=' * (first + 1)} Nomenclature", _nomenclature(rows)]
        case _:
            formulas = displays(block, TYPST, room)
            return [text for formula in formulas for text in _placed(formula, room)]


def _placed(formula: Display, room: float) -> list[str]:
    """Short equations side by side; others in blocks of their own, which pages can break."""
    columns = int(room / max(row.width + _BETWEEN_COLUMNS for row in formula))
    if len(formula) > 1 and columns > 1:
        cells = "\n".join(f"  $ {_equation(row)} $," for row in formula)
        return [f"#side-by-side({columns},\n{cells}\n)"]
    return [f"#fit($ {_equation(row)} $)" for row in formula]


def _equation(row: Row) -> str:
    if len(row.lines) == 1:
        return f"{row.left} = {row.lines[0]}"
    first, *others = row.lines
    return " \\\n  ".join([f"{row.left} = & {first}", *(f'& quad "" {line}' for line in others)])


def _nomenclature(rows: Sequence[tuple[tuple[MatrixName | str, ...], str]]) -> str:
    cells = [f"  [{_names(names)}], [{typst_text(meaning)}]," for names, meaning in rows]
    start = "#table(columns: (28%, 1fr), stroke: none, inset: (x: 0pt, y: 3pt), column-gutter: 1em,"
    return "\n".join([start, *cells, ")"])


def _names(names: Sequence[MatrixName | str]) -> str:
    written = []
    for name in names:
        if isinstance(name, MatrixName):
            written.append(f"${TYPST.matrix_name(name.name)}$")
        else:
            written.append("…" if name == "..." else f"${TYPST.name(name)}$")
    return ", ".join(written)
