"""Results behave like SymPy's: values by name, formulas, floats, quantities, arrays."""

import pickle

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import (
    Condition,
    Definition,
    Derivation,
    compliance_steps,
    derive_chain,
    derive_robot,
    differentiate,
    substitution,
)
from robostiff.analytic.export import derivation_text
from tests.analytic.formulas import in_numbers
from tests.files import FILES

R, r, h, k = sp.symbols("R r h k", positive=True)


def case_b(form=None, pose=None):
    return derive_robot(rs.load("gough-stewart-b", symbols=("R", "r", "h", "k")), pose, form)


@pytest.fixture(scope="module")
def closed():
    return case_b(rs.Closed())


@pytest.fixture(scope="module")
def steps():
    return case_b(rs.Steps())


def numbers(K):
    return np.array(K.tolist(), dtype=float)


def numeric_K(**values):
    return rs.stiffness(rs.load("gough-stewart-b", symbols=tuple(values)).substituted(values)).K


def assert_agrees(K, expected):
    np.testing.assert_allclose(K, expected, atol=1e-12 * np.max(np.abs(expected)), rtol=1e-12)


VALUES = {"R": 0.5, "r": 0.3, "h": 0.75, "k": 2e8}


@pytest.mark.parametrize("form", ["closed", "steps"])
def test_floats_by_name_and_by_symbol(form, request):
    derivation = request.getfixturevalue(form)
    expected = numeric_K(**VALUES)
    assert_agrees(numbers(derivation.substituted(VALUES)), expected)
    by_symbol = {sp.Symbol(name): value for name, value in VALUES.items()}
    assert_agrees(numbers(derivation.substituted(by_symbol)), expected)
    assert_agrees(numbers(derivation.subs(VALUES).K), expected)
    assert all(x.is_Float for x in derivation.substituted(VALUES) if x != 0)


def test_exact_values_stay_exact(closed):
    exact = {"R": sp.Rational(1, 2), "r": sp.Rational(3, 10), "h": sp.Rational(3, 4), "k": 1}
    K = closed.substituted(exact)
    assert K == closed.K.xreplace({s: sp.sympify(exact[s.name]) for s in closed.symbols})
    assert K[2, 2].is_Rational


@pytest.mark.parametrize("form", ["closed", "steps"])
def test_some_symbols_alone(form, request):
    derivation = request.getfixturevalue(form)
    some = derivation.subs({"R": 2 * sp.Symbol("r"), "h": 0.75})
    assert isinstance(some, rs.RobotDerivation)
    assert some.free_symbols == set(some.symbols) == {k, r}
    expected = numeric_K(R=0.6, r=0.3, h=0.75, k=2e8)
    assert_agrees(numbers(some.substituted({"r": 0.3, "k": 2e8})), expected)
    total = sp.zeros(6, 6)
    for leg in some.legs:
        for w, c in zip(leg.wrenches, leg.compliances, strict=True):
            total += w * w.T / c
    at = {r: 0.3, k: 2e8}
    for d in some.definitions:
        at[d.symbol] = d.expression.subs(at)
    assert_agrees(numbers(total.subs(at)), expected)


@pytest.mark.parametrize("system", ["cgs", "imperial"])
def test_quantities_of_any_system_are_converted(closed, system: str):
    """A registry may prefer centimetres or yards."""
    pint = pytest.importorskip("pint")
    Q = pint.UnitRegistry(system=system).Quantity
    given = {"R": Q(500, "mm"), "r": Q(30, "cm"), "h": Q(0.75, "m"), "k": Q(100, "MN/m")}
    expected = closed.lambdify()(R=0.5, r=0.3, h=0.75, k=1e8)
    assert numbers(closed.lambdify()(**given)) == pytest.approx(expected, rel=1e-12)
    assert numbers(closed.subs(given).K) == pytest.approx(expected, rel=1e-12)
    with pytest.raises(rs.InputError, match="a quantity of mechanics"):
        closed.subs({"h": Q(3, "ampere")})


def test_a_derivative_by_name_or_by_a_symbol_of_that_name(closed):
    """A symbol without the assumptions of the formula's own has another identity in SymPy."""
    expected = differentiate(closed, h).dK
    assert differentiate(closed, sp.Symbol("h")).dK == expected
    assert differentiate(closed, "h").dK == expected


def test_stages_of_a_chain_have_the_values_too():
    K = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"K{min(i, j) + 1}{max(i, j) + 1}"))
    for form in (rs.Closed(), rs.Steps()):
        chain = derive_chain(K, {"tip": [0, sp.Symbol("a"), 1], "slide": [1, 0, 0]}, form)
        put = chain.subs("a", sp.Rational(1, 2))
        assert put.stages[0].J == sp.Matrix([0, sp.Rational(1, 2), 1])
        assert sp.Symbol("a") not in put.free_symbols
        known = {s: sp.Integer(i * i + 3) for i, s in enumerate(put.symbols)}
        expected = chain.substituted({**known, sp.Symbol("a"): sp.Rational(1, 2)})
        assert put.substituted(known) == expected
        assert put.stages[-1].mu.free_symbols <= {
            *put.symbols,
            *(d.symbol for d in put.definitions),
        }


def test_floats_end_at_once_where_roots_of_constants_pile_up():
    """SymPy keeps 0.3 sqrt(3) a product, and evaluates such trees again at each sign test."""
    x = sp.Symbol("x", positive=True)
    steps, last = [], x
    for i in range(60):
        symbol = sp.Symbol(f"t_{i}")
        steps.append(Definition(symbol, sp.sqrt(sp.sqrt(3) * last + sp.sqrt(2) * last**2 / 5)))
        last = symbol
    K = sp.ImmutableMatrix(sp.diag(last, 0, 0))
    found = Derivation("K_C", K, (), K, tuple(steps)).substituted({"x": 0.3})[0, 0]
    value = 0.3
    for _ in range(60):
        value = np.sqrt(np.sqrt(3) * value + np.sqrt(2) * value**2 / 5)
    assert float(found) == pytest.approx(value, rel=1e-13)


def test_exact_values_that_would_grow_without_end_are_refused(monkeypatch):
    """At a tenth of the bound: to that itself SymPy takes seconds."""
    monkeypatch.setattr(substitution, "_LONGEST", substitution._LONGEST // 10)
    x = sp.Symbol("x", positive=True)
    steps, last = [], x
    for i in range(60):
        symbol = sp.Symbol(f"t_{i}")
        steps.append(Definition(symbol, sp.sqrt(sp.sqrt(3) * last + sp.sqrt(2) * last**2 / 5)))
        last = symbol
    K = sp.ImmutableMatrix(sp.diag(last, 0, 0))
    with pytest.raises(rs.InputError, match="write floats"):
        Derivation("K_C", K, (), K, tuple(steps)).substituted({"x": sp.Rational(3, 10)})


def test_floats_keep_their_digits_where_terms_cancel():
    x = sp.Symbol("x", real=True)
    K = sp.ImmutableMatrix(sp.diag((1 + x) ** 2 - 1 - 2 * x, 0, 0))
    assert float(Derivation("K", K, (), K).substituted({"x": 1e-10})[0, 0]) == pytest.approx(1e-20)


@pytest.mark.parametrize("form", ["closed", "steps"])
def test_symbols_without_values_stay_and_wrong_names_are_refused(form, request):
    derivation = request.getfixturevalue(form)
    written = derivation.substituted({})
    assert written.free_symbols == derivation.free_symbols
    some = derivation.substituted({"R": 0.5, "h": sp.Rational(3, 4)})
    assert some.free_symbols == {k, r}
    expected = numeric_K(**VALUES)
    at = {R: 0.5, r: 0.3, h: 0.75, k: 2e8}
    for K in (written.subs(at), some.subs(at), derivation.evalf(12, subs=VALUES)):
        assert_agrees(numbers(K.evalf()), expected)


def test_compliances_and_derivatives_have_the_same_names_for_it(steps):
    soft = compliance_steps(steps)
    C = soft.subs({"R": 0.5, "h": 0.75}).evalf(subs={"r": 0.3, "k": 2e8})
    np.testing.assert_allclose(numbers(C) @ numeric_K(**VALUES), np.eye(6), atol=1e-9)
    assert soft.free_symbols == differentiate(steps, "h").free_symbols == steps.free_symbols
    K, dK = differentiate(steps, "k").evalf(subs=VALUES)
    assert_agrees(numbers(dK), numbers(K) / VALUES["k"])


def test_conditions_are_checked():
    a = sp.Symbol("a", positive=True)
    K = sp.ImmutableMatrix(sp.diag(a, a, a))
    length = Condition("the beam has a positive length", 1 - a)
    derivation = rs.RobotDerivation("robot", K, (), K, conditions=(length,))
    assert derivation.substituted({"a": 0.5})[0, 0] == sp.Float(0.5)
    assert derivation.subs("a", 0.5).conditions == ()
    for method in (derivation.substituted, derivation.subs):
        with pytest.raises(rs.InputError, match="the beam has a positive length"):
            method({"a": 2})
    f = derivation.lambdify()
    np.testing.assert_array_equal(f.holds([0.5, 2.0]), [True, False])
    with pytest.raises(rs.NoAnswerError, match=r"1 of 2 points, first at \[1\]: a = 2"):
        f([0.5, 2.0])


@pytest.mark.parametrize("form", ["closed", "steps"])
def test_functions_of_arrays(form, request):
    derivation = request.getfixturevalue(form)
    f = derivation.lambdify("h", "R", "r", "k")
    heights = np.array([0.5, 0.75, 1.0])
    K = f(heights, 0.5, np.array([[0.2], [0.3]]), 1e8)
    assert K.shape == (2, 3, 6, 6)
    assert_agrees(K[1, 1], numeric_K(h=0.75, R=0.5, r=0.3, k=1e8))
    assert_agrees(f(0.75, k=1e8, r=0.3, R=0.5), K[1, 1])
    assert_agrees(pickle.loads(pickle.dumps(f))(0.75, 0.5, 0.3, 1e8), K[1, 1])  # noqa: S301


def test_values_without_the_sign_of_their_symbol_do_not_hold(closed):
    f = closed.lambdify("h", "R", "r", "k")
    np.testing.assert_array_equal(f.holds([0.5, -0.5], 0.5, 0.3, 1e8), [True, False])


def test_a_design_whose_legs_do_not_reach_is_refused_where_its_root_cancels():
    """K of a 3-RRR has the square of a root alone: beyond reach a negative stiffness."""
    formula = rs.derive("3-rrr", symbols=("R", "l1", "l2", "r"))
    apart = {"R": 0.33, "l1": 0.45, "l2": 0.16, "r": 0.07}  # l1 - l2 > R - r
    with pytest.raises(rs.InputError, match="a gap of"):
        rs.load("3-rrr", apart)
    for evaluate in (formula.substituted, formula.subs):
        with pytest.raises(rs.InputError, match=r"got a negative stiffness -.*expected values at"):
            evaluate(apart)


@pytest.mark.parametrize(("name", "put"), [("delta", {"R": 0.2}), ("six-joint-arm", {"q2": 0.3})])
def test_values_keep_a_formula_in_vectors(name, put):
    """One leg, the table and the sum were lost: K was printed in named steps."""
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    general = rs.derive(robot, pose=rs.AtSymbols())
    derivation = general.subs(put)
    form = derivation.vectors or derivation.in_series
    assert form is not None
    values = {x.name: robot.nominal.get(x.name, 0.05) for x in derivation.symbols}
    values |= {"z": 0.5} if "z" in values else {}
    expected = np.array(general.substituted(values | put), dtype=float)
    assert in_numbers(form, values) == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())
    assert not set(put) & {x.name for x in derivation.symbols}
    assert len(derivation_text(derivation)) <= len(derivation_text(general))


def test_a_symbol_may_have_a_shorter_name_than_its_parameter():
    plain = rs.derive("3-rps")
    short = rs.derive("3-rps", symbols={"cylinder": "c"})
    assert {str(s) for s in short.symbols} == {str(s) for s in plain.symbols} - {"cylinder"} | {"c"}
    assert short.meanings["c"] == plain.meanings["cylinder"]
    values = rs.load("3-rps", symbols=rs.ALL_PARAMETERS).nominal
    other = {"c" if name == "cylinder" else name: x for name, x in values.items()}
    found, expected = short.substituted(other), plain.substituted(values)
    assert np.allclose(np.array(found, float), np.array(expected, float), rtol=1e-12)
    text = derivation_text(short)
    assert "cylinder" not in text
    assert "c: length, 0.4 m in the model" in text
    assert "c_i: compliance of the leg under this wrench" in text  # c is the length


@pytest.mark.parametrize("x", [0.0, 0.1, -0.2, -0.9])
def test_the_size_of_a_length_that_is_zero_in_the_file_is_in_steps(x):
    # It was refused: "got 'Abs(500*x + 237)', expected a formula of ...".
    robot = rs.load(FILES / "slide-of-either-sign.yaml", symbols=rs.ALL_PARAMETERS)
    K = rs.derive(robot).lambdify()
    values = {**robot.nominal, "x": x}
    expected = rs.stiffness(robot.substituted(values)).K
    found = K(**{name: values[name] for name in K.arguments})
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
