"""Legs in parallel as formulas: rotation (11), change of reference point (13), sum (12)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy as sp

from robostiff.analytic.closed import canonical
from robostiff.errors import InputError


def skew_formula(v: Any) -> sp.ImmutableMatrix:
    """Skew matrix (v x), eq. (14), of expressions."""
    x, y, z = v
    return sp.ImmutableMatrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def rotated_formula(K_local: Any, R: Any) -> sp.ImmutableMatrix:
    """Stiffness in global axes, diag(R, R) K diag(R, R)^T, eq. (11), of expressions (6 x 6)."""
    block = sp.diag(sp.Matrix(R), sp.Matrix(R))
    return sp.ImmutableMatrix(block * sp.Matrix(K_local) * block.T)


def moved_formula(K: Any, v: Any) -> sp.ImmutableMatrix:
    """Stiffness about a new reference point, J_v^-T K J_v^-1, of expressions (6 x 6).

    v points from the old reference point to the new one, and J_v^-1 = [[I, (v x)], [0, I]]: the
    sign of (13) corrected.

    Examples
    --------
    >>> k, d = sp.symbols("k d")
    >>> moved_formula(sp.diag(0, k, 0, 0, 0, 0), [d, 0, 0])[5, 5]
    d**2*k
    """
    J_inverse = sp.Matrix(sp.BlockMatrix([[sp.eye(3), skew_formula(v)], [sp.zeros(3), sp.eye(3)]]))
    return sp.ImmutableMatrix(J_inverse.T * sp.Matrix(K) * J_inverse)


def sum_of_legs(
    K_legs: Sequence[Any], v_leg_end_to_ref: Sequence[Any], extra: Sequence[sp.Expr] = ()
) -> sp.ImmutableMatrix:
    """Stiffness of a parallel robot as a canonical formula, eq. (12) with (13) corrected.

    Parameters
    ----------
    K_legs : sequence of (6, 6) matrices
        Stiffness of each leg about its end, global axes.
    v_leg_end_to_ref : sequence of 3 expressions each
        From each leg end to the reference point.
    extra : sequence of SymPy expressions
        Further expressions whose roots and angles shall be known.

    Raises
    ------
    InputError
        When there are not as many vectors as legs.
    """
    if len(K_legs) != len(v_leg_end_to_ref) or not K_legs:
        raise InputError(
            "vectors from leg ends", got=len(v_leg_end_to_ref), expected=f"{len(K_legs)}, one a leg"
        )
    total = sp.zeros(6, 6)
    for K, v in zip(K_legs, v_leg_end_to_ref, strict=True):
        total += moved_formula(K, v)
    return canonical(total, extra)
