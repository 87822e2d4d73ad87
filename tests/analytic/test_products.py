"""Products in pieces are products, and quotients undo them."""

import flint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.closed import product
from robostiff.analytic.exact.field import quotient

RING = flint.fmpq_mpoly_ctx.get(["x", "y", "z"], flint.Ordering.lex)
X, Y, Z = RING.gens()

polynomials = st.dictionaries(
    st.tuples(*[st.integers(0, 3)] * 3), st.integers(-5, 5).filter(bool), max_size=8
).map(RING.from_dict)
divisors = polynomials.filter(bool)


@given(polynomials, polynomials, st.integers(1, 12))
def test_a_product_in_pieces_is_the_product(a, b, piece):
    assert product(a, b, limit=100, piece=piece) == a * b


@given(polynomials, divisors)
def test_a_quotient_undoes_the_product(a, d):
    assert quotient(a * d, d) == a


@given(polynomials)
def test_what_does_not_divide_has_no_quotient(a):
    d = X * Y + 1
    assert quotient(a * d + Z, d) is None


def test_a_product_beyond_the_limit_is_given_up():
    long = sum((X**i * Y ** (7 * i % 11) for i in range(50)), RING.constant(0))
    for piece in (100, 10**6):
        with pytest.raises(FormulaTooLargeError, match="more than 60 terms"):
            product(long, long, limit=60, piece=piece)
