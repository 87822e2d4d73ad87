"""The recursion (15) in closed form: exact, fraction-free, canonical."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.field import ExactField
from robostiff.errors import InputError


class FormulaTooLargeError(InputError):
    """A closed form would exceed the number of terms that were allowed."""


@dataclass(frozen=True)
class ExactMatrix:
    """A symmetric matrix of polynomials over one common denominator.

    Attributes
    ----------
    field : ExactField
    entries : tuple of tuples
        Polynomials of the field, upper and lower part.
    denominator : polynomial
    """

    field: ExactField
    entries: tuple[tuple[Any, ...], ...]
    denominator: Any

    @classmethod
    def of(cls, field: ExactField, K: Any) -> ExactMatrix:
        """A SymPy matrix over its common denominator."""
        elements = [[field.element(K[i, j]) for j in range(K.cols)] for i in range(K.rows)]
        common = field.ring.constant(1)
        for row in elements:
            for element in row:
                common = common * element.den / common.gcd(element.den)
        entries = tuple(tuple(e.num * (common / e.den) for e in row) for row in elements)
        return cls(field, entries, common)

    @property
    def terms(self) -> int:
        """Number of terms of all numerators."""
        return sum(len(entry) for row in self.entries for entry in row)

    def expressions(self) -> sp.ImmutableMatrix:
        """The matrix in SymPy, every entry a canonical fraction."""
        field = self.field

        def written(entry: Any) -> sp.Expr:
            return field.expression(field.fraction(entry, self.denominator))

        return sp.ImmutableMatrix([[written(entry) for entry in row] for row in self.entries])


@dataclass(frozen=True)
class ClosedStage:
    """One step of the recursion (15) in exact arithmetic; mu is None for a redundant joint."""

    u: Any
    mu: sp.Expr
    after: ExactMatrix


def eliminate_exactly(K: ExactMatrix, J: Any, limit: int) -> ClosedStage:
    """Stiffness after one more passive joint, (N mu - u u^T) / (D mu) for K = N / D, eq. (15).

    As in Bareiss' elimination the previous denominator divides the new numerators exactly, so that
    no fractions pile up; where square roots or sines hide the factor, it is left in.

    Parameters
    ----------
    K : ExactMatrix
        Before.
    J : (n, 1) SymPy matrix
        Twist of the joint.
    limit : int
        Most terms that an entry may have.

    Raises
    ------
    FormulaTooLargeError
        Before memory does.
    """
    field, N, D = K.field, K.entries, K.denominator
    n = len(N)
    column = _polynomial_column(field, J)
    scale = field.element(column.scale)
    used = [k for k in range(n) if not column.entries[k].is_zero()]
    zero = field.ring.constant(0)
    u = [
        field.reduced(sum((_times(N[j][k], column.entries[k], limit) for k in used), zero))
        for j in range(n)
    ]
    mu = field.reduced(sum((_times(column.entries[k], u[k], limit) for k in used), zero))
    u_written = sp.ImmutableMatrix(
        [field.expression(field.fraction(entry, D) * scale) for entry in u]
    )
    if mu.is_zero():
        return ClosedStage(u_written, sp.Integer(0), K)
    mu_written = field.expression(field.fraction(mu, D) * scale * scale)
    upper: dict[tuple[int, int], Any] = {}
    for i in range(n):
        for j in range(i, n):
            entry = _times(N[i][j], mu, limit) - _times(u[i], u[j], limit)
            upper[i, j] = field.reduced(entry)
    return ClosedStage(u_written, mu_written, _divided(field, n, upper, D, mu))


@dataclass(frozen=True)
class _Column:
    entries: tuple[Any, ...]
    scale: sp.Expr


def _polynomial_column(field: ExactField, J: Any) -> _Column:
    """A joint twist as polynomials times a scale; the scale does not change what is free."""
    elements = [field.element(J[k, 0]) for k in range(J.rows)]
    common = field.ring.constant(1)
    for element in elements:
        common = common * element.den / common.gcd(element.den)
    entries = tuple(e.num * (common / e.den) for e in elements)
    return _Column(entries, 1 / field.polynomial_expression(common))


def _divided(
    field: ExactField, n: int, upper: dict[tuple[int, int], Any], D: Any, mu: Any
) -> ExactMatrix:
    """Numerators over D mu, with what divides both taken out."""
    divided = {}
    for place, entry in upper.items():
        quotient, rest = divmod(entry, D)
        if not rest.is_zero():
            break
        divided[place] = quotient
    else:
        upper, denominator = divided, mu
        return ExactMatrix(field, _symmetric(n, upper), denominator)
    denominator = field.reduced(D * mu)
    common = denominator
    for entry in upper.values():
        common = common.gcd(entry)
    upper = {place: entry / common for place, entry in upper.items()}
    return ExactMatrix(field, _symmetric(n, upper), denominator / common)


def _symmetric(n: int, upper: dict[tuple[int, int], Any]) -> tuple[tuple[Any, ...], ...]:
    return tuple(tuple(upper[min(i, j), max(i, j)] for j in range(n)) for i in range(n))


def _times(a: Any, b: Any, limit: int) -> Any:
    """Product, refused beforehand when it could not stay within the limit."""
    if len(a) * len(b) > 50 * limit:
        raise _too_large(len(a) * len(b), limit)
    product = a * b
    if len(product) > limit:
        raise _too_large(len(product), limit)
    return product


def _too_large(terms: int, limit: int) -> FormulaTooLargeError:
    return FormulaTooLargeError(
        "closed form",
        got=f"an entry of up to {terms} terms",
        expected=f"at most {limit}",
        hint="nobody reads that: ask for the steps, form=Steps(), or raise Closed(limit=...)",
    )


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
