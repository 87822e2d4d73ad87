"""Stiffness of whole cable robots: laws, and ties to what is known otherwise."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.cables import structure_matrix, wrench_derivative
from robostiff.spatial import Space, skew
from tests.cables.machines import cable_robot, random_robot
from tests.campaign.bodies import minimum
from tests.campaign.loaded_cables import suspended

STATUS = rs.Status
NAMES = rs.shipped_cable_robots()


def test_without_tension_cables_hold_by_stretching_alone():
    robot = random_robot(0, weight=False)
    cables = tuple(replace(cable, least_tension=0.0) for cable in robot.cables)
    loose = rs.stiffness(replace(robot, cables=cables))
    assert loose.status == STATUS.UNTENSIONED
    np.testing.assert_allclose(loose.tensions, 0, atol=1e-12)
    W = structure_matrix(loose.placed)
    exact = W @ np.diag(loose.axial) @ W.T
    np.testing.assert_allclose(loose.K, exact, rtol=1e-10, atol=1e-10 * np.abs(exact).max())
    np.testing.assert_allclose(loose.taut_stiffness, 0, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_shipped_robots_stand_at_home(name):
    robot = cable_robot(name)
    assert isinstance(robot, rs.CableRobot)
    result = rs.stiffness(robot)
    assert result.status == STATUS.OK
    assert (np.linalg.eigvalsh(result.K) > 0).all()
    np.testing.assert_allclose(result.missing_wrench, 0, atol=1e-7)
    np.testing.assert_allclose(result.K, result.K.T, rtol=1e-12, atol=1e-9)
    assert result.rank == len(result.K)
    assert result.free_motions == result.unstable_motions == ()


@pytest.mark.parametrize("name", ["cable-8", "cable-3-suspended"])
def test_matrix_of_a_robot_is_that_of_its_energy(name):
    robot = cable_robot(name)
    result = rs.stiffness(robot)
    bodies = suspended(robot, np.append(robot.home.p, np.zeros(3)), result.tensions)
    exact = np.linalg.inv(minimum(bodies, np.zeros(6)).compliance)
    np.testing.assert_allclose(result.K, exact, rtol=1e-10, atol=1e-10 * np.abs(exact).max())


def test_a_wrench_that_is_held_changes_by_its_derivative():
    robot = cable_robot("cable-8")
    result = rs.cable_stiffness(robot, None, [20.0, -10, 30, 1, 2, -1])
    start, weight = result.reference_point, robot.weight
    assert weight is not None

    def held(d: np.ndarray) -> np.ndarray:
        R = Rotation.from_rotvec(d[3:]).as_matrix()
        forces = [(np.zeros(3), np.asarray(weight.force))]
        for cable, tension, k in zip(robot.cables, result.tensions, result.axial, strict=True):
            arm, before = R @ cable.attachment, cable.exit_point - start - cable.attachment
            v = cable.exit_point - start - d[:3] - arm
            length = np.linalg.norm(v)
            stretched = k * (length - np.linalg.norm(before))
            forces.append((arm, (tension + stretched) * v / length))
        return -np.sum([np.append(f, np.cross(arm, f)) for arm, f in forces], axis=0)

    h = 1e-6
    rates = np.stack([held(h * e) - held(-h * e) for e in np.eye(6)], axis=1) / (2 * h)
    derivative = wrench_derivative(result.K, held(np.zeros(6)))
    np.testing.assert_allclose(derivative, rates, atol=1e-9 * np.abs(rates).max())
    assert np.abs(result.K - rates).max() > 0.5  # of the moment


def test_batch_is_pose_by_pose():
    robot = cable_robot("cable-8-suspended")
    rng = np.random.default_rng(0)
    poses = [0, 0, 2, 0, 0, 0] + rng.uniform(-1, 1, (2, 6, 6)) * [3, 2, 1, 0.1, 0.1, 0.1]
    batch = rs.stiffness(robot, poses)
    assert batch.batch_shape == (2, 6)
    for index in np.ndindex(2, 6):
        one = rs.stiffness(robot, poses[index])
        assert one.status_codes == batch.status_codes[index]
        assert (one.rank, one.held_rank) == (batch.rank[index], batch.held_rank[index])
        if one.answered:
            np.testing.assert_allclose(batch[index].K, one.K, rtol=1e-9, atol=1e-6)


def test_another_point_is_the_matrix_of_a_robot_with_that_reference_point():
    robot = cable_robot("cable-8")
    tensions = rs.GivenTensions(np.linspace(60, 130, 8))  # held by others too
    offset = np.array([0.2, -0.1, 0.4])
    other = rs.cable_stiffness(replace(robot, reference_point=offset), tensions=tensions)
    moved = rs.cable_stiffness(robot, tensions=tensions, at=robot.home.p + offset)
    np.testing.assert_allclose(moved.K, other.K, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(moved.missing_wrench, other.missing_wrench, atol=1e-9)


def test_a_small_load_moves_a_platform_that_others_hold_as_its_stiffness_says():
    """Given tensions that do not balance: a moment M that others hold adds -skew(M) / 2 to K."""
    robot, rule = random_robot(2), rs.GivenTensions(np.full(8, 300.0))
    found = rs.cable_stiffness(robot, tensions=rule)
    K = found.K.copy()
    K[3:, 3:] -= 0.5 * skew(found.missing_wrench[3:])
    for F in 1e-2 * np.eye(6):
        ends: list[Any] = [
            rs.cable_response(robot, wrench=s * F, tensions=rule).displacement for s in (1, -1)
        ]
        moved = 0.5 * np.subtract(*ends)
        np.testing.assert_allclose(K @ moved, F, rtol=0, atol=1e-7)


def test_the_matrix_of_a_plane_is_part_of_that_in_space():
    robot = cable_robot("cable-4-planar")
    plane = rs.cable_stiffness(robot)
    tensions = rs.GivenTensions(plane.tensions)
    space = rs.cable_stiffness(replace(robot, space=Space.SPATIAL), tensions=tensions)
    rows = np.ix_([0, 1, 5], [0, 1, 5])
    np.testing.assert_allclose(space.K[rows], plane.K, rtol=1e-12, atol=1e-9)


def test_millimetres_decide_like_metres():
    robot = cable_robot("cable-3-suspended")
    assert robot.weight is not None
    for factor in (1e-3, 1e3):
        scaled = replace(
            robot,
            cables=tuple(
                replace(c, exit_point=factor * c.exit_point, attachment=factor * c.attachment)
                for c in robot.cables
            ),
            home=rs.Frame(np.eye(3), factor * robot.home.p),
            weight=replace(robot.weight, point=factor * robot.weight.point),
        )
        result = rs.stiffness(scaled)
        assert (result.status, int(result.rank), int(result.held_rank)) == (STATUS.OK, 6, 3)


def test_platform_hung_in_its_centre_of_mass_is_free_to_turn():
    rope = rs.Cable("rope", [0, 0, 1], [0, 0, 0], EA=1e5)
    robot = rs.CableRobot("plumb", (rope,), rs.Frame.identity(), rs.Weight([0, 0, -100]))
    result = rs.stiffness(robot)
    assert result.status == STATUS.FREE_MOTIONS
    assert (int(result.rank), int(result.held_rank)) == (3, 1)
    motions = [str(motion) for motion in result.free_motions]
    assert motions == [f"rotation about {axis} through (0, 0, 0) m" for axis in "xyz"]
    assert result.compliance is None


def test_weight_below_steadies_and_weight_above_topples():
    """A pendulum with its mass c below the eye: K_rx = F c; above it, -F c."""
    rope = rs.Cable("rope", [0, 0, 1], [0, 0, 0], EA=1e5)
    for c in (-0.2, 0.2):
        weight = rs.Weight([0, 0, -100], [0, 0, c])
        result = rs.stiffness(rs.CableRobot("pendulum", (rope,), rs.Frame.identity(), weight))
        # The eye moves sideways: two pendulums in series.
        assert result.K[3, 3] == pytest.approx(-100 * c)
        assert (STATUS.UNSTABLE in result.status) == (c > 0)
        assert len(result.unstable_motions) == (2 if c > 0 else 0)


def test_crossed_tension_topples_a_platform_and_is_reported():
    """Turning a bar pulled across itself: elastic only along the cables, geometric negative."""
    exits, ends = np.array([[1.0, 0, 0], [-1, 0, 0]]), np.array([[-0.2, 0, 0], [0.2, 0, 0]])
    cables = tuple(
        rs.Cable(f"c{i}", exits[i], ends[i], EA=1e5, least_tension=100) for i in range(2)
    )
    robot = rs.CableRobot("bar", cables, rs.Frame.identity(), space=Space.PLANAR)
    result = rs.stiffness(robot)
    assert result.status == STATUS.UNSTABLE
    assert result.rank == 3
    assert str(result.unstable_motions[0]) == "rotation about z through (0, 0, 0) m"
    assert result.K[2, 2] == pytest.approx(2 * 100 * (0.04 / 1.2 - 0.2))


def test_unstrained_length_decides_the_stiffness():
    """t = EA (l - l0)/l0 has the slope EA/l0 at any stretch."""
    EA, l0 = 1e4, 2.0
    for t in (0.0, 1e3, 5e3):
        length = l0 * (1 + t / EA)
        rope = rs.Cable("rope", [0, 0, length], [0, 0, 0], EA=EA)
        robot = rs.CableRobot("pendulum", (rope,), rs.Frame.identity())
        result = rs.cable_stiffness(robot, tensions=rs.GivenTensions([t]))
        assert result.axial[0] == pytest.approx(EA / l0, rel=1e-14)


def test_winch_is_in_series():
    rope = rs.Cable("rope", [0, 0, 2], [0, 0, 0], EA=1e4, guide_length=3.0, winch_stiffness=500.0)
    robot = rs.CableRobot("pendulum", (rope,), rs.Frame.identity())
    result = rs.stiffness(robot)
    assert result.axial[0] == pytest.approx(1 / (5 / 1e4 + 1 / 500))
    soft = replace(rope, EA=None)
    assert rs.stiffness(replace(robot, cables=(soft,))).axial[0] == pytest.approx(500)
