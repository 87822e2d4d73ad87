"""Eigenvalues in closed form, against the numerical ones."""

import numpy as np
import pytest
import sympy as sp

from robostiff.analytic import StiffnessPart, eigenvalue_formulas, snapshot_formula
from robostiff.errors import InputError
from tests.analytic.formulas import (
    CASE_A,
    CASE_B,
    K11,
    L_A,
    L_B,
    R,
    cubic_platform,
    h,
    r,
    stewart,
    three_puu,
)

ELL = sp.Symbol("ell", positive=True)


def check_against_numbers(K, part, length=None, seeds=(1, 2)):
    """Values with their multiplicities are those of the matrix, and vectors are eigenvectors."""
    found = eigenvalue_formulas(K, part, length)
    assert not found.unsolved
    t = 3 if K.rows == 6 else 2
    for seed in seeds:
        generator = np.random.default_rng(seed)
        symbols = sorted(K.free_symbols | ({length} if length is not None else set()), key=str)
        values = {s: sp.Rational(int(generator.integers(20, 90)), 37) for s in symbols}
        M = np.array(K.evalf(30, subs=values), dtype=float)
        rows = {StiffnessPart.TRANSLATION: slice(0, t), StiffnessPart.ROTATION: slice(t, None)}
        M = M[rows[part], rows[part]] if part in rows else M
        ell = float(values[length]) if length is not None else 1.0
        B = (
            np.diag([1.0] * t + [ell**2] * (len(M) - t))
            if part is StiffnessPart.WHOLE
            else np.eye(len(M))
        )
        scale = np.diag(1 / np.sqrt(np.diag(B)))
        expected = np.linalg.eigvalsh(scale @ M @ scale)
        numbers = []
        for e in found.values:
            value = float(e.value.evalf(30, subs=values))
            numbers += [value] * e.multiplicity
            assert len(e.vectors) == e.multiplicity
            for vector in e.vectors:
                v = np.array(vector.evalf(30, subs=values), dtype=float)[:, 0]
                residual = np.abs(M @ v - value * B @ v).max()
                assert residual <= 1e-10 * np.abs(M).max() * np.abs(v).max()
        np.testing.assert_allclose(sorted(numbers), expected, atol=1e-10 * expected.max())
    return found


@pytest.mark.parametrize("part", [StiffnessPart.TRANSLATION, StiffnessPart.ROTATION])
def test_equations_27_and_28(part):
    for angles, length in ((CASE_A, L_A), (CASE_B, L_B)):
        check_against_numbers(stewart(*angles, length), part)


def test_equation_27_by_hand():
    found = eigenvalue_formulas(stewart(*CASE_A, L_A))
    values = {e.multiplicity: e.value for e in found.values}
    assert sp.simplify(values[2] - 3 * K11 * (R - r) ** 2 / L_A**2) == 0
    assert sp.simplify(values[1] - 6 * K11 * h**2 / L_A**2) == 0


def test_whole_matrices_with_a_length():
    found = check_against_numbers(stewart(*CASE_A, L_A), StiffnessPart.WHOLE, ELL)
    assert {e.multiplicity: e.value for e in found.values}[3] == 0
    found = check_against_numbers(stewart(*CASE_B, L_B), StiffnessPart.WHOLE, ELL)
    assert sorted(e.multiplicity for e in found.values) == [1, 1, 2, 2]


def test_the_whole_needs_a_length_only_where_units_are_coupled():
    with pytest.raises(InputError, match="give length="):
        eigenvalue_formulas(stewart(*CASE_B, L_B), StiffnessPart.WHOLE)
    decoupled = stewart(*CASE_B, L_B).subs(R, 2 * r)
    found = check_against_numbers(sp.ImmutableMatrix(decoupled), StiffnessPart.WHOLE)
    assert sum(e.multiplicity for e in found.values) == 6


def test_cubic_stewart_platform_at_its_centre_is_isotropic():
    K = snapshot_formula(cubic_platform()).K
    k, a = sp.symbols("k a", positive=True)
    translation = check_against_numbers(K, StiffnessPart.TRANSLATION)
    assert [(e.value, e.multiplicity) for e in translation.values] == [(2 * k, 3)]
    check_against_numbers(K, StiffnessPart.ROTATION)
    assert K.free_symbols == {k, a}


def test_3_puu_at_its_centre():
    K = snapshot_formula(three_puu()).K
    found = check_against_numbers(K, StiffnessPart.TRANSLATION)
    assert sorted(e.multiplicity for e in found.values) == [1, 2]
    check_against_numbers(K, StiffnessPart.ROTATION)


def test_planar_parts():
    a, b, c, k = sp.symbols("a b c k", positive=True)
    K = sp.ImmutableMatrix([[a, b, 0], [b, c, 0], [0, 0, k]])
    check_against_numbers(K, StiffnessPart.TRANSLATION)
    assert eigenvalue_formulas(K, StiffnessPart.ROTATION).values[0].value == k
    found = check_against_numbers(K, StiffnessPart.WHOLE)
    assert len(found.values) == 3


def test_a_general_block_has_no_closed_form():
    K = sp.zeros(6)
    for i in range(3):
        for j in range(3):
            K[i, j] = sp.Symbol(f"k{min(i, j)}{max(i, j)}")
    found = eigenvalue_formulas(K)
    assert found.unsolved
    assert found.values == ()
    assert found.answer == "no closed form: irreducible factor of degree 3"
    # The factor is the characteristic polynomial, by Berkowitz' algorithm as well.
    charpoly = K[:3, :3].charpoly(found.symbol).as_expr()
    assert sp.expand(found.unsolved[0].factor ** 2 - charpoly**2) == 0


def test_roots_of_squared_sines_are_sines():
    a, k = sp.symbols("a k", positive=True)
    K = sp.zeros(3)
    K[0, 1] = K[1, 0] = k * sp.sin(a)
    found = eigenvalue_formulas(K)
    assert {e.value for e in found.values} == {k * sp.sin(a), -k * sp.sin(a)}


def test_a_symbol_called_lambda_is_no_clash():
    k = sp.Symbol("lambda")
    found = eigenvalue_formulas(sp.diag(k, k, k, 0, 0, 0))
    assert found.symbol != k
    assert found.values[0].value == k


def test_a_matrix_that_is_not_symmetric_is_refused():
    with pytest.raises(InputError, match="symmetric"):
        eigenvalue_formulas(sp.Matrix(3, 3, range(9)))


def test_two_equal_roots_are_one_value_of_multiplicity_two():
    """x^2 - 2 sqrt(a) x + a is a square, and no product of polynomials of a."""
    a, b = sp.symbols("a b", positive=True)
    Q = sp.Matrix([[2, -2, 1], [1, 2, 2], [2, 1, -2]]) / 3
    K = sp.diag(Q * sp.diag(sp.sqrt(a), sp.sqrt(a), b) * Q.T, sp.zeros(3))
    found = {e.value: e for e in eigenvalue_formulas(K).values}
    assert {value: e.multiplicity for value, e in found.items()} == {sp.sqrt(a): 2, b: 1}
    assert [len(found[value].vectors) for value in (sp.sqrt(a), b)] == [2, 1]
