"""Identities decided at random points, and operations counted as SymPy counts them."""

import numpy as np
import sympy as sp

import robostiff as rs
from robostiff.analytic.exact.definition import count_of
from robostiff.analytic.exact.exact_points import ExactPoints
from robostiff.record import Record, cosine, sine


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


BAR = """robostiff: 1
name: tapered bar
source: made up
parameters: {d: 30 mm, e: 20 mm}
legs:
  - name: bar
    chain:
      - type: beam
        to: [300 mm, 0, 0]
        y_axis: z
        material: steel
        taper:
          - {share: 0.4, section: {rectangle: {width_y: d, height_z: e}}}
          - {share: 0.6, section: {rectangle: {width_y: e, height_z: d/2}}}
"""


def test_a_taper_of_rectangles_whose_sides_are_symbols(tmp_path):
    file = tmp_path / "bar.yaml"
    file.write_text(BAR)
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
