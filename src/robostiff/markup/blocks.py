"""Blocks of a page, independent of its format: paragraphs, numbers, tables, matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Paragraph:
    """A paragraph."""

    text: str
    tone: Tone = Tone.PLAIN


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    text: str


@dataclass(frozen=True)
class Bullets:
    """A list of sentences; warnings stand out."""

    items: tuple[str, ...]
    tone: Tone = Tone.PLAIN


@dataclass(frozen=True)
class Facts:
    """A list of names and values."""

    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Table:
    """A table; the first cell of each row names it.

    Attributes
    ----------
    header : sequence of str
    rows : sequence of rows of str or Number
    """

    header: Sequence[str]
    rows: Sequence[Sequence[Cell]]


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


@dataclass(frozen=True)
class LabelledMatrix:
    """A symmetric, semidefinite matrix between twists and wrenches.

    Attributes
    ----------
    symbol : str
    values : (n, n) array
        What is rounding beside its row and column is shown as 0.
    rows, columns : sequences of n str
    units : BlockUnits
    """

    symbol: str
    values: np.ndarray
    rows: Sequence[str]
    columns: Sequence[str]
    units: BlockUnits

    @property
    def first_rotation(self) -> int:
        """Row and column at which the second blocks begin."""
        turns = (i for i, name in enumerate(self.columns) if name[0] in "rM")
        return next(turns, len(self.columns))


Block = Paragraph | Heading | Bullets | Facts | Table | LabelledMatrix
