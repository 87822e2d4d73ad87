"""Laws of batches and of equality."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.elastostatics import CartesianStiffness, aggregate
from tests.cases.metric import distance

SHAPES = [(), (3, 1, 4), (0,)]
FORMS = [
    rs.WrenchBasis(),
    rs.Block(),
    rs.Recursive(groups=((1, 0), (2, 3))),
    rs.SaddlePoint(),
    rs.IndexRules(),
]


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
    batch = rs.chain_stiffness(C.reshape(*shape, 6, 6), J_q.reshape(*shape, 6, 4), form=form)
    assert batch.batch_shape == shape
    assert batch.rank.shape == batch.status_codes.shape == shape
    assert np.isfinite(batch.matrix).all()
    for i, index in enumerate(np.ndindex(shape)):
        assert_same(batch[index], rs.chain_stiffness(C[i], J_q[i], form=form))


def test_one_compliance_at_many_poses_and_one_pose_of_many_compliances():
    C, J_q = mixed_poses(5, 3)
    many_joints = rs.chain_stiffness(C[0], J_q)
    many_springs = rs.chain_stiffness(C, J_q[0])
    for i in range(3):
        assert_same(many_joints[i], rs.chain_stiffness(C[0], J_q[i]))
        assert_same(many_springs[i], rs.chain_stiffness(C[i], J_q[0]))


def test_aggregated_batch_is_the_loop_over_poses():
    C1, J1 = mixed_poses(6, 6)
    C2, J2 = mixed_poses(7, 6)
    whole = aggregate([rs.chain_stiffness(C, J, length=1.0) for C, J in ((C1, J1), (C2, J2))])
    for i in range(6):
        legs = [rs.chain_stiffness(C[i], J[i], length=1.0) for C, J in ((C1, J1), (C2, J2))]
        assert_same(whole[i], aggregate(legs))


def test_parts_joined_and_reshaped():
    C, J_q = mixed_poses(8, 6)
    parts = [rs.chain_stiffness(C[k], J_q[k]) for k in (slice(0, 1), slice(1, 3), slice(3, 6))]
    joined = CartesianStiffness.joined(parts)
    shaped = joined.reshaped((3, 2))
    for i in range(6):
        assert_same(joined[i], rs.chain_stiffness(C[i], J_q[i]))
        assert_same(shaped[i // 2, i % 2], rs.chain_stiffness(C[i], J_q[i]))


FORCE = [300.0, 100.0, -200.0, 0.0, 0.0, 0.0]
POSES = [[0, 0, 0.9, 0, 0, 0], [0, 0, 3.0, 0, 0, 0]]  # the second one is out of reach
ANSWERS: dict[str, Callable[[Any], Any]] = {
    "stiffness": rs.stiffness,
    "stiffness at poses": lambda robot: rs.stiffness(robot, POSES),
    "deflection": lambda robot: rs.deflection(robot, wrench=FORCE),
    "deflection at poses": lambda robot: rs.deflection(robot, POSES, FORCE),
    "equilibrium": lambda robot: rs.equilibrium(robot, wrench=FORCE),
    "modes": rs.modes,
    "modes at poses": lambda robot: rs.modes(robot, POSES),
    "indices": rs.indices,
    "verification": rs.verify,
    "posture": rs.find_posture,
}


def _pickled(what: Any) -> Any:
    return pickle.loads(pickle.dumps(what))  # noqa: S301  # of our own


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_is_equal_to_its_copies_and_to_the_same_answer(name: str) -> None:
    answer, again = (ANSWERS[name](rs.load("hexapod")) for _ in range(2))
    copies = [copy.copy(answer), copy.deepcopy(answer), _pickled(answer), again]
    for other in copies:
        assert answer == other
    assert answer != ANSWERS[name](rs.load("hexapod", {"k_joint": "100 N/um"}))


def test_answers_of_linkages_are_equal_to_their_pickles() -> None:
    lift = rs.load_linkage("double-pantograph")
    at, force = {"screw": -0.1}, [0, 0, -100, 0, 0, 0]
    answers = rs.stiffness(lift, at), rs.deflection(lift, at, force), rs.equilibrium(lift, at)
    for answer in (*answers, rs.stiffness(lift, [[-0.1], [-0.05]])):
        assert answer == _pickled(answer)


@pytest.mark.parametrize("name", ["hexapod", "delta", "six-joint-arm", "cable-8", "capaman"])
def test_a_robot_is_equal_to_one_of_the_same_values(name: str) -> None:
    robot = rs.load(name)
    assert robot == rs.load(name)
    assert robot == _pickled(robot)
    assert robot != rs.load("3-rps")
    assert robot != name


def test_a_robot_with_another_value_is_another_one() -> None:
    assert rs.load("hexapod") != rs.load("hexapod", {"R": "400.001 mm"})
    low, again, high = (rs.Frame(np.eye(3), np.array([0, 0, z])) for z in (0.5, 0.5, 0.6))
    assert low == again
    assert low != high


def test_another_question_has_another_answer() -> None:
    robot = rs.load("hexapod")
    assert rs.stiffness(robot) != rs.stiffness(robot, at=[0, 0, 1])
    assert rs.stiffness(robot) != rs.stiffness(robot, method=rs.Block())
    assert rs.stiffness(robot, POSES)[0] != rs.stiffness(robot, POSES)[1]


def test_modes_of_a_pickle_are_those_of_the_robot() -> None:
    found = rs.modes(rs.load("delta"))
    kept = _pickled(found)
    assert [str(mode) for mode in kept] == [str(mode) for mode in found]
