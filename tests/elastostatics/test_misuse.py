"""Misuse is an exception that says what came and what was expected."""

import numpy as np
import pytest

import robostiff as rs
from robostiff import InputError
from robostiff.elastostatics import aggregate, aggregate_matrices, eliminate_index
from robostiff.spatial import Space, screw_of_twist, skew, twist_transport

E6 = np.eye(6)
NO_JOINTS = np.zeros((6, 0))
LOPSIDED = E6 + np.eye(6, k=1)


@pytest.mark.parametrize(
    ("C", "J_q", "message"),
    [
        (np.eye(6)[:5], NO_JOINTS, r"compliance of the chain: got \(5, 6\)"),
        (np.ones(6), NO_JOINTS, r"compliance of the chain: got \(6,\)"),
        (np.eye(5), np.zeros((5, 1)), "matrix size: got 5"),
        (E6, np.zeros(6), r"passive joint Jacobian: got \(6,\)"),
        (E6, np.zeros((3, 2)), r"expected a shape \(\.\.\., 6, q\)"),
        (E6, np.full((6, 1), np.nan), "finite number"),
        (np.full((6, 6), np.inf), NO_JOINTS, "finite number"),
        (LOPSIDED, NO_JOINTS, r"entries \[0, 1\] and \[1, 0\].*symmetric"),
    ],
)
def test_matrices_that_do_not_fit(C: np.ndarray, J_q: np.ndarray, message: str):
    with pytest.raises(InputError, match=message):
        rs.chain_stiffness(C, J_q)


def test_without_joints_the_message_says_what_to_write():
    with pytest.raises(InputError, match=r"np\.zeros\(\(3, 0\)\)"):
        rs.chain_stiffness(np.eye(3), [])


def test_asymmetry_of_one_pose_of_a_batch_is_reported():
    with pytest.raises(InputError, match=r"symmetric matrix"):
        rs.chain_stiffness(np.stack([E6, LOPSIDED]), NO_JOINTS)


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf])
def test_length_must_be_positive(length: float):
    with pytest.raises(InputError, match="characteristic length"):
        rs.chain_stiffness(E6, NO_JOINTS, length=length)


@pytest.mark.parametrize("groups", [((0,),), ((0, 1), (1, 2)), ((0, 1), (3,)), ((0, 1, 2, 3),), ()])
def test_groups_hold_each_joint_once(groups: tuple[tuple[int, ...], ...]):
    with pytest.raises(InputError, match=r"each of the 3 joints 0 to 2 once"):
        rs.chain_stiffness(E6, E6[:, :3], form=rs.Recursive(groups=groups))


@pytest.mark.parametrize("p", [-1, 6])
def test_index_out_of_range(p: int):
    with pytest.raises(InputError, match=f"got {p}, expected 0 to 5"):
        eliminate_index(E6, p)


def test_nothing_to_aggregate():
    with pytest.raises(InputError, match="at least one leg"):
        aggregate([])
    with pytest.raises(InputError, match="got 1, expected 2, one a leg"):
        aggregate_matrices([E6, E6], [np.zeros(3)])


@pytest.mark.parametrize(
    "numbers",
    [{"independence": 0.0}, {"independence": 1e-3}, {"rigidity": 1e-3}, {"near_rigidity": 2.0}],
)
def test_tolerances_in_order(numbers: dict[str, float]):
    with pytest.raises(InputError, match="0 < strict <= near < 1"):
        rs.Tolerance(**numbers)


def test_vectors_and_sizes_of_the_wrong_length():
    with pytest.raises(InputError, match="2 or 3 components"):
        twist_transport(np.zeros(4))
    with pytest.raises(InputError, match="matrix size"):
        Space.of_size(4)
    with pytest.raises(InputError, match="a motion, not zero"):
        screw_of_twist(np.zeros(6), np.zeros(3), 1.0)


def test_forms_are_objects_with_names():
    assert rs.IndexRules().name == "index-rules"
    assert rs.Recursive() == rs.Recursive(groups=None)
    assert hash(rs.Recursive(groups=((1, 0),))) is not None


def test_shapes_are_checked_while_testing():
    jaxtyping = pytest.importorskip("jaxtyping")
    with pytest.raises(jaxtyping.TypeCheckError, match="parameter 'v'"):
        skew(np.zeros(4))
