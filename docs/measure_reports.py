"""Reports of all shipped robots under a load: bytes of the page, and pages of the PDF.

python docs/measure_reports.py FOLDER [ROBOT ...]
"""

import re
import sys
from pathlib import Path

import robostiff as rs
from robostiff.report import described_by, report_contents, report_html, report_pdf
from robostiff.robots import shipped_cable_robots, shipped_linkages, shipped_robots

LOADS = {6: [300, 100, -200, 0, 0, 0], 3: [100, 20, 0]}


def main(folder: str, *names: str) -> None:
    for name in names or (*shipped_robots(), *shipped_cable_robots(), *shipped_linkages()):
        robot = rs.load(name)
        try:
            symbolic = rs.load(name, symbols=rs.ALL_PARAMETERS)
        except rs.InputError:
            symbolic = None  # robots of cables and linkages have no formula
        contents = report_contents(
            robot,
            wrench=LOADS[robot.space.size],
            symbolic=symbolic if isinstance(symbolic, rs.Robot) else None,
            described_by=described_by(name),
        )
        page, paper = report_html(contents).encode(), report_pdf(contents)
        Path(folder, f"{name}.html").write_bytes(page)
        Path(folder, f"{name}.pdf").write_bytes(paper)
        pages = len(re.findall(rb"/Type\s*/Page\b", paper))
        sys.stdout.write(f"{name:24} {len(page) / 1e6:.2f} MB {pages:3} pages\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
