import subprocess

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Condition, Derivation, RobotDerivation, differentiate
from robostiff.analytic.export import julia_function, matlab_function
from robostiff.analytic.export.code import JULIA_WORDS, MATLAB_WORDS
from robostiff.analytic.export.program import program
from robostiff.analytic.placement.agreement import closed_places
from robostiff.analytic.placement.robot_placement import place_robot
from tests.analytic.export import small_readers
from tests.analytic.export.derivations import (
    ALL,
    INFINITE,
    WRONG_SIGNS,
    equation_4,
    exact,
    of_signed_symbols,
    random_values,
)
from tests.other_programs import command

LANGUAGES = {
    "julia": (julia_function, small_readers.julia),
    "matlab": (matlab_function, small_readers.matlab),
}


def largest_difference(K, expected):
    return np.max(np.abs(K - expected)) / max(np.max(np.abs(expected)), 1e-300)


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", ALL)
def test_functions_give_the_substituted_formula(language, name):
    write, read = LANGUAGES[language]
    f = read(write(ALL[name]))
    for seed in range(2):
        values = random_values(ALL[name], seed)
        found = f(*values.values())
        assert largest_difference(found, exact(ALL[name], values)) < 1e-13


def octave(folder, script):
    (folder / "run.m").write_text(script, encoding="utf-8")
    done = subprocess.run(
        [command("Octave"), "--quiet", "--no-init-file", "run.m"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.needs("Octave")
def test_octave_gives_the_substituted_formula(tmp_path):
    lines, expected = [], []
    for i, derivation in enumerate(ALL.values()):
        source = matlab_function(derivation, f"formula_{i}")
        (tmp_path / f"formula_{i}.m").write_text(source, encoding="utf-8")
        values = random_values(derivation, i)
        arguments = ", ".join(repr(x) for x in values.values())
        lines.append(f"printf('%.17g ', formula_{i}({arguments})'); printf('\\n');")
        expected.append(exact(derivation, values))
    printed = octave(tmp_path, "\n".join(lines) + "\n")
    rows = printed.splitlines()
    assert len(rows) == len(ALL)
    for row, K in zip(rows, expected, strict=True):
        assert largest_difference(np.array(row.split(), dtype=float).reshape(K.shape), K) < 1e-13


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
    "six-joint-arm": rs.AtSymbols(),
    "us-ups": rs.AtHome(),
}


@pytest.mark.needs("Octave")
def test_octave_gives_the_stiffness_of_robots(tmp_path):
    lines, expected = [], []
    for name, pose in POSED.items():
        robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
        derivation = rs.derive(robot, pose=pose)
        own = name.replace("-", "_") + "_"
        own = own if own[0].isalpha() else f"robot_{own}"
        (tmp_path / f"{own}.m").write_text(matlab_function(derivation, own), encoding="utf-8")
        for values, result, _ in closed_places(place_robot(robot, pose), sets=2, poses=2):
            given = [repr(float(values[s.name])) for s in program(derivation).arguments]
            lines.append(f"printf('%.17g ', {own}({', '.join(given)})'); printf('\\n');")
            expected.append(result.K)
    rows = octave(tmp_path, "\n".join(lines) + "\n").splitlines()
    for row, K in zip(rows, expected, strict=True):
        found = np.array(row.split(), dtype=float).reshape(K.shape)
        assert largest_difference(found, K) < 1e-12


def guarded():
    """A denominator that may vanish, a radicand that may be negative, and a condition."""
    a, b = sp.symbols("a b", real=True)
    K = sp.ImmutableMatrix(sp.diag(1 / (a - b), sp.sqrt(a - b) ** -2 * sp.sqrt(a), sp.acos(b / 9)))
    length = Condition("the beam has a positive length", 3 - b)
    return RobotDerivation("guarded", K, (), K, conditions=(length,))


REFUSED = [(1.0, 1.0), (1.0, 1.0 + 1e-9), (-1.0, -2.0), (5.0, 4.0), (1e4, -10.0)]


@pytest.mark.parametrize("language", LANGUAGES)
def test_functions_refuse_where_the_formula_does_not_hold(language):
    write, read = LANGUAGES[language]
    f = read(write(guarded()))
    assert f(2.0, 1.0)[0, 0] == 1.0
    for values in REFUSED:
        with pytest.raises(ValueError, match=r"does not hold|left the real numbers"):
            f(*values)


@pytest.mark.parametrize("language", LANGUAGES)
def test_values_without_the_sign_of_their_symbol_or_infinite_are_refused(language):
    write, read = LANGUAGES[language]
    f = read(write(of_signed_symbols()))
    assert f(0.0, 0.5, -1.0)[0, 0] == 0.5
    for values in (*WRONG_SIGNS, *INFINITE):
        with pytest.raises(ValueError, match="does not hold"):
            f(*values)


@pytest.mark.needs("Octave")
def test_octave_refuses_where_the_formula_does_not_hold(tmp_path):
    (tmp_path / "guarded.m").write_text(matlab_function(guarded(), "guarded"), encoding="utf-8")
    lines = ["disp(guarded(2, 1)(1, 1))"]
    lines += [
        f"try; guarded({a!r}, {b!r}); disp('answered'); catch e; disp(e.identifier); end"
        for a, b in REFUSED
    ]
    source = matlab_function(of_signed_symbols(), "signed")
    (tmp_path / "signed.m").write_text(source, encoding="utf-8")
    lines += [
        f"try; signed({A!r}, {L!r}, {x!r}); disp('answered'); catch e; disp(e.identifier); end"
        for A, L, x in WRONG_SIGNS
    ]
    printed = octave(tmp_path, "\n".join(lines) + "\n")
    refused = len(REFUSED) + len(WRONG_SIGNS)
    assert printed.split() == ["1", *["robostiff:formula"] * refused]


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_derivative_comes_beside(language):
    write, read = LANGUAGES[language]
    derivation = ALL["gough_stewart_b"]
    found = differentiate(derivation, sp.Symbol("h", positive=True))
    values = random_values(derivation, 3)
    K, dK = read(write(found))(*values.values())
    expected_K, expected_dK = found.substituted(values)
    assert largest_difference(K, np.array(expected_K.tolist(), dtype=float)) < 1e-13
    assert largest_difference(dK, np.array(expected_dK.tolist(), dtype=float)) < 1e-13


def test_a_robot_at_a_general_pose_agrees_with_the_numerical_form():
    derivation = rs.derive("3-rpr", pose=rs.AtSymbols())
    robot = rs.load("3-rpr", symbols=rs.ALL_PARAMETERS)
    values = {**robot.nominal, "x": 0.02, "y": -0.03, "gamma": 0.2}
    given = [values[s.name] for s in derivation.symbols]
    expected = rs.stiffness(robot.numeric, [0.02, -0.03, 0.2]).K
    for write, read in LANGUAGES.values():
        assert largest_difference(read(write(derivation))(*given), expected) < 1e-12


@pytest.mark.parametrize(
    ("write", "words"), [(julia_function, JULIA_WORDS), (matlab_function, MATLAB_WORDS)]
)
def test_names_of_the_language_are_not_hidden(write, words):
    names = [sp.Symbol(word) for word in sorted(words)]
    K = sp.ImmutableMatrix(sp.diag(sum(names), sp.sqrt(names[0]), 0))
    source = write(Derivation("K", K, (), K))
    for word in words:
        assert f"    {word} = " not in source
        assert not source.startswith(f"{word} = ")
    with pytest.raises(rs.InputError, match="name of the function"):
        write(equation_4(), "function")


def test_long_names_stay_apart_in_matlab():
    """MATLAB cuts names after 63 letters."""
    symbols = [sp.Symbol("length_of_a_leg_" * 5 + end) for end in ("a", "b")]
    K = sp.ImmutableMatrix(sp.diag(symbols[0], symbols[1], 0))
    f = small_readers.matlab(matlab_function(Derivation("K", K, (), K)))
    assert f(2.0, 3.0).diagonal().tolist() == [2.0, 3.0, 0.0]


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", ALL)
def test_lines_are_short_and_ascii_and_code_is_the_same_each_time(language, name):
    source = LANGUAGES[language][0](ALL[name])
    assert source == LANGUAGES[language][0](ALL[name])
    assert max(map(len, source.splitlines())) <= 100
    assert source.isascii()


@pytest.mark.parametrize("language", LANGUAGES)
def test_integers_beyond_doubles_are_floats(language):
    x = sp.Symbol("x")
    K = sp.ImmutableMatrix(sp.diag(x * 10**20 / 3, x, 0))
    source = LANGUAGES[language][0](Derivation("K", K, (), K))
    assert "1e+20" in source
    assert "100000000000000000000" not in source
