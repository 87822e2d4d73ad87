"""Square roots: quotients, products, squares, nested roots; checked against numbers."""

import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st

from robostiff.analytic import ExactField, canonical

a, b, c = sp.symbols("a b c", positive=True)
s, t = sp.symbols("s t")
VALUES = {a: sp.Rational(7, 5), b: sp.Rational(9, 11), c: sp.Rational(3, 13)}


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


@pytest.mark.parametrize(
    "zero",
    [
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
    assert ExactField([zero, sp.sqrt(5)]).element(zero).is_zero


def test_signs_that_are_not_known_are_not_guessed():
    # sqrt(s t) = sqrt(s / t) |t|, which is not sqrt(s / t) t.
    difference = sp.sqrt(s * t) - t * sp.sqrt(s / t)
    assert not ExactField([difference]).element(difference).is_zero


def test_roots_stay_as_they_were_given():
    root = sp.sqrt((a - b) ** 2 + 4 * c**2)
    assert canonical(sp.Matrix([[a / root]]))[0] == a * root / sp.expand(root**2)
