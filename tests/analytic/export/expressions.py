"""Random expressions of the vocabulary."""

import sympy as sp
from hypothesis import strategies as st

X = sp.Symbol("x", positive=True)
Y = sp.Symbol("y", real=True)
SYMBOLS = (X, Y, sp.Symbol("mu_1"), sp.Symbol("n", integer=True, nonnegative=True))

leaves = st.one_of(
    st.sampled_from(SYMBOLS),
    st.integers(-40, 40).map(sp.Integer),
    st.fractions(max_denominator=9, min_value=-5, max_value=5).map(
        lambda f: sp.Rational(f.numerator, f.denominator)
    ),
    # Products of smaller ones are no doubles, and refused.
    st.floats(-3, 3).filter(lambda x: x == 0 or abs(x) > 1e-9).map(sp.Float),
    st.sampled_from([sp.pi, sp.E]),
)


def _larger(smaller):
    pairs = st.tuples(smaller, smaller)
    return st.one_of(
        pairs.map(lambda ab: ab[0] + ab[1]),
        pairs.map(lambda ab: ab[0] * ab[1]),
        pairs.map(lambda ab: sp.Mul(*ab, evaluate=False)),
        smaller.map(lambda e: e**2),
        smaller.map(lambda e: 1 / (e**2 + 1)),
        smaller.map(lambda e: sp.sqrt(e**2 + sp.Rational(1, 3))),
        smaller.map(sp.sin),
        smaller.map(sp.cos),
        smaller.map(lambda e: sp.atan2(e, 3)),
        smaller.map(sp.Abs),
    )


expressions = st.recursive(leaves, _larger, max_leaves=12).filter(
    lambda e: not e.has(sp.zoo, sp.nan, sp.oo, sp.I, sp.re, sp.im, sp.arg, sp.sign)
)
