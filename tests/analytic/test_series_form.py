"""Serial arms as a textbook has them: compliance as a sum over the springs, K its inverse."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Steps
from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.export import (
    derivation_html,
    derivation_latex,
    derivation_markdown,
    derivation_text,
    derivation_typst,
)
from robostiff.analytic.placement.agreement import RobotInNumbers, matrix_distance
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.analytic.placement.robot_pose import AtHome, AtSymbols
from robostiff.analytic.series_form import series_form
from robostiff.analytic.vectors.forms import InSeries, VectorForm
from robostiff.analytic.vectors.vector_expressions import names_in
from robostiff.errors import DisagreementError
from robostiff.robots import robot_file


@pytest.fixture(scope="module")
def placed():
    return place_robot(rs.load("two-link-arm", symbols=rs.ALL_PARAMETERS), AtHome())


@pytest.fixture(scope="module")
def arm(placed):
    return series_form(placed)


def test_springs_in_series_add_their_compliances(arm):
    turned = str(arm.C[5, 5])
    assert turned == "1/k_2 + 1/k_1 + l1/EI_z_1 + l2/EI_2"
    assert str(arm.C[2, 2]) == "l1**3/(3*EI_y_1) + l2**3/(3*EI_2)"
    assert arm.C[0, 2] == arm.C[2, 5] == 0
    assert arm.C == arm.C.T


def test_its_inverse_is_the_stiffness_of_the_arm(placed, arm):
    random = np.random.default_rng(3)
    for _ in range(3):
        values = {k: v * random.uniform(0.9, 1.1) for k, v in placed.robot.nominal.items()}
        K = arm.stiffness(values)
        wanted = rs.stiffness(placed.robot.substituted(values)).K
        assert matrix_distance(K, wanted, 0.5) < 1e-10


def test_a_wrong_compliance_is_found(placed, arm):
    C = sp.Matrix(arm.C)
    C[5, 5] *= sp.Rational(1001, 1000)
    wrong = replace(arm, C=sp.ImmutableMatrix(C))
    with pytest.raises(DisagreementError, match="the formula and the numerical form"):
        RobotInNumbers.of(placed).check(wrong.K, wrong.definitions)


def test_exports_begin_with_the_compliance():
    derivation = rs.derive("two-link-arm", symbols=("l1", "l2"), form=Steps())
    assert derivation.vectors is None
    assert isinstance(derivation.in_series, InSeries)
    assert all(isinstance(d, Definition) for d in derivation.in_series.definitions)
    text = derivation_text(derivation)
    assert "Compliance: a sum over the springs" in text
    assert "K_0 = C^-1" in text.splitlines()
    # Wrenches made conjugate to one another say no more.
    assert "w_1_1" not in text
    assert r"\mathbf{C}^{-1}" in derivation_latex(derivation)


def test_a_leg_with_passive_joints_is_no_arm():
    assert series_form(place_robot(rs.load("planar-link", symbols=("L",)), AtHome())) is None


@pytest.mark.parametrize("pose", [AtHome(), AtSymbols()])
def test_an_arm_of_six_joints_is_its_rotations_points_and_springs(pose):
    robot = rs.load("six-joint-arm", symbols=("upper", "fore", "flange"))
    placed = place_robot(robot, pose)
    arm = series_form(placed)
    assert isinstance(arm, VectorForm)
    assert [name for name, _, _ in arm.drives] == [f"joint{i}" for i in range(1, 7)]
    assert [name for name, *_ in arm.beams] == ["column", "upper arm", "forearm", "wrist"]
    assert len(arm.leg) <= 30
    # The last joint turns neither a spring nor the reference point.
    rotations = [e.name for e in arm.leg if e.name.startswith("R_")]
    for name in rotations:
        assert any(name in names_in(e.expression) for e in arm.leg), name
    random = np.random.default_rng(5)
    for _ in range(3):
        values = {k: v * random.uniform(0.8, 1.2) for k, v in robot.nominal.items()}
        joints = {name: float(random.uniform(-1.5, 1.5)) for name in placed.coordinates}
        numeric = robot.substituted(values)
        at = rs.JointCoordinates(np.array(list(joints.values()))) if joints else None
        wanted = rs.stiffness(numeric, at).K
        assert matrix_distance(arm.stiffness(values | joints), wanted, 0.5) < 1e-10


def test_a_wrong_beam_of_an_arm_is_found():
    placed = place_robot(rs.load("six-joint-arm", symbols=("fore",)), AtHome())
    arm = series_form(placed)
    assert isinstance(arm, VectorForm)
    name, Q, m, (L, *products) = arm.beams[2]
    wrong = (*arm.beams[:2], (name, Q, m, (L * sp.Rational(1001, 1000), *products)), arm.beams[3])
    wrong = replace(arm, beams=wrong)
    with pytest.raises(DisagreementError, match="the formula and the numerical form"):
        RobotInNumbers.of(placed).check(wrong.K, wrong.definitions)


def test_exports_of_an_arm_in_vectors():
    derivation = rs.derive("six-joint-arm", symbols=("fore",), form=Steps())
    lines = derivation_text(derivation).splitlines()
    assert "C = sum of c t t^T + sum of T D T^T" in lines
    assert "K_C = C^-1" in lines
    assert not any(line.startswith("w_1") for line in lines)
    for write in (derivation_latex, derivation_markdown, derivation_html, derivation_typst):
        assert "fore" in write(derivation)


def test_rigid_drives_add_nothing_and_axes_may_be_inclined(tmp_path):
    text = robot_file("six-joint-arm").read_text(encoding="utf-8")
    for old, new in (
        (
            "name: joint2, axis: y, role: actuated, stiffness: 5e5 N m/rad,",
            "name: joint2, axis: y, role: actuated,",
        ),
        ("name: joint4, axis: x,", "name: joint4, axis: [3, 0, 4],"),
    ):
        assert old in text
        text = text.replace(old, new)
    page = tmp_path / "arm.yaml"
    page.write_text(text, encoding="utf-8")
    robot = rs.load(page, symbols=rs.ALL_PARAMETERS)
    placed = place_robot(robot, AtSymbols())
    arm = series_form(placed)
    assert isinstance(arm, VectorForm)
    assert [name for name, *_ in arm.drives] == [f"joint{i}" for i in (1, 3, 4, 5, 6)]
    assert arm.passive == ()
    joints = dict(zip(placed.coordinates, (0.4, 0.3, -0.6, 0.8, 0.5, -0.2), strict=True))
    wanted = rs.stiffness(robot.numeric, rs.JointCoordinates(np.array([*joints.values()]))).K
    assert matrix_distance(arm.stiffness({**robot.nominal, **joints}), wanted, 0.5) < 1e-10
