"""All indices of a pose at once."""

import dataclasses

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.indices import principal_stiffness
from robostiff.errors import InputError, NoAnswerError
from robostiff.page import principal_table


def numbers(value):
    """Every float inside an object."""
    if isinstance(value, rs.Stiffness):
        return
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from numbers(getattr(value, field.name))
    elif isinstance(value, tuple):
        for item in value:
            yield from numbers(item)
    elif isinstance(value, np.ndarray):
        yield from value.ravel().tolist()
    elif isinstance(value, float):
        yield value


@pytest.mark.parametrize("name", rs.shipped_robots())
def test_every_shipped_robot_has_indices_without_nan(name: str):
    found = rs.indices(rs.stiffness(rs.load(name)))
    assert np.all(np.isfinite(list(numbers(found))))
    assert found.status == found.result.status


def test_parts_agree_with_one_another():
    found = rs.indices(rs.stiffness(rs.load("six-joint-arm")), length=0.3)
    wrenches, twists = found.eigenscrews.wrenches, found.eigenscrews.twists
    assert np.allclose([w.stiffness for w in wrenches], found.principal.translational)
    assert np.allclose([t.stiffness for t in twists], found.collinear.rotational)
    assert np.isclose(found.worst_deflection.translational, 1 / found.collinear.smallest)
    assert np.isclose(found.virtual_work.worst, 0.5 / found.eigenstiffness.values[0])
    assert found.length == found.condition.length == found.virtual_work.length == 0.3


def test_the_length_is_the_robots_own_when_left_out():
    result = rs.stiffness(rs.load("hexapod"))
    assert isinstance(result, rs.Stiffness)
    assert rs.indices(result).length == float(result.length)


def test_a_batch_is_answered_pose_by_pose():
    robot = rs.load("3-puu")
    poses = np.array([[0.01, 0, 0.3], [1.0, 0, 0.3], [0, 0.02, 0.3]])
    found = rs.indices(rs.stiffness(robot, poses), length=0.2)
    assert found.answered.tolist() == [True, False, True]
    assert found.status_codes[1] == int(rs.Status.UNREACHABLE)
    assert [one is None for one in found] == [False, True, False]
    alone = rs.indices(rs.stiffness(robot, poses[2]), length=0.2)
    assert np.isclose(found[2].collinear.smallest, alone.collinear.smallest, rtol=1e-12)
    assert found[2].length == alone.length == 0.2
    with pytest.raises(NoAnswerError, match="falls short of the pose"):
        _ = found[1]
    assert len(found[found.answered]) == 2
    with pytest.raises(InputError, match="length"):
        rs.indices(rs.stiffness(robot, poses), length=-1.0)


def test_one_index_takes_one_pose():
    batch = rs.stiffness(rs.load("gough-stewart-b"), np.tile([0, 0, 0.8, 0, 0, 0], (3, 1)))
    with pytest.raises(InputError, match=r"got '3 poses', expected a single one; take result\[i\]"):
        principal_stiffness(batch)
    assert rs.indices(batch[1]).length > 0


def test_a_pose_out_of_reach_has_no_indices():
    with pytest.raises(NoAnswerError, match="falls short of the pose"):
        rs.indices(rs.stiffness(rs.load("3-puu"), [1.0, 0, 0.3]))


def test_something_else_is_refused():
    for other in (np.eye(6), rs.stiffness(rs.load("cable-8"))):
        with pytest.raises(InputError, match="a result of stiffness for a robot with legs"):
            rs.indices(other)  # pyright: ignore[reportCallIssue]


def test_far_away_points_do_not_blur_what_does_not_depend_on_them():
    result = rs.stiffness(rs.load("hexapod"))
    near, far = rs.indices(result), rs.indices(result.about(np.array([1e5, 0, 0])))
    assert np.allclose(far.centre_of_stiffness.point, near.centre_of_stiffness.point, atol=1e-9)
    for one, two in zip(near.eigenscrews.twists, far.eigenscrews.twists, strict=True):
        assert np.isclose(one.stiffness, two.stiffness, rtol=1e-12)


def test_a_moment_in_a_plane_is_about_z():
    table = principal_table(rs.indices(rs.stiffness(rs.load("3-rrr"))))
    assert [row[0] for row in table.rows] == ["force along x", "force along y", "moment about z"]
