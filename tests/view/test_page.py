"""The page on its server, without a browser."""

import json
import socket
import subprocess
import sys
import time
from signal import SIGINT
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.view import LivePage, machine_of, parameter_sliders, parameters_written
from tests.interrupts import interrupts_heard
from tests.view.test_machines import numbers

pytest.importorskip("viser", reason="no viser here")


@pytest.fixture(scope="module")
def page():
    robot = rs.load("3-rrr")
    sliders = parameter_sliders(parameters_written("3-rrr", None))
    page = LivePage(machine_of(robot), sliders, lambda moved: rs.load("3-rrr", moved), port=8431)
    yield page
    page.close()


@pytest.fixture(autouse=True)
def at_home(page):
    """Every slider where it began; what other tests have drawn is gone."""
    for handle, slider in sliders_of(page):
        handle.value = slider.start
    page.update()


def sliders_of(page: LivePage) -> list[Any]:
    of_pose = [(page._handles[s.name], s) for s in (*page._of_pose, *page._of_load)]
    return [*of_pose, *((page._handles[f"parameter {s.name}"], s) for s in page._of_parameters)]


def shown(page: LivePage) -> np.ndarray:
    return numbers(page._stiffness.content)


def test_values_shown_are_those_of_the_library(page):
    np.testing.assert_allclose(shown(page), rs.stiffness(rs.load("3-rrr")).K, rtol=1e-9, atol=1e-6)


def test_the_picture_follows_a_slider(page):
    page.move("x", 40.0)
    expected = rs.stiffness(rs.load("3-rrr"), [0.04, 0, 0]).K
    until = time.monotonic() + 60
    while not np.allclose(shown(page), expected, rtol=1e-9) and time.monotonic() < until:
        time.sleep(0.02)
    np.testing.assert_allclose(shown(page), expected, rtol=1e-9, atol=1e-6)


def test_the_picture_follows_a_parameter(page):
    name, slider = next((s.name, s) for s in page._of_parameters if s.unit == "mm")
    page._handles[f"parameter {name}"].value = 1.05 * slider.start
    page.update()
    expected = rs.stiffness(rs.load("3-rrr", {name: f"{1.05 * slider.start!r} mm"})).K
    np.testing.assert_allclose(shown(page), expected, rtol=1e-9, atol=1e-6)


def test_nothing_of_another_pose_stays_in_the_picture(page):
    assert page._scene.names
    page._handles["x"].value = page._of_pose[0].high
    answer = page.update()
    assert answer.status == "unreachable"
    assert page._scene.names == []
    assert "data-symbol" not in page._stiffness.content
    assert "reach" in page._head.content


def test_a_parameter_that_makes_no_robot_says_so(page):
    name = next(s.name for s in page._of_parameters if s.unit == "mm")
    page._rebuilt, kept = refused, page._rebuilt
    try:
        page._handles[f"parameter {name}"].value = 1.0
        answer = page.update()
    finally:
        page._rebuilt = kept
    assert answer.status == "no answer"
    assert page._scene.names == []
    assert "too short to close" in page._head.content


def refused(moved: object) -> Any:
    raise rs.InputError("crank", got=0.001, expected="one that is not too short to close")


def test_a_layer_can_be_hidden(page):
    page._seen["robot"].value = False
    page.update()
    assert not [name for name in page._scene.names if name.startswith("/robot")]
    page._seen["robot"].value = True
    page.update()
    assert [name for name in page._scene.names if name.startswith("/robot")]


def test_only_this_computer_is_served(page):
    port = page._server.get_port()
    with socket.create_connection(("127.0.0.1", port), timeout=10):
        pass
    # an address of this computer too, on which nothing listens
    with pytest.raises(OSError, match=r"refused|reset"):
        socket.create_connection(("127.0.0.2", port), timeout=10)


@pytest.mark.parametrize("as_json", [False, True])
def test_ctrl_c_ends_the_command_cleanly(as_json):
    command = [sys.executable, "-m", "robostiff.cli.main", "view", "planar-link"]
    command += ["--no-browser", "--port", "8461", *["--json"] * as_json]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with interrupts_heard():
        program = subprocess.Popen(command, **pipes)
    with program:
        assert program.stdout is not None
        assert program.stderr is not None
        if as_json:
            found = json.loads("".join(program.stdout.readline() for _ in range(4)))
            assert found["schema"] == "robostiff view 1"
            address = found["url"]
        else:
            address = program.stdout.readline()
        assert address.startswith("http://127.0.0.1:")
        program.send_signal(SIGINT)
        program.wait(timeout=60)
        said, complaints = program.stdout.read(), program.stderr.read()
    assert program.returncode == 0
    assert complaints == ""
    assert said.strip() == ("" if as_json else "Ctrl-C ends the view.")
