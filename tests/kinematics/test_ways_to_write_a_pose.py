"""Poses as tips and axes, as transforms, and rotations as they are written."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.kinematics.turn import vector_of_turn_near
from robostiff.spatial.rotation import (
    is_rigid_transform,
    matrix_of_rotation,
    nearest_rotation,
    vector_of_quaternion,
    vector_of_rotation,
)
from tests.project.shown_output import ROOT


@pytest.fixture(scope="module")
def machine() -> rs.Robot:
    return rs.load(str(ROOT / "examples/tricept-with-head.yaml"))


TIPS = np.array([[0.1, 0.05, -1.6], [0.0, 0.2, -1.7]])
AXES = np.array([[0.2, 0.1, 1.0], [0.0, -0.6, 2.0]])


def test_tip_and_axis_are_where_they_were_given(machine):
    result = rs.stiffness(machine, rs.ToolPose(TIPS, AXES))
    assert np.all(result.status_codes == 0)
    transform = result.transform
    np.testing.assert_allclose(transform.translation, TIPS, atol=1e-9)
    unit = AXES / np.linalg.norm(AXES, axis=1, keepdims=True)
    np.testing.assert_allclose(transform.rotation.as_matrix()[:, :, 2], unit, atol=1e-9)


def test_stiffness_is_that_of_the_whole_pose(machine):
    by_axis = rs.stiffness(machine, rs.ToolPose(TIPS[0], AXES[0]))
    again = rs.stiffness(machine, by_axis.transform)
    np.testing.assert_allclose(by_axis.K, again.K, atol=1e-9 * np.abs(again.K).max())


def test_tip_is_the_reference_point():
    robot = rs.load(str(ROOT / "examples/tricept.yaml"))
    home = rs.stiffness(robot)
    result = rs.stiffness(robot, rs.ToolPose(home.reference_point, [0, 0, 1]))
    np.testing.assert_allclose(result.pose, home.pose, atol=1e-9)


def test_a_machine_of_three_freedoms_does_not_reach_any_axis():
    robot = rs.load(str(ROOT / "examples/tricept.yaml"))
    assert rs.stiffness(robot, rs.ToolPose([0, 0, -1.45], [0, 1, 1])).status == (
        rs.Status.UNREACHABLE
    )


def test_six_freedoms_turn_the_shortest_way_then_spin():
    robot = rs.load("hexapod")
    tilted = rs.ToolPose([0, 0, 0.9], [0, np.sin(0.1), np.cos(0.1)])
    np.testing.assert_allclose(
        rs.find_posture(robot, tilted).pose[0], [0, 0, 0.9, -0.1, 0, 0], atol=1e-12
    )
    spun = rs.find_posture(robot, rs.ToolPose([0, 0, 0.9], [0, 0, 3], spin=[0.0, 0.2]))
    np.testing.assert_allclose(spun.pose[1], [0, 0, 0.9, 0, 0, 0.2], atol=1e-12)
    np.testing.assert_allclose(spun.pose[0], [0, 0, 0.9, 0, 0, 0.0], atol=1e-12)


def test_opposite_axis_is_a_half_turn():
    robot = rs.load("hexapod")
    R = rs.find_posture(robot, rs.ToolPose([0, 0, 0.9], [0, 0, -1])).snapshot
    assert R is not None
    pose = rs.find_posture(robot, rs.ToolPose([0, 0, 0.9], [0, 0, -1])).pose[0]
    assert np.linalg.norm(pose[3:]) == pytest.approx(np.pi)
    assert pose[5] == pytest.approx(0.0, abs=1e-9)


def test_another_axis_of_the_platform(machine):
    result = rs.stiffness(machine, rs.ToolPose([0, 0, -1.65], [0, 1, 0.1], tool_axis=[0, 1, 0]))
    R = result.transform.rotation.as_matrix()
    np.testing.assert_allclose(R[:, 1], np.array([0, 1, 0.1]) / np.hypot(1, 0.1), atol=1e-9)


@pytest.mark.parametrize("x", [0.2, -0.2, 0.6])
def test_a_head_that_stands_upright_turns_before_it_tilts_across_its_axis(machine, x: float):
    """Its axes are in the plane of the wanted one, so that no small motion leads there."""
    result = rs.stiffness(machine, rs.ToolPose([0.05, 0, -1.6], [x, 0, 1]))
    assert result.status == rs.Status.OK
    unit = np.array([x, 0, 1]) / np.hypot(x, 1)
    axis = result.transform.rotation.as_matrix()[:, 2]
    np.testing.assert_allclose(axis, unit, rtol=0, atol=1e-9)
    turned, tilted = result.joint_coordinates["machine"][-2:]
    assert abs(turned) == pytest.approx(np.pi / 2, abs=1e-9)
    assert abs(tilted) > 0.05


def test_coordinates_of_a_result_choose_its_posture_again(machine):
    pose = rs.ToolPose([0.05, 0, -1.6], [0.2, 0, 1])
    result = rs.stiffness(machine, pose)
    q = dict(result.joint_coordinates)
    for near in (q, {"machine": q["machine"].tolist()}):
        again = rs.stiffness(machine, pose, near=near)
        np.testing.assert_allclose(again.K, result.K, rtol=0, atol=1e-9 * np.abs(result.K).max())
        found = rs.find_posture(machine, pose, near=near).coordinates[0][0]
        np.testing.assert_allclose(found, q["machine"], rtol=0, atol=1e-9)
    legs = rs.stiffness(rs.load("3-rrr")).joint_coordinates
    assert rs.stiffness(rs.load("3-rrr"), near=legs).status == rs.Status.OK
    for wrong in ({}, {"machine": q["machine"], "other": [0.0]}, {"machine": [0.0]}):
        with pytest.raises(rs.InputError, match="near of 'tricept with head'"):
            rs.stiffness(machine, pose, near=wrong)


TURNS = Rotation.from_rotvec([[0.1, 0, 0.05], [0, -0.2, 0.1], [0, 0, 0.3]])
POSES = RigidTransform.from_components([[0, 0, 0.8], [0.01, 0, 0.82], [0, 0.02, 0.79]], TURNS)
MATRICES = POSES.as_matrix()


@pytest.fixture(scope="module")
def robot():
    return rs.load("gough-stewart-b")


@pytest.mark.parametrize(
    "pose",
    [
        MATRICES[1],
        MATRICES[1].tolist(),
        rs.Frame(MATRICES[1, :3, :3], MATRICES[1, :3, 3]),
        POSES[1],
    ],
    ids=["array", "list", "frame", "transform"],
)
def test_one_pose_however_it_is_written(robot, pose):
    six = [0.01, 0, 0.82, 0, -0.2, 0.1]
    found = rs.stiffness(robot, pose)
    np.testing.assert_allclose(found.K, rs.stiffness(robot, six).K, rtol=1e-12, atol=1e-3)
    np.testing.assert_allclose(found.pose, six, atol=1e-15)


def test_batches_of_matrices(robot):
    expected = rs.stiffness(robot, POSES)
    for pose in (MATRICES, MATRICES.tolist()):
        np.testing.assert_array_equal(rs.stiffness(robot, pose).K, expected.K)
    grid = np.stack([MATRICES, MATRICES])
    assert rs.stiffness(robot, grid).batch_shape == (2, 3)


def test_results_give_transforms(robot):
    one, many = rs.stiffness(robot, MATRICES[2]), rs.stiffness(robot, MATRICES)
    np.testing.assert_allclose(one.transform.as_matrix(), MATRICES[2], atol=1e-15)
    np.testing.assert_allclose(many.transform.as_matrix(), MATRICES, atol=1e-15)
    again = rs.stiffness(robot, many.transform)
    np.testing.assert_allclose(again.K, many.K, rtol=1e-9)


def test_four_rows_of_a_robot_with_four_coordinates_are_four_poses():
    h4 = rs.load("h4")
    assert len(h4.coordinates) == 4
    home = np.asarray(rs.stiffness(h4).pose)[h4.coordinate_places]
    rows = home + np.random.default_rng(1).uniform(-0.01, 0.01, (4, 4))
    assert rs.stiffness(h4, rows).batch_shape == (4,)


def test_planar_robots_take_transforms_in_their_plane():
    robot = rs.load("3-rrr")
    found = rs.stiffness(robot, [0.02, 0.01, 0.1])
    assert found.transform is not None
    again = np.asarray(rs.stiffness(robot, found.transform.as_matrix()).pose)
    np.testing.assert_allclose(again, np.asarray(found.pose), atol=1e-15)


ANGLES = [0.0, 1e-200, 1e-12, 1e-7, 1e-3, 0.5, 2.0, 3.0, np.pi - 1e-9, np.pi]


def directions(count: int = 50) -> np.ndarray:
    v = np.random.default_rng(3).normal(size=(count, 3))
    v = np.concatenate([v, np.eye(3), -np.eye(3), [[1, 1, 0], [0, -1, 1]]])
    return v / np.linalg.norm(v, axis=1)[:, None]


@pytest.mark.parametrize("angle", [*ANGLES, 5.0, 20.0])
def test_matrices_are_those_of_scipy(angle):
    r = angle * directions()
    R = matrix_of_rotation(r)
    np.testing.assert_allclose(R, Rotation.from_rotvec(r).as_matrix(), atol=1e-14)
    np.testing.assert_array_equal(R[7], matrix_of_rotation(r[7]))
    np.testing.assert_allclose(np.swapaxes(R, 1, 2) @ R, np.broadcast_to(np.eye(3), R.shape),
                               atol=1e-14)  # fmt: skip


@pytest.mark.parametrize("angle", ANGLES)
def test_vectors_give_their_matrices_back(angle):
    R = Rotation.from_rotvec(angle * directions()).as_matrix()
    r = vector_of_rotation(R)
    along = np.abs(np.sum(r * directions(), axis=1))
    np.testing.assert_allclose(along, angle, rtol=1e-13, atol=1e-300)
    np.testing.assert_allclose(matrix_of_rotation(r), R, atol=1e-14)
    if angle < np.pi - 1e-6:
        np.testing.assert_allclose(r, angle * directions(), rtol=0, atol=1e-13 * max(angle, 1e-300))


def test_quaternions_of_any_size_give_vectors():
    q = np.random.default_rng(4).normal(size=(200, 4)) * [1e-9, 1, 1, 1]
    r = vector_of_quaternion(q)
    np.testing.assert_allclose(r, Rotation.from_quat(q).as_rotvec(), atol=1e-14)


def test_a_matrix_of_few_digits_gets_the_nearest_rotation():
    R = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
    assert nearest_rotation(R) is R
    near = nearest_rotation(R.round(6))
    np.testing.assert_allclose(near @ near.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(near, Rotation.from_matrix(R.round(6)).as_matrix(), atol=1e-12)


def test_rigid_transforms_are_known():
    assert is_rigid_transform(RigidTransform.identity())
    assert not is_rigid_transform(Rotation.identity())


@pytest.mark.parametrize("near", [0.0, 1e-9, 2.0, np.pi, 4.0])
def test_vectors_on_entries_are_those_near_another(near):
    """Also around half a turn, where the shortest vector jumps, and beyond it."""
    axis = np.array([2.0, -1.0, 2.0]) / 3
    others = np.random.default_rng(3).uniform(-1.5, 1.5, (40, 3))
    for other in [np.zeros(3), *others]:
        turned = Rotation.from_rotvec(near * axis) * Rotation.from_rotvec(other)
        found = vector_of_turn_near(turned.as_matrix().astype(object), near * axis).astype(float)
        again = Rotation.from_rotvec(found).inv() * turned
        assert again.magnitude() < 1e-14
    beyond = Rotation.from_rotvec((near + 0.2) * axis).as_matrix().astype(object)
    found = vector_of_turn_near(beyond, near * axis).astype(float)
    np.testing.assert_allclose(found, (near + 0.2) * axis, atol=1e-14)
