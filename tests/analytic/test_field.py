"""Exact arithmetic: the laws of a field, relations of sines and roots, certain zeros."""

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from robostiff.analytic import ExactField, canonical

a, b, phi = sp.symbols("a b phi", positive=True)
ROOT = sp.sqrt(a**2 + b**2)
LEAVES = [a, b, sp.sin(phi), sp.cos(phi), ROOT, sp.sqrt(3), sp.Rational(2, 3), sp.Integer(-1)]
FIELD = ExactField(LEAVES)
VALUES = {a: sp.Rational(7, 5), b: sp.Rational(9, 11), phi: sp.Rational(3, 7)}


def value(expression):
    return float(sp.sympify(expression).evalf(30, subs=VALUES))


formulas = st.recursive(
    st.sampled_from(LEAVES),
    lambda inner: st.tuples(st.sampled_from("+-*"), inner, inner).map(
        lambda t: {"+": t[1] + t[2], "-": t[1] - t[2], "*": t[1] * t[2]}[t[0]]
    ),
    max_leaves=8,
)


@given(formulas, formulas)
def test_arithmetic_of_elements_is_arithmetic_of_values(f, g):
    x, y = FIELD.element(f), FIELD.element(g)
    for exact, plain in ((x + y, f + g), (x - y, f - g), (x * y, f * g)):
        assert value(FIELD.expression(exact)) == pytest.approx(value(plain), rel=1e-11, abs=1e-11)
    if not y.is_zero:
        assert (x / y) * y == x


@given(formulas, formulas)
def test_equal_formulas_have_one_canonical_form(f, g):
    left = FIELD.element((f + g) ** 2)
    right = FIELD.element(f**2) + 2 * FIELD.element(f) * FIELD.element(g) + FIELD.element(g**2)
    assert (left.num, left.den) == (right.num, right.den)


def test_a_root_alone_is_brought_up_and_a_sum_with_a_root_stays_below():
    """The conjugate of a sum may vanish where the sum does not."""
    alone = FIELD.element(1 / (ROOT * sp.sin(phi) * (1 + sp.sqrt(3))))
    below = FIELD.polynomial_expression(alone.den)
    assert not below.has(sp.sin)
    assert not below.atoms(sp.Pow) & {ROOT, sp.sqrt(3)}
    total = FIELD.element(1 / (ROOT + a))
    assert FIELD.expression(total) == 1 / (a + ROOT)
    assert FIELD.element(FIELD.expression(total) * (ROOT + a) - 1).is_zero


@pytest.mark.parametrize(
    "zero",
    [
        sp.sin(phi) ** 2 + sp.cos(phi) ** 2 - 1,
        sp.sin(2 * phi) - 2 * sp.sin(phi) * sp.cos(phi),
        sp.sin(phi + a) - sp.sin(phi) * sp.cos(a) - sp.cos(phi) * sp.sin(a),
        ROOT**2 - a**2 - b**2,
        1 / (ROOT - a) - (ROOT + a) / b**2,
        sp.tan(phi) * sp.cos(phi) - sp.sin(phi),
        sp.cos(sp.pi / 6) - sp.sqrt(3) / 2,
        sp.sin(phi) - 2 * sp.sin(phi / 2) * sp.cos(phi / 2),
        sp.cos(phi) - 4 * sp.cos(phi / 3) ** 3 + 3 * sp.cos(phi / 3),
        sp.cos(3 * phi / 2) - sp.cos(phi) * sp.cos(phi / 2) + sp.sin(phi) * sp.sin(phi / 2),
    ],
)
def test_zero_is_recognised(zero):
    assert ExactField([zero, ROOT]).element(zero).is_zero


def test_floats_are_decimals():
    assert canonical(sp.Matrix([[0.1 + a, 0.25 * a]]))[0, 1] == a / 4
