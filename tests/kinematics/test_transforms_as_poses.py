"""Poses as matrices, frames and rigid transforms."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs

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
