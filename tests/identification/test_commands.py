"""The commands ``identify`` and ``plan``, and the files that they write."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.robots import robot_file
from tests.cli.running import Running
from tests.identification.campaigns import hexapod_campaign, hexapod_frames

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
ARM, CAMPAIGN = EXAMPLES / "loaded-arm.yaml", EXAMPLES / "campaign.csv"
ZEROS = ("--parameters", "arm/joint*", "--parameters", "arm/joint[2345].zero")


run = Running()


def test_the_campaign_of_the_examples(tmp_path):
    """The simulated machine has these compliances; the fit finds them, and says how well."""
    picture = tmp_path / "residuals.svg"
    found = run.answer("identify", ARM, CAMPAIGN, *ZEROS, "--plot", picture)
    truth = {
        **{"arm/joint1": 2.13e-6, "arm/joint2": 1.62e-6, "arm/joint3": 3.72e-6},
        **{"arm/joint4": 1.97e-5, "arm/joint5": 1.88e-5, "arm/joint6": 3.55e-5},
        **{"arm/joint2.zero": 4e-4, "arm/joint3.zero": -7e-4},
        **{"arm/joint4.zero": 3e-4, "arm/joint5.zero": -5e-4},
    }
    for name, value in truth.items():
        assert abs(found["values"][name] - value) < 3 * found["std"][name]
    assert found["status"] == "ok"
    assert picture.stat().st_size > 1000


def test_a_page_with_tables_and_residuals(tmp_path):
    page = tmp_path / "residuals.html"
    run.done("identify", ARM, CAMPAIGN, *ZEROS, "--plot", page)
    html = page.read_text("utf-8")
    assert html.startswith("<!doctype html>")
    assert "<title>loaded-arm, identified</title>" in html
    assert "status <b>ok</b>" in html
    assert '<img alt="Residuals of loaded-arm"' in html


def test_a_model_file_with_the_values(tmp_path):
    """Comments and order stay; the file is the robot that was found."""
    output = tmp_path / "identified.yaml"
    done = run.done("identify", ARM, CAMPAIGN, "--parameters", "arm/joint*", "-o", output, status=1)
    assert "does-not-fit" in done.output
    text, before = output.read_text().splitlines(), ARM.read_text().splitlines()
    assert len(text) == len(before)
    changed = [k for k, pair in enumerate(zip(text, before, strict=True)) if pair[0] != pair[1]]
    assert all("# +-" in text[k] and "from campaign.csv, 108 readings" in text[k] for k in changed)
    assert len(changed) == 6
    found = rs.identify(rs.load(ARM), rs.Measurements.read(CAMPAIGN, rs.load(ARM)), ["arm/joint*"])
    stiffness = [role.stiffness for role in rs.load(output).legs[0].chain.roles]
    for k, value in enumerate(stiffness, 1):
        assert 1 / value == pytest.approx(found.values[f"arm/joint{k}"], rel=1e-9)


def test_a_value_without_a_place_of_its_own(tmp_path):
    output = tmp_path / "identified.yaml"
    done = run.done("identify", ARM, CAMPAIGN, *ZEROS, "-o", output, status=2)
    assert "place of 'arm/joint2.zero'" in done.output
    assert "z2: 0 deg of a turn: [{z: z2}] before the joint" in done.output
    assert not output.exists()


def test_a_zero_has_a_place_as_the_parameter_of_a_turn(tmp_path):
    """As the message advises; in the fit it is the zero of the joint, and its unit is said."""
    joint, turn = (
        "      - {type: revolute, name: joint2,",
        "      - {type: rigid, turn: [{y: z2}]}\n",
    )
    text = ARM.read_text().replace("  fore:", "  z2: 0 deg\n  fore:").replace(joint, turn + joint)
    (tmp_path / "arm.yaml").write_text(text)
    written = tmp_path / "identified.yaml"
    words = "--parameters", "z2", "-o", written
    found = run.answer("identify", tmp_path / "arm.yaml", CAMPAIGN, *words, status=1)
    joint = run.answer("identify", ARM, CAMPAIGN, "--parameters", "arm/joint2.zero", status=1)
    for kind in ("values", "std"):
        assert found[kind]["z2"] == pytest.approx(joint[kind]["arm/joint2.zero"], rel=1e-6)
    (line,) = (line for line in written.read_text().splitlines() if "z2:" in line)
    assert re.match(r"  z2: [-0-9.]+ deg  # \+-[-0-9.e]+ rad \(95 %\), from", line)


def test_a_plan_has_the_units_of_parameters_and_says_how_far_markers_move():
    marks = ("--marker", "m1=0.1 0 0", "--marker", "m2=0 0.1 0", "--marker", "m3=-0.1 -0.1 0.05")
    given = ("--parameters", "k_joint", "--count", 3, "--candidates", 20, *marks)
    load = ("--force", "0 0 -6 kN", "--force", "5 kN 0 0")
    done = run("plan", "hexapod", *given, *load, "--sigma", "1 um")
    assert re.search(r"\nk_joint +\S+ N/m\n", done.output), done.output
    few = run.done("plan", "hexapod", *given, "--force", "0 0 -60 N", "--sigma", "20 um", status=2)
    assert re.search(r"less than 5 sigma, at most by 0\.[0-9]+: hang on larger loads", few.output)


def test_a_plan(tmp_path):
    output = tmp_path / "plan.csv"
    marks = ("--marker", "m1=0.08 0.1 0", "--marker", "m2=0.05 -0.09 0.08",
             "--marker", "m3=0.05 -0.05 -0.1")  # fmt: skip
    done = run.done(
        *("plan", ARM, "--parameters", "arm/joint*", "--count", 6, "--candidates", 40, *marks),
        *("--force", "600 N -300 N -900 N", "--hook", "0.12 0.15 0.05", "--json", "-o", output),
        *("--criterion", "test-pose", "--wrench", "0 0 -1000 N 0 0 0"),
    )
    found = json.loads(done.output)
    assert found["value"] < found["random"]
    lines = output.read_text().splitlines()
    assert lines[0].startswith("posture,joint1 [deg]")
    assert len(lines) == 7


@pytest.mark.parametrize(
    ("place", "complaint"),
    [
        (("--joints", "0.8 0.8 0.8 0.8 0.8 0.8"), ""),
        (("--pose", "tip 0 0 0.8 axis 0 0 1"), ""),
        (
            ("--joints", "0.8 0.8 0.8 0.8 0.8 8"),
            "got a pose out of reach, expected one in reach; leg 'leg1'",
        ),
    ],
)
def test_a_test_pose_is_given_as_any_pose(place, complaint):
    given = "--parameters", "leg1/actuator", "--marker", "m1=0 0.1 0", "--force", "0 0 -90 kN"
    load = "--criterion", "test-pose", "--wrench", "0 0 -1000 N 0 0 0", "--candidates", 8
    done = run("plan", "gough-stewart-b", *given, "--count", 3, *load, *place)
    assert done.exit_code == (2 if complaint else 0), done.output
    assert complaint in done.output


@pytest.mark.filterwarnings("ignore:.*identified.yaml.*nothing in the file uses 'k_screw'")
def test_one_value_for_six_legs_that_are_written_once(tmp_path):
    """Six values have no place in the pattern of a leg; one that they share has."""
    robot, output = rs.load("hexapod"), tmp_path / "identified.yaml"
    given = {"frames": hexapod_frames(), "measured": hexapod_campaign()}
    six = rs.identify(robot, parameters=["leg*/strut"], **given)
    with pytest.raises(rs.InputError, match=r"place of 'leg2/strut': got none of its own"):
        six.write(output, robot_file("hexapod"))
    assert not output.exists()
    one = rs.identify(robot, parameters=["leg*/strut"], shared=True, **given)
    one.write(output, robot_file("hexapod"))
    for leg in rs.load(output).legs:
        (strut,) = [own for own in leg.chain.elements if own.name == "strut"]
        assert 1 / strut.role.stiffness == pytest.approx(one.values["leg*/strut"], rel=1e-9)


def test_values_of_a_robot_description_are_written_as_its_side_file(tmp_path):
    """Joints that share a pattern get entries of their own; what the pattern says besides stays."""
    side, output = tmp_path / "ur5.stiffness.yaml", tmp_path / "identified.stiffness.yaml"
    text = (EXAMPLES / "ur5.stiffness.yaml").read_text()
    side.write_text(text.replace("{stiffness: 20 kN m/rad}", "{stiffness: 16 kN m/rad}"))
    robot, stiffer = (
        rs.load(EXAMPLES / "ur5.urdf", side=own) for own in (EXAMPLES / side.name, side)
    )
    q = np.random.default_rng(3).uniform(-1.5, 1.5, (12, 6))
    wrenches = np.random.default_rng(4).uniform(-50, 50, (12, 6))
    moved = [
        rs.deflection(stiffer, rs.JointCoordinates(own), wrench=w).twist
        for own, w in zip(q, wrenches, strict=True)
    ]
    measured = rs.Measurements(
        rs.JointCoordinates(q),
        np.array(moved)[:, :3],
        wrenches=wrenches,
        markers=["tip"] * 12,
        sigma=1e-6,
        kinds=rs.Reading.DISPLACEMENT,
    )
    frames = rs.KnownFrames({"tip": [0, 0, 0.12]})
    found = rs.identify(robot, measured, ["ur5/*joint"], frames=frames)
    assert found.outliers == ()  # of readings without noise residuals are rounding
    found.write(output, EXAMPLES / "ur5.urdf")
    again = rs.load(EXAMPLES / "ur5.urdf", side=output)
    elements = again.legs[0].chain.elements
    springs = {own.name: own.role.stiffness for own in elements if hasattr(own, "role")}
    assert len(springs) == 6
    for name, stiffness in springs.items():
        assert 1 / stiffness == pytest.approx(found.values[f"ur5/{name}"], rel=1e-9)
    assert found.values["ur5/elbow_joint"] == pytest.approx(1 / 16e3, rel=1e-2)
    assert all(line in output.read_text() for line in text.splitlines())


def test_dial_gauges_need_the_places_of_their_readings(tmp_path):
    file = tmp_path / "gauge.csv"
    file.write_text(
        "shoulder [deg],elbow [deg],Fy [N],marker,dx [um],dy [um],sigma [um]\n"
        "0,90,-100,tip,0,-250,5\n0,90,100,tip,0,251,5\n30,-60,-100,tip,20,-300,5\n"
    )
    asked = ("identify", "two-link-arm", file, "--parameters", "arm/shoulder")
    refused = run.done(*asked, status=2)
    hint = '--marker "tip=0 0 50 mm" --instrument "0 0 0 0 0 0"'
    assert hint in refused.stderr
    known = run(*asked, "--marker", "tip=0 0 50 mm", "--instrument", "0 0 0 0 0 0")
    assert "arm/shoulder" in known.stdout
