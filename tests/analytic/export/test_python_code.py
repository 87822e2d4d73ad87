import numpy as np
import pytest
import sympy as sp
from hypothesis import given

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.export import python_function
from robostiff.errors import InputError
from tests.analytic.export.derivations import (
    ALL,
    INFINITE,
    WRONG_SIGNS,
    equation_4,
    exact,
    in_steps,
    of_signed_symbols,
    random_values,
)
from tests.analytic.export.expressions import SYMBOLS, expressions


def compiled(derivation, name="stiffness"):
    module = {}
    exec(compile(python_function(derivation, name), "generated", "exec"), module)  # noqa: S102
    return module[name]


def largest_difference(K, expected):
    return np.max(np.abs(K - expected)) / max(np.max(np.abs(expected)), 1e-300)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("seed", range(3))
def test_generated_function_gives_the_substituted_formula(name, seed):
    derivation = ALL[name]
    values = random_values(derivation, seed)
    K = compiled(derivation)(*values.values())
    assert K.shape == derivation.K.shape
    assert largest_difference(K, exact(derivation, values)) < 1e-13


@pytest.mark.parametrize("name", ["equation_4", "oblique", "in_steps", "one_term"])
def test_arrays_broadcast(name):
    derivation = ALL[name]
    sets = [[random_values(derivation, 7 * i + j) for j in range(4)] for i in range(3)]
    first, *others = derivation.symbols
    # The first argument varies along the first axis alone, as an array (3, 1).
    arguments = [np.array([[row[0][first]] for row in sets])]
    arguments += [np.array([[values[s] for values in row] for row in sets]) for s in others]
    K = compiled(derivation)(*arguments)
    shape = (3, 4) if others else (3, 1)
    assert K.shape == (*shape, *derivation.K.shape)
    for i, j in np.ndindex(*shape):
        values = {first: sets[i][0][first], **{s: sets[i][j][s] for s in others}}
        assert largest_difference(K[i, j], exact(derivation, values)) < 1e-13


def test_values_without_the_sign_of_their_symbol_or_infinite_are_refused():
    K = compiled(of_signed_symbols())
    assert K(0.0, 0.5, -1.0)[0, 0] == 0.5
    for values in (*WRONG_SIGNS, *INFINITE):
        with pytest.raises(ValueError, match="does not hold at 1 of 1"):
            K(*values)
    with pytest.raises(ValueError, match="does not hold at 1 of 2"):
        K(1.0, [0.5, -0.5], -1.0)
    words = " ".join(python_function(of_signed_symbols()).split())
    assert "unless A, L are positive or zero; unless x is negative or zero; unless the" in words


def test_integers_are_taken_as_numbers():
    K = compiled(equation_4())(2, 0, 1, 3, 0, np.array([4, 8]))
    np.testing.assert_allclose(K[:, 0, 0], [1.75, 1.875], rtol=1e-15)


@given(expressions)
def test_random_expressions(expression):
    K = sp.ImmutableMatrix([[expression, 0, 0], [0, expression**2 + 1, 0], [0, 0, 1]])
    derivation = Derivation("K", K, (), K)
    values = random_values(derivation, 1)
    with np.errstate(all="ignore"):
        got = compiled(derivation)(*values.values())
    expected = exact(derivation, values)
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9)


def test_names_of_steps_are_kept_and_what_nobody_needs_is_left_out():
    source = python_function(in_steps())
    assert "    mu_1 = L*u_1_2 + u_1_6\n" in source
    assert "unused" not in source


def test_a_definition_that_others_share_keeps_its_name():
    x, y, mu = sp.symbols("x y mu_1")
    entry = (x + y) ** 2
    definition = Definition(mu, x + y)
    K = sp.ImmutableMatrix([[entry, mu, 0], [mu, 1 / mu, 0], [0, 0, 0]])
    source = python_function(Derivation("K", K, (), K, (definition,)))
    assert "mu_1 = x + y" in source
    assert "t1" not in source
    assert "mu_1**2" in source


def test_shared_subexpressions_are_computed_once():
    source = python_function(ALL["oblique"])
    assert source.count("np.sin(") == source.count("np.cos(") == source.count("np.sqrt(") == 1


def test_exact_fractions():
    assert "K[..., 0, 0] = 1/3\n" in python_function(ALL["numbers_only"])


def test_docstring_says_order_and_convention():
    source = python_function(in_steps())
    assert "def stiffness(K_11, K_12, K_13," in source
    text = " ".join(compiled(in_steps()).__doc__.split())
    assert "twist (dx, dy, dz, rx, ry, rz) of the reference point" in text
    assert "wrench (Fx, Fy, Fz, Mx, My, Mz) about the reference point" in text
    assert "SI units" in text


@pytest.mark.parametrize("name", ALL)
def test_lines_are_short_and_code_is_the_same_each_time(name):
    source = python_function(ALL[name])
    assert source == python_function(ALL[name])
    assert max(map(len, source.splitlines())) <= 96


def test_the_function_may_have_another_name():
    assert compiled(equation_4(), "K_tip")(1, 0, 0, 1, 0, 1)[0, 0] == 1


@pytest.mark.parametrize("name", ["", "2a", "lambda", "a b", "np", "x)\nimport os"])
def test_a_name_that_is_no_identifier_is_refused(name):
    with pytest.raises(InputError, match="name of the function"):
        python_function(equation_4(), name)


def test_two_symbols_of_one_name_are_refused():
    K = sp.diag(sp.Symbol("L"), sp.Symbol("L", positive=True), 0)
    with pytest.raises(InputError, match="two called 'L'"):
        python_function(Derivation("K", sp.ImmutableMatrix(K), (), sp.ImmutableMatrix(K)))


@pytest.mark.parametrize(
    "entry", [sp.gamma(SYMBOLS[0]), SYMBOLS[0] ** SYMBOLS[1], sp.oo, sp.I, sp.Integer(10) ** 400]
)
def test_what_is_no_number_of_a_computer_is_refused(entry):
    K = sp.ImmutableMatrix(3, 3, lambda i, j: entry if i == j == 0 else 0)
    with pytest.raises(InputError):
        python_function(Derivation("K", K, (), K))
