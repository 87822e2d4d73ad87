"""What is shown is what was derived: only the form of a formula may change."""

import re
from types import SimpleNamespace

import pytest
import sympy as sp
from hypothesis import given

import robostiff as rs
from robostiff.analytic import Definition, Derivation
from robostiff.analytic.export import (
    derivation_html,
    derivation_latex,
    derivation_markdown,
    derivation_text,
    derivation_typst,
)
from robostiff.analytic.export.entries import factored_matrix, in_decimals, readable
from robostiff.analytic.export.language import broken_lines, wrapped_formula
from robostiff.analytic.export.notation import Nomenclature
from robostiff.analytic.export.outline import outline_of
from robostiff.analytic.vectors.vector_expressions import names_in
from robostiff.errors import InputError
from tests.analytic.export.derivations import ALL
from tests.analytic.export.expressions import expressions
from tests.analytic.formulas import derived

R, r, h, phi, k = sp.symbols("R r h phi k", positive=True)


def value(expression):
    symbols = sorted(expression.free_symbols, key=str)
    values = {s: sp.Rational(i + 3, i + 5) for i, s in enumerate(symbols)}
    return complex(sp.N(expression.xreplace(values), 30))


@given(expressions)
def test_readable_is_the_same_value(expression):
    shown = readable(expression)
    assert shown.count_ops() <= expression.count_ops()
    assert value(shown - expression) == pytest.approx(0, abs=1e-20 + 1e-20 * abs(value(expression)))


@pytest.mark.parametrize("name", ALL)
def test_factor_times_matrix_is_the_matrix(name):
    K = ALL[name].K
    factor, rest = factored_matrix(K)
    for i in range(K.rows):
        for j in range(K.cols):
            expected = value(K[i, j])
            assert abs(value(factor * rest[i, j]) - expected) <= 1e-12 * abs(expected)


def test_a_factor_of_all_entries_leaves_angles_as_they_are():
    # The multiple angle of K_66 was written out, which made the factor look longer than none.
    named = rs.derive("hexapod").named
    assert named is not None
    factor, rest = factored_matrix(named.K)
    L, c = (sp.Symbol(name, positive=True) for name in ("L_a", "c_a"))
    alpha = sp.Symbol("alpha", real=True)
    assert factor == 3 / (L**2 * c)
    angle = next(d.symbol for d in named.definitions if d.expression == 2 * alpha + sp.pi / 6)
    assert rest[5, 5] == 2 * R**2 * r**2 * sp.cos(angle) ** 2


@pytest.mark.parametrize("name", ["delta", "3-prs"])
def test_sums_over_compliances_have_no_common_denominator(name):
    named = rs.derive(name).named
    assert named is not None
    K = named.K
    factor, rest = factored_matrix(K)
    assert factor == sp.Rational(3, 2)
    for i, j in ((0, 0), (2, 2), (3, 3), (5, 5)):
        assert sp.denom(rest[i, j]).free_symbols <= sp.denom(K[i, j]).free_symbols
        assert sp.simplify(factor * rest[i, j] - K[i, j]) == 0


def test_what_would_explode_is_left_as_it_is():
    symbols = sp.symbols("a:24")
    squares = sum(((i + 2) * s + sp.sin(s)) ** 2 for i, s in enumerate(symbols))
    assert readable(squares) == squares
    K = sp.ImmutableMatrix(sp.diag(squares, squares + 1, k))
    assert factored_matrix(K) == (1, K)


PLAIN = SimpleNamespace(write=str, opening="(", closing=")", slash="/", power="**{}")


@given(expressions)
def test_broken_lines_say_the_same(expression):
    symbols = {s.name: s for s in expression.free_symbols}
    for room in (3, 9, 30):
        written = " ".join(broken_lines(expression, PLAIN, room))
        # Factors stand side by side: "a b" is a product.
        product = re.sub(r"(?<=[\w)]) (?=[\w(])", "*", written)
        read = sp.sympify(product, locals=symbols)
        assert value(read) == pytest.approx(value(expression), rel=1e-9, abs=1e-9)


@given(expressions)
def test_wrapped_formula_says_the_same(expression):
    text = str(expression)
    for width in (12, 30, 88):
        lines = wrapped_formula(text, width, "K = ")
        assert "".join("".join(lines).split()) == "".join(f"K = {text}".split())
        assert all(line.startswith("    ") for line in lines[1:])


@pytest.mark.parametrize("name", ["3-rpr-beams", "delta"])
def test_a_robot_of_numbers_is_printed_in_numbers_that_a_person_reads(name):
    derivation = rs.derive(rs.load(name))
    text = derivation_text(derivation)
    assert max(map(len, re.findall(r"\d+", text))) <= 14
    assert not derivation.K.has(sp.Float)
    if name == "delta":  # what is the same in its digits is in no table
        assert "u_i = (d_i - crank_i v_i)/(4/5)" in text
        assert "crank_i = 7/20" in text


@pytest.mark.parametrize(
    "write",
    [derivation_text, derivation_latex, derivation_markdown, derivation_html, derivation_typst],
)
def test_no_term_of_a_long_sum_is_lost_between_its_lines(write):
    K = sp.ImmutableMatrix(sp.diag(sum(sp.Symbol(f"zz_{i}") ** 2 for i in range(40)), 0, 0))
    written = write(Derivation("K_C", K, (), K))
    assert written.count("zz") == 80  # in the formula, and in the nomenclature


def test_all_decimals_have_as_many_digits():
    derivation = rs.derive("gough-stewart-b").subs({"h": 1 / 3, "k": 1e8 / 7})
    for text in (derivation_text(derivation), derivation._repr_html_()):
        decimals = re.findall(r"\d+\.\d+", text)
        assert decimals
        assert max(len(x.replace(".", "").lstrip("0")) for x in decimals) <= 12


@pytest.mark.parametrize("pose", ["AtHome", "AtJoints", "AtSymbols"])
@pytest.mark.parametrize("name", ["3-rrr", "gantry-tau", "orthoglide", "turned-screws"])
def test_what_cancels_in_K_and_is_printed_has_its_meaning(name, pose):
    # The angle at which all legs begin stood in their wrenches, and nothing said what it is.
    try:
        derivation = derived(name, getattr(rs, pose)())
    except InputError:
        pytest.skip("no formula there")
    *blocks, last = outline_of(derivation)
    assert isinstance(last, Nomenclature)
    listed = {str(x) for names, _ in last.rows for x in names}
    assert names_in(blocks) & derivation.meanings.keys() <= listed


def test_a_pose_without_coordinates_is_home():
    where = derived("turned-screws", rs.AtSymbols()).where
    assert where == "in the home configuration"


def test_legs_that_begin_at_a_symbolic_angle_are_turns_of_one():
    text = derivation_text(derived("turned-screws"))
    assert "Turned about z by 120 degrees it is leg 2, leg2; about z by 240 degrees" in text


def test_what_a_wrench_takes_from_another_is_turned_as_a_whole():
    # It stood in products of the sines of both angles.
    named = derived("tapered-arm").named
    with_q1 = [d for d in named.definitions if d.expression.has(sp.Symbol("q1", real=True))]
    assert len(with_q1) == 1
    assert str(with_q1[0].expression) == "q1 + q2"


def test_a_long_number_is_put_into_the_sum_that_it_multiplies():
    # 1.81405895692e-43*b*(5.25e+31*b**2 + 4.01625e+31*t**2)
    text = derivation_text(derived("tapered-arm"))
    assert not re.search(r"e-[3-9]\d|e\+[2-9]\d", text)
    b, t = sp.symbols("b t", positive=True)
    small, large = sp.Rational(10**13 + 1, 3 * 10**25), sp.Integer(10) ** 20
    shown = in_decimals(small * b * (large * b + 7 / t))
    assert sp.sstr(shown, full_prec=False) == "b*(33333333.3333*b + 2.33333333333e-12/t)"


def test_names_of_several_letters_are_not_abbreviated_as_one_row():
    names = sp.symbols("L_a d_a d_b L_b", positive=True)
    K = sp.ImmutableMatrix(sp.diag(sum(names), 0, 0))
    steps = tuple(Definition(name, R + i * r) for i, name in enumerate(names, start=2))
    text = derivation_text(Derivation("K_C", K, (), K, steps))
    assert "\nL_a, L_b, d_a, d_b: length, by its equation\n" in text
