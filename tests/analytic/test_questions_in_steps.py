"""Questions about derivations in steps, series in a symbol, and the check of all robots."""

import sys

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Definition, decoupling_conditions, free_motion_formulas, rank_formula
from robostiff.analytic.exact.definition import different_entries
from robostiff.analytic.exact.exact_points import matrix_value
from tests.analytic.formulas import derived
from tests.project.shown_output import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))
from derivations_of_robots import hidden_zeros, random_places, row_of_robot, wasted  # pyright: ignore[reportMissingImports]

from tests.files import FILES

k, x, a = sp.symbols("k x a", positive=True)


@pytest.fixture(scope="module")
def planar():
    return derived("3-rpr", rs.AtSymbols())


@pytest.fixture(scope="module")
def turned():
    pose = rs.AtCoordinates({"gamma": sp.Symbol("g")})
    return rs.derive("gough-stewart-a", symbols=("k",), pose=pose)


def test_rank_in_steps_is_that_in_numbers(planar, turned):
    assert rank_formula(planar).rank == 3
    assert free_motion_formulas(planar) == ()
    K = turned.lambdify()(**{s.name: 0.3 if s.name == "g" else 1.0 for s in turned.symbols})
    assert rank_formula(turned).rank == np.linalg.matrix_rank(K, tol=1e-9)
    with pytest.raises(rs.InputError, match="rank"):
        rank_formula(planar.subs({"gamma": 0}))


def _rank_at(derivation, values):
    """Rank of K, rotations at 1 m; a singular value is zero where it is below 1e-9 of the first."""
    K = matrix_value(
        derivation.K, {s: values[s.name] for s in derivation.symbols}, derivation.definitions
    )
    return np.linalg.matrix_rank(K, tol=1e-9 * np.linalg.norm(K, 2))


def test_a_turn_by_a_right_angle_is_singular():
    """Fichter's singularity, found as a factor of the determinant in steps."""
    g = sp.Symbol("g", real=True)
    turned = rs.derive("gough-stewart-b", pose=rs.AtCoordinates({"gamma": g}))
    found = rank_formula(turned)
    assert set(found.allowed) == {sp.cos(g)}
    assert {s.name for s in found.exceptions if s.is_Symbol} == {"R", "h", "k", "r"}
    values = {"R": 0.5, "h": 0.7, "k": 1e8, "r": 0.3}
    assert _rank_at(turned, values | {"g": 0.4}) == 6
    assert _rank_at(turned, values | {"g": np.pi / 2}) == 5


def test_a_platform_that_is_parallel_to_its_base_has_lost_rank():
    general = derived("gough-stewart-a", rs.AtSymbols())
    found = rank_formula(general)
    (locus,) = found.allowed
    tilted = sp.cos(sp.Symbol("alpha", real=True)) * sp.cos(sp.Symbol("beta", real=True)) - 1
    assert (found.rank, locus) == (5, tilted)
    values = {s.name: 0.2 for s in general.symbols} | {"R": 0.5, "z": 0.7, "k": 1e8}
    assert _rank_at(general, values) == 5
    assert _rank_at(general, values | {"alpha": 0.0, "beta": 0.0}) == 3


def test_the_locus_at_a_general_pose_is_where_the_rank_drops():
    general = derived("gough-stewart-b", rs.AtSymbols())
    (locus,) = rank_formula(general).allowed
    random = np.random.default_rng(3)
    for _ in range(3):
        values = {s.name: random.uniform(0.2, 1.2) for s in general.symbols}
        x = next(s for s in locus.free_symbols if s.name == "x")
        put_in = {s: values[s.name] for s in locus.free_symbols if s != x}
        line = np.array(sp.Poly(locus.xreplace(put_in), x).all_coeffs(), dtype=float)
        for root in np.roots(line)[np.isreal(np.roots(line))].real:
            assert _rank_at(general, values | {"x": root}) == 5
        assert _rank_at(general, values) == 6


def test_a_locus_that_is_too_long_is_said_to_be():
    found = rank_formula(rs.derive("hexaglide", symbols=("k",), pose=rs.AtSymbols()))
    assert (found.rank, found.exceptions) == (6, ())
    assert "too long" in found.remark


def test_self_stresses_of_a_frame_are_no_wrenches_of_the_formula():
    # Their zeros made the rank a failure of the singular values.
    path = FILES / "portal.yaml"
    formula = rs.derive(path, form=rs.Steps())
    assert not any(w.is_zero_matrix for leg in formula.legs for w in leg.wrenches)
    K = rs.stiffness(rs.load(path)).K
    own = formula.lambdify()(w=0.4, h=1.5, l=0.8)
    np.testing.assert_allclose(own, K, atol=1e-9 * K.max())
    found = rank_formula(formula)
    assert found.rank == 3
    # K_yy stays regular where its two compliances are equal, which was listed as an exception.
    assert found.exceptions == ()
    assert "hidden" in found.remark


@pytest.mark.parametrize("coordinate", ["y", "x", "gamma"])
def test_decoupling_in_steps_is_that_of_the_closed_form(coordinate):
    pose = rs.AtCoordinates({coordinate: sp.Symbol("s", real=True)})
    steps, closed = (rs.derive("3-rpr", pose=pose, form=form) for form in (rs.Steps(), rs.Closed()))
    assert not steps.is_closed
    assert closed.is_closed
    assert set(decoupling_conditions(steps)) == set(decoupling_conditions(closed))


@pytest.mark.parametrize("name", ["3-rpr", "3-prs", "tripteron"])
def test_formulas_at_a_symbolic_pose_have_no_waste(name):
    row, derivation = row_of_robot(name, "symbolic", 6)
    assert derivation is not None
    assert row.defects == ()
    assert row.error < 1e-11
    assert row.sets == 6


@pytest.mark.parametrize("name", ["h4", "hexapod", "delta", "3-rps"])
def test_no_step_is_zero_or_a_copy_and_zeros_are_zeros(name):
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, form=rs.Steps())
    values, K = random_places(robot, "home", 4)
    entries = [x for x in different_entries(derivation.K) if not (x.is_Symbol or (-x).is_Symbol)]
    of_K = [Definition(sp.Dummy(), x) for x in entries]
    assert wasted([*derivation.definitions, *of_K], values) == []
    assert hidden_zeros(derivation.K, K) == []


def test_waste_is_found():
    names = sp.symbols("t_1 t_2 t_3 t_4")
    expressions = (x * a, x + a - (a + x) * 1, -x * a + 0, sp.sin(x) ** 2 + sp.cos(x) ** 2 - 1)
    definitions = [Definition(s, e) for s, e in zip(names, expressions, strict=True)]
    values = {"x": np.array([0.3, 0.7]), "a": np.array([2.0, 5.0])}
    assert wasted(definitions[::2], values) == ["t_3 is a copy of t_1"]
    assert wasted(definitions[3:], values) == ["t_4 is zero"]
    K = np.array([np.diag([1.0, 1.0, 0.0])] * 2)
    formula = sp.ImmutableMatrix(3, 3, lambda i, j: x if i == j or (i, j) == (0, 1) else 0)
    assert hidden_zeros(formula, K) == [
        "K12 is zero, and is written x",
        "K33 is zero, and is written x",
    ]
