"""Reports on cable robots, networks and flexible platforms: what applies, and nothing empty."""

import re
from pathlib import Path

import pytest

import robostiff as rs
from robostiff.markup import Folded, Number, Section, Table, inner_blocks
from robostiff.plot.picture import Scene
from robostiff.report import described_by, report_contents, report_page, report_pdf
from robostiff.report.figures import figures_in

STAR = Path(__file__).parents[2] / "docs" / "star-platform.yaml"
SIX = [100, 0, -200, 0, 0, 5]


def sections_of(robot, wrench, **options):
    found = report_contents(robot, wrench=wrench, **options)
    sections = [own for own in report_page(found).blocks if isinstance(own, Section)]
    assert all(inner_blocks(section) for section in sections)
    return found, {section.anchor: every(section) for section in sections}


def every(block) -> list:
    """All blocks inside a block."""
    return [own for part in inner_blocks(block) for own in (part, *every(part))]


def figures_of(sections) -> set[str]:
    return {figure.name for blocks in sections.values() for figure in figures_in(blocks)}


def test_shares_that_are_rounding_are_shown_as_zero():
    _, sections = sections_of(rs.load("six-joint-arm"), [0, 0, -500, 0, 0, 0])
    *_, every_part = (part for part in sections["load"] if isinstance(part, Table))
    shares = [cell.value for row in every_part.rows for cell in row if isinstance(cell, Number)]
    assert len(shares) == 10
    assert shares.count(0) == 2
    assert sum(shares) == pytest.approx(100)


def test_a_flexible_platform_from_a_file_has_few_pages():
    found = report_contents(rs.load(STAR), wrench=SIX, described_by=described_by(str(STAR)))
    pages = re.findall(rb"/Type\s*/Page\b", report_pdf(found))
    assert 3 <= len(pages) <= 8


@pytest.mark.parametrize(
    ("machine", "more"),
    [
        (rs.load("cable-8"), set()),
        (rs.load("double-pantograph"), {"energy"}),
        (rs.load_linkage("double-pantograph"), {"energy"}),
    ],
    ids=["cables", "network", "linkage"],
)
def test_pictures_and_parts_of_machines_of_all_kinds(machine, more):
    """Their words stand in pages.txt."""
    found, sections = sections_of(machine, SIX)
    assert figures_of(sections) == {"robot", "ellipsoid", "deformed", *more}
    if not more:
        tables = [part for part in sections["load"] if isinstance(part, Table)]
        assert [row[0] for row in tables[1].rows] == [cable.name for cable in machine.cables]
        return
    (folded,) = (part for part in sections["inputs"] if isinstance(part, Folded))
    given = " ".join(str(table.rows) for table in folded.blocks if isinstance(table, Table))
    assert isinstance(found.robot, rs.Network)
    assert all(part.name in given for part in (*found.robot.joints, *found.robot.springs))


def test_a_flexible_platform_is_drawn_deformed():
    _, sections = sections_of(rs.load(STAR), SIX)
    (deformed,) = (one for one in figures_in(sections["load"]) if one.name == "deformed")
    picture = deformed.levels[0].picture
    assert isinstance(picture, Scene)
    assert picture.notes[0].startswith("displacements × ")
