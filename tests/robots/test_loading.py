"""Finding robots by name or file."""

import subprocess
import sys
from typing import assert_type, get_args

import pytest

from robostiff import robots
from robostiff.errors import FileError, InputError
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.robots import describe, load, robot_file, shipped_cable_robots, shipped_robots

SNAPSHOT = """\
{"name": "jack", "reference_point": [0, 0, 0.5], "legs": [{"name": "jack", "end": [0, 0, 0.5],
 "chain": [{"type": "spring", "kind": "P", "point": [0, 0, 0], "axis": [0, 0, 1], "k": 2e6}]}]}
"""


def test_names_have_the_types_of_their_robots():
    assert get_args(robots.ShippedRobot) == shipped_robots()
    assert get_args(robots.ShippedCableRobot) == shipped_cable_robots()
    assert isinstance(assert_type(load("hexapod"), Robot), Robot)
    assert isinstance(assert_type(load("cable-8"), CableRobot), CableRobot)


def test_name_or_path_gives_the_same_robot(tmp_path):
    copy = tmp_path / "mine.yaml"
    copy.write_text(robot_file("3-rpr").read_text())
    for source in (copy, str(copy)):
        robot = load(source)
        assert isinstance(robot, Robot)
        assert robot.name == "3-rpr"


def test_snapshot_file(tmp_path):
    file = tmp_path / "jack.json"
    file.write_text(SNAPSHOT)
    assert isinstance(load(file), Snapshot)
    with pytest.raises(InputError, match=r"parameters of .*a snapshot, frozen at one pose"):
        load(file, {"h": 1.0})


def test_unknown_name_lists_the_robots_and_the_nearest():
    with pytest.raises(InputError) as caught:
        load("gough-stewart-c")
    message = str(caught.value)
    assert message.startswith("robot: got 'gough-stewart-c', expected a file, or the name of a")
    assert "3-puu, 3-rpr, 3-rpr-beams" in message
    assert message.endswith("did you mean gough-stewart-b?")


def test_a_name_without_the_ending_of_its_file_is_completed(tmp_path, monkeypatch):
    (tmp_path / "my-arm.yaml").write_text(robot_file("3-rpr").read_text())
    monkeypatch.chdir(tmp_path)
    for name in ("my-arm", "./my-arm"):
        with pytest.raises(InputError, match=rf"did you mean {name}\.yaml\?$"):
            load(name)


def test_a_model_without_its_version_is_not_taken_for_a_snapshot(tmp_path):
    file = tmp_path / "mine.yaml"
    model = robot_file("gough-stewart-b").read_text() + "reference_point: [0, 0, 100 mm]\n"
    file.write_text(model.replace("robostiff: 1\n", ""))
    with pytest.raises(FileError, match="expected robostiff: 1 at the top"):
        load(file)


@pytest.mark.parametrize("ask", [describe, robot_file])
def test_only_shipped_robots_are_described(ask):
    with pytest.raises(InputError, match=r"expected the name of a shipped robot: 3-rpr"):
        ask("../3-rpr")


def test_file_that_is_neither(tmp_path):
    file = tmp_path / "list.yaml"
    file.write_text("name: something\n")
    with pytest.raises(FileError, match=r"list\.yaml:1:1: model file: expected robostiff: 1"):
        load(file)


def test_parameters_of_shipped_robot():
    robot = load("gough-stewart-b", {"h": "1 m"})
    assert isinstance(robot, Robot)
    assert robot.home is not None
    assert robot.home.p[2] == 1.0
    with pytest.raises(InputError, match=r"parameter H: .*one of the parameters R, r, h, k"):
        load("gough-stewart-b", {"H": "1 m"})


def test_import_is_light():
    code = (
        "import sys, robostiff.robots as robots; robots.shipped_robots(); "
        "print([m for m in ('pydantic', 'pint', 'yaml', 'numpy', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
