"""Reports as somebody sees them, in a real browser."""

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.report import write_report
from tests.report.browsing import chromium, opened
from tests.report.machines import with_symbols

pytestmark = pytest.mark.needs("Chromium", "Playwright")
POSE, LOAD = [0.06, 0.02, 0.9, 0, 0.17, 0], [300, 100, -200, 0, 0, 0]
PLANAR_LOAD = [100, 20, 3]


@pytest.fixture(scope="module")
def browser():
    with chromium() as program:
        yield program


@pytest.fixture(scope="module")
def planar_map():
    # wide enough for poses out of reach
    grid = rs.Grid(x=rs.Axis(-0.6, 0.6, 9), y=rs.Axis(-0.6, 0.6, 7), rz=rs.Axis(-0.2, 0.2, 3))
    return rs.stiffness_map(rs.load("3-rrr"), grid, [rs.Quantity.WORST_DEFLECTION])


@pytest.fixture(scope="module")
def planar_page(tmp_path_factory, planar_map) -> Path:
    path = tmp_path_factory.mktemp("reports") / "planar.html"
    write_report(with_symbols("3-rrr"), path, wrench=PLANAR_LOAD, found=planar_map)
    return path


@pytest.fixture(scope="module")
def planar(browser, planar_page):
    return opened(browser, planar_page)


@pytest.fixture(scope="module")
def spatial(browser, tmp_path_factory):
    path = tmp_path_factory.mktemp("reports") / "spatial.html"
    write_report(rs.load("hexapod"), path, POSE, wrench=LOAD)
    return opened(browser, path)


@pytest.mark.parametrize("name", ["planar", pytest.param("spatial", marks=pytest.mark.slow)])
def test_every_plot_is_drawn(name, request):
    image = pytest.importorskip("PIL.Image")
    report = request.getfixturevalue(name)
    counts = {"planar": (3, 4), "spatial": (4, 1)}
    assert (len(report.plots), len(report.charts)) == counts[name]
    page = image.open(BytesIO(report.page.screenshot(full_page=True))).convert("RGB")
    for plot in (*report.plots, *report.charts):
        box = plot.bounding_box()
        top = box["y"] + report.page.evaluate("scrollY")
        seen = page.crop((box["x"], top, box["x"] + box["width"], top + box["height"]))
        drawn = np.any(np.asarray(seen) != seen.getpixel((2, 2)), axis=-1)
        assert drawn.mean() > 0.01, plot.get_attribute("id")
        # more than a legend: what is drawn reaches over much of the place
        for across in (0, 1):
            reached = np.flatnonzero(drawn.any(axis=across))
            assert np.ptp(reached) > 0.4 * drawn.shape[1 - across], plot.get_attribute("id")


@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_nothing_is_fetched_and_nothing_goes_wrong(name, request):
    report = request.getfixturevalue(name)
    assert [url for url in report.requests if not url.startswith(("data:", "blob:"))] == [
        report.page.url
    ]
    assert report.page.url.startswith("file:")
    assert report.complaints == []


def test_the_slider_changes_the_slice(planar, planar_map):
    slider = planar.page.locator("#slider-worst-deflection")
    label = planar.page.locator("#label-worst-deflection")
    said, drawn = [], []
    for level in range(3):
        slider.focus()
        slider.press("Home")
        for _ in range(level):
            slider.press("ArrowRight")
        said.append(label.text_content())
        drawn.append(planar.page.locator("#plot-worst-deflection").inner_html())
        at = f"rz = {float(planar_map.rz[level]):g} rad"
        assert at in drawn[-1].replace("\N{MINUS SIGN}", "-")
    assert said == ["rz = -0.2 rad", "rz = 0 rad", "rz = 0.2 rad"]
    assert len(set(drawn)) == 3


def test_poses_out_of_reach_are_named_in_the_legend(planar, planar_map):
    assert (planar_map["rank"] < 3).any()
    words = set(planar.page.locator("#plot-worst-deflection text").all_text_contents())
    assert "unreachable" in words


def test_formulas_are_typeset(planar):
    planar.page.locator("#formula summary").click()
    box = planar.page.locator("#formula .formula math").first.bounding_box()
    assert box["height"] > 10
    assert box["width"] > 20


def test_half_a_screen_is_wide_enough_and_dark_is_dark(browser, planar_page):
    report = opened(browser, planar_page, width=640, dark=True)
    page = report.page
    assert page.evaluate("document.documentElement.scrollWidth") <= 640
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert ground == "rgb(22, 25, 29)"
    for plot in report.plots:
        assert plot.evaluate("place => place._fullLayout.paper_bgcolor") == "#16191d"
        assert plot.bounding_box()["width"] <= 640
    ink = "chart => getComputedStyle(chart.querySelector('text')).fill"
    for chart in report.charts:
        assert chart.evaluate(ink) == "rgb(232, 232, 232)"
        assert chart.bounding_box()["width"] <= 640
    page.emulate_media(color_scheme="light")
    page.wait_for_function(
        "[...document.querySelectorAll('.plot')].every("
        "(place) => place._fullLayout.paper_bgcolor === '#ffffff')"
    )
    page.close()


def test_what_is_printed_is_an_image_of_every_figure_on_light_ground(browser, planar_page):
    image = pytest.importorskip("PIL.Image")
    report = opened(browser, planar_page, dark=True)
    page = report.page
    page.wait_for_function(
        "[...document.querySelectorAll('.on-paper')].every((one) => one.complete && one.src)",
        timeout=120_000,
    )
    assert len(report.plots) == page.locator(".on-paper").count()
    assert len(report.charts) == 4
    page.emulate_media(media="print", color_scheme="dark")
    assert not any(plot.is_visible() for plot in report.plots)
    for shown in page.locator(".on-paper").all():
        assert shown.is_visible()
        drawn = image.open(BytesIO(shown.screenshot())).convert("RGB")
        assert drawn.getpixel((2, 2)) == (255, 255, 255)
        assert np.any(np.asarray(drawn) != 255, axis=-1).mean() > 0.003
    assert page.locator("details").count() > 0
    for event, state in (("beforeprint", ":not([open])"), ("afterprint", "[open]")):
        page.evaluate(f"window.dispatchEvent(new Event('{event}'))")
        assert page.locator(f"details{state}").count() == 0
    page.close()


def test_nothing_is_offered_to_be_uploaded(planar):
    planar.page.locator("#plot-robot").hover()
    titles = planar.page.locator(".modebar-btn").evaluate_all(
        "all => all.map((one) => one.dataset.title || '')"
    )
    assert titles
    assert not [title for title in titles if "loud" in title or "hart Studio" in title]
