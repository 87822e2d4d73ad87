"""Small functions of formulas, each by an example that says what it does."""

import sympy as sp

from robostiff.analytic import Derivation
from robostiff.analytic.chain import rule_in_words
from robostiff.analytic.exact.element import quotient_of
from robostiff.analytic.exact.factors import bound_of_terms, completed_squares, product_of
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.exact.trigonometry import shortest_trigonometry
from robostiff.analytic.export import python_function
from robostiff.analytic.export.code import ascii_identifier, plain_text
from robostiff.analytic.export.entries import (
    NameParts,
    in_decimals,
    name_parts,
    ordered_terms,
    readable,
    without_lost_digits,
)
from robostiff.analytic.questions.rank import matrix_by_entries
from robostiff.analytic.springs.leg_springs import summed

x, y, k, a, b, R, r, h = sp.symbols("x y k a b R r h")


def test_rules_of_joints():
    about_z = sp.Matrix([0, 0, 0, 0, 0, 1])
    assert rule_in_words(about_z, redundant=False).endswith("(19), row and column 6 vanish")
    away = sp.Matrix([0, 0, -x, 0, 1, 0])
    assert "away from the reference point: quasi-t" in rule_in_words(away, redundant=False)


def test_springs_that_feel_the_same_stand_in_one_bracket():
    springs = [(y**2, x / k), (y**2, 1 / a)]
    found = summed([(1, 1 / a), *springs])
    assert str(found) == "y**2*(x/k + 1/a) + 1/a"


def test_quotients_terms_and_factors():
    assert quotient_of(x, 2 * y) == x / (2 * y)
    assert ordered_terms(1 - x**2 - y) == [1, -(x**2), -y]
    assert readable(R**2 - 2 * R * r + r**2) == (R - r) ** 2
    field = ExactField([R, r, h])
    product = product_of(field, (2 * R**2 - 2 * r**2) / (3 * R))
    assert (product.number, len(product.powers)) == (sp.Rational(2, 3), 3)
    squares, rest = completed_squares(field, field.element((R - r) ** 2 / 2 + h**2).num)
    assert [field.polynomial_expression(s) for s, _ in squares] == [R - r]
    assert field.polynomial_expression(rest) == h**2
    # A square that is longer than what it replaces does not take others with it.
    field = ExactField([R, r, h, a])
    squares, rest = completed_squares(field, field.element((h + a) ** 2 + R**2 - R * r + r**2).num)
    assert [field.polynomial_expression(s) for s, _ in squares] == [a + h]
    assert field.polynomial_expression(rest) == R**2 - R * r + r**2
    assert [bound_of_terms((a + b) ** n, 500) for n in (3, 30)] == [8, 501]


def test_names_and_digits():
    assert [ascii_identifier(name) for name in ("Δx'", "__x", "é", "")] == [
        "Deltax_",
        "v__x",
        "e",
        "v",
    ]
    assert plain_text('K "of"  a */ leg%') == "K of a / leg"
    K = sp.ImmutableMatrix(sp.diag(sp.Symbol("lambda"), 0, 0))
    source = python_function(Derivation("K", K, (), K, meanings={"lambda": "length"}))
    assert "    lambda_ : array_like\n        lambda of the formula, length\n" in source
    assert name_parts("K_1_13") == NameParts("K", ("1", "13"), 0)
    assert name_parts("a_ix").subscripts == ("i", "x")
    assert name_parts("x'_E").primes == 1
    third = sp.Rational(10**20 + 1, 3 * 10**20)
    assert str(in_decimals(3 * k / 10 + sp.sqrt(2) * third)) == "3*k/10 + 0.471404520791"
    tiny = sp.Rational(1, 3**40)
    assert without_lost_digits(sp.ImmutableMatrix([[2, tiny], [tiny, 3]]))[0, 1] == 0


def test_equal_entries_have_one_name():
    M, names = matrix_by_entries(sp.ImmutableMatrix([[k + a, b, 0], [b, k + a, 0], [0, 0, -b]]))
    assert M[0, 0] == M[1, 1] == names[0].symbol
    assert (M[2, 2], len(names)) == (-b, 1)


def test_sums_of_angles():
    c, s = sp.cos, sp.sin
    half = r * (sp.sqrt(3) * s(a) + c(a)) / 2
    assert shortest_trigonometry(half) == r * s(a + sp.pi / 6)
    assert shortest_trigonometry(1 / (c(a) * c(r) - s(a) * s(r))) == 1 / c(a + r)
