"""Parallel robots in the joint coordinates of their legs."""

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic.exact.definition import operations_of
from robostiff.analytic.export import derivation_text
from robostiff.analytic.placement.agreement import sampled_robots
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.elastostatics import matrix_distance
from robostiff.errors import InputError
from robostiff.robots import robot_file
from tests.analytic.formulas import derived, in_numbers

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_a_five_bar_in_joint_angles_is_as_in_a_textbook():
    derivation = derived("fb3", rs.AtJoints())
    k, l1 = (sp.Symbol(x, positive=True) for x in ("k", "l1"))
    for number, leg in enumerate(derivation.named.legs, start=1):
        crank, elbow = (sp.Symbol(f"theta_{number}_{j}", real=True) for j in (1, 2))
        assert leg.compliances == (l1**2 * sp.sin(elbow) ** 2 / k,)
        along = crank + elbow
        assert leg.wrenches == (sp.ImmutableMatrix([sp.cos(along), sp.sin(along), 0]),)
    assert operations_of(derivation.named.K, derivation.named.definitions) <= 60
    text = derivation_text(derivation)
    assert "0 = a - l1*cos(theta_1_1) + l1*cos(theta_2_1)" in text


def test_a_leg_meets_the_platform_by_its_last_angle():
    derivation = derived("3-rrr", rs.AtJoints())
    r = sp.Symbol("r", positive=True)
    moments = [leg.wrenches[0][2] for leg in derivation.named.legs]
    phases = [sp.Integer(0), -sp.pi / 3, sp.pi / 3]
    for number, (moment, phase) in enumerate(zip(moments, phases, strict=True), start=1):
        last = sp.Symbol(f"theta_{number}_3", real=True)
        wanted = r * sp.cos(last + phase)
        assert any(sp.simplify(moment - sign * wanted) == 0 for sign in (1, -1))
    assert operations_of(derivation.named.K, derivation.named.definitions) <= 200


def test_joints_of_a_serial_arm_are_those_of_its_pose():
    symbols = ("l1", "l2")
    at_joints = rs.derive("two-link-arm", symbols=symbols, pose=rs.AtJoints())
    assert at_joints.coordinates == ("q1", "q2")
    assert at_joints.K == rs.derive("two-link-arm", symbols=symbols, pose=rs.AtSymbols()).K


def test_what_a_belt_holds_is_no_coordinate():
    """The elbow of an arm follows its shoulder by a belt: the sum of both is held."""
    robot = rs.load(EXAMPLES / "bevel-wrist.yaml", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, pose=rs.AtSymbols())
    assert derivation.coordinates == ("q1", "q3", "q4")
    q = np.array([-0.7, 0.0, 0.5, 0.1])
    expected = rs.stiffness(robot.numeric, rs.JointCoordinates(q)).K
    values = {**robot.nominal, "q1": q[0], "q3": q[2], "q4": q[3]}
    K = derivation.lambdify(*values)(*values.values())
    assert K == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())
    with pytest.raises(InputError, match="expected q1, q3, q4"):
        rs.derive(robot, pose=rs.AtCoordinates({"q2": 0.1}))


def test_coordinates_that_the_legs_decide_say_which_joints_they_are():
    robot = rs.load(EXAMPLES / "tricept-with-head.yaml", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, form=rs.Steps())
    text = " ".join(derivation_text(derivation).split())
    assert "q_machine_6: displacement of tricept/strut1/telescope1 of leg 'machine'" in text
    # Some are only in the condition that the legs close.
    in_K = set(derivation.K.free_symbols).union(
        *(d.expression.free_symbols for d in derivation.definitions)
    )
    assert not set(derivation.symbols) <= in_K


def test_an_angle_may_be_turned_either_way():
    """It was a positive symbol: half of each sweep was refused."""
    robot = rs.load("hexapod", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot)
    values = {**robot.nominal, "alpha": -0.1}
    expected = rs.stiffness(robot.substituted(values)).K
    K = derivation.lambdify(*values)(*values.values())
    assert K == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["agile-eye", "3-puu", "tripteron"])
def test_legs_with_one_chain_are_one_leg_by_its_springs(name):
    """They were steps of each leg, on 220 to 520 lines."""
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    derivation, placed = rs.derive(robot, pose=rs.AtJoints()), place_robot(robot, rs.AtJoints())
    # Those of the closure were missing among the arguments.
    function = derivation.lambdify(*derivation.symbols)
    assert function.arguments == tuple(x.name for x in derivation.symbols)
    assert derivation.free_symbols == set(derivation.symbols)
    text = derivation_text(derivation, width=88)
    assert "K_i = W_i (W_i^T C_i W_i)^-1 W_i^T" in text
    assert "Legs close where they hold the platform alike" in " ".join(text.split())
    assert len(text.splitlines()) < 125
    form, random = derivation.vectors, np.random.default_rng(2)
    assert form is not None
    for _ in range(2):
        numeric, ((values, pose),) = sampled_robots(placed, random, 0.04, 1)
        K = rs.stiffness(numeric, pose).K
        assert matrix_distance(in_numbers(form, values), K, placed.length) < 1e-9


def test_a_passive_joint_that_depends_on_others_takes_nothing(tmp_path):
    """Two joints about one axis turn as one: the second is no column of J_i."""
    text = robot_file("agile-eye").read_text(encoding="utf-8")
    elbow = "    - {type: revolute, name: elbow, axis: y, role: passive}\n"
    assert elbow in text
    page = tmp_path / "twice.yaml"
    page.write_text(text.replace(elbow, elbow + elbow.replace("elbow", "again")), "utf-8")
    robot = rs.load(page, symbols=rs.ALL_PARAMETERS)
    form = rs.derive(robot, pose=rs.AtJoints()).vectors
    assert form is not None
    assert form.passive == ("j_i_1", "j_i_3")
