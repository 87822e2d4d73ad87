"""Questions to a formula: its rank and when it drops, its free motions, its decoupling."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import sympy as sp

from robostiff.analytic.elimination import determinant, echelon, null_space
from robostiff.analytic.field import ExactField


@dataclass(frozen=True)
class RankFormula:
    """Rank of a symmetric positive semidefinite formula.

    Attributes
    ----------
    rank : int
        For general values of the symbols.
    exceptions : tuple of sympy.Expr
        Irreducible factors that all principal minors of that size share: where one is zero, the
        rank drops.
    """

    rank: int
    exceptions: tuple[sp.Expr, ...]


def rank_formula(K: Any) -> RankFormula:
    """Rank of a stiffness formula and the conditions under which it drops.

    A positive semidefinite matrix of rank r has a principal minor of size r that is not zero; the
    rank drops where all of them vanish, so at the zeros of their common factors.

    Examples
    --------
    >>> a, b = sp.symbols("a b")
    >>> rank_formula(sp.diag(a, a - b, 0))
    RankFormula(rank=2, exceptions=(a, a - b))
    """
    K = sp.Matrix(K)
    field = ExactField(list(K))
    elements = [[field.element(K[i, j]) for j in range(K.cols)] for i in range(K.rows)]
    rank = len(echelon(field, elements)[1])
    if rank == 0:
        return RankFormula(0, ())
    shared = None
    for places in combinations(range(K.rows), rank):
        minor = determinant(field, [[elements[i][j] for j in places] for i in places])
        if not minor.is_zero:
            shared = minor.num if shared is None else shared.gcd(minor.num)
    factors = [] if shared is None else shared.factor()[1]
    exceptions = [field.polynomial_expression(factor) for factor, _ in factors]
    return RankFormula(rank, tuple(sorted(exceptions, key=sp.default_sort_key)))


def free_motion_formulas(K: Any) -> tuple[sp.ImmutableMatrix, ...]:
    """Twists that meet no stiffness, as formulas: a basis of the null space in echelon form.

    Parameters
    ----------
    K : (n, n) matrix of SymPy expressions

    Returns
    -------
    tuple of (n, 1) matrices
        Each with a 1 in a coordinate of its own, rotations first where there is a choice.

    Examples
    --------
    >>> k, d = sp.symbols("k d")
    >>> K = k * sp.Matrix([[1, 0, d], [0, 1, 0], [d, 0, d**2]])
    >>> free_motion_formulas(K)[0].T
    Matrix([[-d, 0, 1]])
    """
    K = sp.Matrix(K)
    field = ExactField(list(K))
    n = K.rows
    rows = [[field.element(entry) for entry in K.row(i)] for i in range(n)]
    return tuple(
        sp.ImmutableMatrix([field.expression(element) for element in motion])
        for motion in null_space(field, rows, n)
    )


def decoupling_conditions(K: Any) -> tuple[sp.Expr, ...]:
    """Irreducible factors that all entries between translations and rotations share.

    Where one of them is zero, forces only translate the platform and moments only turn it. An
    empty tuple: no single condition decouples; ``(0,)``: they are decoupled as they are.

    Examples
    --------
    >>> k, R, r = sp.symbols("k R r")
    >>> decoupling_conditions(sp.Matrix([[k, 0, k * (R - r)], [0, k, 0], [k * (R - r), 0, k]]))
    (k, R - r)
    """
    K = sp.Matrix(K)
    t = 3 if K.rows == 6 else 2
    field = ExactField(list(K))
    coupling = [field.element(K[i, j]) for i in range(t) for j in range(t, K.rows)]
    present = [element.num for element in coupling if not element.is_zero]
    if not present:
        return (sp.Integer(0),)
    shared = present[0]
    for polynomial in present[1:]:
        shared = shared.gcd(polynomial)
    factors = [field.polynomial_expression(factor) for factor, _ in shared.factor()[1]]
    return tuple(sorted(factors, key=sp.default_sort_key))
