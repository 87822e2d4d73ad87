"""A platform in cables under load with locked winches: balance, slack, and the loss of rest."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.cables import structure_matrix, weight_wrench
from tests.cables.machines import answered, cable_robot, random_robot, slack_event

STATUS = rs.Status


@pytest.mark.parametrize(
    ("name", "load"),
    [
        ("cable-8", [0, 0, -200, 0, 0, 0]),
        ("cable-8", [100, -50, 30, 1, 2, -1]),
        ("cable-8-suspended", [0, 300, -1000, 50, 0, 80]),
        ("cable-4-planar", [30, -100, 2]),
        ("cable-3-suspended", [50, 20, 0, 0, 0, 0]),
    ],
)
def test_forces_balance_under_the_load(name, load):
    response = rs.cable_response(cable_robot(name), wrench=load)
    after = answered(response)
    pulled = structure_matrix(after.placed) @ response.tensions + weight_wrench(after.placed)
    np.testing.assert_allclose(pulled + np.array(load), 0, atol=1e-7)
    assert (response.tensions >= 0).all()
    zero = {name for name, t in zip(after.cable_names, response.tensions, strict=True) if t == 0}
    assert zero == set(response.slack)
    assert (STATUS.SLACK in response.status) == bool(response.slack)
    k, stretched = response.before.axial, after.placed.lengths - response.before.placed.lengths
    law = np.maximum(0, response.before.tensions + k * stretched)
    np.testing.assert_allclose(response.tensions, law, atol=1e-7)


@pytest.mark.parametrize(
    ("name", "load"),
    [
        ("cable-8", [0, 0, -200, 0, 0, 0]),
        ("cable-4-planar", [0, -100, 0]),
        ("cable-3-suspended", [50, 0, 0, 0, 0, 0]),
    ],
)
def test_first_slack_is_where_a_cable_loses_its_tension(name, load):
    robot, load = cable_robot(name), np.array(load, dtype=float)
    event = slack_event(rs.cable_response(robot, wrench=load))
    below = rs.cable_response(robot, wrench=(event.factor - 1e-3) * load)
    above = rs.cable_response(robot, wrench=(event.factor + 1e-3) * load)
    assert below.slack == ()
    assert event.cable in above.slack
    i = answered(above).cable_names.index(event.cable)
    assert 0 < below.tensions[i] < 1e-2 * below.tensions.max()


def test_slack_cable_is_as_good_as_cut():
    robot = cable_robot("cable-8")
    load = [0, 0, -300.0, 0, 0, 0]
    whole = rs.cable_response(robot, wrench=load)
    assert whole.slack == ("cable5", "cable6", "cable7", "cable8")
    taut = answered(whole).axial > 0
    W = structure_matrix(answered(whole).placed)[:, taut]
    elastic = W @ np.diag(answered(whole).axial[taut]) @ W.T
    np.testing.assert_allclose(answered(whole).elastic, elastic, atol=1e-9)
    # Four cables, two freedoms of the pendulum left to their tension.
    assert answered(whole).held_rank == 4
    assert answered(whole).rank == 6


def test_free_and_unstable_platforms_do_not_answer():
    rope = rs.Cable("rope", [0, 0, 1], [0, 0, 0], EA=1e5)
    for weight in (rs.Weight([0, 0, -100]), rs.Weight([0, 0, -100], [0, 0, 0.2])):
        robot = rs.CableRobot("plumb", (rope,), rs.Frame.identity(), weight)
        response = rs.cable_response(robot, wrench=[1, 0, 0, 0, 0, 0])
        assert STATUS.NO_EQUILIBRIUM in response.status
        assert response.carried == 0


def test_infeasible_pose_has_no_response():
    response = rs.cable_response(
        cable_robot("cable-8"), [0, 0, 3, 0, 0, 0], wrench=[1, 0, 0, 0, 0, 0]
    )
    assert response.status == STATUS.INFEASIBLE
    assert not response.has_answer


def test_imbalance_before_the_load_is_held_by_others():
    robot = random_robot(2)
    rule = rs.GivenTensions(np.full(8, 300.0))
    response = rs.cable_response(robot, wrench=[0, 0, 0, 0, 0, 0], tensions=rule)
    assert response.displacement is not None
    np.testing.assert_allclose(response.displacement, 0, atol=1e-12)
    assert STATUS.UNBALANCED in response.status


def test_tensions_beyond_their_limits_are_named():
    response = rs.cable_response(cable_robot("cable-8"), wrench=[20, 10, -50, 0, 0, 0])
    low = [i for i, t in enumerate(response.tensions) if t < 50]
    assert STATUS.BEYOND_LIMITS in response.status
    assert len(low) == 4
    for i, advice in zip(low, response.advice, strict=False):
        assert advice.startswith(f"the tension of 'cable{i + 1}' is {response.tensions[i]:.5g} N")
        assert "outside its limits 50 to 720 N" in advice
