"""Commands, readers and writers of other distributions are found by their entry points."""

import importlib.metadata
import json
from importlib.metadata import EntryPoint

import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff import extras
from robostiff.cli.main import app

ADDED = {
    extras.COMMANDS: {"legs": "tests.cli.an_extra:CountLegs"},
    extras.READERS: {".slide": "tests.cli.an_extra:SLIDE"},
    extras.WRITERS: {"count": "tests.cli.an_extra:COUNT"},
}


def entry_points(*, group: str) -> list[EntryPoint]:
    return [EntryPoint(name, value, group) for name, value in ADDED[group].items()]


@pytest.fixture(autouse=True)
def _one_extra(monkeypatch):
    """This extra is installed, and no other."""
    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)
    extras.entry_points_of.cache_clear()
    yield
    extras.entry_points_of.cache_clear()


def ran(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(words))
    return result.exit_code, result.output


def test_a_command_is_run_and_listed():
    assert ran("legs", "hexapod") == (0, "6 legs\n")
    status, printed = ran("legs", "3-rps", "--json")
    assert (status, json.loads(printed)) == (0, {"schema": "robostiff legs 1", "legs": 3})
    assert "Count the legs of a robot." in ran("--help")[1]
    assert "view" not in ran("--help")[1]
    status, printed = ran("leg", "hexapod")
    assert status == 2
    assert "did you mean legs?" in printed
    status, printed = ran("legs", "hexapode")
    assert status == 2
    assert "did you mean hexapod?" in printed


def test_a_reader_reads_files_of_its_ending(tmp_path):
    file, side = tmp_path / "table.slide", tmp_path / "table.stiffness.yaml"
    file.write_text("0.5")
    side.write_text("{robostiff: 1, source: a test, tool: tip, joints: {slide: {stiffness: 2e6}}}")
    robot = rs.load(file)  # with the side file beside it
    assert robot.name == "slide"
    assert rs.stiffness(robot).compliance[0, 0] == pytest.approx(5e-7)
    with pytest.raises(rs.InputError, match="a file that exists"):
        rs.load(str(tmp_path / "other.slide"))


def test_a_writer_is_a_form_of_convert(tmp_path):
    assert ran("convert", "3-rpr-beams", "--to", "count")[1].endswith(" bodies\n")
    file = tmp_path / "robot.count"
    assert ran("convert", "3-rpr-beams", "--to", "count", "-o", str(file))[0] == 0
    assert file.read_text().endswith(" bodies.count\n")
    status, printed = ran("convert", "hexapod", "--to", "count", "-o", str(tmp_path / "robot.tcl"))
    assert status == 2
    assert "a name that ends in .count" in printed
    status, printed = ran("convert", "hexapod", "--to", "opensees")
    assert status == 2
    assert "models for OpenSees need 'robostiff-interop'" in printed
    status, printed = ran("convert", "hexapod", "--to", "counted")
    assert status == 2
    assert "expected snapshot, graph, " in printed
    assert ", count; did you mean count?" in printed
