"""What reports say, word for word but for what is folded and drawn, is on file in ``pages.txt``.

A line there is what a report is of, below it the page; ``python -m tests.report.test_pages`` writes
it anew. Numbers may differ in their last digits.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.markup import page_text
from robostiff.report import TitleBlock, described_by, report_contents, report_page
from tests.project.shown_output import ROOT, first_difference
from tests.report.machines import with_symbols
from tests.said import indented, now, on_file, write

PAGE = Path(__file__).parent / "pages.txt"
#: What is another in each version, and where rounding decides which of several is the first.
OTHERS = re.compile(
    r"^(versions: |\d+ .* Hz  ).*|[0-9a-f]{64}|(?<=robostiff )[\d.]+|(?<= Hz): .*"
    r"|(?<= N), cable\d|(?<=first slack: )cable\d",
    re.MULTILINE,
)


def page(robot: Any, *pose: Any, **options: Any) -> str:
    """The page of a robot by its name."""
    machine = rs.load(robot) if isinstance(robot, str) else robot
    return page_text(report_page(report_contents(machine, *pose, **options)))


def mapped(where: Any) -> Any:
    return rs.stiffness_map(rs.load("3-rpr"), where)  # type: ignore[arg-type]


NAMES: dict[str, Any] = {
    **{"rs": rs, "page": page, "mapped": mapped, "symbols": with_symbols, "load": rs.load},
    **{"described_by": described_by, "TitleBlock": TitleBlock, "linkage": rs.load_linkage},
    **{"crane": str(ROOT / "examples" / "wall-crane.json"), "zeros": np.zeros},
    **{"star": str(ROOT / "docs" / "star-platform.yaml"), "SIX": [100, 0, -200, 0, 0, 5]},
}


def say(_: str, call: str) -> str:
    try:
        text = eval(call, dict(NAMES))  # noqa: S307
    except rs.RobostiffError as error:
        text = f"error: {error}"
    lines = OTHERS.sub("...", text).splitlines()
    return indented("\n".join(line.rstrip() for line in lines if line.strip(" .")))


@pytest.mark.parametrize("subject", on_file(PAGE))
def test_what_a_report_says_is_what_is_on_file(subject):
    told = on_file(PAGE)[subject]
    produced = now({subject: told}, say)[subject]
    found = {call: first_difference(text, produced[call]) for call, text in told.items()}
    assert {call: own for call, own in found.items() if own} == {}


if __name__ == "__main__":
    write(PAGE, now(on_file(PAGE), say))
