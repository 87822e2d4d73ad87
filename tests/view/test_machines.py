"""Every shipped robot answers at its sliders, and what it shows is what the library computes."""

import re
from pathlib import Path as File
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.linkage import closed_at
from robostiff.plot import Category, Marks, Path, Text
from robostiff_view import machine_of, parameters_written
from robostiff_view.answer import Look
from robostiff_view.sliders import Slider, parameter_sliders

EVERY = (*rs.shipped_robots(), *rs.shipped_cable_robots(), *rs.shipped_linkages())


def loaded(name: str) -> Any:
    return rs.load_linkage(name) if name in rs.shipped_linkages() else rs.load(name)


def start_of(machine: Any) -> dict[str, float]:
    return {slider.name: slider.factor * slider.start for slider in machine.sliders}


def numbers(html: str, symbol: str = "K(?:_C)?") -> np.ndarray:
    """Of the matrix in a page, with all their digits."""
    table = re.search(rf'<table[^>]*data-symbol="{symbol}".*?</table>', html, re.DOTALL)
    found = re.findall(r'<data value="([^"]+)"', table[0] if table else "")
    n = int(np.sqrt(len(found)))
    return np.array([float(value) for value in found]).reshape(n, n)


@pytest.mark.parametrize("name", EVERY)
def test_every_shipped_robot_shows_itself_and_its_stiffness(name):
    robot = loaded(name)
    machine = machine_of(robot)
    answer = machine.answer(start_of(machine), np.zeros(machine.space.size), Look())
    assert any(isinstance(item, Path) for item in answer.layers["robot"])
    expected = rs.stiffness(rs.load(name))
    assert answer.status == str(expected.status)
    np.testing.assert_allclose(
        numbers(answer.stiffness), expected.K, rtol=1e-9, atol=1e-9 * np.abs(expected.K).max()
    )
    points = np.concatenate(
        [item.points for item in answer.layers["robot"] if isinstance(item, Path)]
    )
    # in metres, and all of it where the view is aimed at
    low, high = machine.box
    assert np.all(points.min(axis=0) >= low - 0.5 * machine.size)
    assert np.all(points.max(axis=0) <= high + 0.5 * machine.size)


@pytest.mark.parametrize("name", ["3-rrr", "six-joint-arm", "cable-4-planar"])
def test_a_moved_slider_is_another_pose(name):
    machine = machine_of(rs.load(name))
    values = start_of(machine)
    moved = machine.sliders[0]
    values[moved.name] += 0.05
    shown = numbers(machine.answer(values, np.zeros(machine.space.size), Look()).stiffness)
    pose: Any = np.array([values[slider.name] for slider in machine.sliders])
    expected = rs.stiffness(
        rs.load(name), rs.JointCoordinates(pose) if name == "six-joint-arm" else pose
    )
    np.testing.assert_allclose(shown, expected.K, rtol=1e-9, atol=1e-9 * np.abs(expected.K).max())
    at_home = rs.stiffness(rs.load(name)).K
    assert np.abs(shown - at_home).max() > 1e-4 * np.abs(at_home).max()


def test_a_pose_out_of_reach_shows_its_advice_and_no_robot():
    machine = machine_of(rs.load("3-rrr"))
    answer = machine.answer({**start_of(machine), "x": 5.0}, np.ones(3), Look())
    assert answer.status == "unreachable"
    assert answer.kind == "bad"
    assert not answer.layers
    assert not answer.stiffness
    assert not answer.load
    assert any("reach" in advice for advice in answer.advice)
    assert all(advice in answer.head.replace("&#x27;", "'") for advice in answer.advice)


def test_deflection_and_energy_are_those_of_the_library():
    robot = rs.load("3-rpr-beams")
    machine = machine_of(robot)
    load = np.array([100.0, 20, -30, 1, 2, 3])
    answer = machine.answer(start_of(machine), load, Look())
    bent = rs.deflection(robot, None, load)
    found = [float(v) for v in re.findall(r'<data value="([^"]+)"', answer.load)]
    moves = np.reshape(found[:12], (6, 2))
    np.testing.assert_allclose(moves[:, 0], load)
    np.testing.assert_allclose(1e-6 * moves[:, 1], bent.twist, rtol=1e-9)
    by_name: dict[str, float] = {}
    for part in bent.parts:
        by_name[part.part] = by_name.get(part.part, 0.0) + 100 * part.share
    shown = found[12 : 12 + len(by_name)]
    np.testing.assert_allclose(shown, sorted(by_name.values(), reverse=True), rtol=1e-9)


def test_free_motions_are_given_in_words():
    machine = machine_of(rs.load("gough-stewart-a"))
    answer = machine.answer(start_of(machine), np.zeros(6), Look())
    assert "free: rotation about x through (0, 0, 2) m" in answer.notes
    assert answer.kind == "note"


def test_joints_of_an_arm_move_within_their_limits():
    machine = machine_of(rs.load("scara"))
    quill = next(slider for slider in machine.sliders if slider.name == "quill")
    assert (quill.unit, quill.low, quill.high) == ("mm", 0.0, pytest.approx(200.0))


def test_sliders_begin_at_the_given_pose_and_reach_it():
    machine = machine_of(rs.load("3-rrr"), np.array([2.0, 0, 0]))
    x = machine.sliders[0]
    assert x.start == pytest.approx(2000.0)
    assert x.low < x.start <= x.high


def test_parameters_that_are_numbers_have_sliders():
    written = {"R": "500 mm", "k": "1e8 N/m", "half": "R/2", "more": "60 deg - a", "n": 3, "c": 0}
    found = {slider.label: slider for slider in parameter_sliders(written)}
    assert list(found) == ["R [mm]", "k [N/m]", "n", "c"]
    assert found["R [mm]"].low == 250
    assert found["k [N/m]"].high == 2e8


def test_parameters_of_a_side_file_beside_its_description_have_sliders():
    """Named on the command line, or found by the name of the description."""
    side = "examples/four-bar.stiffness.yaml"
    for given in (None, side):
        assert parameters_written("examples/four-bar.xml", given) == {"angle": "0 deg"}
    assert parameters_written("examples/ur5.urdf", None) == {}
    assert parameters_written("examples/portal.json", None) == {}


@pytest.mark.parametrize("width", [1e-6, 0.02, 1.0, 730.0, 2e8])
def test_steps_are_round_and_some_hundred(width):
    step = Slider("q", "", 0.0, width, 0.0).step
    assert 100 <= width / step <= 400.5
    assert f"{step:e}"[0] in "125"


def test_a_robot_whose_joints_are_in_one_point_has_sliders():
    """Two slides, one on the other: at home all of it is one point, without a size."""
    machine = machine_of(rs.load("examples/ball-screws.yaml"))
    assert [slider.name for slider in machine.sliders] == ["x", "y"]
    assert machine.sliders[0].high == 500.0
    load = np.arange(1.0, machine.space.size + 1)
    assert machine.answer({"x": 0.1, "y": 0.0}, load, Look()).status == "ok"


def test_a_linkage_begins_where_its_joints_are_given():
    """As for stiffness: values of the drives, or of any joint by its name, which is there."""
    linkage = rs.load_linkage("double-pantograph")
    knee = float(closed_at(linkage, {"screw": -0.05})[1].coordinates["right knee"][0])
    for pose in ({"screw": -0.05}, [-0.05], {"right knee": knee}):
        (slider,) = machine_of(linkage, pose).sliders
        assert slider.name == "screw"
        assert slider.start == pytest.approx(-50.0, abs=1e-6)
    with pytest.raises(rs.InputError, match="'skrew'"):
        machine_of(linkage, {"skrew": 0.0})


def test_actuated_joints_of_a_linkage_without_home_are_moved(tmp_path):
    side = File("examples/four-bar.stiffness.yaml").read_text()
    (tmp_path / "s.yaml").write_text(side.replace("home: {crank: angle}", ""))
    linkage = rs.load_linkage("examples/four-bar.xml", side=tmp_path / "s.yaml")
    machine = machine_of(linkage)
    assert [slider.name for slider in machine.sliders] == ["crank"]
    shown = machine.answer({"crank": 0.2}, np.zeros(6), Look())
    expected = rs.stiffness(linkage, {"crank": 0.2})
    assert shown.status == str(expected.status)
    np.testing.assert_allclose(
        numbers(shown.stiffness), expected.K, rtol=0, atol=1e-9 * np.abs(expected.K).max()
    )


def test_what_is_no_robot_is_refused():
    with pytest.raises(rs.InputError, match="robot of a view"):
        machine_of("hexapod")
    with pytest.raises(rs.InputError, match="frozen"):
        machine_of(rs.load("double-pantograph"), [0, 0, 0])


def test_joints_and_parts_of_platforms_have_the_colour_of_their_bar():
    for robot, drawn in (
        (rs.load("six-joint-arm"), Marks),
        (rs.load("docs/star-platform.yaml"), Path),
    ):
        machine = machine_of(robot)
        answer = machine.answer(start_of(machine), np.zeros(6), Look())
        paints = {item.paint for item in answer.layers["robot"] if isinstance(item, drawn)}
        assert len({paint for paint in paints if isinstance(paint, Category)}) >= 4


def test_a_loaded_cable_robot_is_drawn_displaced_beside_its_place_without_load():
    machine = machine_of(rs.load("cable-8"))
    load = np.array([20.0, 10, -50, 0, 0, 0])
    answer = machine.answer(start_of(machine), load, Look(100.0))
    assert {"robot", "load", "shape without load", "ellipsoid of displacements"} <= set(
        answer.layers
    )
    moved = rs.cable_response(machine.robot, wrench=load).displacement
    assert moved is not None
    drawn, rest = (
        [item.points[0] for item in found.layers["robot"] if isinstance(item, Marks)][-1]
        for found in (answer, machine.answer(start_of(machine), 0 * load, Look()))
    )
    np.testing.assert_allclose(drawn - rest, 100 * moved[:3], atol=1e-12)


def test_joints_of_a_linkage_are_named_when_that_is_wanted():
    machine = machine_of(rs.load_linkage("double-pantograph"))
    for seen in (frozenset({"robot"}), frozenset({"robot", "names of joints"})):
        answer = machine.answer(start_of(machine), np.zeros(6), Look(None, seen))
        words = [
            item for items in answer.layers.values() for item in items if isinstance(item, Text)
        ]
        assert bool(words) == ("names of joints" in seen)
