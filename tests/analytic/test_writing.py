"""Expressions are SymPy's own: the same arguments in the same order."""

import flint
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from robostiff.analytic import derive_chain
from robostiff.analytic.exact.element import PolynomialWriter, made_of

x, y, p = sp.Symbol("x"), sp.Symbol("y"), sp.Symbol("x", positive=True)
PLAIN = [sp.sin(x), sp.cos(x), sp.cos(2), x, y, p, sp.Dummy("d")]
GENERATORS = [*PLAIN, sp.sqrt(x + 1), sp.sqrt(3), sp.sqrt(2), sp.sqrt(p)]


def ring(generators):
    names = [f"g{i}" for i in range(len(generators))]
    return flint.fmpq_mpoly_ctx.get(names, flint.Ordering.lex)


def polynomials(generators):
    powers = st.tuples(*[st.sampled_from([0, 0, 0, 1, 2])] * len(generators))
    numbers = st.sampled_from([1, -1, 2, -3]).flatmap(
        lambda p: st.sampled_from([1, 2, 5]).map(lambda q: flint.fmpq(p, q))
    )
    return st.dictionaries(powers, numbers, max_size=7).map(ring(generators).from_dict)


def by_sympy(polynomial, generators):
    terms = []
    for powers, c in polynomial.terms():
        factors = [g**n for g, n in zip(generators, powers, strict=True)]
        terms.append(sp.Mul(sp.Rational(int(c.p), int(c.q)), *factors))
    return sp.Add(*terms)


def assert_same_tree(a, b):
    assert a == b
    assert type(a) is type(b)
    assert hash(a) == hash(b)
    assert len(a.args) == len(b.args)
    for left, right in zip(a.args, b.args, strict=True):
        assert_same_tree(left, right)


# One writer for all examples: what it knows from one must not disturb the next.
WRITERS = {len(g): PolynomialWriter(g) for g in (PLAIN, GENERATORS)}


@given(polynomials(GENERATORS))
def test_roots_merge_as_in_sympy(polynomial):
    written = WRITERS[len(GENERATORS)].expressions([polynomial])[0]
    assert_same_tree(written, by_sympy(polynomial, GENERATORS))


a, b = sp.symbols("a b", real=True)


def test_roots_of_products_are_those_of_sympy():
    for radicand in (-(a - p) * (a + p), (p - 1) * (a + b + p), p**2 * (a - b), -p * (p + 1)):
        assert_same_tree(made_of(sp.sqrt(x), (radicand, sp.S.Half)), sp.sqrt(radicand))


def test_a_derivation_survives_being_rebuilt_by_sympy():
    K0 = sp.Matrix(6, 6, lambda i, j: sp.Symbol(f"K{min(i, j) + 1}{max(i, j) + 1}"))
    L = sp.Symbol("L")
    derivation = derive_chain(K0, {"z": [0, 0, 0, 0, 0, 1], "y+": [0, 0, -L, 0, 1, 0]})
    for entry in derivation.K:
        assert_same_tree(entry, entry.func(*entry.args) if entry.args else entry)
        assert_same_tree(entry, sp.sympify(str(entry)))
