"""Commands: what they print, check, plot and report beside what ``answers.txt`` has of them."""

import json
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff.cli.main import app
from robostiff.markup import in_words, page_html
from robostiff.page import robots_page
from robostiff.robots import describe, shipped_cable_robots, shipped_linkages, shipped_robots
from tests.cli.running import Running

run = Running()
answer = run.answer


@pytest.mark.parametrize("name", shipped_robots())
def test_every_shipped_robot_can_be_checked_and_asked(name):
    assert answer("check", name)["name"] == name
    text = run.done("stiffness", name)
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


def shown(*arguments: str, color: bool = True) -> str:
    return CliRunner().invoke(app, [*arguments], color=color).stdout


def test_status_and_advice_stand_out():
    text = shown("stiffness", "gough-stewart-a")
    assert click.style("status: free-motions", bold=True) in text
    assert click.style("advice: the platform can move", fg="yellow")[:-4] in text
    assert click.style("status: ok", fg="green") in shown("stiffness", "hexapod")


def test_lines_are_those_of_a_file_and_matrices_fit_eighty_columns():
    load = ("--wrench", "200 N 0 -500 0 10 0")
    there = ("stiffness", "3-puu", "--pose", "0.08 0.05 0.25")
    for words in (there, ("deflection", "hexapod", *load)):
        plain = shown(*words, color=False)
        assert click.unstyle(shown(*words)) == plain
        assert max(len(line) for line in plain.splitlines() if "  " in line) <= 80


EXAMPLES = Path(__file__).parents[2] / "examples"
TABLE = (Path(__file__).parent / "data" / "table.yaml").read_text(encoding="utf-8")
check = Running("check")
facts = check.answer


def test_coordinates_that_the_legs_leave_no_room_for(tmp_path):
    file = tmp_path / "table.yaml"
    file.write_text(TABLE.replace("[x, y, z, rx, ry, rz]", "[z, rx, ry]"))
    assert "freedoms at home" not in check(str(file)).stdout
    file.write_text(TABLE.replace("[x, y, z, rx, ry, rz]", "[x, y]"))
    outcome = check.done(str(file), status=2)
    assert "the 3 freedoms that the legs leave it" in outcome.stderr
    assert "write coordinates: [z, rx, ry], or leave it out" in outcome.stderr


def test_free_directions_of_springs_are_counted(tmp_path):
    file, k = tmp_path / "table.yaml", "1e8 N/m"
    place = "      - {type: universal, axes: [y, x], role: passive}\n"
    for written, words in {
        f"stiffness: [{k}, {k}, {k}, 0, 0, 0]": "bearing (3 free directions), universal1 (passive)",
        f"stiffness: [{k}, {k}, {k}, 1e5, 1e5, 0]": "bearing (1 free direction), universal1",
        "compliance: [1e-8, 1e-8, 1e-8, 0, 0, 0]": "bearing, universal1 (passive)",
    }.items():
        spring = f"      - {{type: spring, name: bearing, {written}}}\n"
        file.write_text(TABLE.replace(place, spring + place))
        assert f"leg1: {words}" in check(str(file)).stdout


def test_masses_of_a_snapshot_are_those_of_its_robot(tmp_path):
    for name in ("six-joint-arm", "orthoglide", str(EXAMPLES / "tricept-with-head.yaml")):
        file = tmp_path / "placed.json"
        Running("convert")(name, "-o", str(file), "--overwrite")
        placed, model = facts(str(file))["masses"], facts(name)["masses"]
        assert placed["parts"] == pytest.approx(model["parts"])
        assert placed["centre"] == pytest.approx(model["centre"], abs=1e-12)
        Running("convert")(name, "--to", "graph", "-o", str(file), "--overwrite")
        bodies = facts(str(file))["masses"]
        assert bodies["total"] == pytest.approx(model["total"])
        assert bodies["centre"] == pytest.approx(model["centre"], abs=1e-12)
        assert "masses: " in check(str(file)).stdout


def test_drives_whose_stiffness_depends_on_them_are_written(tmp_path):
    table, file = str(EXAMPLES / "ball-screws.yaml"), tmp_path / "placed.yaml"
    Running("convert").done(table, "--joints", "x=0.4", "-o", str(file))
    moved = rs.stiffness(rs.load(table), rs.JointCoordinates([0.4, 0])).K
    np.testing.assert_allclose(rs.stiffness(rs.load(file)).K, moved, rtol=1e-12, atol=1)


ROBOTS = Path(rs.__file__).parent / "robots"
STAR = str(Path(__file__).parents[2] / "docs" / "star-platform.yaml")
LOAD = ("--wrench", "100 N 0 -50 0 0 0")
PLANE = ("--wrench", "100 N 0 0")


plot = Running("plot")


@pytest.mark.parametrize(
    ("subject", "options", "ending", "written"),
    [
        ("hexapod", (), "svg", "strut.beam1"),
        ("hexapod", ("--what", "free-motions"), "svg", "no free motion"),
        ("hexapod", ("--what", "ellipsoids", "--quality", "stiffness"), "html", "rotations held"),
        ("hexapod", ("--what", "matrix", "--pose", "50 mm 0 0.9 0 0 0"), "svg", "relative size"),
        ("3-rrr", ("--what", "energy", *PLANE), "svg", "elastic energy"),
        ("six-joint-arm", ("--what", "modes"), "svg", "mode 1"),
        ("double-pantograph", LOAD, "svg", "displacements"),
        ("double-pantograph", ("--what", "energy", *LOAD), "svg", "elastic energy"),
        ("double-pantograph", ("--what", "ellipsoids"), "svg", "compliance"),
        ("cable-4-planar", PLANE, "svg", "without load"),
        ("cable-8", ("--what", "matrix"), "svg", "cable-8"),
        pytest.param(STAR, LOAD, "svg", "displacements", id="star-platform"),
    ],
)
def test_anything_is_drawn(tmp_path, subject, options, ending, written):
    file = tmp_path / f"picture.{ending}"
    outcome = plot(subject, *options, "-o", str(file))
    assert (outcome.exit_code, outcome.stdout) == (0, f"{file}\n"), outcome.stderr
    text = file.read_text(encoding="utf-8")
    if ending == "svg":  # texts are comments before the paths that draw them
        text = " ".join(line for line in text.splitlines() if "<!--" in line)
    assert written in text


@pytest.mark.parametrize("what", ["robot", "energy"])
@pytest.mark.parametrize("name", ["a" * 50_000, "two words " * 5_000])
def test_long_names_leave_room_for_the_picture(tmp_path, what, name):
    model = (ROBOTS / "3-rpr.yaml").read_text(encoding="utf-8")
    file, picture = tmp_path / "long.yaml", tmp_path / "picture.png"
    file.write_text(model.replace("leg1", name).replace("base joint", f"{name[:-1]}."))
    load = PLANE if what == "energy" else ()
    plot.done(str(file), "--what", what, *load, "-o", str(picture))
    width = int.from_bytes(picture.read_bytes()[16:20])
    assert width < 2000  # pixels


@pytest.mark.parametrize("ending", ["png", "pdf"])
def test_files_for_paper(tmp_path, ending):
    file = tmp_path / f"picture.{ending}"
    outcome = plot("3-rrr", "-o", str(file), "--json")
    assert json.loads(outcome.stdout)["what"] == "robot"
    assert file.read_bytes()[:4] in {b"\x89PNG", b"%PDF"}


def test_no_file_is_replaced_unasked(tmp_path):
    file = tmp_path / "picture.svg"
    file.write_text("mine")
    refused = plot.done("3-rrr", "-o", str(file), status=2)
    assert "write --overwrite to replace it" in refused.stderr
    assert file.read_text() == "mine"
    plot.done("3-rrr", "-o", str(file), "--overwrite")
    assert file.read_text() != "mine"


def test_a_map_is_drawn_with_and_after_its_computation(tmp_path):
    store, first = tmp_path / "map.nc", tmp_path / "first.svg"
    axes = ("--x", "-0.4 0.4 5", "--y", "-0.4 0.4 4", "--z", "0.2 0.4 3")
    Running("map").done("3-puu", *axes, "-o", str(store), "--plot", str(first))
    assert "<!-- 3-puu: z = 0.3 m, principal translation 1 of 3 -->" in first.read_text()
    page = tmp_path / "status.svg"
    plot.done(str(store), "--quantity", "status", "--cut", "z=0.2", "-o", str(page))
    assert "<!-- 3-puu: z = 0.2 m, status -->" in page.read_text()
    assert "<!-- unreachable -->" in page.read_text()
    refused = plot.done(
        str(store), "--quantity", "worst-deflection", "-o", str(tmp_path / "no.svg"), status=2
    )
    assert "expected translational_stiffness" in refused.stderr


def test_the_picture_of_the_command_is_that_of_python(tmp_path):
    file, own = tmp_path / "command.png", tmp_path / "python.png"
    plot.done("3-rrr", "--what", "ellipsoids", "-o", str(file))
    known = rs.load("3-rrr")
    axes = rs.plot.ellipsoid(rs.stiffness(known), within=known)
    axes.get_figure(root=True).savefig(own, dpi=200, bbox_inches="tight")
    assert file.read_bytes() == own.read_bytes()


rest = Running("equilibrium")


def test_plot_of_the_curve(tmp_path):
    path = tmp_path / "curve.svg"
    asked = ("3-rpr", "--wrench", "0 -0.3 0", "--plot", str(path))
    rest.done(*asked, "--factors", "0 1 3")
    assert "stable" in path.read_text(encoding="utf-8")
    again = rest.done(*asked, "--factors", "0 1 3", status=2)
    assert "--overwrite" in again.stderr


@pytest.mark.parametrize("robot", ["3-puu", "cable-8"])
def test_plot_of_the_loaded_shape(tmp_path, robot: str):
    path = tmp_path / "shape.svg"
    rest.done(robot, "--wrench", "0 0 -200 0 0 0", "--plot", str(path))
    assert "under load" in path.read_text(encoding="utf-8")


def test_plot_of_a_mode_moves(tmp_path):
    path = tmp_path / "mode.html"
    words = ("3-rrr", "--mass", "platform=5 kg", "--plot", str(path), "--mode", "2")
    Running("modes").done(*words)
    page = path.read_text(encoding="utf-8")
    assert "mode 2" in page
    assert "swing(document.getElementById(" in page


def test_points_and_lengths_that_are_far_away_are_questioned():
    for command, given in (("stiffness", ("--at", "0 0 900")), ("indices", ("--length", "900"))):
        outcome = Running(command).done("hexapod", *given)
        assert f"warning: {given[0]}: a length of 900 m; in mm?" in outcome.stderr
        assert not Running(command)("hexapod", given[0], f"{given[1]} mm").stderr
