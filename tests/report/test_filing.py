"""What makes a report one that can be filed and checked: title block, inputs, another design."""

import base64
import gzip
import hashlib
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff.cli.main import app
from robostiff.markup import Paragraph, Section
from robostiff.plot.picture import Field
from robostiff.report import (
    TitleBlock,
    described_by,
    report_contents,
    report_html,
    report_pdf,
    report_typst,
)
from robostiff.report.figures import figures_in
from robostiff.report.results import map_section
from robostiff.report.write import packed
from robostiff.robots import robot_file
from tests.project.shown_output import ROOT
from tests.report.machines import shipped

LOAD = [100, 20, 3]
CHANGED = {"R": "520 mm"}


@pytest.fixture(scope="module")
def contents():
    return report_contents(
        shipped("3-rrr"),
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
    assert contents.described_by is not None
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
    for leg in shipped("3-rrr").legs:
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
    few = rs.stiffness_map(shipped("3-rrr"), grid, [rs.Quantity.WORST_DEFLECTION])
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
    assert "<" not in packed(text)
    assert unpacked(packed(text)) == text
    plain = base64.b85encode(gzip.compress(text.encode(), 9, mtime=0))
    assert b"<" in plain


def test_the_command_takes_all_of_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = ["report", "3-rpr", "-o", "r.html", "--compare", "3-rrr", "--project", "Cell 4"]
    asked += ["--author", "A. E.", "--date", "2026-11-22", "--revision", "C"]
    outcome = CliRunner().invoke(app, asked)
    assert outcome.exit_code == 0, outcome.stderr
    html = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "<h2>Beside 3-rrr</h2>" in html
    assert "<dd>C</dd>" in html
