"""A batch of poses is the loop over its poses, whatever its shape and whatever happens in it."""

import numpy as np
import pytest

from robostiff.elastostatics import (
    Block,
    CartesianStiffness,
    IndexRules,
    Recursive,
    SaddlePoint,
    WrenchBasis,
    aggregate,
    chain_stiffness,
)
from tests.cases.metric import distance

SHAPES = [(), (3, 1, 4), (0,)]
FORMS = [WrenchBasis(), Block(), Recursive(groups=((1, 0), (2, 3))), SaddlePoint(), IndexRules()]


def mixed_poses(seed: int, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Chains of four joints whose numbers of free motions differ from pose to pose."""
    rng = np.random.default_rng(seed)
    C = np.zeros((number, 6, 6))
    J_q = np.zeros((number, 6, 4))
    for i in range(number):
        A = rng.normal(size=(6, 6))
        C[i] = 1e-6 * (A @ A.T + 0.1 * np.eye(6))
        J_q[i] = rng.normal(size=(6, 4))
        kind = i % 6
        if kind == 1:
            J_q[i, :, 2] = 3 * J_q[i, :, 0]
        elif kind == 2:
            J_q[i] = J_q[i, :, :1]
        elif kind == 3:  # rank(J_theta) = 2, and a rigid direction
            C[i] = 1e-6 * (A[:, :2] @ A[:, :2].T)
        elif kind == 4:  # rank(J_theta) = 3, and none
            C[i] = 1e-6 * (A[:, :3] @ A[:, :3].T)
        elif kind == 5:
            J_q[i] = np.eye(6)[:, [0, 3, 4, 3]]
    return C, J_q


def assert_same(one: CartesianStiffness, other: CartesianStiffness) -> None:
    assert int(one.rank) == int(other.rank)
    assert one.status == other.status
    assert np.array_equal(one.redundant, other.redundant)
    assert len(one.free_motions) == len(other.free_motions)
    assert len(one.rigid_directions) == len(other.rigid_directions)
    if one.answered:
        assert distance(one.K, other.K) <= 1e-12


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
@pytest.mark.parametrize("shape", SHAPES)
def test_batch_is_the_loop_over_poses(shape: tuple[int, ...], form):
    number = int(np.prod(shape, dtype=int))
    C, J_q = mixed_poses(3, number)
    batch = chain_stiffness(C.reshape(*shape, 6, 6), J_q.reshape(*shape, 6, 4), form=form)
    assert batch.batch_shape == shape
    assert batch.rank.shape == batch.status_codes.shape == shape
    assert np.isfinite(batch.matrix).all()
    for i, index in enumerate(np.ndindex(shape)):
        assert_same(batch[index], chain_stiffness(C[i], J_q[i], form=form))


def test_one_compliance_at_many_poses_and_one_pose_of_many_compliances():
    C, J_q = mixed_poses(5, 3)
    many_joints = chain_stiffness(C[0], J_q)
    many_springs = chain_stiffness(C, J_q[0])
    for i in range(3):
        assert_same(many_joints[i], chain_stiffness(C[0], J_q[i]))
        assert_same(many_springs[i], chain_stiffness(C[i], J_q[0]))


def test_aggregated_batch_is_the_loop_over_poses():
    C1, J1 = mixed_poses(6, 6)
    C2, J2 = mixed_poses(7, 6)
    whole = aggregate([chain_stiffness(C, J, length=1.0) for C, J in ((C1, J1), (C2, J2))])
    for i in range(6):
        legs = [chain_stiffness(C[i], J[i], length=1.0) for C, J in ((C1, J1), (C2, J2))]
        assert_same(whole[i], aggregate(legs))


def test_parts_joined_and_reshaped():
    C, J_q = mixed_poses(8, 6)
    parts = [chain_stiffness(C[k], J_q[k]) for k in (slice(0, 1), slice(1, 3), slice(3, 6))]
    joined = CartesianStiffness.joined(parts)
    shaped = joined.reshaped((3, 2))
    for i in range(6):
        assert_same(joined[i], chain_stiffness(C[i], J_q[i]))
        assert_same(shaped[i // 2, i % 2], chain_stiffness(C[i], J_q[i]))
