"""A page opened in the Chromium of the system, and what it did while it was open."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.other_programs import command

_DRAWN = """
document.querySelectorAll('.plot').length > 0 && [...document.querySelectorAll('.plot')].every(
  (place) => place.querySelector('.main-svg') !== null && place._fullLayout !== undefined)
  && [...document.querySelectorAll('.chart')].every((place) => place.querySelector('svg') !== null)
"""


@contextmanager
def chromium() -> Iterator[Any]:
    """The browser."""
    from playwright import sync_api

    # drawn by the processor: machines that run tests have no graphics
    arguments = ["--enable-unsafe-swiftshader"]
    if hasattr(os, "getuid") and os.getuid() == 0:
        arguments.append("--no-sandbox")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=command("Chromium"), args=arguments)
        yield browser
        browser.close()


@dataclass
class Opened:
    """A page, with what it asked for and what it complained about."""

    page: Any
    requests: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)

    @property
    def plots(self) -> list[Any]:
        """The places of its scenes."""
        return self.page.locator(".plot").all()

    @property
    def charts(self) -> list[Any]:
        """The places of its charts."""
        return self.page.locator(".chart").all()


def opened(browser: Any, path: Path, *, width: int = 1280, dark: bool = False) -> Opened:
    """A page once all its plots are drawn."""
    scheme = "dark" if dark else "light"
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    # A processor draws what a graphics card draws elsewhere.
    page.set_default_timeout(90_000)
    opened = Opened(page)
    page.on("request", lambda request: opened.requests.append(request.url))
    page.on("pageerror", lambda error: opened.complaints.append(str(error)))
    page.on(
        "console",
        lambda message: opened.complaints.append(message.text) if message.type == "error" else None,
    )
    page.goto(path.as_uri())
    page.wait_for_function(_DRAWN)
    return opened
