"""`robostiff plot`: pictures of anything, into files of several kinds."""

import json
from pathlib import Path

import pytest

import robostiff as rs
from tests.cli.running import Running

ROBOTS = Path(rs.__file__).parent / "robots"
STAR = str(Path(__file__).parents[2] / "docs" / "star-platform.yaml")
LOAD = ("--wrench", "100 N 0 -50 0 0 0")
PLANE = ("--wrench", "100 N 0 0")


run = Running("plot")


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
    outcome = run(subject, *options, "-o", str(file))
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
    outcome = run(str(file), "--what", what, *load, "-o", str(picture))
    assert outcome.exit_code == 0, outcome.stderr
    width = int.from_bytes(picture.read_bytes()[16:20])
    assert width < 2000  # pixels


@pytest.mark.parametrize("ending", ["png", "pdf"])
def test_files_for_paper(tmp_path, ending):
    file = tmp_path / f"picture.{ending}"
    outcome = run("3-rrr", "-o", str(file), "--json")
    assert json.loads(outcome.stdout)["what"] == "robot"
    assert file.read_bytes()[:4] in {b"\x89PNG", b"%PDF"}


def test_no_file_is_replaced_unasked(tmp_path):
    file = tmp_path / "picture.svg"
    file.write_text("mine")
    refused = run("3-rrr", "-o", str(file))
    assert refused.exit_code == 2
    assert "write --overwrite to replace it" in refused.stderr
    assert file.read_text() == "mine"
    assert run("3-rrr", "-o", str(file), "--overwrite").exit_code == 0
    assert file.read_text() != "mine"


def test_a_map_is_drawn_with_and_after_its_computation(tmp_path):
    store, first = tmp_path / "map.nc", tmp_path / "first.svg"
    axes = ("--x", "-0.4 0.4 5", "--y", "-0.4 0.4 4", "--z", "0.2 0.4 3")
    assert Running("map")("3-puu", *axes, "-o", str(store), "--plot", str(first)).exit_code == 0
    assert "<!-- 3-puu: z = 0.3 m, principal translation 1 of 3 -->" in first.read_text()
    page = tmp_path / "status.svg"
    outcome = run(str(store), "--quantity", "status", "--cut", "z=0.2", "-o", str(page))
    assert outcome.exit_code == 0, outcome.stderr
    assert "<!-- 3-puu: z = 0.2 m, status -->" in page.read_text()
    assert "<!-- unreachable -->" in page.read_text()
    refused = run(str(store), "--quantity", "worst-deflection", "-o", str(tmp_path / "no.svg"))
    assert refused.exit_code == 2
    assert "expected translational_stiffness" in refused.stderr


def test_the_picture_of_the_command_is_that_of_python(tmp_path):
    file, own = tmp_path / "command.png", tmp_path / "python.png"
    assert run("3-rrr", "--what", "ellipsoids", "-o", str(file)).exit_code == 0
    known = rs.load("3-rrr")
    axes = rs.plot.ellipsoid(rs.stiffness(known), within=known)
    axes.get_figure(root=True).savefig(own, dpi=200, bbox_inches="tight")
    assert file.read_bytes() == own.read_bytes()
