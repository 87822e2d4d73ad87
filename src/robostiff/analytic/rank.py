"""Rank of a formula and where it drops, free motions, fixed points, decoupling."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from itertools import combinations
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import BUDGET, FormulaTooLargeError, OutOfTimeError, within
from robostiff.analytic.derivation import Derivation, RobotDerivation
from robostiff.analytic.exact.definition import count_of
from robostiff.analytic.exact.factors import echelon, null_space, shared_factors
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.loci import (
    LONG,
    coupling_of,
    decoupling_in_names,
    decoupling_in_steps,
    independent_zeros,
    may_vanish,
    of_legs,
    power_of_a_cosine,
    rank_in_numbers,
    rank_locus,
    shared_zeros,
    written_steps,
)
from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen
from robostiff.spatial import Space, skew

#: Seconds for an answer in steps.
SHORT = 5.0
_LONGEST = 3000  # operations of a factor that is listed


@frozen
class RankFormula:
    """Rank of a symmetric positive semidefinite formula.

    Attributes
    ----------
    rank : int
        For general values of the symbols.
    exceptions : tuple of sympy.Expr
        Irreducible factors that all principal minors of that size share: where one is zero, the
        rank drops.
    common_minor : sympy.Expr
        What those minors share, as a product of the exceptions: at full rank the determinant but
        for its denominator and a number, and 1 for the rank 0.
    remark : str
        Why there are no exceptions where they were not looked for, and which are too long to be
        listed; empty otherwise.
    of_formula : Derivation or None
        The formula whose conditions decide what is `allowed`.
    """

    rank: int
    exceptions: tuple[sp.Expr, ...]
    common_minor: sp.Expr
    remark: str = field(default="", repr=False, compare=False)
    of_formula: Derivation | None = field(default=None, repr=False, compare=False)

    @classmethod
    def of(cls, K: Any, rank: int, powers: Mapping[Any, int], remark: str = "") -> RankFormula:
        """Of a matrix or derivation; `powers`: the factors with their exponents in the minors."""
        powers = dict(powers)
        for factor in [x for x in powers if count_of(x) <= LONG]:
            if (short := power_of_a_cosine(factor)) is not None:
                powers[short[0]] = short[1] * powers.pop(factor)
        kept = independent_zeros(sorted(powers, key=sp.default_sort_key))
        long = [x for x in kept if count_of(x) > _LONGEST]
        kept = tuple(x for x in kept if x not in long)
        names = sorted({str(s) for x in long for s in x.free_symbols})
        if long:
            lost = f"too long to be listed: where a sum in {', '.join(names)} vanishes"
            remark = "; ".join(filter(None, (remark, lost)))
        common = sp.Mul(*(factor ** powers[factor] for factor in kept))
        return cls(rank, kept, common, remark, K if isinstance(K, Derivation) else None)

    @property
    def allowed(self) -> tuple[sp.Expr, ...]:
        """Exceptions that signs of symbols and conditions allow: a length is never zero."""
        possible = (x for x in self.exceptions if not x.is_nonzero)
        conditions = () if self.of_formula is None else self.of_formula.conditions
        return tuple(x for x in possible if x.is_Symbol or may_vanish(x, conditions))


def closed_matrix(formula: Any, question: str) -> sp.Matrix:
    """The matrix that a question is about: a matrix of formulas, or a derivation in closed form.

    Raises
    ------
    InputError
        For a derivation in steps: their names would be taken for independent symbols.
    """
    if not isinstance(formula, Derivation):
        return sp.Matrix(formula)
    if not formula.is_closed:
        raise needs_closed_form(formula, question)
    return sp.Matrix(formula.K)


def needs_closed_form(derivation: Derivation, question: str) -> InputError:
    """The error of a question that steps cannot answer."""
    return InputError(
        f"{question} of {derivation.name!r}",
        got=Words("named steps"),
        expected="a closed form",
        hint="take the home pose, fewer symbols, or form=Closed(); subs(...) with values for "
        "all symbols but a few makes steps short"
        + "; compliance_steps(...) has it in steps"
        * (question == "compliance"),
    )


def rank_by_legs(K: Any) -> int | None:
    """Rank of a robot's derivation in names or in steps; None of others, and if it is not known."""
    named = getattr(K, "named", None)
    if named is None and (not isinstance(K, Derivation) or K.is_closed):
        return None
    rank = getattr(K, "general_rank", None)
    if rank is None and named is not None:  # values were put in
        written = written_steps(K, math.inf)
        rank = rank_in_numbers([written(w) for leg in named.legs for w in leg.wrenches])
    return rank


def rank_formula(K: Any, budget: float | None = BUDGET) -> RankFormula:
    """Rank of a stiffness formula and the conditions under which it drops.

    A positive semidefinite matrix of rank r has a principal minor of size r that is not zero; the
    rank drops where all of them vanish, so at the zeros of their common factors. Points where it
    drops only because several conditions hold at once are not listed. Exceptions are listed whether
    or not the assumptions of the symbols allow them: h = 0 is the limit of flat platforms for h >
    0.

    Parameters
    ----------
    K : (n, n) matrix of SymPy expressions, or Derivation
        Symmetric and positive semidefinite. In steps, or too long, the rank is that in numbers at
        the parameters and poses at which the formula was compared with them, without exceptions.
    budget : float or None
        Seconds of computing; None for no limit.

    Raises
    ------
    InputError
        For a derivation in steps that was not compared with numbers.
    OutOfTimeError
        When it does not end in time, as with a matrix of long sums.
    """
    by_legs = rank_by_legs(K)
    matrix = closed_matrix(K, "rank") if by_legs is None else None
    rank = getattr(K, "general_rank", None) if by_legs is None else by_legs

    def answer() -> RankFormula:
        if matrix is not None:
            try:
                return RankFormula.of(K, *_rank(matrix))
            except FormulaTooLargeError:
                if rank is None:
                    raise
        return RankFormula.of(K, rank or 0, *rank_locus(K, rank or 0))

    is_closed = matrix is not None or K.is_closed
    seconds = budget if is_closed else min(SHORT, budget or SHORT)
    try:
        return within(seconds, answer, "rank of a formula")
    except FormulaTooLargeError as error:
        if rank is None or (is_closed and isinstance(error, OutOfTimeError)):
            raise
        remark = (
            "it drops where wrenches of the legs depend on one another, a condition that is too "
            "long to be listed"
        )
        return RankFormula.of(K, rank, {}, remark)


def _rank(K: Any) -> tuple[int, dict[Any, int]]:
    """Rank, and the factors that all principal minors of its size share, with their exponents."""
    field = ExactField(list(K))
    elements = [[field.element(K[i, j]) for j in range(K.cols)] for i in range(K.rows)]
    rank = len(echelon(field, elements)[1])
    if rank == 0:
        return 0, {}
    chosen = combinations(range(K.rows), rank)
    each = (echelon(field, [[elements[i][j] for j in at] for i in at]) for at in chosen)
    minors = (minor for _, pivots, minor in each if len(pivots) == rank)
    return rank, shared_factors(field, map(field.zeros, minors))


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
    """
    motions = free_motion_formulas(K)
    if not motions:
        return None
    space = Space.of_size(motions[0].rows)
    t = space.translations
    equations = []
    for motion in motions:
        twist = np.zeros(6, dtype=object)
        twist[list(space.rows)] = motion.flat()
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
    """
    if isinstance(K, Derivation) and not K.is_closed:
        try:
            return within(SHORT, lambda: decoupling_in_steps(K), "decoupling")
        except FormulaTooLargeError:
            raise needs_closed_form(K, "decoupling") from None
    if isinstance(K, RobotDerivation) and K.named is not None:
        return decoupling_in_names(K)
    return shared_zeros(coupling_of(closed_matrix(K, "decoupling")))
