"""The recursion (15) in closed form: exact, fraction-free, canonical."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError, spend
from robostiff.analytic.exact.element import Element
from robostiff.analytic.exact.factors import (
    ExactMatrix,
    common_denominator,
    common_factor,
    factors_of,
    over,
    starts_with_minus,
)
from robostiff.analytic.exact.field import ExactField, quotient, shared_field
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.spatial import move_stiffness


@frozen
class ClosedStage:
    """One step of the recursion (15) in exact arithmetic."""

    u: tuple[Any, ...]  # K J up to a common factor
    mu: Any  # J^T K J up to the square of this factor; zero for a redundant joint
    below: tuple[Any, Any]  # what u and mu stand over
    after: ExactMatrix  # stiffness after the joint

    @property
    def is_redundant(self) -> bool:
        """Whether the joint adds no freedom to those before it."""
        return bool(self.mu.is_zero())

    def u_expression(self) -> sp.ImmutableMatrix:
        """K J in SymPy, every entry a canonical fraction."""
        field = self.after.field
        return sp.ImmutableMatrix(
            [field.expression(field.fraction(entry, self.below[0])) for entry in self.u]
        )

    def mu_expression(self) -> sp.Expr:
        """J^T K J in SymPy, a canonical fraction."""
        field = self.after.field
        return field.expression(field.fraction(self.mu, self.below[1]))


def eliminate_exactly(K: ExactMatrix, J: Sequence[Any], limit: int) -> ClosedStage:
    """Stiffness after one more passive joint, (N mu - u u^T) / (D mu) for K = N / D, eq. (15).

    As in Bareiss' elimination the previous denominator divides the new numerators exactly, so that
    no fractions pile up; where square roots or sines hide the factor, it is left in. A joint that
    moves one coordinate only, of those that are left, is eliminated by the index rule (19), (20).

    `K`: before; `J`: n SymPy expressions: twist of the joint; `limit`: most terms that an entry
    may have.

    Raises
    ------
    FormulaTooLargeError
        Before memory does.
    InputError
        When K is indefinite: J^T K J = 0 while K J is not zero.
    """
    field, N, D = K.field, K.entries, K.denominator
    n = len(N)
    elements = [field.element(x) for x in J]
    scale = common_denominator(field, elements)
    column = [over(element, scale) for element in elements]
    below = (D * scale, D * scale * scale)
    present = [k for k in range(n) if any(not entry.is_zero() for entry in N[k])]
    used = [k for k in present if not column[k].is_zero()]
    u = [field.reduce(_sum(field, [(N[j][k], column[k]) for k in used], limit)) for j in range(n)]
    mu = field.reduce(_sum(field, [(column[k], u[k]) for k in used], limit))
    if mu.is_zero():
        if any(not entry.is_zero() for entry in u):
            raise InputError(
                "stiffness matrix",
                got=Words("a joint whose motion causes forces but stores no energy, J^T K J = 0"),
                expected="a positive semidefinite matrix",
            )
        return ClosedStage(tuple(u), mu, below, K)
    alone = used[0] if len(used) == 1 else None
    v, nu = (u, mu) if alone is None else (N[alone], N[alone][alone])
    upper: dict[tuple[int, int], Any] = {}
    for i in present:
        for j in (j for j in present if j >= i and alone not in {i, j}):
            entry = product(N[i][j], nu, limit)
            if not (v[i].is_zero() or v[j].is_zero()):
                entry = entry - product(v[i], v[j], limit)
            upper[i, j] = field.reduce(entry)
    # Numerators over D nu, without common factors.
    divided = upper if D.is_one() else {x: quotient(entry, D) for x, entry in upper.items()}
    denominator = nu
    if None in divided.values():
        denominator = field.reduce(D * nu)
        common = common_factor([denominator, *upper.values()])
        divided = {place: entry / common for place, entry in upper.items()}
        denominator = denominator / common
    return ClosedStage(tuple(u), mu, below, ExactMatrix.of_upper(field, n, divided, denominator))


def canonical(M: Any, extra: Sequence[sp.Expr] = ()) -> sp.ImmutableMatrix:
    """The same matrix, every entry a canonical fraction of its symbols, cosines, sines and roots.

    Parameters
    ----------
    M : SymPy matrix
    extra : sequence of SymPy expressions
        Further expressions whose roots and angles shall be known.
    """
    field = ExactField([*M, *extra])
    return sp.ImmutableMatrix(M.applyfunc(lambda e: field.expression(field.element(e))))


# Pairs of terms that one call of FLINT multiplies: some tenths of a second, which nothing can stop.
PIECE = 2_000_000


def product(a: Any, b: Any, limit: int, piece: int = PIECE) -> Any:
    """The product of two polynomials of one ring, in pieces where they are long.

    Raises
    ------
    FormulaTooLargeError
        When it has more than `limit` terms, or some of its pieces together have.
    """
    long, short = (a, b) if len(a) >= len(b) else (b, a)
    parts, size, ring = [long], max(1, piece // max(1, len(short))), a.context()
    if len(long) > size:
        items = list(long.to_dict().items())
        parts = [ring.from_dict(dict(items[i : i + size])) for i in range(0, len(items), size)]
    total = ring.constant(0)
    for part in parts:
        spend()
        total = total + part * short
        if len(total) > limit:
            raise FormulaTooLargeError.beyond(limit)
    return total


def _sum(field: ExactField, pairs: list[tuple[Any, Any]], limit: int) -> Any:
    """Sum of products."""
    total = field.ring.constant(0)
    for a, b in pairs:
        if not (a.is_zero() or b.is_zero()):
            total = total + product(a, b, limit)
    return total


# Terms of a compliance that is multiplied out, to free its wrench of a common factor.
_MULTIPLIED_OUT = 1000
# Of all numbers of an entry, for each allowed term: ten digits. Long ones count as several terms.
_BITS_A_TERM = 33

#: Entries (i, j) of a symmetric matrix, i <= j.
Upper = dict[tuple[int, int], Element]


def exact_leg(
    field: ExactField, W: list[list[Element]], A: list[list[Element]], n: int, limit: int
) -> tuple[Upper, list[list[Element]], list[list[Element]]]:
    """Eliminate A from [[A, W^T], [W, 0]] as in (15): what is left is -W A^-1 W^T.

    Bareiss' divisions keep every entry a minor, a polynomial; nothing is brought to a fraction
    before the end. Sines below a fraction bar would be multiplied by their conjugates at every
    step, which squares its length each time.

    `A`: (m, m) list of elements: W^T C W; `n`, `limit`: size of a wrench; most terms that an
    entry may have on the way.

    Returns
    -------
    The canonical fractions of K by row and column; wrenches of any length, conjugate to one
    another; and the compliance of each, as factors that are not multiplied out where that is long.

    Raises
    ------
    FormulaTooLargeError
        When an entry would have more.
    """
    m = len(W)
    plain = [_without_roots(field, w) for w in W]
    A = [[A[i][j] * plain[i][1] * plain[j][1] for j in range(m)] for i in range(m)]
    D = common_denominator(field, [x for row in A for x in row])
    upper = {(i, j): over(A[i][j], D) for i in range(m) for j in range(i, m)}
    upper |= {(i, m + j): plain[i][0][j].num for i in range(m) for j in range(n)}
    M = ExactMatrix.of_upper(field, m + n, upper, field.ring.constant(1))
    wrenches, compliances = [], []
    rest = list(range(m))
    # The remaining wrenches without energy are internal stresses between rigid branches.
    while rest := [i for i in rest if not M.entries[i][i].is_zero()]:
        # Coupled to few others first, then short ones.
        among = {i: sum(not M.entries[i][j].is_zero() for j in rest if j != i) for i in rest}
        pivot = min(rest, key=lambda i: (among[i], len(M.entries[i][i]) if among[i] else 0))
        rest.remove(pivot)
        before = M.denominator
        unit = [int(i == pivot) for i in range(m + n)]
        stage = eliminate_exactly(M, unit, limit)
        M = stage.after
        w = [field.fraction(x, field.one.num) for x in stage.u[m:]]
        factors = [field.fraction(stage.mu, D), field.fraction(before, field.one.num)]
        if all(x.is_zero for x in w):
            continue  # an internal stress of a loop, which does not act on the platform
        if factors[0].terms * factors[1].terms <= _MULTIPLIED_OUT:
            w, factor = _without_roots(field, w)
            factors = [factors[0] * factors[1] * factor * factor]
        wrenches.append(w)
        compliances.append(factors)
    K = {}
    for i in range(n):
        for j in range(i, n):
            entry = field.fraction(-M.entries[m + i][m + j] * D, M.denominator)
            coefficients = (*entry.num.coeffs(), *entry.den.coeffs())
            bits = sum(int(x).bit_length() for c in coefficients for x in (c.p, c.q))
            if entry.terms > limit or bits > _BITS_A_TERM * limit:
                raise FormulaTooLargeError.beyond(limit)
            K[i, j] = entry
    return K, wrenches, compliances


def _without_roots(field: ExactField, w: list[Element]) -> tuple[list[Element], Element]:
    """A wrench without the common factor of its entries, such as 1 / L, and that factor."""
    if all(x.is_zero for x in w):
        return w, field.one
    pivot = min((x for x in w if not x.is_zero), key=lambda x: x.terms)
    ratios = [x if x.is_zero else x / pivot for x in w]
    common = common_denominator(field, ratios)
    if not field.has_roots(common):
        scale = Element(field, common, field.one.den)
        return [x if x.is_zero else x * scale for x in ratios], scale / pivot
    # A sum of roots below does not cancel as a common factor: it is taken out as it is.
    common = common_denominator(field, w)
    above = [field.reduce(over(x, common)) for x in w]
    shared = common_factor(above)
    one = field.one.den
    plain = [Element(field, polynomial / shared, one) for polynomial in above]
    return plain, field.fraction(field.reduce(common), shared)


# Terms of a fraction that is factored: longer ones would take long, and would not be read.
_FACTORED = 100


@frozen
class ClosedSum:
    """K = sum of w w^T / c over the wrenches of all legs, every fraction canonical."""

    # (n x n). Fractions over one denominator are added; others stay apart, as their sum would be
    # long.
    K: sp.ImmutableMatrix
    legs: tuple[sp.ImmutableMatrix, ...]  # the part of each leg
    # wrenches of each leg (n x 1), scaled so that their entries are simple
    wrenches: tuple[tuple[sp.ImmutableMatrix, ...], ...]
    compliances: tuple[tuple[sp.Expr, ...], ...]  # the compliance of each wrench


def closed_sum(
    legs: Sequence[tuple[Sequence[Sequence[Any]], Sequence[Sequence[Any]]]],
    n: int,
    limit: int,
    of_all: float = math.inf,
) -> ClosedSum:
    """Add w w^T / c over the wrenches of all legs.

    `legs`: sequence of (W, A): SymPy expressions: m transmitted wrenches of n entries, and the
    compliance A = W^T C W (m x m) that they meet; `n`: size of a wrench; `limit`: most terms
    that an entry may have on the way; `of_all`: most terms of the entries of all legs together.

    Raises
    ------
    FormulaTooLargeError
        When there would be more.
    """
    # One field for all legs: a length that several of them have is one root.
    field = ExactField([x for W, A in legs for row in (*W, *A) for x in row])
    total: dict[tuple[int, int], list[Element]] = {}
    written, wrenches, compliances, terms = [], [], [], 0
    for leg in legs:
        W, A = ([[*map(field.element, row)] for row in rows] for rows in leg)
        K, of_leg, c_leg = exact_leg(field, W, A, n, limit)
        terms += sum(entry.terms for entry in K.values())
        if terms > of_all:
            raise FormulaTooLargeError.beyond(limit)
        for place, entry in K.items():
            # Fractions of one denominator are added.
            fractions = total.setdefault(place, [])
            summed = sum((f for f in fractions if f.den == entry.den), entry)
            if not entry.is_zero:
                others = (f for f in fractions if f.den != entry.den)
                total[place] = [*others, *[summed] * (not summed.is_zero)]
        written.append(_matrix(field, {place: [entry] for place, entry in K.items()}, n))
        w, c = (
            [[fraction_in_factors(field, x) for x in row] for row in x] for x in (of_leg, c_leg)
        )
        wrenches.append(tuple(map(sp.ImmutableMatrix, w)))
        compliances.append(tuple(sp.Mul(*factors) for factors in c))
    return ClosedSum(_matrix(field, total, n), tuple(written), tuple(wrenches), tuple(compliances))


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
    moved = [
        move_stiffness(np.array(sp.Matrix(K)), np.array(sp.Matrix(v)).ravel())
        for K, v in zip(K_legs, v_leg_end_to_ref, strict=True)
    ]
    return canonical(sp.Matrix(sum(moved[1:], moved[0])), extra)


def _matrix(
    field: ExactField, upper: dict[tuple[int, int], list[Element]], n: int
) -> sp.ImmutableMatrix:
    written = {
        place: sp.Add(*(fraction_in_factors(field, fraction) for fraction in fractions))
        for place, fractions in upper.items()
    }
    return sp.ImmutableMatrix(n, n, lambda i, j: written[min(i, j), max(i, j)])


def factored_fraction(expression: Any) -> Any:
    """An expression as one fraction, numerator and denominator factored where they are short."""
    for x in expression.args if expression.is_Mul else (expression,):
        base, exponent = x.as_base_exp()
        terms = [y.args if y.is_Mul else (sp.S.One, y) for y in base.args if base.is_Add]
        is_plain = all(len(y) == 2 and abs(y[0]) is sp.S.One and y[1].is_Symbol for y in terms)
        is_power = exponent.is_Integer and (base.is_Symbol or (bool(terms) and is_plain))
        if not x.is_Rational and (not is_power or starts_with_minus(base)):
            break
    else:  # powers of symbols, of a - b and of a + b: nothing cancels
        return expression
    field = shared_field(expression)
    return fraction_in_factors(field, field.element(expression))


def fraction_in_factors(field: ExactField, element: Element) -> sp.Expr:
    """A fraction, its numerator and denominator factored where they are short."""
    if element.terms > _FACTORED:
        return field.expression(element)
    return factors_of(field, element.num, element.den)
