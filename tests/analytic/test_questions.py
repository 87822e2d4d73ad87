"""Ranks, free motions and decoupling as formulas."""

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import (
    FormulaTooLargeError,
    canonical,
    decoupling_conditions,
    fixed_point_formula,
    free_motion_formulas,
    rank_formula,
)
from tests.analytic.formulas import CASE_A, CASE_B, K11, L_A, L_B, R, derived, h, r, stewart


def rank_at(K, values):
    M = np.array(K.evalf(30, subs=values), dtype=float)
    return np.linalg.matrix_rank(M, tol=1e-9 * max(np.abs(M).max(), 1e-9))


@pytest.fixture(scope="module")
def case_a():
    return stewart(*CASE_A, L_A)


@pytest.fixture(scope="module")
def case_b():
    return stewart(*CASE_B, L_B)


def test_case_a_has_rank_3_but_where_it_is_flat(case_a):
    formula = rank_formula(case_a)
    assert formula.rank == 3
    assert set(formula.exceptions) == {K11, h}
    assert formula.common_minor == K11**3 * h**2
    values = {K11: 2, R: 5, r: 2, h: 3}
    assert rank_at(case_a, values) == 3
    assert rank_at(case_a, {**values, h: 0}) < 3
    # No exception: neither a vertical prism nor a pointed platform loses rank.
    assert rank_at(case_a, {**values, r: 5}) == 3
    assert rank_at(case_a, {**values, r: 0}) == 3


def test_case_b_has_full_rank_and_its_determinant_has_the_exceptions(case_b):
    formula = rank_formula(case_b)
    assert formula.rank == 6
    assert set(formula.exceptions) == {K11, R, h, r}
    ratio = canonical(sp.Matrix([case_b.det(method="berkowitz") / formula.common_minor]))[0]
    assert sp.numer(sp.together(ratio)).is_number
    assert free_motion_formulas(case_b) == ()
    assert fixed_point_formula(case_b) is None


@pytest.mark.parametrize("symbol", [R, r, h])
def test_case_b_loses_rank_at_each_exception(case_b, symbol):
    values = {K11: 2, R: 5, r: 2, h: 3}
    assert rank_at(case_b, values) == 6
    assert rank_at(case_b, {**values, symbol: 0}) < 6


def test_case_b_decouples_at_twice_the_radius(case_a, case_b):
    assert set(decoupling_conditions(case_b)) == {K11, h, r, R - 2 * r}
    assert canonical(case_b.subs(R, 2 * r)[:3, 3:]) == sp.ImmutableMatrix(sp.zeros(3))
    assert R - r in decoupling_conditions(case_a)


def test_a_rank_that_does_not_end_is_refused():
    steps = derived("hexapod", rs.AtSymbols())
    with pytest.raises(FormulaTooLargeError, match=r"rank of a formula: got .*within 0.5 s"):
        rank_formula(steps.K, budget=0.5)


def test_a_length_that_vanishes_in_all_sums_of_names():
    """Rods of an H4 that lie flat, l = R + a, hold no height; their length in names is in sums."""
    names = ("R", "a", "d", "k", "l", "w")
    derivation = rs.derive("h4", symbols=names)
    R, a, l = (sp.Symbol(name, positive=True) for name in ("R", "a", "l"))
    found = rank_formula(derivation)
    assert found.allowed == (R + a - l,)
    assert R + a - l in decoupling_conditions(derivation)
    K = derivation.lambdify(*names)([0.2, 0.3], 0.2, 0.06, 2e4, 0.5, 0.08)
    rounding = 1e-9 * np.abs(K).max()
    assert [np.linalg.matrix_rank(own, tol=rounding) for own in K] == [6, 3]
    assert np.abs(K[0, :3, 3:]).max() > rounding > np.abs(K[1, :3, 3:]).max()


def test_rank_and_free_motion_of_a_long_closed_form_are_those_of_its_wrenches():
    # Both were refused: "an entry of more than 2000 terms on the way".
    file = Path(__file__).parent / "data" / "bent-arm.yaml"
    robot = rs.load(file, symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot)
    assert rank_formula(derivation).rank == 2
    (motion,) = free_motion_formulas(derivation)
    values = {x: robot.nominal[x.name] for x in motion.free_symbols}
    found = np.array(motion.subs(values), dtype=float).ravel()
    K = rs.stiffness(robot.numeric).K
    assert found[2] == 1
    assert np.abs(K @ found).max() < 1e-10 * np.abs(K).max()


@pytest.mark.parametrize("name", ["t3r1", "agile-eye", "orthoglide"])
def test_values_of_stiffnesses_change_no_locus(name):
    """Written out, K named loci that no robot reaches, in numbers of a hundred digits."""
    derivation = rs.derive(rs.load(name, symbols=rs.ALL_PARAMETERS))
    k = next(x for x in derivation.symbols if x.name == "k")
    before, after = rank_formula(derivation), rank_formula(derivation.subs({"k": 1e8}))
    assert after.rank == before.rank == 6
    assert set(after.exceptions) == {*before.exceptions} - {k}
    assert after.allowed == before.allowed == ()
    assert name != "agile-eye" or before.common_minor == k**3


def test_a_length_of_zero_keeps_the_loci_short():
    """They had 295,851 characters."""
    derivation = rs.derive(rs.load("3-rps", symbols=rs.ALL_PARAMETERS)).subs({"r": 0})
    found = rank_formula(derivation)
    K = derivation.lambdify()(R=0.3, cylinder=0.02, h=0.5, k=2e6)
    assert found.rank == np.linalg.matrix_rank(K, tol=1e-9 * np.abs(K).max())
    assert set(map(str, found.exceptions)) == {"h", "k"}
