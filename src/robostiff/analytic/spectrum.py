"""What is known of the eigenvalues of a stiffness formula."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import sympy as sp


class Part(Enum):
    """Which part of a stiffness matrix."""

    TRANSLATION = "translation"
    """Force for translation, rotations held [N/m]."""
    ROTATION = "rotation"
    """Moment for rotation, translations held [N m/rad]."""
    WHOLE = "whole"
    """All of it; rotations times a length count as translations [N/m]."""


@dataclass(frozen=True)
class Eigenvalue:
    """An eigenvalue with its eigenvectors.

    Attributes
    ----------
    value : sympy.Expr
    multiplicity : int
        For general values of the symbols.
    vectors : tuple of sympy.ImmutableMatrix
        A basis of its eigenspace, twists of the part (m x 1), not normalised.
    """

    value: sp.Expr
    multiplicity: int
    vectors: tuple[sp.ImmutableMatrix, ...]


@dataclass(frozen=True)
class Unsolved:
    """An irreducible factor of the characteristic polynomial, of degree 3 or more.

    Attributes
    ----------
    factor : sympy.Expr
        Polynomial in `Eigenvalues.symbol` of which eigenvalues are the zeros.
    degree, multiplicity : int
    """

    factor: sp.Expr
    degree: int
    multiplicity: int


@dataclass(frozen=True)
class Eigenvalues:
    """Eigenvalues of a stiffness matrix or of a part of it.

    Attributes
    ----------
    values : tuple of Eigenvalue
        Those that have a closed form: zeros of factors of degree 1 and 2.
    unsolved : tuple of Unsolved
        Factors that keep the others.
    symbol : sympy.Symbol
        The unknown of the characteristic polynomial.

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> Eigenvalues((), (Unsolved(x**3 - x - 1, 3, 1),), x).answer
    'no closed form: irreducible factor of degree 3'
    """

    values: tuple[Eigenvalue, ...]
    unsolved: tuple[Unsolved, ...]
    symbol: sp.Symbol

    @property
    def is_complete(self) -> bool:
        """Whether all eigenvalues have a closed form."""
        return not self.unsolved

    @property
    def answer(self) -> str:
        """In words: how many closed forms there are, and what has none."""
        found = sum(value.multiplicity for value in self.values)
        missing = [f"irreducible factor of degree {factor.degree}" for factor in self.unsolved]
        if not missing:
            return f"all {found} eigenvalues in closed form"
        start = f"{found} eigenvalues in closed form; " if found else ""
        return f"{start}no closed form: {', '.join(missing)}"
