"""ARCHITECTURE.md names files that exist, and a place for each equation of the paper."""

import re

import pytest

from tests.project.shown_output import ROOT

PAGE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
TABLE = PAGE.partition("## Equations and their places")[2].partition("### ")[0]
ROWS = [row.split("|")[1:-1] for row in TABLE.splitlines() if row.startswith("| (")]
NAMED = re.findall(r"`((?:tests/)?[a-z_]+/[\w/*.-]*)`", PAGE.partition("## Equations")[2])
PLACES = sorted({place for place in NAMED if "NAME" not in place})


@pytest.mark.parametrize("place", PLACES)
def test_named_files_exist(place):
    roots = (ROOT, ROOT / "src/robostiff")
    assert any(list(root.glob(place.rstrip("/"))) for root in roots), place


def test_every_equation_has_one_formula():
    """Numbers 4 to 28; (1) to (3) define the minimum of energy that (4) states."""
    numbers = []
    for row in ROWS:
        for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", row[0]):
            numbers += range(int(first), int(last or first) + 1)
        formula = re.findall(r"`([^`]+)`", row[2])
        assert len(formula) == 1, row[0]
    assert sorted(numbers) == list(range(4, 29))


def test_formulas_name_their_equations():
    for row in ROWS:
        (place,) = re.findall(r"`([^`]+\.py)`", row[2]) or [None]
        if place is None:
            continue
        text = (ROOT / "src/robostiff" / place).read_text(encoding="utf-8")
        named = {int(n) for n in re.findall(r"\((\d{1,2})\)", text)}
        wanted = {int(n) for n in re.findall(r"\((\d+)\)", row[0])}
        assert named & wanted, place
