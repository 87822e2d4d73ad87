"""Sums of numbers with very many digits keep their value when they are scaled."""

import pytest
import sympy as sp

from robostiff.analytic.export.program import scaled

x, y = sp.symbols("x y", positive=True)
TEN = sp.Integer(10)


@pytest.mark.parametrize(
    "expression",
    [
        (TEN**400 * x + 3 * y) / (TEN**398 + y),
        sp.sqrt(TEN**401 * x + y) / (TEN**200 * y + 1),
        (TEN**-90 * x + TEN**-120) ** 2 / (x * TEN**-180),
        sp.sin((TEN**120 * x + y) / TEN**119) * sp.pi / 7,
        (TEN**300 * x + y) ** sp.Rational(1, 3) / TEN**99,
        sp.Integer(7) ** 6000 * x / sp.Integer(7) ** 5999,
    ],
)
def test_the_product_is_the_expression(expression):
    values = {x: sp.Rational(7, 5), y: sp.Rational(2, 3)}
    power, rest = scaled(expression, {})
    apart = (TEN**power * rest.subs(values) / expression.subs(values)).evalf(60, maxn=2000)
    assert abs(apart - 1) < sp.Float("1e-30")
    assert all(abs(n) < TEN**60 for n in rest.atoms(sp.Rational))
