"""The view as somebody sees it, in a real browser."""

import re
from io import BytesIO
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff_view import LivePage, machine_of
from tests.report.browsing import chromium
from tests.view.test_machines import loaded, numbers

pytest.importorskip("viser", reason="no viser here")
pytestmark = pytest.mark.needs("Chromium", "Playwright")
_WAIT = 90_000  # [ms]: a processor draws what a graphics card draws elsewhere
# one of each kind; that all others answer is tested without a browser
KINDS = ("hexapod", "3-rrr", "six-joint-arm", "gough-stewart-a", "cable-8", "double-pantograph")


@pytest.fixture(scope="module")
def browser():
    with chromium() as program:
        yield program


class Opened:
    """A view in the browser, with what it asked for and complained about."""

    def __init__(self, browser: Any, live: LivePage) -> None:
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self.page = browser.new_page(viewport={"width": 1000, "height": 500})
        self.page.set_default_timeout(_WAIT)
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.goto(live.url)
        self.page.wait_for_selector(".robostiff-status")

    @property
    def K(self) -> np.ndarray:
        """The matrix in the page."""
        return numbers(self.page.content())

    def shows(self, expected: np.ndarray) -> bool:
        """Whether the page shows a matrix, some time from now."""
        size = np.abs(expected).max()
        for _ in range(_WAIT // 200):
            K = self.K
            if K.shape == expected.shape and np.abs(K - expected).max() < 1e-9 * size:
                return True
            self.page.wait_for_timeout(200)
        return False


def test_a_slider_moves_the_matrix_in_the_page(browser):
    robot = rs.load("3-rrr")
    live = LivePage(machine_of(robot), port=8521)
    try:
        seen = Opened(browser, live)
        assert seen.shows(rs.stiffness(robot).K)
        field = seen.page.locator("input[type=text]").first
        field.fill("30")
        field.press("Enter")
        assert seen.shows(rs.stiffness(robot, [0.03, 0, 0]).K)
        field.fill("700")
        field.press("Enter")
        seen.page.wait_for_selector(".robostiff-status:text('unreachable')")
        seen.page.wait_for_selector("[data-symbol^=K]", state="detached")
        hosts = {re.sub(r"\w+:/*([^/:]*).*", r"\1", url) for url in seen.requests}
        assert {host for host in hosts if "." in host} == {"127.0.0.1"}
        assert seen.complaints == []
    finally:
        live.close()


@pytest.mark.parametrize("name", KINDS)
def test_a_robot_of_each_kind_opens_and_is_drawn(browser, name):
    image = pytest.importorskip("PIL.Image")
    machine = machine_of(loaded(name))
    live = LivePage(machine, port=8541)
    try:
        seen = Opened(browser, live)
        assert seen.shows(rs.stiffness(rs.load(name)).K)
        canvas = seen.page.locator("canvas").first
        seen.page.wait_for_timeout(3000)
        picture = image.open(BytesIO(canvas.screenshot(timeout=_WAIT))).convert("RGB")
        drawn = np.any(np.asarray(picture) != 255, axis=-1)
        # the robot, and not the grid alone
        assert drawn.mean() > 0.02
        assert seen.complaints == []
        seen.page.close()
    finally:
        live.close()
