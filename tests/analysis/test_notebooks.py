"""What notebooks show of robots, results and derivations."""

import base64
import re
import struct
import sys
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic import differentiate
from robostiff.markup import writers
from tests.markup.test_blocks import text_of
from tests.report.machines import shipped


@pytest.fixture(scope="module")
def singular():
    return rs.stiffness(shipped("gough-stewart-a"))


def test_stiffness_shows_its_matrix_its_units_and_its_free_motions(singular):
    html = singular._repr_html_()
    text = text_of(html.replace("<br>", ""))
    kept = [float(value) for value in re.findall('<data value="(.*?)">', html)]
    assert kept == singular.K.ravel().tolist()
    assert "[N/m, N/rad, N m/rad]" in text
    assert "rank 3 of 6" in text
    for motion in singular.free_motions:
        assert str(motion) in text


def test_cable_robots_show_their_matrix_and_their_tensions():
    result = rs.stiffness(rs.load("cable-8"))
    html = result._repr_html_()
    kept = [float(value) for value in re.findall('<data value="(.*?)">', html)]
    columns = zip(result.placed.lengths, result.axial, result.tensions, strict=True)
    assert kept == [*(float(x) for cable in columns for x in cable), *result.K.ravel().tolist()]


def test_a_load_on_cables_shows_displacement_tensions_and_slack():
    found = rs.cable_response(rs.load("cable-8"), wrench=[0, 0, -200, 0, 0, 0])
    text = text_of(found._repr_html_())
    assert found.displacement is not None
    assert found.after is not None
    assert text.count("slack") >= 4
    assert f"{1e6 * found.displacement[2]:.5g}".replace("-", "−") in text
    kept = [float(value) for value in re.findall('<data value="(.*?)">', found._repr_html_())]
    assert kept[-36:] == found.after.K.ravel().tolist()


def test_what_is_loaded_is_printed_in_a_line():
    names = ("cable-8", "examples/wall-crane.json", "examples/portal.json")
    loaded = [rs.load(name) for name in names]
    for one in (*loaded, rs.load_linkage("double-pantograph"), rs.indices(shipped("3-rrr"))):
        assert len(repr(one)) < 90


def test_deflection_shows_load_displacement_and_who_bends():
    bent = rs.deflection(shipped("hexapod"), wrench=[0, 0, 1000, 0, 0, 0])
    text = text_of(bent._repr_html_())
    assert "1000 N" in text
    assert f"{bent.parts[0].leg}/{bent.parts[0].part}" in text
    assert "more parts" in text


def test_rotations_that_are_rounding_are_shown_as_zero():
    bent = rs.deflection(rs.load("double-pantograph"), wrench=[0, 0, -100, 0, 0, 0])
    rounded = np.add(bent.twist, [0, 0, 0, 1e-14, 0, -1e-14])
    bent = replace(bent, of_loads=replace(bent.elements, twist=rounded))
    found = re.findall(r'<data value="([^"]*)">[^<]*</data>\sµrad', bent._repr_html_())
    assert [float(value) for value in found] == [0, 0, 0]


def test_answers_that_are_missing_show_why():
    robot = shipped("3-rrr")
    far = [2.0, 0.0, 0.0]
    assert "cannot reach" in text_of(rs.stiffness(robot, far)._repr_html_())
    assert "cannot reach" in text_of(rs.deflection(robot, far, [1, 0, 0])._repr_html_())


def test_a_batch_shows_how_many_have_a_matrix():
    found = rs.stiffness(shipped("3-rrr"), np.zeros((4, 3)))
    assert "4 poses" in text_of(found._repr_html_())


@pytest.mark.parametrize("name", [*rs.shipped_robots()])
def test_robots_show_their_legs(name):
    robot = shipped(name)
    text = text_of(robot._repr_html_())
    assert robot.title in text
    for leg in robot.legs:
        assert leg.name in text


def test_derivations_show_typeset_formulas():
    robot = rs.load("planar-link", symbols=("L",))
    assert isinstance(robot, rs.Robot)
    derivation = rs.derive(robot)
    assert "<math" in derivation._repr_html_()
    assert "<mi>L</mi>" in derivation._repr_html_()
    derivative = differentiate(derivation, derivation.symbols[0])
    assert "<mo>∂</mo>" in derivative._repr_html_()


@pytest.fixture(scope="module")
def loaded():
    return rs.equilibrium(shipped("3-rrr"), wrench=[50.0, 0, 0])


def test_equilibria_show_where_they_are_and_their_matrix(loaded):
    html = loaded._repr_html_()
    assert f"stable, margin {loaded.margin:.5g} of 1" in text_of(html)
    kept = {float(value) for value in re.findall('<data value="(.*?)">', html)}
    assert set(loaded.K.ravel()) | {1e6 * loaded.displacement[0]} <= kept
    far: Any = rs.equilibrium(shipped("3-rrr"), [2.0, 0, 0], [1.0, 0, 0])
    assert "status unreachable" in text_of(far._repr_html_())
    assert far.advice[0] in text_of(far._repr_html_())


def test_modes_show_their_frequencies():
    found = rs.modes(shipped("3-rrr"), masses={"platform": 2.0})
    kept = re.findall('<data value="(.*?)">', found._repr_html_())
    assert [float(value) for value in kept] == found.frequencies[:10].tolist()
    assert f"{len(found) - 10} more at higher frequencies" in text_of(found._repr_html_())
    assert found[0].words.replace("-", "−") in text_of(found._repr_html_())


def test_indices_show_their_values():
    found = rs.indices(rs.stiffness(shipped("3-rrr")))
    kept = {float(value) for value in re.findall('<data value="(.*?)">', found._repr_html_())}
    assert {*found.principal.translational, found.worst_deflection.translational} <= kept


def test_verifications_show_every_method():
    found = rs.verify(shipped("3-rrr"))
    text = text_of(found._repr_html_())
    assert "methods agree" in text
    for comparison in found.comparisons:
        assert f"{comparison.method}" in text


def _picture(result):
    """The title of the picture, and the size of its PNG."""
    tables, html = result._repr_html_(), result._repr_mimebundle_()["text/html"]
    assert html.startswith(tables)
    ((title, data),) = re.findall('<img alt="(.*?)".*?base64,(.*?)">', html[len(tables) :])
    png = base64.b64decode(data)
    assert png.startswith(b"\x89PNG\r\n")
    return title, struct.unpack(">II", png[16:24])


def test_notebooks_show_pictures_below_the_tables(loaded):
    robot = shipped("3-rrr")
    answers = {
        "3-rrr": robot,
        "3-rrr: translational compliance": rs.stiffness(robot, [0.01, 0, 0]),
        "3-rrr under load": loaded,
    }
    for title, result in answers.items():
        shown, (width, height) = _picture(result)
        assert shown == title
        assert width == 1003
        assert height > 400
    assert _picture(rs.deflection(robot, wrench=[1, 0, 0]))[0] == "3-rrr"
    assert _picture(rs.modes(robot, masses={"platform": 2.0}))[0].startswith("3-rrr, mode 1")


def test_what_has_no_answer_shows_no_picture():
    robot, far = shipped("3-rrr"), [2.0, 0, 0]
    weight = [rs.Mass(2.0)]
    results: list[Any] = [
        rs.stiffness(robot, far),
        rs.stiffness(robot, np.zeros((4, 3))),
        rs.deflection(robot, far, [1, 0, 0]),
        rs.equilibrium(robot, far, [1.0, 0, 0]),
        rs.modes(robot, far, masses={"platform": 2.0}),
        rs.deflection(robot, loads={"platform": weight}, gravity=[0, -9.81, 0]),
    ]
    for result in results:
        assert result._repr_mimebundle_() == {"text/html": result._repr_html_()}


def test_terminals_and_machines_without_matplotlib_draw_nothing(monkeypatch):
    robot = shipped("3-rrr")
    monkeypatch.setattr(writers, "find_spec", lambda _: None)
    assert robot._repr_mimebundle_() == {"text/html": robot._repr_html_()}
    terminal = SimpleNamespace(display_formatter=SimpleNamespace(active_types=["text/plain"]))
    ipython = SimpleNamespace(get_ipython=lambda: terminal)
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    assert robot._repr_mimebundle_() == {}


def test_ipython_takes_the_tables_with_the_picture():
    formatter = pytest.importorskip("IPython.core.formatters").DisplayFormatter()
    shown, _ = formatter.format(shipped("3-rrr"))
    assert set(shown) == {"text/html", "text/plain"}
    assert "<img" in shown["text/html"]


@pytest.mark.parametrize(
    ("machine", "words"),
    [
        (lambda: rs.load("examples/ur5.urdf"), "shoulder_pan_joint"),
        (lambda: rs.load("examples/portal.json"), "3 beams"),
        (lambda: rs.load("cable-8"), "cable1"),
        (lambda: rs.load_linkage("double-pantograph"), "prismatic"),
        (lambda: rs.find_posture(shipped("hexapod")).snapshot.one(0), "leg1"),
    ],
    ids=["urdf", "network", "cables", "linkage", "snapshot"],
)
def test_machines_of_all_kinds_show_their_parts_and_a_picture(machine, words):
    shown = machine()
    assert words in text_of(shown._repr_html_())
    assert "<img" in shown._repr_mimebundle_()["text/html"]


def test_critical_loads_optima_tolerances_and_compensations_are_shown():
    critical = rs.critical_load(shipped("3-rpr"), wrench=[0, -1e-3, 0], up_to=10)
    assert "no critical load up to 10 times" in text_of(critical._repr_html_())
    robot = rs.load("3-rrr", symbols=("l2", "k"))
    best = rs.optimise(robot, rs.WorstDeflection(), {"l2": (0.24, 0.26)})
    text = text_of(best._repr_html_())
    assert best.ending.value in text
    assert f"{best.values['l2']:.5g}" in text
    spread = rs.tolerances(robot, {"k": rs.Uniform(0.1), "l2": rs.Normal("1 mm")}, samples=128)
    text = text_of(spread._repr_html_())
    assert "99 % below" in text
    assert f"{100 * spread.shares('worst_deflection')['k']:.1f} %" in text
    bent = rs.network_response(rs.load("examples/portal.json"), {"top": [1000, 0, 0]})
    assert "reaction [N, N m]" in text_of(bent._repr_html_())
    path = rs.compensate(shipped("3-rpr"), [[0, 0, 0]], [0, -1000, 0])
    assert "without correction" in text_of(path._repr_html_())
