"""--near chooses a posture on the command line."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.cli import pictures
from robostiff.io.map_files import read_map
from robostiff.model import PlacedFreedom
from robostiff.plot.picture import Path, Scene
from tests.cli.running import Running

run = Running()
printed = run.answer


def test_near_chooses_the_other_posture():
    robot, pose = rs.load("3-rrr"), [0.02, 0.01, 0.1]
    other = [own[-1].coordinates for own in rs.postures(robot, pose).values()]
    words = " ".join(f"{value:.17g}" for q in other for value in q)
    command = ["stiffness", "3-rrr", "--pose", "0.02 0.01 0.1"]
    home, near = printed(*command), printed(*command, "--near", words)
    expected = rs.stiffness(robot, pose, near=other).K
    K = np.array(near["stiffness"])
    assert np.allclose(K, expected, rtol=1e-9)
    apart = K - np.array(home["stiffness"])
    assert np.abs(apart).max() > 1e-3 * np.abs(K).max()


@pytest.mark.parametrize("what", ["robot", "ellipsoids", "deflection"])
def test_near_chooses_the_posture_that_is_drawn(what, tmp_path, monkeypatch):
    robot, pose = rs.load("3-rrr"), [0.02, 0.01, 0.1]
    other = [own[-1].coordinates for own in rs.postures(robot, pose).values()]
    words = " ".join(f"{value:.17g}" for q in other for value in q)
    drawn: list[Scene] = []
    monkeypatch.setattr(pictures, "draw", lambda picture, *_: drawn.append(picture))
    load = ["--wrench", "100 20 3"] if what == "deflection" else []
    command = ["plot", "3-rrr", "--what", what, "--pose", "0.02 0.01 0.1", *load]
    for more in ([], ["--near", words]):
        run(*command, *more, "-o", str(tmp_path / "robot.png"))
    posed = rs.find_posture(robot, pose, near=other).snapshot.one(0)
    factor = 1e3 if "mm" in drawn[0].axes[0] else 1.0
    joints = [part for leg in posed.legs for part in leg.elements]
    elbows = factor * np.array([part.point for part in joints if isinstance(part, PlacedFreedom)])
    home, near = (
        [item.points for item in picture.items if isinstance(item, Path)] for picture in drawn
    )
    size = np.ptp(elbows, axis=0).max()

    def missed(lines):
        points = np.concatenate(lines)
        apart = np.linalg.norm(elbows[:, None, :2] - points[None, :, :2], axis=-1)
        return apart.min(axis=1).max() / size

    assert missed(near) < 1e-9
    assert missed(home) > 1e-2


def test_joints_of_a_parallel_robot_are_those_of_its_actuators():
    robot = rs.load("hexapod")
    home = [float(q[0, 2]) for q in rs.find_posture(robot).coordinates]
    in_mm = " ".join(f"{1e3 * q + 10:.12g} mm" for q in home)
    q = rs.ActuatorCoordinates(np.array(home) + 0.01)
    expected = np.asarray(rs.stiffness(robot, q).pose)
    found = printed("stiffness", "hexapod", "--joints", in_mm)["pose"]
    assert np.allclose(found, expected, atol=1e-9)
    one = printed("stiffness", "hexapod", "--joints", f"leg2/strut={home[1] + 0.01:.12g}")["pose"]
    longer = rs.ActuatorCoordinates({"leg2/strut": home[1] + 0.01})
    expected = np.asarray(rs.stiffness(robot, longer).pose)
    assert np.allclose(one, expected, atol=1e-9)


def test_tip_and_axis_as_a_pose():
    found = printed("stiffness", "hexapod", "--pose", "tip 0 0 900 mm axis 0 0 1 spin 10 deg")
    assert np.allclose(found["pose"], [0, 0, 0.9, 0, 0, np.pi / 18], atol=1e-9)


def test_near_of_a_map(tmp_path):
    robot, grid = rs.load("3-rrr"), rs.Grid(x=rs.Axis(-0.02, 0.02, 2), rz=rs.Axis(0.05, 0.1, 2))
    other = [own[-1].coordinates for own in rs.postures(robot, [0.0, 0.0, 0.07]).values()]
    words = " ".join(f"{value:.17g}" for q in other for value in q)
    command = ["map", "3-rrr", "--x", "-0.02 0.02 2", "--rz", "0.05 0.1 2", "--near"]
    ending = ["--quantity", "stiffness", "-o"]
    found = tmp_path / "near.zarr"
    result = run(*command, words, *ending, str(found))
    assert result.exit_code == 0, result.output
    expected = rs.stiffness_map(robot, grid, [rs.Quantity.STIFFNESS], near=other)
    with read_map(found) as stored:
        assert np.allclose(stored.K, expected.K, rtol=1e-9)
    home = rs.stiffness_map(robot, grid, [rs.Quantity.STIFFNESS])
    assert np.abs(expected.K - home.K).max() > 1e-3 * np.abs(home.K).max()
