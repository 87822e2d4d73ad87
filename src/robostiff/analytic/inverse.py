"""Compliance as a formula: the inverse of a stiffness, and the stiffness of a compliance."""

from __future__ import annotations

from typing import Any

import sympy as sp

from robostiff.analytic.budget import BUDGET, within
from robostiff.analytic.elimination import echelon
from robostiff.analytic.field import ExactField
from robostiff.analytic.questions import closed_matrix
from robostiff.errors import InputError


def compliance_formula(K: Any, budget: float | None = BUDGET) -> sp.ImmutableMatrix:
    """Compliance C = K^-1 as a formula, every entry a canonical fraction.

    The deflection under a wrench w at the reference point is C w. The same function gives the
    stiffness K = C^-1 of a compliance.

    Parameters
    ----------
    K : (n, n) matrix of SymPy expressions, or Derivation in closed form
        Symmetric.
    budget : float or None
        Seconds of computing; None for no limit.

    Raises
    ------
    InputError
        For a derivation in steps, and for a matrix without an inverse.
    OutOfTimeError
        When it does not end in time.

    Examples
    --------
    A cantilever in the plane:

    >>> L, EA, EI, F = sp.symbols("L EA EI F", positive=True)
    >>> K = sp.Matrix([[EA / L, 0, 0], [0, 12 * EI / L**3, -6 * EI / L**2],
    ...                [0, -6 * EI / L**2, 4 * EI / L]])
    >>> (compliance_formula(K) * sp.Matrix([0, F, 0])).T
    Matrix([[0, F*L**3/(3*EI), F*L**2/(2*EI)]])
    """
    matrix = closed_matrix(K, "compliance")
    return within(budget, lambda: _inverse(matrix), "compliance")


def _inverse(K: Any) -> sp.ImmutableMatrix:
    n = K.rows
    field = ExactField(K.flat())
    one, zero = field.one, field.zero
    rows = [
        [*(field.element(K[i, j]) for j in range(n)), *(one if i == j else zero for j in range(n))]
        for i in range(n)
    ]
    reduced, pivots = echelon(field, rows)
    if pivots != list(range(n)):
        raise InputError(
            "compliance",
            got=f"a matrix of rank {sum(pivot < n for pivot in pivots)} of {n}",
            expected="one with an inverse",
            hint="free_motion_formulas(...) gives its free motions",
        )
    return sp.ImmutableMatrix(n, n, lambda i, j: field.expression(reduced[i][n + j]))
