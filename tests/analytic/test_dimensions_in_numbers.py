"""Formulas of robots whose dimensions are numbers: roots stay exact, and no rounding is printed."""

from pathlib import Path

import numpy as np
import sympy as sp

import robostiff as rs
from robostiff.analytic.export import derivation_text

UR5 = Path(__file__).parents[2] / "examples" / "ur5.urdf"


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
        derivation = rs.derive(name, symbols=("k",))
        assert derivation.is_closed
        values = np.array(derivation.K.subs(derivation.symbols[0], 3e7), dtype=float)
        expected = rs.stiffness(rs.load(name, {"k": "3e7 N/m"})).K
        assert np.allclose(values, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_a_description_is_derived_without_a_word_about_symbols():
    text = derivation_text(rs.derive(UR5))
    assert "e-17" not in text, "what rounding left is no dimension"
    assert "R_0 = [ 0  0   1 ]" in text


def test_long_roots_are_decimals_without_rounding_beside_the_diagonal():
    text = derivation_text(rs.derive("hexapod", symbols=()))
    matrix = text[text.index("All legs together") :]
    assert "e-" not in matrix
    assert "12049634.5476" in matrix
