"""The picture of a view on the page about views, as a browser shows it.

python docs/make_view_picture.py docs/_static/view.png
"""

import shutil
import sys

from playwright.sync_api import sync_playwright

import robostiff as rs
from robostiff_view import LivePage, machine_of, parameter_sliders, parameters_written

LOAD = [300, 100, -500, 0, 0, 0]
_WAIT = 120_000  # [ms]: a processor draws


def main(picture: str) -> None:
    sliders = parameter_sliders(parameters_written("hexapod", None))
    live = LivePage(machine_of(rs.load("hexapod")), sliders, wrench=LOAD)
    arguments = ["--no-sandbox", "--enable-unsafe-swiftshader"]
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=arguments
            )
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.set_default_timeout(_WAIT)
            page.goto(live.url)
            page.wait_for_selector(".robostiff-status")
            # viser says that there is no graphics card
            page.locator(".mantine-Notification-closeButton").click()
            page.wait_for_timeout(8000)
            page.screenshot(path=picture)
            browser.close()
    finally:
        live.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
