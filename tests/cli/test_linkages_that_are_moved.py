"""Linkages at joint coordinates, and the posture of --near: numbers, pictures, maps and reports."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.cli import pictures
from robostiff.errors import NoAnswerError
from robostiff.io.map_files import read_map
from robostiff.model import PlacedFreedom
from robostiff.plot.picture import Path, Scene
from robostiff.report import report_contents
from tests.cli.running import Running
from tests.project.shown_output import ROOT

PANTOGRAPH = "double-pantograph"
LOW = ("--joints", "screw=-50 mm")
DATA = rs.plot.PictureData()
LOAD = ("--wrench", "0 0 -100 N 0 0 0")
run = Running()


@pytest.fixture(scope="module")
def low():
    return rs.network_at(rs.load_linkage(PANTOGRAPH), {"screw": -0.05})


@pytest.mark.parametrize("options", [(), LOAD, ("--what", "ellipsoids")])
def test_a_picture_is_of_the_given_coordinates(tmp_path, options):
    here, there = tmp_path / "home.svg", tmp_path / "low.svg"
    for path, joints in ((here, ()), (there, LOW)):
        run.done("plot", PANTOGRAPH, *joints, *options, "-o", str(path))
    assert here.read_text() != there.read_text()
    if not options or options == LOAD:
        assert "screw −50 mm" in there.read_text(encoding="utf-8")


def test_a_report_has_the_coordinates_of_all_joints(tmp_path, low):
    path = tmp_path / "low.html"
    run.done("report", PANTOGRAPH, *LOW, *LOAD, "--finite-load", "-o", str(path))
    html = path.read_text(encoding="utf-8")
    assert "At screw −50 mm: status" in html
    assert 'value="-0.05"' in html
    assert "Under finite load" in html
    contents = report_contents(rs.load_linkage(PANTOGRAPH), {"screw": -0.05})
    np.testing.assert_allclose(contents.stiffness.K, rs.stiffness(low).K)


def test_out_of_reach_is_no_answer(tmp_path):
    with pytest.raises(NoAnswerError, match="do not close"):
        report_contents(rs.load_linkage(PANTOGRAPH), {"screw": -5.0})
    outcome = run.done("equilibrium", PANTOGRAPH, "--joints", "screw=-5", *LOAD, status=1)
    assert "do not close" in outcome.stderr


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


def test_near_of_a_map(tmp_path):
    robot, grid = rs.load("3-rrr"), rs.Grid(x=rs.Axis(-0.02, 0.02, 2), rz=rs.Axis(0.05, 0.1, 2))
    other = [own[-1].coordinates for own in rs.postures(robot, [0.0, 0.0, 0.07]).values()]
    words = " ".join(f"{value:.17g}" for q in other for value in q)
    command = ["map", "3-rrr", "--x", "-0.02 0.02 2", "--rz", "0.05 0.1 2", "--near"]
    ending = ["--quantity", "stiffness", "-o"]
    found = tmp_path / "near.zarr"
    run.done(*command, words, *ending, str(found))
    expected = rs.stiffness_map(robot, grid, [rs.Quantity.STIFFNESS], near=other)
    with read_map(found) as stored:
        assert np.allclose(stored.K, expected.K, rtol=1e-9)
    home = rs.stiffness_map(robot, grid, [rs.Quantity.STIFFNESS])
    assert np.abs(expected.K - home.K).max() > 1e-3 * np.abs(home.K).max()


FOUR_BAR = str(ROOT / "examples/four-bar.xml")


def test_a_map_over_a_joint_also_of_legs(tmp_path):
    path = tmp_path / "map.nc"
    run.done("map", FOUR_BAR, "--joint", "crank -10 deg 10 deg 3", "-o", str(path))
    with read_map(path) as stored:
        assert stored.crank.attrs["units"] == "rad"
        assert stored.translational_stiffness.attrs["units"] == "N/m"
        assert (stored.status == 0).all()
        assert np.allclose(stored.crank, np.radians([-10, 0, 10]))
