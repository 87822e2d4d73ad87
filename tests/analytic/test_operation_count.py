"""Operations of formulas against SymPy's own count."""

import numpy as np
import sympy as sp

from robostiff.analytic.exact.definition import count_of

x, y = sp.symbols("x y")
p = sp.Symbol("p", positive=True)
PARTS = [x, y, p, x + y, x - y, sp.Integer(2), sp.Integer(-3), sp.Rational(-1, 5), sp.pi]
PARTS += [sp.sqrt(3), sp.S.NegativeOne, sp.sqrt(2) / 2, sp.sqrt(p), 1 / sp.sqrt(p), sp.Float(-0.3)]


def drawn(draw: np.random.Generator, depth: int) -> sp.Expr:
    """Any formula of sums, products, powers and functions."""
    if depth == 0:
        return PARTS[draw.integers(len(PARTS))]
    a, b = drawn(draw, depth - 1), drawn(draw, depth - 1)
    kept = sp.Mul(sp.Rational(-1, 2), a + x * y, evaluate=False)
    forms = [a + b, a - b, a * b, a / (b + x * y), sp.sin(x + PARTS[draw.integers(5)]), kept]
    exponents = [2, -1, -2, sp.Rational(-3, 2)]
    forms += [(a + x * y) ** exponent for exponent in exponents]
    return forms[draw.integers(len(forms))]


def test_it_is_the_count_of_sympy():
    draw = np.random.default_rng(1)
    for _ in range(300):
        formula = drawn(draw, int(draw.integers(4)))
        assert count_of(formula) == formula.count_ops(), formula
