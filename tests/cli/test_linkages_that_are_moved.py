"""Pictures and reports of a linkage at joint coordinates."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.errors import NoAnswerError
from robostiff.report import report_contents
from robostiff_view import machine_of
from tests.cli.running import Running

PANTOGRAPH, LOW = "double-pantograph", ("--joints", "screw=-50 mm")
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
        outcome = run("plot", PANTOGRAPH, *joints, *options, "-o", str(path))
        assert outcome.exit_code == 0, outcome.stderr
    assert here.read_text() != there.read_text()
    if not options or options == LOAD:
        assert "screw −50 mm" in there.read_text(encoding="utf-8")


def test_a_report_has_the_coordinates_of_all_joints(tmp_path, low):
    path = tmp_path / "low.html"
    outcome = run("report", PANTOGRAPH, *LOW, *LOAD, "--finite-load", "-o", str(path))
    assert outcome.exit_code == 0, outcome.stderr
    html = path.read_text(encoding="utf-8")
    assert "At screw −50 mm: status" in html
    assert 'value="-0.05"' in html
    assert "Under finite load" in html
    contents = report_contents(rs.load_linkage(PANTOGRAPH), {"screw": -0.05})
    np.testing.assert_allclose(contents.stiffness.K, rs.stiffness(low).K)


def test_the_sliders_of_a_view_begin_there():
    machine = machine_of(rs.load_linkage(PANTOGRAPH), {"screw": -0.05})
    (screw,) = machine.sliders
    assert (screw.name, screw.unit, screw.start) == ("screw", "mm", -50.0)


def test_out_of_reach_is_no_answer(tmp_path):
    with pytest.raises(NoAnswerError, match="do not close"):
        report_contents(rs.load_linkage(PANTOGRAPH), {"screw": -5.0})
    outcome = run("equilibrium", PANTOGRAPH, "--joints", "screw=-5", *LOAD)
    assert outcome.exit_code == 1
    assert "do not close" in outcome.stderr
