"""Exact arithmetic: fields, nested roots, identities at random points, dimensions in numbers."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analytic import ExactField, canonical
from robostiff.analytic.exact.definition import count_of
from robostiff.analytic.exact.exact_points import ExactPoints
from robostiff.record import Record, cosine, sine
from tests.files import FILES

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


def record_of(*values):
    record = Record(dict(zip("xy", values, strict=False)))
    return record, [record.input(name) for name in record.inputs]


def test_what_is_equal_is_the_first_of_its_kind():
    record, (x, y) = record_of([0.7, 1.9], [0.4, 0.8])
    square = (x + y) * (x + y)
    expanded = x * x + 2 * x * y + y * y
    steps = [x.step, y.step, square.step, expanded.step, (y * y - x * x).step]
    same = ExactPoints(record).same([*steps, ((x - y) * (x + y)).step])
    assert same[expanded.step].step == square.step
    last = same[((x - y) * (x + y)).step]
    assert (last.step, last.factor) == ((y * y - x * x).step, -1)


def test_floats_that_agree_to_12_digits_are_not_equal():
    record, (x,) = record_of([0.7, 1.9])
    one = cosine(x) * cosine(x) + sine(x) * sine(x)
    near = x * (one + sp.Rational(1, 10**20))
    same = ExactPoints(record).same([x.step, one.step, near.step])
    assert same[one.step].step is None
    assert same[one.step].factor == 1
    assert same[near.step].step == near.step


def test_what_is_small_is_not_zero_and_not_the_same():
    record, (x,) = record_of([0.03, 0.02])
    power = x
    for _ in range(27):
        power = power * x  # 2e-43
    same = ExactPoints(record).same([x.step, power.step, (power * 2).step])
    assert [own.step for own in same.values()] == [x.step, power.step, (power * 2).step]
    points, square = ExactPoints(record), x * x
    points.same([x.step, power.step, square.step])
    assert not points.are_equal(power.step, (x.step, square.step), 1)


def test_a_taper_of_rectangles_whose_sides_are_symbols():
    file = FILES / "tapered-bar.yaml"
    formula = rs.derive(file, symbols=("d", "e"), form=rs.Steps()).lambdify()
    for values in ({"d": 0.027, "e": 0.019}, {"d": 0.01, "e": 0.05}):
        K = rs.stiffness(rs.load(file, values)).K
        np.testing.assert_allclose(formula(**values), K, rtol=1e-12, atol=1e-9 * np.abs(K).max())


def test_products_of_small_lengths_are_not_zero_and_not_equal():
    record, (x, y) = record_of([1.3e-6, 2.9e-6], [2.1e-6, 1.7e-6])
    small, other, product = x**8, y**8, x**4 * y**4
    points = ExactPoints(record)
    steps = [x.step, y.step, small.step, other.step, product.step]
    assert all(found.step == step for step, found in points.same(steps).items())
    assert not points.are_equal(product.step, (small.step, other.step), 1)


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


def test_without_symbols_zeros_are_exact():
    derivation = rs.derive("gough-stewart-b", symbols=())
    K = rs.stiffness(rs.load("gough-stewart-b")).K
    assert derivation.K.free_symbols == set()
    assert np.allclose(np.array(derivation.K, dtype=float), K, rtol=1e-12, atol=1e-6)
    zeros = np.array(derivation.K) == 0
    assert np.array_equal(zeros, np.abs(K) < 1e-3), "what is zero is 0, and nothing else"
    assert derivation.K[0, 0] == sp.Rational(3800 * 1500000, 83)


def test_roots_of_numbers_are_found_beside_symbols():
    """Sums of roots had grown without end, and the budget ended before the formula."""
    for name in ("3-puu", "gantry-tau"):
        assert rs.derive(name, symbols=("k",)).is_closed
