"""Eigenvalues of stiffness formulas, where they have a closed form."""

from __future__ import annotations

from typing import Any

import sympy as sp

from robostiff.analytic.elimination import determinant, null_space
from robostiff.analytic.factors import factored
from robostiff.analytic.field import ExactField
from robostiff.analytic.quadratic import quadratic_roots
from robostiff.analytic.spectrum import Eigenvalue, Eigenvalues, Part, Unsolved
from robostiff.errors import InputError
from robostiff.spatial import Space


def eigenvalue_formulas(
    K: Any, part: Part = Part.TRANSLATION, length: sp.Expr | None = None
) -> Eigenvalues:
    """Eigenvalues of a stiffness formula, from the factors of its characteristic polynomial.

    The matrix is first split into the smallest blocks that do not act on one another; their
    characteristic polynomials are factored over the rational numbers and the symbols, cosines,
    sines and roots of the entries. A cubic that does not factor is given as it is: Cardano's
    formula would be no answer.

    Parameters
    ----------
    K : (n, n) symmetric matrix of SymPy expressions, n = 6 or 3
    part : Part
        Translations alone, rotations alone, or all. Eigenvalues of the whole mix newtons by metre
        with newton metres wherever a translation is coupled with a rotation, so that a length is
        needed to compare them.
    length : SymPy expression, optional
        For `Part.WHOLE`: rotations are measured by the translation at this distance [m].

    Returns
    -------
    Eigenvalues

    Raises
    ------
    InputError
        When the matrix is not symmetric, or translations are coupled with rotations and no length
        is given.

    Examples
    --------
    >>> k, R, r, h, L = sp.symbols("k R r h L", positive=True)
    >>> K = 3 * k / L**2 * sp.diag((R - r) ** 2, (R - r) ** 2, 2 * h**2, 0, 0, 0)
    >>> found = eigenvalue_formulas(K)
    >>> [(e.value, e.multiplicity) for e in found.values]
    [(6*h**2*k/L**2, 1), (3*k*(R - r)**2/L**2, 2)]
    >>> found.answer
    'all 3 eigenvalues in closed form'
    """
    K = sp.ImmutableMatrix(K)
    M = _part_of(K, part, length)
    is_scaled = part is Part.WHOLE and length is not None
    symbol: Any = sp.Symbol(_free_name(M))
    field = ExactField([*M, symbol])
    elements = [[field.element(M[i, j]) for j in range(M.cols)] for i in range(M.rows)]
    unknown = field.element(symbol)
    place = field.generators.index(symbol)
    powers: dict[str, tuple[Any, int]] = {}
    for block in _blocks(M):
        rows = [[unknown * int(i == j) - elements[i][j] for j in block] for i in block]
        for factor, exponent in field.zeros(determinant(field, rows)).factor()[1]:
            if factor.degrees()[place]:
                known = powers.get(str(factor), (factor, 0))[1]
                powers[str(factor)] = (factor, known + int(exponent))
    values: list[Eigenvalue] = []
    unsolved: list[Unsolved] = []
    for factor, multiplicity in powers.values():
        degree = factor.degrees()[place]
        if degree > 2:
            unsolved.append(Unsolved(_collected(field, factor, symbol), degree, multiplicity))
            continue
        for value in quadratic_roots(field, factor, symbol):
            vectors = _eigenvectors(M, value)
            if is_scaled:
                vectors = tuple(_twist(vector, length) for vector in vectors)
            values.append(Eigenvalue(value, multiplicity, vectors))
    values.sort(key=lambda e: sp.default_sort_key(e.value))
    return Eigenvalues(tuple(values), tuple(unsolved), symbol)


def _part_of(K: Any, part: Part, length: Any) -> sp.ImmutableMatrix:
    space = Space.of_size(K.rows)
    t, n = space.translations, space.size
    if K.cols != n or any(
        K[i, j] != K[j, i] and sp.simplify(K[i, j] - K[j, i]) != 0
        for i in range(n)
        for j in range(i)
    ):
        raise InputError("stiffness matrix", got=f"{K.shape}", expected="a symmetric matrix")
    if part is Part.TRANSLATION:
        return K[:t, :t]
    if part is Part.ROTATION:
        return K[t:, t:]
    if length is not None:
        scale = sp.diag(*[1] * t, *[1 / sp.sympify(length)] * (n - t))
        return sp.ImmutableMatrix(scale * K * scale)
    if any(sp.simplify(entry) != 0 for entry in K[:t, t:]):
        raise InputError(
            "eigenvalues of the whole matrix",
            got="translations coupled with rotations, so that units differ",
            expected="a length by which rotations become translations",
            hint="give length=..., or ask for Part.TRANSLATION or Part.ROTATION",
        )
    return K


def _blocks(M: sp.ImmutableMatrix) -> list[list[int]]:
    """Coordinates that act on one another, block by block."""
    blocks: list[list[int]] = []
    for i in range(M.rows):
        joined = [block for block in blocks if any(M[i, j] != 0 for j in block)]
        blocks = [block for block in blocks if block not in joined]
        blocks.append(sorted([i, *(j for block in joined for j in block)]))
    return sorted(blocks)


def _eigenvectors(M: sp.ImmutableMatrix, value: Any) -> tuple[sp.ImmutableMatrix, ...]:
    """A basis of the null space of M - value I; a new root in the value is one of the field."""
    n = M.rows
    field = ExactField([*M, value])
    shift = field.element(value)
    rows = [[field.element(M[i, j]) - shift * int(i == j) for j in range(n)] for i in range(n)]
    return tuple(
        sp.ImmutableMatrix([factored(field, e.num) / factored(field, e.den) for e in vector])
        for vector in null_space(field, rows, n)
    )


def _twist(vector: sp.ImmutableMatrix, length: Any) -> sp.ImmutableMatrix:
    """A vector in which rotations were measured by the length, as a twist."""
    t = Space.of_size(vector.rows).translations
    entries: list[Any] = [vector[i, 0] for i in range(vector.rows)]
    if not any(entries[t:]):
        return vector
    moved = [sp.factor_terms(entry * length) for entry in entries[:t]]
    return sp.ImmutableMatrix([*moved, *entries[t:]])


def _collected(field: ExactField, factor: Any, symbol: Any) -> sp.Expr:
    """A polynomial by powers of the unknown, the highest with a plus sign where it can be."""
    written: Any = sp.collect(field.polynomial_expression(factor), symbol)
    leading = sp.Poly(written, symbol).LC()
    return (
        sp.collect(sp.expand(-written), symbol) if leading.could_extract_minus_sign() else written
    )


def _free_name(M: sp.ImmutableMatrix) -> str:
    taken, name = {symbol.name for symbol in M.free_symbols}, "lambda"
    while name in taken:
        name += "'"
    return name
