"""Functions and programs of formulas give the same numbers, or refuse."""

import subprocess

import numpy as np
import pytest
import sympy as sp
from hypothesis import given

import robostiff as rs
from robostiff.analytic import Condition, Derivation, RobotDerivation, differentiate
from robostiff.analytic.export import matlab_function, python_function
from robostiff.analytic.export.code import JULIA_WORDS, MATLAB_WORDS
from robostiff.analytic.export.program import program
from robostiff.analytic.placement.agreement import closed_places
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.errors import InputError
from tests.analytic.export.derivations import (
    ALL,
    INFINITE,
    WRONG_SIGNS,
    exact,
    named_values,
    of_signed_symbols,
    random_values,
)
from tests.analytic.export.expressions import SYMBOLS, expressions
from tests.analytic.export.programs import (
    READERS,
    WRITERS,
    in_all_languages,
    in_c,
    in_python,
    largest_difference,
)
from tests.other_programs import command

writers = pytest.mark.parametrize("language", WRITERS)


@in_all_languages
@pytest.mark.parametrize("name", ALL)
def test_functions_give_the_substituted_formula(language, name, tmp_path):
    f = READERS[language](ALL[name], tmp_path)
    for seed in range(2):
        values, expected = named_values(name, seed)
        K = f(*values.values())
        assert K.shape == expected.shape
        assert largest_difference(K, expected) < 1e-13


def guarded():
    """A denominator that may vanish, a radicand that may be negative, and a condition."""
    a, b = sp.symbols("a b", real=True)
    K = sp.ImmutableMatrix(sp.diag(1 / (a - b), sp.sqrt(a - b) ** -2 * sp.sqrt(a), sp.acos(b / 9)))
    length = Condition("the beam has a positive length", 3 - b)
    return RobotDerivation("guarded", K, (), K, conditions=(length,))


REFUSED = [(1.0, 1.0), (1.0, 1.0 + 1e-9), (-1.0, -2.0), (5.0, 4.0), (1e4, -10.0)]


@in_all_languages
def test_functions_refuse_where_the_formula_does_not_hold(language, tmp_path):
    f = READERS[language](guarded(), tmp_path)
    assert f(2.0, 1.0)[0, 0] == 1.0
    for values in REFUSED:
        with pytest.raises(ValueError, match=r"does not hold|left the real numbers"):
            f(*values)


@in_all_languages
def test_values_without_the_sign_of_their_symbol_or_infinite_are_refused(language, tmp_path):
    f = READERS[language](of_signed_symbols(), tmp_path)
    assert f(0.0, 0.5, -1.0)[0, 0] == 0.5
    for values in (*WRONG_SIGNS, *INFINITE):
        with pytest.raises(ValueError, match="does not hold"):
            f(*values)


@in_all_languages
def test_a_derivative_comes_beside(language, tmp_path):
    found = differentiate(ALL["gough_stewart_b"], sp.Symbol("h", positive=True))
    values = random_values(found.derivation, 3)
    each = READERS[language](found, tmp_path)(*values.values())
    for own, expected in zip(each, found.substituted(values), strict=True):
        assert largest_difference(own, np.array(expected.tolist(), dtype=float)) < 1e-13


def octave(folder, script):
    (folder / "run.m").write_text(script, encoding="utf-8")
    words = [command("Octave"), "--quiet", "--no-init-file", "run.m"]
    done = subprocess.run(
        words, cwd=folder, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.needs("Octave")
def test_octave_gives_the_substituted_formula(tmp_path):
    """Also of a derivative, which comes beside, and of names that MATLAB cuts after 63 letters."""
    asked = [(own, *named_values(name, i % 2)) for i, (name, own) in enumerate(ALL.items())]
    rate = differentiate(ALL["gough_stewart_b"], sp.Symbol("h", positive=True))
    values = random_values(rate.derivation, 3)
    asked.append((rate, values, np.array(rate.substituted(values)[1].tolist(), dtype=float)))
    symbols = [sp.Symbol("length_of_a_leg_" * 5 + end) for end in ("a", "b")]
    K = sp.ImmutableMatrix(sp.diag(symbols[0], symbols[1], 0))
    values = dict(zip(symbols, (2.0, 3.0), strict=True))
    asked.append((Derivation("K", K, (), K), values, np.diag([2.0, 3.0, 0.0])))
    lines, expected = [], []
    for i, (derivation, values, K) in enumerate(asked):
        source = matlab_function(derivation, f"formula_{i}")
        (tmp_path / f"formula_{i}.m").write_text(source, encoding="utf-8")
        arguments = ", ".join(map(repr, values.values()))
        count = len(derivation.matrices)
        lines.append(f"[A{{1:{count}}}] = formula_{i}({arguments});")
        lines.append(f"printf('%.17g ', A{{{count}}}'); printf('\\n');")
        expected.append(K)
    rows = octave(tmp_path, "\n".join(lines) + "\n").splitlines()
    for row, K in zip(rows, expected, strict=True):
        assert largest_difference(np.array(row.split(), dtype=float).reshape(K.shape), K) < 1e-13


@pytest.mark.needs("Octave")
def test_octave_refuses_where_the_formula_does_not_hold(tmp_path):
    lines = ["disp(guarded(2, 1)(1, 1))"]
    wrong = [*WRONG_SIGNS, *INFINITE]
    each = (("guarded", guarded(), REFUSED), ("signed", of_signed_symbols(), wrong))
    for name, derivation, refused in each:
        (tmp_path / f"{name}.m").write_text(matlab_function(derivation, name), encoding="utf-8")
        lines += [
            f"try; {name}({', '.join(map(repr, map(float, values)))}); disp('answered'); "
            "catch e; disp(e.identifier); end"
            for values in refused
        ]
    count = len(REFUSED) + len(wrong)
    assert octave(tmp_path, "\n".join(lines) + "\n").split() == [
        "1",
        *["robostiff:formula"] * count,
    ]


# --- what is written ---


@writers
def test_lines_are_short_and_comments_end(language):
    for derivation in ALL.values():
        source = WRITERS[language](derivation)
        assert max(map(len, source.splitlines())) <= 100
        assert source.isascii()
        assert source.count("*/") == (language == "c")


@writers
def test_what_is_no_number_of_a_computer_is_refused(language):
    x, y = SYMBOLS[:2]
    for entry in (sp.gamma(x), sp.besselj(0, x), x**y, sp.oo, sp.I, sp.Integer(10) ** 400):
        K = sp.ImmutableMatrix(3, 3, lambda i, j, entry=entry: entry if i == j == 0 else 0)
        with pytest.raises(InputError):
            WRITERS[language](Derivation("K", K, (), K))


@pytest.mark.parametrize(("language", "words"), [("julia", JULIA_WORDS), ("matlab", MATLAB_WORDS)])
def test_names_of_the_language_are_not_hidden_and_long_integers_are_floats(language, words):
    names = [sp.Symbol(word) for word in sorted(words)]
    K = sp.ImmutableMatrix(sp.diag(sum(names), sp.sqrt(names[0]), names[1] * 10**20 / 3))
    source = WRITERS[language](Derivation("K", K, (), K))
    for word in words:
        assert f"    {word} = " not in source
        assert not source.startswith(f"{word} = ")
    assert "1e+20" in source
    assert "100000000000000000000" not in source


# --- arrays, in Python ---


@pytest.mark.parametrize("name", ["equation_4", "oblique", "in_steps", "one_term"])
def test_arrays_broadcast(name):
    derivation = ALL[name]
    sets = [[random_values(derivation, 7 * i + j) for j in range(3)] for i in range(2)]
    first, *others = derivation.symbols
    # The first argument varies along the first axis alone, as an array (2, 1).
    arguments = [np.array([[row[0][first]] for row in sets])]
    arguments += [np.array([[values[s] for values in row] for row in sets]) for s in others]
    K = in_python(derivation)(*arguments)
    shape = (2, 3) if others else (2, 1)
    assert K.shape == (*shape, *derivation.K.shape)
    for i, j in np.ndindex(*shape):
        values = {first: sets[i][0][first], **{s: sets[i][j][s] for s in others}}
        assert largest_difference(K[i, j], exact(derivation, values)) < 1e-13
    with pytest.raises(ValueError, match="does not hold at 1 of 2"):
        in_python(of_signed_symbols())(1.0, [0.5, -0.5], -1.0)


@given(expressions)
def test_random_expressions(expression):
    K = sp.ImmutableMatrix([[expression, 0, 0], [0, expression**2 + 1, 0], [0, 0, 1]])
    derivation = Derivation("K", K, (), K)
    values = random_values(derivation, 1)
    with np.errstate(all="ignore"):
        got = in_python(derivation)(*values.values())
    np.testing.assert_allclose(got, exact(derivation, values), rtol=1e-9, atol=1e-9)


# Closed forms and steps, parameters and poses, legs by closed forms and by joint coordinates.
POSED = {
    "3-rps": rs.AtSymbols(),
    "3-rrr": rs.AtJoints(),
    "agile-eye": rs.AtHome(),
    "delta": rs.AtSymbols(),
    "gantry-tau": rs.AtSymbols(),
    "h4": rs.AtHome(),
    "hexaglide": rs.AtSymbols(),
    "orthoglide": rs.AtSymbols(rs.EulerAngles("ZXZ")),
    "gough-stewart-a-beams": rs.AtSymbols(),
    "gough-stewart-b": rs.AtSymbols(),
    "hexapod": rs.AtSymbols(),
    "six-joint-arm": rs.AtSymbols(),
    "tripteron": rs.AtSymbols(),
    "two-link-arm": rs.AtSymbols(),
    "us-ups": rs.AtHome(),
}
QUICK = ("3-rrr", "gough-stewart-b", "two-link-arm")


def robot_and_answers(name):
    """A derivation, and values of the arguments of its program with K."""
    robot, pose = rs.load(name, symbols=rs.ALL_PARAMETERS), POSED[name]
    derivation = rs.derive(robot, pose=pose)
    arguments = [s.name for s in program(derivation).arguments]
    answers = closed_places(place_robot(robot, pose), sets=2, poses=2)
    return derivation, [([float(at[x]) for x in arguments], own.K) for at, own, _ in answers]


@pytest.mark.needs("a C compiler")
@pytest.mark.parametrize(
    "name", [pytest.param(x, marks=[] if x in QUICK else pytest.mark.slow) for x in POSED]
)
def test_programs_give_the_stiffness_of_a_robot(name, tmp_path):
    derivation, answers = robot_and_answers(name)
    assert answers
    for f in (in_c(derivation, tmp_path), in_python(derivation)):
        for values, K in answers:
            assert largest_difference(np.asarray(f(*values)), K) < 1e-12


@pytest.mark.needs("Octave")
@pytest.mark.parametrize(
    "names", [QUICK[1:], pytest.param(POSED, marks=pytest.mark.slow)], ids=["few", "all"]
)
def test_octave_gives_the_stiffness_of_robots(names, tmp_path):
    lines, expected = [], []
    for name in names:
        derivation, answers = robot_and_answers(name)
        own = f"robot_{name.replace('-', '_')}_"
        (tmp_path / f"{own}.m").write_text(matlab_function(derivation, own), encoding="utf-8")
        for values, K in answers:
            given = ", ".join(map(repr, values))
            lines.append(f"printf('%.17g ', {own}({given})'); printf('\\n');")
            expected.append(K)
    rows = octave(tmp_path, "\n".join(lines) + "\n").splitlines()
    for row, K in zip(rows, expected, strict=True):
        assert largest_difference(np.array(row.split(), dtype=float).reshape(K.shape), K) < 1e-12


def test_julia_agrees_with_the_numerical_form_at_a_general_pose(tmp_path):
    derivation = rs.derive("3-rpr", pose=rs.AtSymbols())
    robot = rs.load("3-rpr", symbols=rs.ALL_PARAMETERS)
    values = {**robot.nominal, "x": 0.02, "y": -0.03, "gamma": 0.2}
    given = [values[s.name] for s in derivation.symbols]
    expected = rs.stiffness(robot.numeric, [0.02, -0.03, 0.2]).K
    assert largest_difference(READERS["julia"](derivation, tmp_path)(*given), expected) < 1e-12


def test_a_program_takes_the_vectors_where_they_are_shorter():
    derivation = rs.derive("orthoglide", pose=rs.AtSymbols())
    steps = rs.derive("orthoglide", pose=rs.AtSymbols(), form=rs.Steps())
    assert program(derivation).operations < 0.6 * program(steps).operations
    assert program(derivation).arguments == program(steps).arguments
    assert "d_1_x" in python_function(derivation)
