"""The page on its server, without a browser."""

import json
import math
import socket
import subprocess
import sys
import time
from contextlib import closing
from http.client import HTTPConnection
from importlib.metadata import version
from signal import SIGINT
from types import SimpleNamespace
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

import robostiff as rs
from robostiff.plot import Path, PlainColour
from robostiff_view import LivePage, machine_of, parameter_sliders, parameters_written
from robostiff_view.page import see_all
from tests.interrupts import interrupts_heard
from tests.view.test_machines import numbers

pytest.importorskip("viser", reason="no viser here")
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol


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


def test_buttons_bring_sliders_back(page, monkeypatch):
    """Each button its own sliders."""
    pressed = []
    for label, sliders, to in (("home", page._of_pose, None), ("none", page._of_load, 0.0)):
        button = type("Button", (), {"on_click": lambda _, action: pressed.append(action)})()
        monkeypatch.setattr(page._gui, "add_button", lambda _, own=button: own)
        page._add_reset(label, sliders, to)
    for handle, slider in sliders_of(page):
        handle.value = slider.high
    for action in pressed:
        action(None)
    moved = [slider.key for handle, slider in sliders_of(page) if handle.value != slider.start]
    assert moved == [slider.key for slider in page._of_parameters]


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


def answered(page: LivePage, path: str, **headers: str) -> int:
    """The status of a handshake with headers of its own, such as a foreign page would send."""
    port = page._server.get_port()
    viser_protocol = f"viser-v{version('viser')}"
    every = {
        "Host": f"127.0.0.1:{port}",
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Protocol": viser_protocol,
        **headers,
    }
    connection = HTTPConnection("127.0.0.1", port, timeout=10)
    with closing(connection):
        connection.putrequest("GET", path, skip_host=True)
        for name, value in every.items():
            connection.putheader(name, value)
        connection.endheaders()
        return connection.getresponse().status


def test_no_other_page_can_connect(page):
    port, path = page._server.get_port(), urlsplit(page.url).path.rstrip("/")
    own = f"http://127.0.0.1:{port}"
    assert answered(page, path, Origin=own) == 101
    assert answered(page, path) == 101  # a program that was told the address
    for foreign in ("http://evil.example", f"http://localhost:{port}", f"{own}0", "null"):
        assert answered(page, path, Origin=foreign) == 403
    rebound = f"evil.example:{port}"
    assert answered(page, path, Host=rebound, Origin=f"http://{rebound}") == 403
    for guess in ("", "/", f"{path}x", path[:-1], f"/{path}", "/guess/", "/?websocket=1"):
        assert answered(page, guess or "/", Origin=own) == 403


def test_the_page_itself_needs_its_address(page):
    assert answered(page, urlsplit(page.url).path, Upgrade="none") == 200
    assert answered(page, "/", Upgrade="none") == 403


@pytest.mark.parametrize("sent", [b"\xff\xff", b"", b"\x81\xa4type\xa4None", "text"])
def test_a_message_that_cannot_be_read_is_one_line(page, sent, caplog):
    with connect(
        page.url.replace("http", "ws").rstrip("/"),
        subprotocols=[Subprotocol(f"viser-v{version('viser')}")],
    ) as client:
        client.send(sent)
        with pytest.raises(ConnectionClosed):
            list(client)
    assert [len(record.getMessage().splitlines()) for record in caplog.records] == [1]
    assert caplog.records[0].exc_info is None
    assert answered(page, urlsplit(page.url).path) == 101


def test_a_slider_stays_within_its_ends(page):
    slider = page._of_pose[0]
    drawn = {}
    for value in (slider.high, 1e12, math.inf, slider.low, -1e12, math.nan):
        page._handles["x"].value = value
        drawn[value] = page.update().head
    assert drawn[slider.high] == drawn[1e12] == drawn[math.inf]
    assert drawn[slider.low] == drawn[-1e12]


def test_a_scale_of_ones_own_begins_at_the_automatic_one(page):
    page._handles[page._of_load[0].key].value = 500.0
    note = next(n for n in page.update().notes if n.startswith("displacements"))
    assert not page._exaggeration.visible
    page._automatic.value = False
    until = time.monotonic() + 60
    while not page._exaggeration.visible and time.monotonic() < until:
        time.sleep(0.02)
    assert note == f"displacements × {page._exaggeration.value:g}"
    assert note in page.update().notes
    page._automatic.value = True


def test_lines_have_a_bounded_number_of_dashes(page):
    ends = np.array([[0.0, 0, 0], [1e12, 0, 0]])
    assert len(page._scene._pieces(Path(ends, PlainColour.INK, dashed=True))) <= 200


def test_the_page_follows_after_an_error(page, monkeypatch):
    monkeypatch.setattr(page, "update", fails)
    page.move("x", 30.0)
    time.sleep(0.2)
    monkeypatch.undo()
    test_the_picture_follows_a_slider(page)


def fails() -> None:
    raise RuntimeError("a picture that cannot be drawn")


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


def test_a_narrow_picture_is_seen_from_farther_away():
    followed: list[Any] = []
    position, middle = np.array([2.0, -3.0, 1.0]), np.array([0.0, 0.0, 0.5])
    camera = SimpleNamespace(position=position, look_at=middle, on_update=followed.append)
    see_all(SimpleNamespace(camera=camera))
    for aspect, factor in ((1.6, 1.0), (0.5, 1.2), (0.5, 1.2), (0.4, 1.5), (1.6, 1.0)):
        camera.aspect = aspect
        followed[0](camera)
        np.testing.assert_allclose(camera.position, middle + factor * (position - middle))
