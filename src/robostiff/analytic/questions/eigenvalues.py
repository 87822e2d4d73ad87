"""Eigenvalues of stiffness formulas, where they have a closed form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np
import sympy as sp
from sympy.polys.matrices import DomainMatrix

from robostiff.analytic.budget import BUDGET, within
from robostiff.analytic.derivation import Derivation
from robostiff.analytic.exact.definition import Definition, used_definitions
from robostiff.analytic.exact.exact_matrix import determinant, null_space
from robostiff.analytic.exact.factors import factored, quadratic_roots
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.exact.operation_count import count_of
from robostiff.analytic.questions.rank import closed_matrix, matrix_by_entries
from robostiff.errors import InputError
from robostiff.spatial import Space

_LONGEST = 150  # operations of all entries
_SEED = 17
_LARGEST = 10**15  # number in an entry, of whose root squares are taken out


class StiffnessPart(Enum):
    """The part of a stiffness matrix of which eigenvalues are computed."""

    TRANSLATION = "translation"
    """Force for translation, rotations held [N/m]."""
    ROTATION = "rotation"
    """Moment for rotation, translations held [N m/rad]."""
    WHOLE = "whole"
    """The whole matrix; rotations are multiplied by a length [N/m]."""


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
        Polynomial in `Eigenvalues.symbol` of which eigenvalues are the zeros; for a large block a
        determinant that is not written out.
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
    definitions : tuple of Definition
        What names stand for where the entries K11, K12, ... of the matrix are too long to be put
        in, and in steps; in the order in which they can be computed.

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> Eigenvalues((), (Unsolved(x**3 - x - 1, 3, 1),), x).answer
    'no closed form: irreducible factor of degree 3'
    """

    values: tuple[Eigenvalue, ...]
    unsolved: tuple[Unsolved, ...]
    symbol: sp.Symbol
    definitions: tuple[Definition, ...] = ()

    @property
    def answer(self) -> str:
        """A sentence: the number of closed forms, and the factors without one."""
        found = sum(value.multiplicity for value in self.values)
        missing = [f"irreducible factor of degree {factor.degree}" for factor in self.unsolved]
        if not missing:
            return f"all {found} eigenvalues in closed form"
        start = f"{found} eigenvalues in closed form; " if found else ""
        return f"{start}no closed form: {', '.join(missing)}"


def eigenvalue_formulas(
    K: Any,
    part: StiffnessPart = StiffnessPart.TRANSLATION,
    length: sp.Expr | None = None,
    budget: float | None = BUDGET,
) -> Eigenvalues:
    """Eigenvalues of a stiffness formula, from the factors of its characteristic polynomial.

    The matrix is first split into the smallest blocks that do not act on one another; their
    characteristic polynomials are factored over the rational numbers and the symbols, cosines,
    sines and roots of the entries. A cubic that does not factor is given as it is: Cardano's
    formula would not be useful.

    Parameters
    ----------
    K : (n, n) symmetric matrix of SymPy expressions, n = 6 or 3, or Derivation
        Of a derivation in steps, of one with named compliances, and of a long one, eigenvalues are
        formulas of its entries K11, K12, ..., which `Eigenvalues.definitions` has.
    part : StiffnessPart
        Translations alone, rotations alone, or all. Eigenvalues of the whole mix newtons by metre
        with newton metres wherever a translation is coupled with a rotation, so that a length is
        needed to compare them.
    length : SymPy expression, optional
        For `StiffnessPart.WHOLE`: rotations are measured by the translation at this distance [m].
    budget : float or None
        Seconds of computing; None for no limit.

    Returns
    -------
    Eigenvalues

    Raises
    ------
    InputError
        When the matrix is not symmetric, or translations are coupled with rotations and no length
        is given.
    OutOfTimeError
        When they are not found in time.

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
    in_steps = isinstance(K, Derivation) and not K.is_closed
    matrix = sp.ImmutableMatrix(K.K if in_steps else closed_matrix(K, "eigenvalues"))
    definitions: tuple[Definition, ...] = ()
    source = getattr(K, "named", None) or K
    springs = any(d.symbol.name.startswith("c_") for d in getattr(source, "definitions", ()))
    if in_steps or springs or _is_long(_part_of(matrix, part, length)):
        of_names = source.definitions if isinstance(K, Derivation) else ()
        matrix, definitions = matrix_by_entries(matrix if source is K else source.K, of_names)
    M = _part_of(sp.ImmutableMatrix(matrix), part, length)
    found = within(budget, lambda: _eigenvalues(M, part, length), "eigenvalues")
    results = [e.value for e in found.values] + [x.factor for x in found.unsolved]
    results += [vector for e in found.values for vector in e.vectors]
    return replace(found, definitions=used_definitions(definitions, results))


def _is_long(M: Any) -> bool:
    """Whether roots of its entries, of which squares have to be found, are too long to be read."""
    numbers = M.atoms(sp.Rational)
    if any(max(abs(int(x.p)), int(x.q)) > _LARGEST for x in numbers):
        return True
    return sum(count_of(entry) for entry in set(M)) > _LONGEST


def _eigenvalues(M: sp.ImmutableMatrix, part: StiffnessPart, length: Any) -> Eigenvalues:
    """From the factors of the characteristic polynomials of its blocks."""
    is_scaled = part is StiffnessPart.WHOLE and length is not None
    symbol: Any = sp.Symbol(_free_name(M))
    field = ExactField([*M, symbol])
    elements = [[field.element(M[i, j]) for j in range(M.cols)] for i in range(M.rows)]
    unknown = field.element(symbol)
    place = field.generators.index(symbol)
    powers: dict[str, tuple[Any, int]] = {}
    unsolved: list[Unsolved] = []
    for block in _blocks(M):
        if (degrees := _degrees_in_numbers(M, block)) and min(degrees) > 2:
            own = sp.eye(len(block)) * symbol - M.extract(block, block)
            unsolved.append(Unsolved(sp.Determinant(own), len(block), 1))
            continue
        rows = [[unknown * int(i == j) - elements[i][j] for j in block] for i in block]
        for factor, exponent in field.zeros(determinant(field, rows)).factor()[1]:
            if factor.degrees()[place]:
                known = powers.get(str(factor), (factor, 0))[1]
                powers[str(factor)] = (factor, known + int(exponent))
    multiplicities: dict[Any, int] = {}
    for factor, multiplicity in powers.values():
        degree = factor.degrees()[place]
        if degree > 2:
            unsolved.append(Unsolved(_collected(field, factor, symbol), degree, multiplicity))
            continue
        # A square of x - sqrt(a) is no power of a factor: its two zeros are one.
        for value in quadratic_roots(field, factor, symbol):
            multiplicities[value] = multiplicities.get(value, 0) + multiplicity
    values: list[Eigenvalue] = []
    for value in sorted(multiplicities, key=sp.default_sort_key):
        vectors = _eigenvectors(M, value)
        if is_scaled:
            vectors = tuple(_twist(vector, length) for vector in vectors)
        values.append(Eigenvalue(value, multiplicities[value], vectors))
    return Eigenvalues(tuple(values), tuple(unsolved), symbol)


def _degrees_in_numbers(M: sp.ImmutableMatrix, block: list[int]) -> list[int]:
    """Degrees of the factors of a large block's characteristic polynomial at random numbers.

    Factors in symbols have at least such degrees. Empty for a small block, and one with roots.
    """
    if len(block) < 4:
        return []
    random = np.random.default_rng(_SEED)
    values = {s: int(random.integers(1, 10**6)) for s in sorted(M.free_symbols, key=str)}
    numbers = M.extract(block, block).xreplace({s: sp.Integer(x) for s, x in values.items()})
    if not all(x.is_Rational for x in numbers):
        return []
    polynomial: Any = DomainMatrix.from_Matrix(numbers).convert_to(sp.QQ).charpoly()
    unknown = sp.Symbol("x")
    factors = sp.Poly(polynomial, unknown, domain=sp.QQ).factor_list()[1]
    return [int(factor.degree()) for factor, _ in factors]


def _part_of(K: Any, part: StiffnessPart, length: Any) -> sp.ImmutableMatrix:
    space = Space.of_size(K.rows)
    t, n = space.translations, space.size
    if K.cols != n or any(
        K[i, j] != K[j, i] and sp.simplify(K[i, j] - K[j, i]) != 0
        for i in range(n)
        for j in range(i)
    ):
        raise InputError("stiffness matrix", got=f"{K.shape}", expected="a symmetric matrix")
    if part is StiffnessPart.TRANSLATION:
        return K[:t, :t]
    if part is StiffnessPart.ROTATION:
        return K[t:, t:]
    if length is not None:
        scale = sp.diag(*[1] * t, *[1 / sp.sympify(length)] * (n - t))
        return sp.ImmutableMatrix(scale * K * scale)
    if any(sp.simplify(entry) != 0 for entry in K[:t, t:]):
        raise InputError(
            "eigenvalues of the whole matrix",
            got="translations coupled with rotations, so that units differ",
            expected="a length by which rotations become translations",
            hint="give length=..., or take StiffnessPart.TRANSLATION or .ROTATION",
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
        sp.ImmutableMatrix([factored(field, e.num, e.den) for e in vector])
        for vector in null_space(field, rows, n)
    )


def _twist(vector: sp.ImmutableMatrix, length: Any) -> sp.ImmutableMatrix:
    """A vector with rotations multiplied by the length, as a twist."""
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
