"""Every shipped robot, and how robots are loaded."""

from typing import assert_type, get_args

import numpy as np
import pytest

from robostiff import robots
from robostiff.errors import FileError, InputError
from robostiff.io.document import read_document
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.robots import describe, load, robot_file, shipped_cable_robots, shipped_robots
from tests.calls import calls_of

SPREAD = {
    "3-rpr": (0.15, 0.15, 0, 0, 0, 0.4),
    "3-rpr-beams": (0.15, 0.15, 0, 0, 0, 0.4),
    "3-rrr": (0.06, 0.06, 0, 0, 0, 0.3),
    "3-prs": (0, 0, 0.08, 0.25, 0.25, 0),
    "3-puu": (0.15, 0.15, 0.15, 0, 0, 0),
    "3-rps": (0, 0, 0.12, 0.3, 0.3, 0),
    "3-upu": (0.15, 0.15, 0.15, 0, 0, 0),
    "agile-eye": (0, 0, 0, 0.3, 0.3, 0.3),
    "capaman": (0.02, 0.02, 0, 0, 0, 0.2),
    "delta": (0.12, 0.12, 0.1, 0, 0, 0),
    "gantry-tau": (0.15, 0.15, 0.15, 0, 0, 0),
    "h4": (0.08, 0.08, 0.05, 0, 0, 0.5),
    "orthoglide": (0.15, 0.15, 0.15, 0, 0, 0),
    "t3r1": (0.12, 0.12, 0.12, 0, 0, 0.6),
    "tripteron": (0.15, 0.15, 0.15, 0, 0, 0),
    "us-ups": (0, 0, 0, 0.3, 0.3, 0.3),
}
SWAYING = ("3-prs", "3-rps", "capaman")  # coordinates that are not chosen change too


def random_poses(name, finder, count=60):
    spread = np.array(SPREAD.get(name, (0.12, 0.12, 0.12, 0.3, 0.3, 0.3)))
    rng = np.random.default_rng(7)
    poses = finder.home_pose + rng.uniform(-1, 1, (count, 6)) * spread
    return finder.find(poses[:, finder.robot.coordinate_places]).pose if name in SWAYING else poses


@pytest.mark.parametrize("name", [*shipped_robots(), *shipped_cable_robots()])
def test_loads_and_says_where_it_comes_from(name):
    robot = load(name)
    assert robot.name == name
    info = describe(name)
    assert (info.name, info.title, info.source) == (name, robot.title, robot.source)
    assert len(info.title) < 90
    assert "\n" not in info.source


def test_loading_is_quick():
    load("gough-stewart-b")
    assert calls_of(lambda: load("gough-stewart-b")) < 150_000


@pytest.mark.parametrize("name", [*shipped_robots(), *shipped_cable_robots()])
def test_file_is_written_with_care(name):
    text = robot_file(name).read_text()
    assert read_document(robot_file(name)).data["source"].strip()
    assert all(len(line) <= 130 for line in text.splitlines())
    assert "\t" not in text


SNAPSHOT = """\
{"name": "jack", "reference_point": [0, 0, 0.5], "legs": [{"name": "jack", "end": [0, 0, 0.5],
 "chain": [{"type": "spring", "kind": "P", "point": [0, 0, 0], "axis": [0, 0, 1], "k": 2e6}]}]}
"""


def test_names_have_the_types_of_their_robots():
    assert get_args(robots.ShippedRobot) == shipped_robots()
    assert get_args(robots.ShippedCableRobot) == shipped_cable_robots()
    assert isinstance(assert_type(load("hexapod"), Robot), Robot)
    assert isinstance(assert_type(load("cable-8"), CableRobot), CableRobot)


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


def test_parameters_of_shipped_robot():
    robot = load("gough-stewart-b", {"h": "1 m"})
    assert robot.home is not None
    assert robot.home.p[2] == 1.0
