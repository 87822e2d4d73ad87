"""Exact arithmetic: the laws of a field, relations of sines and nested roots, certain zeros."""

import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st

from robostiff.analytic import ExactField, canonical

a, b, c, phi = sp.symbols("a b c phi", positive=True)
s, t = sp.symbols("s t")
ROOT = sp.sqrt(a**2 + b**2)
LEAVES = [a, b, sp.sin(phi), sp.cos(phi), ROOT, sp.sqrt(3), sp.Rational(2, 3), sp.Integer(-1)]
FIELD = ExactField(LEAVES)
VALUES = {a: sp.Rational(7, 5), b: sp.Rational(9, 11), phi: sp.Rational(3, 7)}
VALUES |= {c: sp.Rational(3, 13)}


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
        sp.sqrt(a / (b + c)) - sp.sqrt(a * b + a * c) / (b + c),
        sp.sqrt(6) - sp.sqrt(2) * sp.sqrt(3),
        sp.sqrt(a**2 + 2 * a * b + b**2) - a - b,
        sp.sqrt((a - b) ** 2 + c**2) - sp.sqrt(sp.expand((a - b) ** 2 + c**2)),
        sp.sqrt(3 + 2 * sp.sqrt(2)) - 1 - sp.sqrt(2),
        sp.sqrt(2 * a + 2 * b) - sp.sqrt(2) * sp.sqrt(a + b),
        sp.sqrt(a**2 * b + a**2 * c) - a * sp.sqrt(b + c),
        sp.sqrt(s / t) ** 2 - s / t,
        sp.sqrt(sp.sqrt(a) + b) ** 4 - a - 2 * b * sp.sqrt(a) - b**2,
    ],
    ids=str,
)
def test_zero_is_recognised(zero):
    assert ExactField([zero, ROOT, sp.sqrt(5)]).element(zero).is_zero


def test_floats_are_decimals():
    assert canonical(sp.Matrix([[0.1 + a, 0.25 * a]]))[0, 1] == a / 4


def number(expression):
    return sp.sympify(expression).evalf(40, subs=VALUES)


positive = st.recursive(
    st.sampled_from([a, b, c, sp.Integer(2), sp.Integer(3), sp.Rational(5, 6)]),
    lambda inner: st.tuples(st.sampled_from("+*/r"), inner, inner).map(
        lambda t: {"+": t[1] + t[2], "*": t[1] * t[2], "/": t[1] / t[2], "r": sp.sqrt(t[1])}[t[0]]
    ),
    max_leaves=5,
)
flat = positive.filter(lambda e: not any(p.exp.q == 2 for p in e.atoms(sp.Pow)))


@given(positive, positive)
def test_formulas_with_nested_roots_keep_their_values(f, g):
    formula = sp.sqrt(f) * g - sp.sqrt(g) / f
    field = ExactField([formula])
    back = field.expression(field.element(formula))
    assert abs(number(back) - number(formula)) < 1e-30 * (1 + abs(number(formula)))


@given(flat, flat)
def test_the_root_of_a_product_is_the_product_of_roots(f, g):
    zero = sp.sqrt(sp.expand(f * g)) - sp.sqrt(f) * sp.sqrt(g)
    assert ExactField([zero]).element(zero).is_zero


@given(flat, flat)
def test_what_is_not_zero_can_be_divided_by(f, g):
    root = sp.sqrt(f) + sp.sqrt(g) - 1
    assume(abs(number(root)) > 1e-20)
    field = ExactField([root])
    element = field.element(root)
    assert element * (1 / element) == field.one
    inverse = field.expression(1 / element)
    assert abs(number(inverse) * number(root) - 1) < 1e-25


def test_signs_that_are_not_known_are_not_guessed():
    # sqrt(s t) = sqrt(s / t) |t|, which is not sqrt(s / t) t.
    difference = sp.sqrt(s * t) - t * sp.sqrt(s / t)
    assert not ExactField([difference]).element(difference).is_zero


def test_roots_stay_as_they_were_given():
    root = sp.sqrt((a - b) ** 2 + 4 * c**2)
    assert canonical(sp.Matrix([[a / root]]))[0] == a * root / sp.expand(root**2)
