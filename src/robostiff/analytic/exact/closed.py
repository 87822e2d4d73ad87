"""The recursion (15) in closed form: exact, fraction-free, canonical."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.exact.exact_matrix import ExactMatrix, common_denominator, over
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.exact.products import product, quotient
from robostiff.errors import InputError


@dataclass(frozen=True)
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
    u = [field.reduced(_sum(field, [(N[j][k], column[k]) for k in used], limit)) for j in range(n)]
    mu = field.reduced(_sum(field, [(column[k], u[k]) for k in used], limit))
    if mu.is_zero():
        if any(not entry.is_zero() for entry in u):
            raise InputError(
                "stiffness matrix",
                got="a joint whose motion causes forces but stores no energy, J^T K J = 0",
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
            upper[i, j] = field.reduced(entry)
    return ClosedStage(tuple(u), mu, below, _divided(field, n, upper, D, nu))


def canonical(M: Any, extra: Sequence[sp.Expr] = ()) -> sp.ImmutableMatrix:
    """The same matrix, every entry a canonical fraction of its symbols, cosines, sines and roots.

    Parameters
    ----------
    M : SymPy matrix
    extra : sequence of SymPy expressions
        Further expressions whose roots and angles shall be known.

    Examples
    --------
    >>> a = sp.Symbol("a")
    >>> canonical(sp.Matrix([[sp.sin(a) ** 2 + sp.cos(a) ** 2, 1 / sp.sqrt(2)]]))
    Matrix([[1, sqrt(2)/2]])
    """
    field = ExactField([*M, *extra])
    return sp.ImmutableMatrix(M.applyfunc(lambda e: field.expression(field.element(e))))


def _sum(field: ExactField, pairs: list[tuple[Any, Any]], limit: int) -> Any:
    """Sum of products."""
    total = field.ring.constant(0)
    for a, b in pairs:
        if not (a.is_zero() or b.is_zero()):
            total = total + product(a, b, limit)
    return total


def _divided(
    field: ExactField, n: int, upper: dict[tuple[int, int], Any], D: Any, mu: Any
) -> ExactMatrix:
    """Numerators over D mu, without common factors."""
    divided = {}
    for place, entry in upper.items():
        divided[place] = entry if D.is_one() else quotient(entry, D)
        if divided[place] is None:
            break
    else:
        return ExactMatrix.of_upper(field, n, divided, mu)
    denominator = field.reduced(D * mu)
    common = denominator
    for entry in upper.values():
        common = common.gcd(entry)
    upper = {place: entry / common for place, entry in upper.items()}
    return ExactMatrix.of_upper(field, n, upper, denominator / common)
