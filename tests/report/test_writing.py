"""What is written, and what is said instead."""

import re
import sys
from dataclasses import replace

import pytest

import robostiff as rs
from robostiff.report import (
    TitleBlock,
    described_by,
    report_contents,
    report_html,
    report_pdf,
    report_typst,
    save_report,
)
from robostiff.robots import robot_file
from tests.cli.running import Running
from tests.project.shown_output import ROOT
from tests.report.machines import with_symbols

PLANAR_LOAD = [100, 20, 3]


@pytest.fixture(scope="module")
def planar():
    return report_contents(rs.load("3-rpr"), wrench=PLANAR_LOAD)


pytestmark = pytest.mark.usefixtures("in_a_folder")
run = Running("report")


def test_a_page_and_a_pdf_or_a_pdf_alone(tmp_path):
    outcome = run.done("3-rpr", "--wrench", "100 N 20 N 3 N*m", "--pdf", "-o", "robot.html")
    assert outcome.stdout.split() == ["robot.html", "robot.pdf"]
    assert run("3-rpr", "--pdf", "-o", "alone.pdf").stdout.split() == ["alone.pdf"]
    assert (tmp_path / "robot.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    for name in ("robot.pdf", "alone.pdf"):
        assert (tmp_path / name).read_bytes().startswith(b"%PDF-")
        assert (tmp_path / name).stat().st_size > 10_000
    assert len(list(tmp_path.iterdir())) == 3


def test_couplings_are_listed_with_their_sums_at_home():
    html = report_html(report_contents(rs.load(ROOT / "tests/files/geared-wrist.yaml")))
    cells = re.sub(r"(<[^>]*>)+", "|", html)
    assert "|arm/belt|b + 1.5 a|0.17453| rad|locked|50000| N m/rad|" in cells
    assert "|arm/coupling of s and a|s + 0.005 a|0.02| m|locked|rigid|" in cells


def test_a_report_with_every_section_has_few_pages_and_says_the_formula_once():
    typst = pytest.importorskip("typst")
    robot = rs.load("hexapod")
    grid = rs.Grid(x=rs.Axis(-0.1, 0.1, 3), y=rs.Axis(-0.1, 0.1, 3))
    contents = report_contents(
        robot,
        [0.06, 0.02, 0.9, 0, 0.17, 0],
        wrench=[300, 100, -200, 0, 0, 0],
        found=rs.stiffness_map(robot, grid, [rs.Quantity.WORST_DEFLECTION]),
        symbolic=with_symbols("hexapod"),
        finite=True,
        title_block=TitleBlock("cell 4", "A. Engineer", "2026-11-23", "B"),
        described_by=described_by(robot_file("hexapod")),
        other=robot,
    )
    source = report_typst(contents)
    pages = typst.compile(source.encode(), format="svg", ignore_system_fonts=True)
    assert 2 <= len(pages) <= 9  # all but the last are full
    formula = source.partition("= The formula")[2]
    assert "One leg, and what differs between the legs" in formula
    assert "Leg 2: leg2" not in formula


def test_a_wide_matrix_scrolls_by_itself():
    contents = report_contents(
        rs.load("gough-stewart-b"), wrench=[0, 0, -100, 0, 0, 0], finite=True
    )
    before = re.findall(r"(<div[^>]*>)?\s*<table class=\"robostiff-matrix\"", report_html(contents))
    assert len(before) == 3
    assert all(before)


@pytest.mark.parametrize(
    ("words", "status"),
    [
        (("gough-stewart-a", "--wrench", "0 0 0 0 0 1"), 1),
        (("3-rrr", "--pose", "2 0 0", "--wrench", "1 0 0", "--pdf"), 1),
        ((str(ROOT / "examples/wall-crane.json"),), 0),
    ],
)
def test_the_exit_status_says_whether_there_are_all_answers(words, status, tmp_path):
    """What these pages say stands in pages.txt."""
    assert run(*words, "-o", "robot.html").exit_code == status
    html = (tmp_path / "robot.html").read_text(encoding="utf-8")
    assert ('class="plot"' in html) == ("3-rrr" not in words)


def test_words_of_a_model_are_text_not_markup():
    title = '</script> & $x$ "quoted" \\'
    odd = replace(rs.load("3-rpr"), name="<b>#odd</b>", title=title)
    contents = report_contents(odd)
    html = report_html(contents)
    assert "<b>#odd" not in html
    assert "&lt;b&gt;#odd&lt;/b&gt;: &lt;/script&gt; &amp; $x$" in html
    assert html.count("</script>") == 3
    pdf = report_pdf(contents)
    assert pdf.startswith(b"%PDF-")
    assert report_pdf(contents) == pdf


@pytest.mark.parametrize(
    ("package", "path", "hint"),
    [
        ("plotly", "robot.html", r"pip install 'robostiff\[plot\]'"),
        ("matplotlib", "robot.pdf", r"pip install 'robostiff\[plot\]'"),
        ("typst", "robot.pdf", r"pip install 'robostiff\[pdf\]'"),
    ],
)
def test_a_missing_package_is_named_and_nothing_is_written(
    package, path, hint, monkeypatch, tmp_path, planar
):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(rs.InputError, match=hint):
        save_report(planar, tmp_path / path)
    assert not any(tmp_path.iterdir())


def test_an_old_report_stays_when_the_new_one_fails(monkeypatch, tmp_path):
    path = tmp_path / "robot.html"
    path.write_text("old")

    def interrupted(contents):
        raise KeyboardInterrupt

    monkeypatch.setattr("robostiff.report.write.report_html", interrupted)
    with pytest.raises(KeyboardInterrupt):
        rs.write_report(rs.load("3-rpr"), path)
    assert path.read_text() == "old"
    assert [found.name for found in tmp_path.iterdir()] == ["robot.html"]


def test_a_map_of_another_robot_is_refused(tmp_path):
    grid = rs.Grid(x=rs.Axis(-0.01, 0.01, 2), y=rs.Axis(-0.01, 0.01, 2))
    rs.stiffness_map(rs.load("3-rpr"), grid).to_netcdf("map.nc", engine="h5netcdf")
    outcome = run.done("hexapod", "--map", "map.nc", "-o", "x.html", status=2)
    assert "robot of the map: got '3-rpr'" in outcome.stderr
    assert not (tmp_path / "x.html").exists()
