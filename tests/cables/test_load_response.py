"""A platform in cables under load with locked winches: balance, slack, and the loss of rest."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

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


def test_rest_is_the_minimum_of_the_energy():
    """A force alone has a potential: the rest is where elastic energy less its work is least."""
    load = np.array([60.0, 40, -150, 0, 0, 0])
    response = rs.cable_response(cable_robot("cable-8"), wrench=load)
    assert response.slack
    before = response.before
    origin, k = before.reference_point, before.axial
    slack_lengths = before.placed.lengths - before.tensions / k

    def energy(x):
        R = Rotation.from_rotvec(x[3:]).as_matrix()
        ends = origin + x[:3] + before.placed.arms @ R.T
        lengths = np.linalg.norm(ends - before.placed.exit_points, axis=-1)
        stretch = np.maximum(lengths - slack_lengths, 0)
        force = load[:3] + before.placed.weight_force
        return 0.5 * np.sum(k * stretch**2) - force @ x[:3]

    found = minimize(energy, np.zeros(6), method="Powell", options={"xtol": 1e-10, "ftol": 1e-14})
    assert response.displacement is not None
    assert energy(response.displacement) <= found.fun + 1e-9
    assert response.displacement is not None
    np.testing.assert_allclose(response.displacement[:3], found.x[:3], atol=1e-5)


@pytest.mark.parametrize("name", ["cable-8", "cable-8-suspended", "cable-4-planar"])
def test_small_loads_move_by_the_compliance(name):
    robot = cable_robot(name)
    n = robot.space.size
    load = 1e-4 * np.arange(1, n + 1)
    response = rs.cable_response(robot, wrench=load)
    expected = np.linalg.solve(rs.stiffness(robot).K, load)
    assert response.displacement is not None
    np.testing.assert_allclose(response.displacement, expected, rtol=1e-4)


def test_matrix_under_load_is_the_derivative_of_the_load():
    robot, load = cable_robot("cable-8"), np.array([100.0, -50, -150, 0, 0, 0])
    response = rs.cable_response(robot, wrench=load)
    assert response.slack
    step = 1e-2
    for i in range(3):
        more, less = (
            rs.cable_response(robot, wrench=load + sign * step * np.eye(6)[i]) for sign in (1, -1)
        )
        moved = answered(more).pose - answered(less).pose
        turn = (
            Rotation.from_rotvec(answered(more).pose[3:])
            * Rotation.from_rotvec(answered(less).pose[3:]).inv()
        )
        twist = np.concatenate([moved[:3], turn.as_rotvec()])
        np.testing.assert_allclose(
            answered(response).K @ twist, 2 * step * np.eye(6)[i], atol=1e-3 * step
        )


@pytest.mark.parametrize(
    ("name", "load"),
    [
        ("cable-8", [0, 0, -200, 0, 0, 0]),
        ("cable-8", [10, 0, 0, 0, 0, 0]),
        ("cable-8-suspended", [0, 300, 0, 0, 0, 0]),
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


def test_load_that_lifts_a_hanging_platform_is_not_carried():
    robot = cable_robot("cable-8-suspended")
    assert robot.weight is not None
    weight = -robot.weight.force[2]
    response = rs.cable_response(robot, wrench=[0, 0, 1.5 * weight, 0, 0, 0])
    assert STATUS.NO_EQUILIBRIUM in response.status
    assert 0 < response.carried < 1 / 1.5
    assert not response.has_answer
    with pytest.raises(rs.NoAnswerError, match="does not carry the load"):
        _ = response.tensions


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


def test_no_load_moves_nothing():
    response = rs.cable_response(cable_robot("cable-8"), wrench=np.zeros(6))
    assert response.displacement is not None
    np.testing.assert_allclose(response.displacement, 0, atol=1e-12)
    np.testing.assert_allclose(answered(response).K, response.before.K, rtol=1e-9, atol=1e-6)
    assert response.first_slack is None


def test_imbalance_before_the_load_is_held_by_others():
    robot = random_robot(2)
    rule = rs.GivenTensions(np.full(8, 300.0))
    response = rs.cable_response(robot, wrench=[0, 0, 0, 0, 0, 0], tensions=rule)
    assert response.displacement is not None
    np.testing.assert_allclose(response.displacement, 0, atol=1e-12)
    assert STATUS.UNBALANCED in response.status


@pytest.mark.parametrize("load", [None, [1, 2], "up", [np.nan] * 6])
def test_loads_that_are_none(load):
    with pytest.raises(rs.InputError, match="wrench"):
        rs.cable_response(cable_robot("cable-8"), wrench=load)


def test_one_pose_at_a_time():
    with pytest.raises(rs.InputError, match="one pose"):
        rs.cable_response(
            cable_robot("cable-8"), [[0, 0, 1, 0, 0, 0]] * 2, wrench=[1, 0, 0, 0, 0, 0]
        )


@pytest.mark.parametrize("name", ["cable-3-suspended", "cable-8-suspended"])
def test_first_slack_is_where_the_response_changes(name):
    """Just before that part of the load no cable is slack, just after it that one is."""
    robot = rs.load(name)
    rng = np.random.default_rng(5)
    loads = [rng.normal(size=6) * ([300] * 3 + [30] * 3) * rng.choice([0.1, 1, 5]) for _ in "1234"]
    firsts = [(F, rs.cable_response(robot, wrench=F).first_slack) for F in loads]
    slack = [(F, first) for F, first in firsts if first is not None]
    assert len(slack) >= 3
    for F, first in slack:
        before, after = (
            rs.cable_response(robot, wrench=part * first.factor * F) for part in (0.999, 1.001)
        )
        assert (before.slack, after.slack) == ((), (first.cable,))


def test_tensions_beyond_their_limits_are_named():
    response = rs.cable_response(cable_robot("cable-8"), wrench=[20, 10, -50, 0, 0, 0])
    low = [i for i, t in enumerate(response.tensions) if t < 50]
    assert STATUS.BEYOND_LIMITS in response.status
    assert len(low) == 4
    for i, advice in zip(low, response.advice, strict=False):
        assert advice.startswith(f"the tension of 'cable{i + 1}' is {response.tensions[i]:.5g} N")
        assert "outside its limits 50 to 720 N" in advice
