"""Cables as springs that only pull: equilibrium, buckling, paths and modes, by energies of ours."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.model.cable import Cable, CableRobot, Weight
from robostiff.spatial import Frame, Space
from robostiff.statics.equations.problem import EquilibriumProblem
from tests.cables.machines import answered, random_robot
from tests.campaign.bodies import Bodies, NoMinimumError, curvatures, minimum
from tests.campaign.loaded_cables import suspended


def rested(robot: CableRobot, **given: Any) -> rs.Equilibrium:
    """One equilibrium."""
    answer = rs.equilibrium(robot, **given)
    return answer


def bodies_of(robot: CableRobot) -> Bodies:
    """The platform in its cables, at home."""
    six = np.concatenate([robot.home.p, Rotation.from_matrix(robot.home.R).as_rotvec()])
    return suspended(robot, six, rs.cable_stiffness(robot).tensions)


def stays(robot: CableRobot, limit: np.ndarray, share: float) -> bool:
    """Whether the energy has a minimum under a share of a load, close to that of a little less."""
    bodies = bodies_of(robot)
    near = minimum(bodies, 0.1 * limit)
    for part in (*np.linspace(0.2, 0.9, 8), 0.99, 0.999, 1 - 2e-5):
        near = minimum(bodies, part * limit, 1.0, near.state)
    try:
        found = minimum(bodies, share * limit, 1.0, near.state)
    except NoMinimumError:
        return False
    is_close = np.linalg.norm((found.displacement - near.displacement)[:3]) < 2e-3
    return bool(is_close and curvatures(bodies, found.state)[0] > 0)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("size", [30.0, 400.0])
def test_equilibrium_is_a_minimum_of_an_energy_of_ours(seed: int, size: float):
    robot, random = random_robot(seed), np.random.default_rng(seed)
    F, at = size * random.normal(size=3), random.uniform(-0.3, 0.3, 3)
    found = rested(robot, wrench=[*F, 0, 0, 0], at=at)
    before = rs.cable_stiffness(robot)
    if not before.answered:
        assert found.status == rs.Status.INFEASIBLE
        return
    bodies = bodies_of(robot)
    bodies.centres[1] = at
    truth = minimum(bodies, np.array([*F, 0, 0, 0]))
    np.testing.assert_allclose(found.displacement, truth.displacement, rtol=0, atol=1e-10)
    stored = sum(
        own.tension**2 / (2 * k) for own, k in zip(found.springs, before.axial, strict=True)
    )
    assert np.isclose(found.energy, stored, rtol=1e-9)
    slack = any(own.tension == 0 for own in found.springs)
    assert bool(found.status & rs.Status.SLACK) == slack


def test_the_same_as_the_response_with_locked_winches():
    """Where the path turns by more than a right angle: a cable becomes slack (0.47 of the load)."""
    robot, load = rs.load("cable-4-planar"), [30.0, -100, 2]
    loaded, response = rested(robot, wrench=load), rs.cable_response(robot, wrench=load)
    assert response.displacement is not None
    np.testing.assert_allclose(loaded.displacement, response.displacement, atol=1e-13)
    np.testing.assert_allclose(loaded.K_total, answered(response).K, rtol=1e-9, atol=1e-6)
    assert [own.tension for own in loaded.springs] == pytest.approx(list(response.tensions))
    assert loaded.status == response.status


def test_a_load_above_topples_a_platform_at_one_cable():
    """``W c theta^2 / 2 - P h theta^2 / 2``, as both turn about the attachment."""
    W, c, h = 300.0, 0.4, 0.25
    rope = Cable("rope", [0, 2, 0], [0, 0, 0], EA=1e6)
    weight = Weight([0, -W, 0], [0, -c, 0])
    robot = CableRobot("plumb", (rope,), Frame.identity(), weight, space=Space.PLANAR)
    found = rs.critical_load(robot, wrench=[0, -1.0, 0], at=[0, h, 0])
    assert np.isclose(found.factor, W * c / h, rtol=1e-8)
    assert found.mode.startswith("the platform buckles: rotation about z")
    below, above = (
        rested(robot, wrench=[0, -s * found.factor, 0], at=[0, h, 0]) for s in (0.99, 1.01)
    )
    assert below.stable
    assert rs.Status.BEYOND_CRITICAL_LOAD in above.status


def test_a_platform_is_lifted_at_the_limit_of_its_path():
    robot, load = rs.load("cable-8-suspended"), np.array([0, 0, 1500.0, 0, 0, 0])
    found = rs.critical_load(robot, wrench=load)
    assert found.is_limit
    for share, holds in ((1 - 1e-5, True), (1 + 1e-3, False)):
        assert stays(robot, found.factor * load, share) == holds
    curve = rs.load_path(robot, wrench=load, factors=[0.3, 0.57, 1.0])
    assert curve.stable.values.tolist() == [True, True, False]
    assert np.isclose(curve.critical_factor.values[0], found.factor, rtol=1e-9)
    assert curve.critical_mode.values[0] == found.mode
    response = rs.cable_response(robot, wrench=load)
    assert np.isclose(response.carried, found.factor, rtol=1e-9)


def test_a_platform_whose_cables_are_all_slack_is_at_its_limit():
    """Lifted by its weight, it hangs no longer: the limit at every load beyond, however large."""
    robot = rs.load("cable-3-suspended")
    assert robot.weight is not None
    weight = float(np.linalg.norm(robot.weight.force))
    found = rs.critical_load(robot, wrench=[0, 0, 1200.0, 0, 0, 0])
    assert np.isclose(1200 * found.factor, weight, rtol=1e-6)
    assert (found.is_limit, found.mode) == (True, "the platform snaps through: translation along z")
    for part in (1.001, 80.0):
        answer = rs.equilibrium(robot, wrench=[0, 0, part * weight, 0, 0, 0])
        assert rs.Status.BEYOND_CRITICAL_LOAD in answer.status
        assert answer.critical is not None
        assert np.isclose(answer.critical.factor * part, 1, rtol=1e-6)


def test_another_equilibrium_far_beyond_a_limit_is_said_to_be_beyond_it():
    """Newton's method leads directly there, past the load at which the path ends."""
    robot, F = random_robot(470488, 12), np.array([5.484386, -4.562384, 29.192673, 0, 0, 0])
    limit = rs.critical_load(robot, wrench=F).factor
    assert np.isclose(limit, 23.3336, rtol=1e-4)
    answer = rs.equilibrium(robot, wrench=7 * limit * F)
    assert rs.Status.BEYOND_CRITICAL_LOAD in answer.status


@pytest.mark.parametrize(
    ("seed", "cables", "force"),
    [
        # another branch, and its critical point, lie within a step of the path
        pytest.param(131, 11, [326.286, -159.078, -110.654], marks=pytest.mark.slow),
        # the path turns back at the corner where a cable becomes slack
        (123, 10, [-209.107, 732.258, 110.285]),
    ],
)
def test_platforms_that_are_lost_where_a_cable_becomes_slack(
    seed: int, cables: int, force: list[float]
):
    robot, F = random_robot(seed, cables), np.array(force)
    found = rs.critical_load(robot, wrench=[*F, 0, 0, 0])
    assert found.is_limit
    carried = rs.cable_response(robot, wrench=[*(2 * found.factor * F), 0, 0, 0]).carried
    assert np.isclose(2 * carried, 1, atol=1e-3)
    limit = found.factor * np.array([*F, 0, 0, 0])
    assert rested(robot, wrench=(1 - 1e-5) * limit).stable
    for share, holds in ((1 - 1e-5, True), (1 + 1e-3, False)):
        assert stays(robot, limit, share) == holds


def test_modes_are_those_of_stiffness_and_mass():
    robot, inertia = rs.load("cable-8"), [0.1, 0.2, 0.3]
    found = rs.modes(robot, masses={"platform": rs.Mass(5, inertia=inertia)})
    squares = eigh(rs.stiffness(robot).K, np.diag([5, 5, 5, *inertia]), eigvals_only=True)
    np.testing.assert_allclose(2 * np.pi * found.frequencies, np.sqrt(squares), rtol=1e-9)


def test_loads_and_wrenches_are_one():
    robot, at = rs.load("cable-8"), np.array([0.05, -0.02, 1.1])
    by_load = rested(robot, loads={"platform": rs.DeadForce([9, 5, -60], at)})
    by_wrench = rested(robot, wrench=[9, 5, -60, 0, 0, 0], at=at)
    np.testing.assert_allclose(by_load.pose, by_wrench.pose, atol=1e-13)
    mass = rested(robot, loads={"platform": rs.Mass(7)})
    force = rested(robot, wrench=[0, 0, -7 * 9.80665, 0, 0, 0])
    np.testing.assert_allclose(mass.pose, force.pose, atol=1e-12)


def test_a_pose_is_held_by_the_wrench_that_leads_there():
    robot, F = rs.load("cable-8"), np.array([60.0, 40, -150, 1, 2, -1])
    loaded = rested(robot, wrench=F)
    held = rested(robot, displacement=loaded.displacement)
    assert loaded.status & rs.Status.SLACK
    np.testing.assert_allclose(held.wrench, F, atol=1e-8)


def test_what_tensions_leave_is_held_throughout():
    """Nothing moves without a load, and with one wherever wrenches are taken."""
    tensions = rs.cable_tensions(random_robot(3)).values
    robot = random_robot(3)
    given = tuple(
        Cable(
            own.name,
            own.exit_point,
            own.attachment,
            own.EA,
            own.guide_length,
            own.winch_stiffness,
            tension=float(t) + 20.0,
        )
        for own, t in zip(robot.cables, tensions, strict=True)
    )
    unbalanced = CableRobot("given", given, robot.home, robot.weight, robot.reference_point)
    still = rested(unbalanced)
    np.testing.assert_allclose(still.displacement, 0, atol=1e-12)
    assert still.status & rs.Status.UNBALANCED
    load = {"platform": rs.DeadForce([3, -2, 1], [0.1, 0.2, -0.1])}
    one, other = (rested(unbalanced, loads=load, at=at) for at in (None, [0.3, 0.1, 0.2]))
    assert np.max(np.abs(one.displacement)) > 1e-6
    np.testing.assert_allclose(one.pose, other.pose, atol=1e-13)


def test_batches_say_where_there_are_no_tensions():
    poses = [[0, 0, 1, 0, 0, 0], [0, 0, 3, 0, 0, 0]]
    found = rs.equilibrium(rs.load("cable-8"), poses, [0, 0, -10, 0, 0, 0])
    assert found.answered.tolist() == [True, False]
    assert found[1].status == rs.Status.INFEASIBLE
    robot = rs.load("cable-8")
    lost = rs.critical_load(robot, poses[1], [0, 0, 1, 0, 0, 0])
    assert not lost.is_found
    assert lost.status == rs.Status.INFEASIBLE
    assert rs.modes(robot, poses[1], masses={"platform": 1}).status == rs.Status.INFEASIBLE


def test_a_load_that_is_not_carried_is_refused_in_few_solves(monkeypatch: pytest.MonkeyPatch):
    """By its path alone; the cable that becomes slack before is met on it."""
    robot, solves = rs.load("cable-8-suspended"), 0
    real = EquilibriumProblem.linear_equations

    def counted(*given: Any) -> Any:
        nonlocal solves
        solves += 1
        return real(*given)

    assert robot.weight is not None
    load = np.array([0, 0, -1.5 * robot.weight.force[2], 0, 0, 0])
    with monkeypatch.context() as patch:
        patch.setattr(EquilibriumProblem, "linear_equations", counted)
        response = rs.cable_response(robot, wrench=load)
    assert not response.has_answer
    assert solves < 500
    event = response.first_slack
    assert event is not None
    assert event.factor < response.carried
    before, after = (
        rs.cable_response(robot, wrench=part * event.factor * load) for part in (0.9999, 1.0001)
    )
    assert not before.slack
    assert after.slack == (event.cable,)
