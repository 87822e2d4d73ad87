"""`robostiff check`: what depends on the other, beside what ``answers.txt`` has of it."""

from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from tests.cli.running import Running

EXAMPLES = Path(__file__).parents[2] / "examples"
TABLE = (Path(__file__).parent / "data" / "table.yaml").read_text(encoding="utf-8")
run = Running("check")
facts = run.answer


def test_coordinates_that_the_legs_leave_no_room_for(tmp_path):
    file = tmp_path / "table.yaml"
    file.write_text(TABLE.replace("[x, y, z, rx, ry, rz]", "[z, rx, ry]"))
    assert "freedoms at home" not in run(str(file)).stdout
    file.write_text(TABLE.replace("[x, y, z, rx, ry, rz]", "[x, y]"))
    outcome = run(str(file))
    assert outcome.exit_code == 2
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
        assert f"leg1: {words}" in run(str(file)).stdout


@pytest.mark.parametrize("ending", [".png", ".svg"])
def test_picture(tmp_path, ending):
    file = tmp_path / f"robot{ending}"
    assert facts("3-rrr", "--plot", str(file))["picture"] == str(file)
    assert file.stat().st_size > 5000
    again = run("3-rrr", "--plot", str(file))
    assert again.exit_code == 2
    assert "write --overwrite to replace it" in again.stderr
    assert run("3-rrr", "--plot", str(file), "--overwrite").exit_code == 0


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
        assert "masses: " in run(str(file)).stdout


def test_drives_whose_stiffness_depends_on_them_are_written(tmp_path):
    table, file = str(EXAMPLES / "ball-screws.yaml"), tmp_path / "placed.yaml"
    assert Running("convert")(table, "--joints", "x=0.4", "-o", str(file)).exit_code == 0
    moved = rs.stiffness(rs.load(table), rs.JointCoordinates([0.4, 0])).K
    np.testing.assert_allclose(rs.stiffness(rs.load(file)).K, moved, rtol=1e-12, atol=1)
