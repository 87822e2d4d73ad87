"""Robots at vector level: one generic leg, the table of what differs, and the sum."""

import copy
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.analytic import AtSymbols, Steps
from robostiff.analytic.export import (
    derivation_html,
    derivation_latex,
    derivation_markdown,
    derivation_text,
    derivation_typst,
)
from robostiff.analytic.leg_table import LegTable
from robostiff.analytic.robot_placement import place_robot
from robostiff.analytic.vector_expressions import Cross, Stacked, Turned, Vector
from robostiff.analytic.vector_form import check_vector_form, vector_form
from robostiff.errors import DisagreementError


@pytest.fixture(scope="module")
def placed():
    return place_robot(rs.load("gough-stewart-b", symbols=("R", "r", "k")), AtSymbols())


@pytest.fixture(scope="module")
def platform(placed):
    return vector_form(placed)


def test_a_platform_is_one_leg_and_the_angles_of_eq_26(platform):
    named = {e.name: e.expression for e in platform.leg}
    u, b = Vector("u_i"), Vector("b_i")
    assert named["w_i"] == Stacked(u, Cross(Turned("Q", b), u))
    assert str(named["c_i"]) == "1/k"
    degrees = {
        name: [int(x * 180 / sp.pi) for x in column] for name, column in platform.columns.items()
    }
    # 360 degrees of the paper's last leg are 0.
    assert degrees == {
        "phi_i": [0, 120, 120, 240, 240, 0],
        "psi_i": [60, 60, 180, 180, 300, 300],
    }
    assert platform.turned == (("leg1", "leg3", "leg5"), ("leg2", "leg4", "leg6"))


def test_it_is_the_stiffness_far_from_the_poses_of_its_check(platform):
    values = {"R": 0.61, "r": 0.27, "k": 3e7, "x": 0.21, "y": -0.1, "z": 0.9}
    values |= {"alpha": 0.3, "beta": -0.2, "gamma": 0.4}
    robot = rs.load("gough-stewart-b", {"R": "0.61 m", "r": "0.27 m", "k": "3e7 N/m"})
    turn = Rotation.from_euler("xyz", [0.3, -0.2, 0.4])
    pose = RigidTransform.from_components([0.21, -0.1, 0.9], turn)
    K = rs.stiffness(robot, pose).K
    assert np.max(np.abs(platform.stiffness(values) - K)) < 1e-12 * np.max(np.abs(K))


def test_a_wrong_form_is_found(placed, platform):
    check_vector_form(platform, placed)
    psi = platform.columns["psi_i"]
    wrong = replace(
        platform, columns=platform.columns | {"psi_i": (psi[0] + sp.pi / 180, *psi[1:])}
    )
    with pytest.raises(DisagreementError, match="vector form"):
        check_vector_form(wrong, placed)


def test_a_leg_with_a_couple_names_the_directions_of_both():
    form = rs.derive("3-upu", symbols=("h", "turned"), form=Steps()).vectors
    assert form is not None
    named = {e.name: e.expression for e in form.leg}
    assert named["w_i_2"] == Stacked(None, Vector("n_i"))
    assert {str(s) for s in named["c_i_2"].free_symbols} >= {"s_i", "t_i", "L_i"}
    assert form.turned == (("leg1", "leg2", "leg3"),)


def test_a_plane_robot_has_its_points_and_drives_in_the_table():
    form = rs.derive("3-rpr", symbols=(), form=Steps()).vectors
    assert form is not None
    assert set(form.columns) == {"a_ix", "a_iy", "b_ix", "b_iy", "c_i"}
    K = rs.stiffness(rs.load("3-rpr")).K
    assert np.allclose(form.stiffness({}), K, rtol=1e-12)


@pytest.mark.parametrize("name", ["two-link-arm", "delta", "3-rrr"])
def test_other_robots_have_none(name):
    assert rs.derive(name, symbols=(), form=Steps()).vectors is None


def test_angles_turn_with_the_parameters_of_a_robot():
    R, alpha = sp.symbols("R alpha", positive=True)
    table = LegTable({"R": 0.6, "alpha": 0.26})
    angles = [alpha, 2 * sp.pi / 3 - alpha, 2 * sp.pi / 3 + alpha]
    points = [(sp.expand_trig(R * sp.cos(a)), sp.expand_trig(R * sp.sin(a)), 0) for a in angles]
    x, y, z = table.vectors("a", "phi", points)
    phi = sp.Symbol("phi_i", real=True)
    assert (x, y, z) == (R * sp.cos(phi), R * sp.sin(phi), 0)
    assert table.columns["phi_i"] == angles
    assert table.turns_of_one_another() == [[0, 2], [1]]


def test_points_on_no_circle_are_coordinates():
    R = sp.Symbol("R", positive=True)
    table = LegTable({"R": 0.6})
    x, y, z = table.vectors("a", "phi", [(R, 0, 0), (0, 2 * R, 0)])
    assert [str(x), str(y), z] == ["a_ix", "a_iy", 0]
    assert table.turns_of_one_another() is None


def test_all_languages_write_it():
    derivation = rs.derive("gough-stewart-b", symbols=("R", "r", "k"), pose=AtSymbols())
    text = derivation_text(derivation)
    for line in (
        "d_i = p + Q b_i - a_i",
        "L_i = |d_i|",
        "w_i = [u_i; (Q b_i) x u_i]",
        "leg3  2*pi/3  pi",
        "K_C = sum over i of w_i w_i^T / c_i",
    ):
        assert line in text.splitlines()
    latex = derivation_latex(derivation)
    assert r"\mathbf{d}_{i} &= \mathbf{p} + \mathbf{Q} \mathbf{b}_{i} - \mathbf{a}_{i}" in latex
    assert r"leg3 & $\frac{2 \pi}{3}$ & $\pi$ \\" in latex
    assert "| leg1 | $0$ | $\\frac{\\pi}{3}$ |" in derivation_markdown(derivation)
    assert "<table>" in derivation_html(derivation)
    assert "bold(upright(d))_(i) = " in derivation_typst(derivation)
    assert copy.deepcopy(derivation).vectors == derivation.vectors
    assert derivation.subs({"k": 1e8}).vectors is None
