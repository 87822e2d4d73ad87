"""Reports on cable robots, networks and flexible platforms: what applies, and nothing empty."""

import re
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis import CableStiffness
from robostiff.markup import Folded, Number, Section, Table, inner_blocks
from robostiff.plot.picture import Scene
from robostiff.report import described_by, report_contents, report_page, report_pdf
from robostiff.report.figures import figures_in

STAR = Path(__file__).parents[2] / "docs" / "star-platform.yaml"
SIX = [100, 0, -200, 0, 0, 5]
COMMON = ["findings", "robot", "stiffness", "load", "inputs", "method"]


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


def test_a_cable_robot():
    found, sections = sections_of(rs.load("cable-8"), SIX, described_by=described_by("cable-8"))
    assert list(sections) == COMMON
    assert figures_of(sections) == {"robot", "ellipsoid", "deformed"}
    tables = [part for part in sections["load"] if isinstance(part, Table)]
    assert isinstance(found.stiffness, CableStiffness)
    assert [row[0] for row in tables[1].rows] == list(found.stiffness.cable_names)
    np.testing.assert_array_equal(found.stiffness.K, rs.stiffness(rs.load("cable-8")).K)


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


@pytest.mark.parametrize("as_linkage", [False, True])
def test_a_network_and_a_linkage(as_linkage):
    name = "double-pantograph"
    robot = rs.load_linkage(name) if as_linkage else rs.load(name)
    found, sections = sections_of(robot, SIX)
    own = ["robot"] if as_linkage else []  # the coordinates of its joints
    rest = ["stiffness", "weakest", "load", "inputs", "method"]
    assert list(sections) == ["findings", *own, *rest]
    assert figures_of(sections) == {"robot", "ellipsoid", "deformed", "energy"}
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
