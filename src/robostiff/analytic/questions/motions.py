"""Free motions, fixed points and decoupling conditions of a formula."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError, within
from robostiff.analytic.derivation import Derivation, RobotDerivation
from robostiff.analytic.exact.factors import null_space
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.questions.loci import (
    coupling_of,
    decoupling_in_names,
    decoupling_in_steps,
    of_legs,
    shared_zeros,
    written_steps,
)
from robostiff.analytic.questions.rank import SHORT, closed_matrix, needs_closed_form, rank_by_legs
from robostiff.errors import InputError
from robostiff.spatial import Space, skew


def free_motion_formulas(K: Any) -> tuple[sp.ImmutableMatrix, ...]:
    """Free motions as formulas: a basis of the null space in echelon form.

    Its denominators say where the basis changes its kind: a rotation about an apex at the height
    h r / (R - r) becomes a translation where R = r.

    Parameters
    ----------
    K : (n, n) matrix of SymPy expressions, or Derivation
        In steps, the motions are in given symbols and in names of its steps.

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
    if (rank := rank_by_legs(K)) is not None:
        return () if rank == of_legs(K).K.rows else _free_motions_in_steps(K, rank)
    matrix = closed_matrix(K, "free motions")
    try:
        return _null_space(matrix)
    except FormulaTooLargeError as error:
        with suppress(InputError):  # of its wrenches, without compliances
            if (rank := getattr(K, "general_rank", None)) is not None:
                return _free_motions_in_steps(K, rank)
        raise error from None


def _free_motions_in_steps(derivation: Any, rank: int) -> tuple[sp.ImmutableMatrix, ...]:
    """Motions against which no wrench of a leg does work."""
    form = of_legs(derivation)
    written = written_steps(derivation, *[math.inf] * (form is not derivation))
    W = sp.Matrix([list(written(w)) for leg in form.legs for w in leg.wrenches])
    try:
        found = within(SHORT, lambda: _null_space(W), "free motions")
    except FormulaTooLargeError:
        found = ()
    if len(found) != form.K.rows - rank:
        raise needs_closed_form(derivation, "free motions")
    return found


def _null_space(K: Any) -> tuple[sp.ImmutableMatrix, ...]:
    field = ExactField(list(K))
    rows = [[field.element(entry) for entry in K.row(i)] for i in range(K.rows)]
    return tuple(
        sp.ImmutableMatrix([field.expression(element) for element in motion])
        for motion in null_space(field, rows, K.cols)
    )


def fixed_point_formula(K: Any) -> sp.ImmutableMatrix | None:
    """The one point of the platform that no free motion moves, such as an apex of all legs.

    A free motion (v, w) moves the point p by v + w x p.

    Parameters
    ----------
    K : (n, n) matrix of SymPy expressions, or Derivation in closed form

    Returns
    -------
    (3, 1) matrix, or (2, 1) for a planar robot, or None
        From the reference point [m]; None where there is no such point, or more than one.

    Examples
    --------
    >>> k, d = sp.symbols("k d")
    >>> K = k * sp.Matrix([[1, 0, d], [0, 1, 0], [d, 0, d**2]])
    >>> fixed_point_formula(K).T
    Matrix([[0, -d]])
    """
    motions = free_motion_formulas(K)
    if not motions:
        return None
    space = Space.of_size(motions[0].rows)
    t = space.translations
    equations = []
    for motion in motions:
        twist = np.zeros(6, dtype=object)
        twist[list(space.rows)] = list(motion)
        equations += [[*skew(twist[3:])[i, :t], twist[i]] for i in range(t)]
    field = ExactField(entry for equation in equations for entry in equation)
    rows = [[field.element(entry) for entry in equation] for equation in equations]
    points = null_space(field, rows, t + 1)
    if len(points) != 1 or points[0][t].is_zero:
        return None
    return sp.ImmutableMatrix([field.expression(entry / points[0][t]) for entry in points[0][:t]])


def decoupling_conditions(K: Any) -> tuple[sp.Expr, ...]:
    """Irreducible factors that all entries between translations and rotations share.

    Where one of them is zero, forces only translate the platform and moments only turn it. An
    empty tuple: no single condition decouples; ``(0,)``: they are decoupled as they are. Named
    steps are written out.

    Raises
    ------
    InputError
        For steps that are too long to be written out.

    Examples
    --------
    >>> k, R, r = sp.symbols("k R r")
    >>> decoupling_conditions(sp.Matrix([[k, 0, k * (R - r)], [0, k, 0], [k * (R - r), 0, k]]))
    (k, R - r)
    """
    if isinstance(K, Derivation) and not K.is_closed:
        try:
            return within(SHORT, lambda: decoupling_in_steps(K), "decoupling")
        except FormulaTooLargeError:
            raise needs_closed_form(K, "decoupling") from None
    if isinstance(K, RobotDerivation) and K.named is not None:
        return decoupling_in_names(K)
    return shared_zeros(coupling_of(closed_matrix(K, "decoupling")))
