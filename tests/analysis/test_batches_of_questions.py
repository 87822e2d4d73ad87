"""Deflection, compliance and indices of many poses: the numbers and statuses of each pose alone."""

from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff.cli.main import app
from robostiff.kinematics import find_posture
from robostiff.spatial import Space
from tests.analysis.test_many_poses import posed, row_of

# Also free motions (at home of the first), a plane, closure by iteration, an arm, a loop in a leg.
ROBOTS = ["gough-stewart-a", "3-rpr", "3-rps", "six-joint-arm", "delta"]


def poses_of(robot: Any) -> Any:
    """Six poses: home among them, and, unless joints pose the robot, one out of reach."""
    poses = posed(robot, 6, 0.05)
    if isinstance(poses, rs.JointCoordinates):
        return poses
    poses[4] = poses[0] + (poses[4] - poses[0]) * 1e-9
    poses[2, 0] += 5.0
    return poses


@pytest.mark.parametrize("one_load", [True, False])
@pytest.mark.parametrize("name", ROBOTS)
def test_deflections_are_those_of_each_pose(name, one_load):
    robot: Any = rs.load(name)
    random, poses, n = np.random.default_rng(2), poses_of(robot), robot.space.size
    F = 100 * random.uniform(-1, 1, (6, n))
    F[4] = np.eye(n)[min(n - 1, 2)]  # along z, and in the plane a moment
    loads = np.tile(F[4], (6, 1)) if one_load else F
    at = random.uniform(-0.2, 0.2, (6, 3)) * [1, 1, robot.space is Space.SPATIAL]
    found = rs.deflection(robot, poses, F[4] if one_load else F, at=at)
    for i in range(6):
        alone = rs.deflection(robot, row_of(poses, i), loads[i], at=at[i])
        assert found.status_codes[i] == int(alone.status)
        assert found.answered[i] == alone.has_answer
        assert bool(found.twist.mask[i].any()) == (not alone.has_answer)
        assert found[i].advice == alone.advice
        if alone.has_answer:
            size = np.max(np.abs(alone.twist))
            np.testing.assert_allclose(found.twist[i], alone.twist, rtol=1e-9, atol=1e-9 * size)
            assert np.isclose(found.energy[i], alone.energy, rtol=1e-9)
            for own, expected in zip(found.leg_wrenches, alone.leg_wrenches, strict=True):
                np.testing.assert_allclose(own[i], expected, rtol=1e-8, atol=1e-7)
            assert [part.part for part in found[i].parts] == [part.part for part in alone.parts]
            assert np.isclose(found[i].parts[0].energy, alone.parts[0].energy, rtol=1e-9)
    assert found.status == rs.Status(int(np.bitwise_or.reduce(found.status_codes)))
    # Numbers are missing where a status says why, and nowhere else.
    bad = rs.Status.UNREACHABLE | rs.Status.UNBALANCED
    np.testing.assert_array_equal(found.answered, (found.status_codes & int(bad)) == 0)
    some = found[found.answered]
    assert len(some) == np.count_nonzero(found.answered) == len(list(some))
    assert not np.ma.getmaskarray(some.twist).any()


def test_deflections_over_a_grid_have_its_shape():
    robot: Any = rs.load("gough-stewart-b")
    poses = np.tile([0, 0, 0.8, 0, 0, 0], (2, 3, 1)) + np.linspace(0, 0.05, 6).reshape(2, 3, 1)
    found = rs.deflection(robot, poses, [0, 0, -100, 0, 0, 0])
    assert found.twist.shape == (2, 3, 6)
    assert found.energy.shape == found.status_codes.shape == (2, 3)
    assert found[1].twist.shape == (3, 6)
    assert np.array_equal(found[1, 2].twist, found.twist[1, 2])


@pytest.mark.parametrize("name", ["gough-stewart-a", "3-rpr"])
def test_indices_are_those_of_each_pose(name):
    robot: Any = rs.load(name)
    poses = poses_of(robot)
    found = rs.indices(robot, poses, length=0.2)
    assert len(found[found.answered]) == np.count_nonzero(found.answered)
    smallest = found.each(lambda one: one.collinear.smallest)
    worst = found.each(lambda one: one.worst_deflection.translational)
    for i, one in enumerate(found):
        if one is None:
            assert found.status_codes[i] == int(rs.Status.UNREACHABLE)
            assert smallest.mask[i]
            with pytest.raises(rs.NoAnswerError, match="no stiffness matrix"):
                _ = found[i]
            with pytest.raises(rs.NoAnswerError, match="no stiffness matrix"):
                rs.indices(robot, row_of(poses, i))
            continue
        alone = rs.indices(robot, row_of(poses, i), length=0.2)
        assert (one.status, one.length) == (alone.status, 0.2)
        assert np.isclose(smallest[i], alone.collinear.smallest, rtol=1e-9)
        assert bool(np.ma.getmaskarray(worst)[i]) == (alone.worst_deflection.translational is None)


def test_indices_need_no_inverse_of_k(monkeypatch):
    """Where the wrenches of the legs give the compliance."""
    result = rs.stiffness(rs.load("gough-stewart-b"))
    expected = np.linalg.inv(result.K)

    def refused(*_: Any) -> None:
        raise AssertionError("K is inverted")

    monkeypatch.setattr(np.linalg, "inv", refused)
    found = rs.indices(result)
    worst = np.linalg.eigvalsh(expected[:3, :3])[-1]
    assert np.isclose(found.worst_deflection.translational, worst, rtol=1e-9)


def test_near_chooses_the_posture_of_every_question(tmp_path):
    robot: Any = rs.load("3-rrr")
    pose = [0.02, 0.01, 0.1]
    own, *others = rs.postures(robot, pose)["leg1"]
    q = [leg[0] for leg in find_posture(robot, pose).coordinates]
    near = [others[0].coordinates, *q[1:]]
    K, plain = rs.stiffness(robot, pose, near=near).K, rs.stiffness(robot, pose).K
    assert own.of_home
    assert not np.allclose(K, plain, rtol=1e-3)
    assert np.array_equal(rs.indices(robot, pose, near=near).result.K, K)
    assert np.array_equal(rs.verify(robot, pose, near=near).reference.K, K)
    assert rs.verify(robot, pose, near=near).agree
    C = rs.compliance(robot, [pose, pose], near=near)
    np.testing.assert_allclose(C @ K, np.tile(np.eye(3), (2, 1, 1)), atol=1e-9)
    bent = rs.deflection(robot, [pose], [10, 0, 0], near=near)
    np.testing.assert_allclose(bent.twist[0], 10 * C[0, :, 0], rtol=1e-9)
    words = ["--pose", " ".join(map(str, pose)), "--near", " ".join(map(str, np.concatenate(near)))]
    smallest = rs.indices(robot, pose, near=near).collinear.smallest
    shown = CliRunner().invoke(app, ["indices", "3-rrr", *words, "--json"])
    assert shown.exit_code == 0
    assert f"{smallest:.9g}"[:8] in shown.stdout
    assert CliRunner().invoke(app, ["verify", "3-rrr", *words]).exit_code == 0
    page = tmp_path / "page.html"
    command = ["report", "3-rrr", "-o", str(page), *words]
    assert CliRunner().invoke(app, command).exit_code == 0
    assert page.exists()
