"""What a formula can do, it can do in steps, in names of its springs, and in vectors."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import compliance_steps, differentiate
from tests.analytic.export.programs import READERS, in_all_languages, in_python
from tests.analytic.formulas import in_numbers

VECTORS = ["gough-stewart-b", "delta", "3-rrr", "six-joint-arm"]


def place_of(robot, form):
    """Values of the symbols of a formula: nominal, and a pose near home."""
    home = dict(zip(("q1", "q2", "q3", "q4", "q5", "q6"), robot.legs[0].chain.home, strict=False))
    values = {}
    for i, s in enumerate(form.symbols):
        usual = robot.nominal.get(s.name, 0.03 + 0.01 * i + (home.get(s.name, 0.0)))
        values[s.name] = float(usual) if s.name != "z" else robot.numeric.home.p[2] + 0.02
    return values


@pytest.fixture(scope="module", params=VECTORS)
def levels(request):
    robot = rs.load(request.param, symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, pose=rs.AtSymbols())
    form = derivation.vectors or derivation.in_series
    return derivation, form, place_of(robot, derivation)


def test_vectors_are_functions_of_numbers_and_arrays(levels):
    derivation, form, values = levels
    assert form.symbols == derivation.symbols
    K = derivation.lambdify()(**values)
    np.testing.assert_allclose(form.lambdify()(**values), K, atol=1e-10 * np.max(np.abs(K)))
    np.testing.assert_allclose(in_numbers(form, values), K, atol=1e-10 * np.max(np.abs(K)))
    name = next(iter(values))
    many = values | {name: values[name] * np.array([0.99, 1.0, 1.01])}
    np.testing.assert_allclose(
        form.lambdify()(**many), derivation.lambdify()(**many), atol=1e-10 * np.max(np.abs(K))
    )


def test_values_in_vectors_leave_vectors(levels):
    _, form, values = levels
    name = next(iter(values))
    found = form.subs({name: values[name]})
    assert type(found) is type(form)
    assert name not in {s.name for s in found.symbols}
    K = in_numbers(form, values)
    np.testing.assert_allclose(in_numbers(found, values), K, atol=1e-12 * np.max(np.abs(K)))


def test_derivatives_of_vectors_are_those_of_steps(levels):
    derivation, form, values = levels
    for name in list(values)[:: max(1, len(values) // 3)]:
        _, dK = differentiate(form, name).lambdify()(**values)
        _, expected = differentiate(derivation, name).lambdify()(**values)
        np.testing.assert_allclose(dK, expected, atol=1e-9 * np.max(np.abs(expected)))


@in_all_languages
def test_vectors_are_programs_in_all_languages(levels, language, tmp_path):
    _, form, values = levels
    K, given = in_numbers(form, values), [values[s.name] for s in form.symbols]
    found = READERS[language](form, tmp_path)(*given)
    least = 1e-12 * np.max(np.abs(K)) if language == "c" else 1e-3
    np.testing.assert_allclose(found, K, rtol=1e-9, atol=least)


def test_vectors_have_a_compliance():
    form = rs.derive("gough-stewart-b", pose=rs.AtSymbols()).vectors
    assert form is not None
    robot = rs.load("gough-stewart-b", symbols=rs.ALL_PARAMETERS)
    values = place_of(robot, form)
    C = np.array(compliance_steps(form).substituted(values), dtype=float)
    np.testing.assert_allclose(C @ in_numbers(form, values), np.eye(6), atol=1e-9)


def test_names_of_springs_are_a_formula_of_their_own():
    robot = rs.load("3-prs", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot)
    named = derivation.named
    assert named is not None
    assert named.symbols == derivation.symbols
    values = {s.name: robot.nominal[s.name] for s in named.symbols}
    K = rs.stiffness(robot.numeric).K
    np.testing.assert_allclose(named.lambdify()(**values), K, atol=1e-9 * np.max(K))
    assert (
        named.subs({"l": sp.Rational(1, 2)}).conditions
        == derivation.subs({"l": sp.Rational(1, 2)}).conditions
    )
    _, dK = differentiate(named, "l").lambdify()(**values)
    _, expected = differentiate(derivation, "l").lambdify()(**values)
    np.testing.assert_allclose(dK, expected, atol=1e-9 * np.max(np.abs(expected)))


def test_compliances_are_programs_and_pages():
    soft = compliance_steps(rs.derive("3-prs"))
    assert "<math>" in soft._repr_html_()
    values = {s.name: v for s, v in zip(soft.symbols, (0.5, 1e7, 0.6, 0.2), strict=True)}
    C = np.array(soft.substituted(values), dtype=float)
    np.testing.assert_allclose(in_python(soft)(**values), C, rtol=1e-9, atol=1e-20)
