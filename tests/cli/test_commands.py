"""The commands as a user types them: output, exit status, messages."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.markup import in_words, page_html
from robostiff.page import robots_page
from robostiff.robots import (
    describe,
    robot_file,
    shipped_cable_robots,
    shipped_linkages,
    shipped_robots,
)
from tests.cli.running import Running
from tests.io.test_springs_and_laws import ARM

CASES = Path(__file__).parent.parent / "cases" / "data"


run = Running()
answer = run.answer


def test_json_of_stiffness_has_what_scripts_need():
    found = answer("stiffness", "gough-stewart-b")
    wanted = {
        "stiffness",
        "compliance",
        "rank",
        "free_motions",
        "redundant_joints",
        "status",
        "reference_point",
        "order",
        "units",
        "method",
    }
    assert wanted <= found.keys()
    assert found["status"] == "ok"
    assert found["method"] == "wrench-basis"
    assert found["order"]["twist"] == ["dx", "dy", "dz", "rx", "ry", "rz"]
    np.testing.assert_allclose(
        np.array(found["stiffness"]) @ np.array(found["compliance"]), np.eye(6), atol=1e-9
    )


def test_free_motions_in_words_and_no_compliance():
    found = answer("stiffness", "gough-stewart-a")
    words = [motion["description"] for motion in found["free_motions"]]
    assert words == [f"rotation about {axis} through (0, 0, 2) m" for axis in "xyz"]
    assert found["compliance"] is None
    assert found["rank"] == 3


def test_units_in_the_pose():
    written = answer("stiffness", "gough-stewart-b", "--pose", "10 mm 0 0.8 0 0 10 deg")
    plain = answer("stiffness", "gough-stewart-b", "--pose", f"0.01 0 0.8 0 0 {np.pi / 18}")
    np.testing.assert_allclose(written["stiffness"], plain["stiffness"], rtol=1e-12, atol=1e-4)


def test_at_moves_the_reference_point():
    found = answer("stiffness", "gough-stewart-b", "--at", "0 0 1")
    K = rs.stiffness(rs.load("gough-stewart-b"), at=[0, 0, 1]).K
    assert found["reference_point"] == [0, 0, 1]
    np.testing.assert_allclose(found["stiffness"], K)


def test_standard_input_takes_models_and_snapshots():
    model = robot_file("gough-stewart-b").read_text()
    snapshot = (CASES / "a10_oblique_baseU_tipS.json").read_text()
    assert answer("stiffness", "-", stdin=model)["rank"] == 6
    assert answer("stiffness", "-", stdin=snapshot)["rank"] == 1


def test_parameters_can_be_set():
    found = answer("stiffness", "gough-stewart-b", "--set", "k=2e8 N/m")
    plain = answer("stiffness", "gough-stewart-b")
    np.testing.assert_allclose(
        found["stiffness"], 2 * np.array(plain["stiffness"]), rtol=1e-12, atol=1e-6
    )


def test_a_form_that_does_not_hold_is_a_bad_status():
    found = answer("stiffness", "gough-stewart-b", "--method", "block", status=1)
    assert found["stiffness"] is None
    assert "form-does-not-hold" in found["status"]
    assert "rank(J_theta)" in found["advice"][0]


def test_an_unreachable_pose_is_a_bad_status_naming_legs():
    found = answer("stiffness", "3-puu", "--pose", "0.8 0 0.3", status=1)
    assert found["stiffness"] is None
    assert found["rank"] is None
    assert found["status"] == "unreachable"
    assert any("leg 'leg2' falls short of the pose by" in line for line in found["advice"])


def test_deflection_under_loads_at_bodies_is_that_of_the_library():
    at_strut = ("--load", "leg1/strut=0 0 -80 N", "--weight", "platform=12 kg")
    loads = {"leg1/strut": [0, 0, -80.0], "platform": rs.Mass(12.0)}
    hexapod = rs.load("hexapod")
    for more, gravity in (((), None), (("--gravity=-y",), "-y")):
        found = answer("deflection", "hexapod", *at_strut, *more)
        expected = rs.deflection(hexapod, loads=loads, gravity=gravity).twist
        np.testing.assert_allclose(found["deflection"], expected, rtol=1e-12)
    both = answer("deflection", "hexapod", *at_strut, "--wrench", "0 0 -100 N 0 0 0")
    F = [0, 0, -100.0, 0, 0, 0]
    expected = rs.deflection(hexapod, wrench=F, loads=loads).twist
    np.testing.assert_allclose(both["deflection"], expected, rtol=1e-12)


def test_deflection_under_gravity_is_that_of_the_library():
    arm, F = rs.load("six-joint-arm"), [0, 0, -150, 0, 0, 0]
    found = answer("deflection", "six-joint-arm", "--gravity=-z")
    np.testing.assert_allclose(found["deflection"], rs.deflection(arm, gravity="-z").twist)
    both = ("--gravity", "0 0 -9.80665", "--wrench", "0 0 -150 N 0 0 0")
    found = answer("deflection", "six-joint-arm", *both)
    expected = rs.deflection(arm, wrench=F, gravity="-z").twist
    np.testing.assert_allclose(found["deflection"], expected, rtol=1e-5)
    assert (
        "Fz -150 N; forces or weights at bodies" in run("deflection", "six-joint-arm", *both).stdout
    )
    assert "got 'none'" in run("deflection", "six-joint-arm").stderr


def test_springs_between_bodies_share_a_wrench(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(ARM, encoding="utf-8")
    found = answer("deflection", str(path), "--wrench", "0 0 -100 N 0 0 0")["deflection"]
    arm = rs.load(path)
    np.testing.assert_allclose(found, rs.deflection(arm, wrench=[0, 0, -100, 0, 0, 0]).twist)
    alone = rs.deflection(arm.with_springs(), wrench=[0, 0, -100, 0, 0, 0]).twist
    assert found[2] / alone[2] < 0.99


@pytest.mark.parametrize("name", shipped_robots())
def test_every_shipped_robot_can_be_checked_and_asked(name):
    assert answer("check", name)["name"] == name
    text = run("stiffness", name)
    assert text.exit_code == 0
    assert "status: " in text.stdout


def test_robots_lists_names_and_sources():
    listed = json.loads(run("robots", "--json").stdout)["robots"]
    assert [robot["name"] for robot in listed] == sorted(
        (*shipped_robots(), *shipped_cable_robots(), *shipped_linkages())
    )
    assert all(robot["source"] for robot in listed)
    lines = run("robots").stdout.splitlines()
    assert lines[0] == f"{len(listed)} robots come with robostiff:"
    assert [line.split()[0] for line in lines[2:]] == [robot["name"] for robot in listed]
    html = page_html(robots_page([describe(robot["name"]) for robot in listed]))
    assert all(in_words(robot["source"]) in html for robot in listed)


def test_the_installed_command_runs_in_a_process_of_its_own():
    command = [sys.executable, "-m", "robostiff.cli.main", "stiffness", "gough-stewart-b"]
    outcome = subprocess.run(command, capture_output=True, text=True, check=False)
    assert outcome.returncode == 0
    assert "rank 6 of 6" in outcome.stdout


def test_a_pose_without_an_answer_is_reported_without_a_traceback():
    outcome = run("verify", "3-puu", "--pose", "5 0 0")
    assert (outcome.exit_code, outcome.stdout) == (1, "")
    assert outcome.stderr.startswith("robostiff: error: nothing to verify: leg 'leg1' falls short")
