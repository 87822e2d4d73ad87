"""Derivatives of formulas, against central differences and against each other."""

import pickle

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import (
    Definition,
    Derivation,
    Steps,
    canonical,
    derivative_formula,
    derive_chain,
    differentiate,
)
from tests.analytic.formulas import CASE_A, CASE_B, L_A, L_B, R, derived, h, r, stewart

L = sp.Symbol("L", positive=True)
FULL = sp.Matrix(6, 6, lambda i, j: sp.Symbol(f"K{min(i, j) + 1}{max(i, j) + 1}"))
JOINTS = {"Rz": [0, 0, 0, 0, 0, 1], "Ry+": [0, 0, -L, 0, 1, 0], "a": [0, L, L**2, 0, 1, 1]}


def values_for(derivation, seed=3):
    """A positive definite stiffness, so that the joints meet some, and a length."""
    generator = np.random.default_rng(seed)
    M = generator.normal(size=(6, 6))
    K = M @ M.T + 6 * np.eye(6)
    values = {FULL[i, j]: K[i, j] for i in range(6) for j in range(i, 6)} | {L: 0.7}
    return {s: sp.Rational(values[s]) for s in derivation.symbols}


def array(M):
    return np.array(M.evalf(30), dtype=float)


def central_difference(derivation, symbol, values):
    """Of order two with forty digits, so that nothing is lost by cancellation."""
    step = sp.Rational(1, 10**9)
    ends = [
        derivation.substituted({**values, symbol: values[symbol] + sign * step}) for sign in (1, -1)
    ]
    return array(((ends[0] - ends[1]) / (2 * step)).evalf(40))


def check(found, expected, size=None):
    size = np.abs(expected).max() if size is None else size
    assert size > 0
    assert np.abs(found - expected).max() <= 1e-9 * size


@pytest.mark.parametrize("symbol", [L, FULL[1, 1], FULL[0, 4]])
def test_steps_closed_form_and_differences_agree(symbol):
    joints = {name: JOINTS[name] for name in ("Rz", "Ry+")}
    steps, closed = derive_chain(FULL, joints, Steps()), derive_chain(FULL, joints)
    values = values_for(steps)
    expected = central_difference(steps, symbol, values)
    K, dK = differentiate(steps, symbol).substituted(values)
    check(array(dK), expected)
    assert array(K) == pytest.approx(array(steps.substituted(values)))
    check(array(differentiate(closed, symbol).substituted(values)[1]), expected)


@pytest.mark.parametrize("symbol", [R, h])
@pytest.mark.parametrize(("angles", "length"), [(CASE_A, L_A), (CASE_B, L_B)])
def test_equations_27_and_28(angles, length, symbol):
    K = stewart(*angles, length)
    by_sympy = canonical(K.diff(symbol))
    assert derivative_formula(K, symbol) == by_sympy


def test_one_further_definition_for_each_step_that_moves():
    steps = derive_chain(FULL, JOINTS, Steps())
    found = differentiate(steps, L)
    names = [d.symbol.name for d in found.definitions]
    assert [d for d in found.definitions if d in steps.definitions] == list(steps.definitions)
    assert len(names) <= 2 * len(steps.definitions)
    # The first joint does not know L: none of its steps has a derivative.
    assert not any(name.startswith("dK_1_") for name in names)
    assert names.index("dmu_2_dL") == names.index("mu_2") + 1
    assert found.name == "dK_C_dL"


def test_a_name_that_is_taken_gets_a_prime():
    x = sp.Symbol("x")
    taken = sp.Symbol("dy_dx")
    y = sp.Symbol("y")
    K = sp.ImmutableMatrix(sp.diag(y, taken, 0))
    found = differentiate(Derivation("K", K, (), K, (Definition(y, x**3 * taken),)), x)
    assert found.definitions[-1] == Definition(sp.Symbol("dy_dx'", real=True), 3 * taken * x**2)


def test_a_symbol_that_nothing_depends_on():
    found = differentiate(derive_chain(FULL, JOINTS, Steps()), sp.Symbol("unrelated"))
    assert found.dK == sp.ImmutableMatrix(sp.zeros(6, 6))
    assert found.definitions == found.derivation.definitions


def test_the_chain_rule_is_that_of_sympy():
    x, y, t, s = sp.symbols("x y t s", positive=True)
    steps = (Definition(t, x**2 * sp.sin(y * x)), Definition(s, sp.sqrt(t) / (x + y) ** 3))
    entries = (s**x * t, sp.atan2(t, s) + sp.cos(s) ** 2, 3 * y * t / s - y)
    K = sp.ImmutableMatrix(sp.diag(*entries))
    found = differentiate(Derivation("K", K, (), K, steps), x)
    at = {"x": sp.Float("0.7", 30), "y": sp.Float("1.3", 30)}
    _, dK = found.substituted(at)
    full = {}
    for d in steps:
        full[d.symbol] = d.expression.xreplace(full)
    for i, entry in enumerate(entries):
        wanted = sp.diff(entry.xreplace(full), x).subs({x: at["x"], y: at["y"]})
        assert abs(dK[i, i] - wanted) < 1e-20 * abs(wanted)


def in_numbers(matrix, values):
    return np.array(matrix.subs({s: values[s.name] for s in matrix.free_symbols}), dtype=float)


@pytest.mark.parametrize(("name", "by"), [("hexapod", "alpha"), ("delta", "a"), ("3-prs", "l")])
def test_the_derivative_of_a_sum_of_springs_is_not_multiplied_out(name, by):
    # That of a hexapod was refused as too long, that of a Delta had 98,580 operations.
    derivation = derived(name)
    found = differentiate(derivation, by)
    assert found.is_closed
    assert found.dK.free_symbols <= set(derivation.symbols)
    assert sum(map(sp.count_ops, found.dK)) < 2000
    nominal = rs.load(name, symbols=rs.ALL_PARAMETERS).nominal
    values = {s.name: nominal[s.name] for s in derivation.symbols}
    K, h = derivation.lambdify(), 1e-5 * nominal[by]
    difference = (K(**values | {by: values[by] + h}) - K(**values | {by: values[by] - h})) / (2 * h)
    written = in_numbers(found.dK, values)
    scale = np.abs(difference).max()
    assert written == pytest.approx(difference, abs=1e-7 * scale)
    assert found.lambdify()(**values)[1] == pytest.approx(written, abs=1e-12 * scale)


def test_the_derivative_of_a_root_is_in_lowest_terms():
    # (2*R - 2*r)/(2*L)
    K = sp.ImmutableMatrix(sp.diag(L, 0, 0))
    root = Definition(L, sp.sqrt((R - r) ** 2 + h**2))
    found = differentiate(Derivation("K_C", K, (), K, (root,)), R)
    assert found.definitions[1].expression == (R - r) / L


def test_a_derivative_is_pickled_and_keeps_its_names_when_values_are_put_in():
    whole = differentiate(derived("gough-stewart-b"), "h")
    again = pickle.loads(pickle.dumps(whole))  # noqa: S301
    assert again.dK == whole.dK
    at = whole.subs({"h": 0.75})
    assert "h" not in map(str, at.symbols)
    others = {str(s): 0.3 + 0.1 * i for i, s in enumerate(at.symbols)}
    both = zip(at.substituted(others), whole.substituted(others | {"h": 0.75}), strict=True)
    for found, expected in both:
        assert np.allclose(np.array(found, float), np.array(expected, float), rtol=1e-12)
