import ctypes
import subprocess

import numpy as np
import pytest
import sympy as sp

from robostiff.analytic import differentiate
from robostiff.analytic.derivation import Derivation
from robostiff.analytic.export import c_function
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
from tests.other_programs import command


def compiled(source, folder, name="stiffness"):
    code, library = folder / "formula.c", folder / "formula.so"
    code.write_text(source, encoding="ascii")
    options = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "-shared", "-fPIC"]
    words = [command("a C compiler"), *options, str(code), "-o", str(library), "-lm"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return getattr(ctypes.CDLL(str(library)), name)


def called(function, values, n):
    array = ctypes.c_double * max(len(values), 1)
    K = (ctypes.c_double * (n * n))(*([float("nan")] * (n * n)))
    function.restype = None
    function(K, array(*values))
    return np.array(K).reshape(n, n)


@pytest.mark.needs("a C compiler")
@pytest.mark.parametrize("name", ALL)
def test_compiled_function_gives_the_substituted_formula(name, tmp_path):
    derivation = ALL[name]
    function = compiled(c_function(derivation), tmp_path)
    for seed in range(3):
        values = random_values(derivation, seed)
        K = called(function, values.values(), derivation.K.rows)
        expected = exact(derivation, values)
        assert np.max(np.abs(K - expected)) <= 1e-13 * np.max(np.abs(expected))


@pytest.mark.needs("a C compiler")
def test_values_without_the_sign_of_their_symbol_or_infinite_are_refused(tmp_path):
    function = compiled(c_function(of_signed_symbols()), tmp_path)
    for values, fails in [
        ((0.0, 0.5, -1.0), 0),
        *((values, 1) for values in (*WRONG_SIGNS, *INFINITE)),
    ]:
        K = (ctypes.c_double * 9)(-7.0)
        assert function(K, (ctypes.c_double * 3)(*values)) == fails
        assert K[0] == (-7.0 if fails else 0.5)


@pytest.mark.needs("a C compiler")
def test_a_derivative_comes_beside(tmp_path):
    derivation = ALL["gough_stewart_b"]
    found = differentiate(derivation, "h")
    values = random_values(derivation, 3)
    K, dK = ((ctypes.c_double * 36)() for _ in range(2))
    function = compiled(c_function(found), tmp_path)
    assert function(K, dK, (ctypes.c_double * len(values))(*values.values())) == 0
    for own, expected in zip((K, dK), found.substituted(values), strict=True):
        np.testing.assert_allclose(np.array(own), np.array(expected.tolist(), float).ravel(), 1e-12)


def test_comment_says_order_and_convention():
    comment, code = c_function(in_steps()).split("*/", 1)
    words = " ".join(comment.replace("*", " ").split())
    assert "p[0] K_11, p[1] K_12" in words
    assert "p[21] L." in words
    assert "twist (dx, dy, dz, rx, ry, rz) of the reference point" in words
    assert "const double L = p[21];" in code


def test_exact_fractions():
    assert "K[0] = 1.0/3.0;" in c_function(ALL["numbers_only"])
    K = sp.ImmutableMatrix(sp.diag(sp.Symbol("x") / 3, 0, 0))
    assert "= (1.0/3.0)*x;" in c_function(Derivation("K", K, (), K))


def test_names_of_steps_are_kept_and_what_nobody_needs_is_left_out():
    source = c_function(in_steps())
    assert "const double mu_1 = L*u_1_2 + u_1_6;" in source
    assert "unused" not in source


@pytest.mark.parametrize("name", ALL)
def test_lines_are_short_and_code_is_the_same_each_time(name):
    source = c_function(ALL[name])
    assert source == c_function(ALL[name])
    assert max(map(len, source.splitlines())) <= 96
    assert source.count("*/") == 1


@pytest.mark.parametrize("name", ["", "2a", "double", "sin", "a b", "f(void){} void g"])
def test_a_name_that_is_no_identifier_is_refused(name):
    with pytest.raises(InputError, match="name of the function"):
        c_function(equation_4(), name)


def test_a_function_that_c_does_not_know_is_refused():
    K = sp.ImmutableMatrix(sp.diag(sp.besselj(0, sp.Symbol("x")), 0, 0))
    with pytest.raises(InputError, match="besselj"):
        c_function(Derivation("K", K, (), K))
