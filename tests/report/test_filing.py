"""Reports as they are filed, of machines of all kinds."""

import base64
import gzip
import hashlib
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.markup import Folded, Number, Paragraph, Section, Table, inner_blocks
from robostiff.plot.picture import Field, Scene
from robostiff.report import (
    TitleBlock,
    described_by,
    report_contents,
    report_html,
    report_page,
    report_pdf,
    report_typst,
)
from robostiff.report.figures import figures_in
from robostiff.report.results import map_section
from robostiff.report.write import pack
from robostiff.robots import robot_file
from tests.cli.running import Running
from tests.project.shown_output import ROOT

LOAD = [100, 20, 3]
CHANGED = {"R": "520 mm"}


@pytest.fixture(scope="module")
def contents():
    return report_contents(
        rs.load("3-rrr"),
        wrench=LOAD,
        title_block=TitleBlock("Cell <4>", "A. Engineer", "2026-11-22", "B"),
        described_by=described_by("3-rrr", CHANGED),
        other=rs.load("3-rpr"),
    )


@pytest.fixture(scope="module")
def html(contents):
    return report_html(contents)


def test_the_title_block_stands_before_the_verdict(html):
    head = html.partition("<header>")[2].partition("</header>")[0]
    block = head.index('class="title-block"')
    assert block < head.index("status-")
    for text in ("Cell &lt;4&gt;", "A. Engineer", "2026-11-22", "<dt>revision</dt><dd>B</dd>"):
        assert text in head


def test_the_file_is_there_word_for_word(contents, html):
    text = robot_file("3-rrr").read_text(encoding="utf-8")
    assert hashlib.sha256(text.encode()).hexdigest() in html
    assert "robostiff: 1\nname: 3-rrr\n" in html
    assert contents.described_by.text == text


@pytest.mark.parametrize(
    "names", [["tricept-with-head.yaml", "tricept.yaml"], ["ur5.urdf", "ur5.stiffness.yaml"]]
)
def test_every_file_of_a_machine_has_its_hash(names):
    known = described_by(ROOT / "examples" / names[0])
    assert known is not None
    assert list(known.files) == names
    for name, digest in known.files.items():
        assert hashlib.sha256((ROOT / "examples" / name).read_bytes()).hexdigest() == digest


def test_every_joint_and_elastic_part_is_listed(html):
    inputs = html.partition('id="inputs"')[2].partition("</section>")[0]
    for leg in rs.load("3-rrr").legs:
        for part in leg.chain.elements:
            assert f'<th scope="row">{leg.name}/{part.name}</th>' in inputs


def test_the_other_design_has_its_own_matrix_and_displacements(html):
    section = html.partition('id="comparison"')[2].partition("</section>")[0]
    matrix = section.partition('data-symbol="K of 3-rpr"')[2].partition("</table>")[0]
    shown = [float(v) for v in re.findall(r'<data value="([^"]+)"', matrix)]
    assert shown == rs.stiffness(rs.load("3-rpr")).K.ravel().tolist()
    moves = section.partition("second over first")[2].partition("</table>")[0]
    values = [float(v) for v in re.findall(r'<data value="([^"]+)"', moves)]
    first = rs.deflection(rs.load("3-rrr"), None, LOAD).twist
    second = rs.deflection(rs.load("3-rpr"), None, LOAD).twist
    np.testing.assert_allclose(values[:3], [1e6 * first[0], 1e6 * second[0], second[0] / first[0]])


def test_paper_has_what_the_page_has(contents, html):
    typst = report_typst(contents)
    headings = re.findall("<h2>(.*?)</h2>", html)
    assert "Under the load" in headings
    assert re.findall("^= (.*)$", typst, re.MULTILINE) == [h.replace("-", "\\-") for h in headings]
    assert "A\\. Engineer" in typst
    pages = re.findall(rb"/Type\s*/Page\b", report_pdf(contents))
    assert 1 <= len(pages) <= 8


def test_letters_of_figures_on_paper_are_not_scaled_down(contents):
    """A figure is as wide as it is drawn, half a page, beside another and alone."""
    typst = report_typst(contents)
    found = re.findall(r'#figure\(.*?<svg [^>]*?width=\\"([0-9.]+)pt', typst, re.DOTALL)
    assert len(found) == typst.count('format: "svg", width: 82mm') > 2
    assert "columns: (1fr, 1fr)" in typst
    for width in found:
        assert 0.9 * 82 <= float(width) * 25.4 / 72 <= 82 / 0.95


def test_a_page_is_below_two_megabytes(html):
    assert len(html.encode()) < 2_000_000


def test_slices_of_a_map_of_millions_of_poses_stay_small(contents):
    grid = rs.Grid(x=rs.Axis(-0.1, 0.1, 2), y=rs.Axis(-0.1, 0.1, 2), rz=rs.Axis(-0.1, 0.1, 2))
    few = rs.stiffness_map(rs.load("3-rrr"), grid, [rs.Quantity.WORST_DEFLECTION])
    sizes = {"x": 300, "y": 200, "rz": 30}
    many = few.isel({name: np.arange(n) * 2 // n for name, n in sizes.items()})
    for name, n in sizes.items():
        many[name] = (name, np.linspace(-0.1, 0.1, n), few[name].attrs)
    section = map_section(replace(contents, found=many))
    assert isinstance(section, Section)
    words, *_ = section.blocks
    assert isinstance(words, Paragraph)
    assert "The slices show" in words.text
    assert "of 300 values of x" in words.text
    (figure,) = figures_in(section.blocks)
    shown = [level.picture for level in figure.levels if isinstance(level.picture, Field)]
    assert len(shown) == 25
    assert 20_000 < sum(picture.values.size for picture in shown) <= 40_000
    first, last = shown[0], shown[-1]
    assert first.x.values[[0, -1]].tolist() == [-0.1, 0.1]
    picked = many.worst_deflection.sel(x=first.x.values, y=first.y.values)
    for picture, k in ((first, 0), (last, -1)):
        values = picked.isel(rz=k).transpose("y", "x").values
        ratio = picture.values / values  # in a unit with a prefix
        np.testing.assert_allclose(ratio, ratio[0, 0], rtol=1e-6)


def unpacked(written: str) -> str:
    """The text that was packed, as the script of the page unpacks it."""
    return gzip.decompress(base64.b85decode(written.replace(".", "<"))).decode()


def test_figures_come_out_of_the_page_as_they_went_in(html):
    found = re.search(r'id="figures">([^<]*)</script>', html)
    assert found is not None
    names = [figure["name"] for figure in json.loads(unpacked(found[1]))["figures"]]
    assert names[0] == "robot"
    assert f"plot-{names[-1]}" in html


def test_packed_text_cannot_end_its_element():
    # so many bytes that every sign occurs
    text = "".join(chr(33 + (i * i) % 9001) for i in range(30000))
    assert "<" not in pack(text)
    assert unpacked(pack(text)) == text
    plain = base64.b85encode(gzip.compress(text.encode(), 9, mtime=0))
    assert b"<" in plain


def test_the_command_takes_all_of_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = ["3-rpr", "-o", "r.html", "--compare", "3-rrr", "--project", "Cell 4"]
    asked += ["--author", "A. E.", "--date", "2026-11-22", "--revision", "C"]
    Running("report").done(*asked)
    html = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "<h2>Beside 3-rrr</h2>" in html
    assert "<dd>C</dd>" in html


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
