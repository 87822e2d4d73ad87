"""Symbols wherever the parts of a model take numbers; certain mistakes are refused."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.model import beam_axes
from robostiff.model.checks import rotation_matrix, unit_vector

L, R, r, h, d, k, E, G = sp.symbols("L R r h d k E G", positive=True)
q = sp.Symbol("q", real=True)
STEEL = rs.material("steel")
SOFT = rs.Material("soft", E=E, G=G)


def at(values, formulas):
    """The numbers of an array of formulas."""
    array = np.asarray(formulas, dtype=object)
    return np.array([float(sp.sympify(e).subs(values)) for e in array.flat]).reshape(array.shape)


def test_beam_between_two_symbolic_points():
    values = {R: 0.5, r: 0.3, h: 0.8, E: 2e11, G: 8e10, d: 0.03}
    to = [r - R, 0, h]
    link = rs.beam_link(to, SOFT, rs.circle(d), theory=rs.Timoshenko())
    numbers = rs.beam_link(
        [-0.2, 0, 0.8], rs.Material("soft", 2e11, 8e10), rs.circle(0.03), theory=rs.Timoshenko()
    )
    np.testing.assert_allclose(at(values, link.to), numbers.to, rtol=1e-15)
    np.testing.assert_allclose(at(values, link.axes), numbers.axes, atol=1e-15)
    np.testing.assert_allclose(
        at(values, link.elasticity.compliance), numbers.elasticity.compliance, rtol=1e-13
    )


def test_length_is_free_of_absolute_values_and_trigonometry():
    link = rs.beam_link([L * sp.cos(q), L * sp.sin(q), 0], SOFT, rs.circle(d))
    assert link.elasticity.compliance[0, 0] == 4 * L / (sp.pi * E * d**2)
    assert not any(entry.has(sp.Abs) for entry in link.axes.flat)


def test_numbers_beside_formulas_become_exact():
    link = rs.beam_link([1, 1, 0], rs.material("steel"), rs.circle(d))
    assert link.elasticity.compliance[0, 0] == 4 * sp.sqrt(2) / (210 * 10**9 * sp.pi * d**2)
    spring = rs.translational_spring(k, [1, 1, 0])
    assert spring.compliance[0, 1] == 1 / (2 * k)
    assert rs.Material.isotropic("soft", E, 0.3).G == 5 * E / 13


@pytest.mark.parametrize("y_axis", [[0, 0, 1], [0.3, 0, 1], [L, 0, 2 * L]])
def test_axes_of_a_beam_are_those_of_numbers(y_axis):
    values = {L: 0.4, h: 0.3}
    axes = beam_axes([L, h, 0], y_axis)
    numbers = beam_axes([0.4, 0.3, 0], at(values, y_axis))
    np.testing.assert_allclose(at(values, axes), numbers, atol=1e-15)


@pytest.mark.parametrize(
    ("shape", "sides"),
    [
        (rs.circle, (0.04,)),
        (rs.tube, (0.05, 0.04)),
        (rs.rectangle, (0.02, 0.05)),
        (rs.rectangle, (0.05, 0.02)),
        (rs.box, (0.06, 0.04, 0.003)),
        (rs.i_section, (0.1, 0.2, 0.0056, 0.0085)),
    ],
)
def test_shapes_of_symbols_are_those_of_numbers(shape, sides):
    symbols = sp.symbols("a b c d", positive=True)[: len(sides)]
    nu = sp.Symbol("nu")
    values = {**dict(zip(symbols, sides, strict=True)), nu: 0.3}
    found, wanted = shape(*symbols, poisson_ratio=nu), shape(*sides)
    for name in ("A", "Iy", "Iz", "J", "shear_factor_y", "shear_factor_z"):
        formula = getattr(found, name)
        assert not formula.has(sp.Float)
        assert float(formula.subs(values)) == pytest.approx(getattr(wanted, name), rel=1e-13)


def test_joints_have_symbolic_axes_and_homes():
    assert rs.revolute([0, L, 0], rs.Passive()).freedoms[0].axis.tolist() == [0, 1, 0]
    tilted = rs.prismatic([0, sp.Rational(3, 5), sp.Rational(4, 5)], rs.Actuated(k), home=[h])
    assert tilted.freedoms[0].axis.tolist() == [0, sp.Rational(3, 5), sp.Rational(4, 5)]
    assert rs.Chain((tilted,)).home.tolist() == [h]
    planar = rs.planar([0, h, r], rs.Passive())
    numbers = rs.planar([0, 0.8, 0.3], rs.Passive())
    for found, wanted in zip(planar.freedoms, numbers.freedoms, strict=True):
        np.testing.assert_allclose(at({h: 0.8, r: 0.3}, found.axis), wanted.axis, atol=1e-15)


def test_exact_directions_and_rotations_stay_exact():
    assert unit_vector("axis", [sp.Integer(0), 1, 1])[1] == sp.sqrt(2) / 2
    c, s = sp.cos(sp.pi / 9), sp.sin(sp.pi / 9)
    turn = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    assert rotation_matrix("turn", turn)[0, 0] == c
    few_digits = [[sp.Rational("0.7071068"), sp.Rational("-0.7071068"), 0]]
    few_digits += [[sp.Rational("0.7071068"), sp.Rational("0.7071068"), 0], [0, 0, 1]]
    nearest = rotation_matrix("turn", few_digits).astype(float)
    np.testing.assert_allclose(nearest.T @ nearest, np.eye(3), atol=1e-15)


def test_robot_built_of_symbols_computes_with_values():
    def arm(length, stiffness, angle):
        elements = (
            rs.revolute([0, 0, 1], rs.Actuated(stiffness), home=[angle]),
            rs.beam_link([length, 0, 0], STEEL, rs.circle(0.02)),
        )
        leg = rs.Leg(
            "arm",
            rs.Frame(np.eye(3), np.array([0, length, 0])),
            rs.Chain(elements),
            rs.Frame.identity(),
        )
        return rs.Robot("arm", (leg,), coordinates=(), reference_point=np.array([0, 0, length]))

    symbolic, numbers = arm(L, k, q), arm(0.4, 1e5, 0.3)
    assert [str(symbol) for symbol in symbolic.symbols] == ["L", "k", "q"]
    found = symbolic.substituted({"L": 0.4, k: 1e5, "q": 0.3})
    C, C_numbers = rs.compliance(found), rs.compliance(numbers)
    np.testing.assert_allclose(C, C_numbers, rtol=0, atol=1e-13 * np.abs(C_numbers).max())
