"""Trigonometry in its shortest form: equal everywhere, and never longer."""

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from robostiff.analytic.exact.trigonometry import shortest_trigonometry

a, b, R, r = sp.symbols("alpha beta R r", positive=True)
s, c, root = sp.sin(a), sp.cos(a), sp.sqrt(3)


@pytest.mark.parametrize(
    ("long", "short"),
    [
        (R**2 - 2 * root * R * r * s * c - 2 * R * r * c**2 + R * r + r**2, "law of cosines"),
        (2 * s * c - 2 * root * c**2 + root, -2 * sp.cos(2 * a + sp.pi / 6)),
        ((R + r) * (root * s - c) / 2, (R + r) * sp.sin(a - sp.pi / 6)),
        (R * s**2 + R * c**2, R),
        (R * s + r * c, R * s + r * c),
        (1 / (R * s**2 + r * c**2), 1 / (R * s**2 + r * c**2)),
        (R * s * sp.cos(b) + R * c * sp.sin(b), R * sp.sin(a + b)),
        (s + c, s + c),
        (R + r, R + r),
    ],
)
def test_a_person_would_write_it_so(long, short):
    if short == "law of cosines":
        short = R**2 - 2 * R * r * sp.sin(2 * a + sp.pi / 6) + r**2
    assert shortest_trigonometry(long) == short


NUMBERS = st.sampled_from([-2, -1, 0, 1, 2, root, -root, sp.Rational(1, 2), sp.sqrt(2)])
FACTORS = st.sampled_from([1, s, c, s * c, c**2, s**2, sp.sin(b), s * sp.cos(b), s * c**2])
SYMBOLS = st.sampled_from([sp.Integer(1), R, r, R * r])


@settings(max_examples=12)
@given(st.lists(st.tuples(NUMBERS, FACTORS, SYMBOLS), min_size=1, max_size=5))
def test_it_is_the_same_function_and_no_longer(terms):
    expression = sp.sqrt(2 * R + sp.Add(*(x * y * z for x, y, z in terms)) ** 2)
    found = shortest_trigonometry(expression)
    assert found.count_ops() <= expression.count_ops()
    for values in ({a: 0.3, b: 1.1, R: 1.7, r: 0.4}, {a: 2.9, b: -0.6, R: 0.8, r: 1.3}):
        difference = (found - expression).evalf(30, subs=values)
        assert abs(difference) < 1e-20
