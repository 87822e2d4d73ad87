"""The picture of a report on the page about reports: its beginning, as a browser shows it.

python docs/make_report_picture.py docs/_static/report.png
"""

import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import sync_playwright

import robostiff as rs

POSE, LOAD = [0.06, 0.02, 0.9, 0, 0.17, 0], [300, 100, -200, 0, 0, 0]


def main(picture: str) -> None:
    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = Path(folder) / "hexapod.html"
        rs.write_report(rs.load("hexapod"), path, POSE, wrench=LOAD)
        arguments = ["--no-sandbox", "--enable-unsafe-swiftshader"]
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=arguments
        )
        page = browser.new_page(viewport={"width": 1000, "height": 1500})
        page.set_default_timeout(90_000)  # a processor draws what a graphics card draws elsewhere
        page.goto(path.as_uri())
        page.wait_for_function("document.querySelectorAll('.plot .main-svg').length > 0")
        page.wait_for_timeout(1000)
        page.screenshot(path=picture)
        browser.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
