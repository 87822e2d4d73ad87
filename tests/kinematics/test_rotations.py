"""Rotation matrices and rotation vectors against those of SciPy."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from robostiff.kinematics.turn import vector_of_turn_near
from robostiff.spatial.rotation import (
    is_rigid_transform,
    matrix_of_rotation,
    nearest_rotation,
    vector_of_quaternion,
    vector_of_rotation,
)

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
