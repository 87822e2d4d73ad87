"""What notebooks show of machines, results and derivations.

The words are on file in ``shown.txt``: a line there is an expression of Python, below it what is
shown of it. ``python -m tests.analysis.test_notebooks`` writes the page anew.
"""

import base64
import re
import struct
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic import differentiate
from robostiff.markup import writers
from tests.markup.test_blocks import text_of
from tests.project.shown_output import ROOT, first_difference
from tests.said import indented, now, on_file, write

PAGE, FAR = Path(__file__).parent / "shown.txt", [2.0, 0.0, 0.0]
SPREAD: dict[str, Any] = {"k": rs.Uniform(0.1), "l2": rs.Normal("1 mm")}


@cache
def load(name: str, *symbols: str) -> Any:
    own = str(ROOT / name) if "/" in name else name
    return rs.load(own, symbols=symbols) if symbols else rs.load(own)


#: What rounding decides.
ROUNDING = re.compile(
    r"(?<=largest dropped )[^,]*|[\d.]+·10−1[3-9]|(?<=after )\d+(?= steps)"
    r"|(?<=with correction  ).*"
)
NAMES = {"rs": rs, "load": load, "zeros": np.zeros, "FAR": FAR, "SPREAD": SPREAD}


def words_of(result: Any) -> str:
    """The text of the tables, a row a line, cells apart."""
    html = re.sub(r"</(?:td|th|dt)>", r"\g<0>  ", result._repr_html_())
    html = re.sub(r"(</(?:tr|p|li|caption|summary|h\d|dd|ul|thead)>)|<br>", r"\1\n", html)
    text = ROUNDING.sub("...", text_of(html))
    return "\n".join(line.strip() for line in text.splitlines() if line.strip())


def say(_: str, expression: str) -> str:
    shown = eval(expression, dict(NAMES))  # noqa: S307
    return indented(shown if isinstance(shown, str) else words_of(shown))


@pytest.mark.parametrize("subject", on_file(PAGE))
def test_what_is_shown_is_what_is_on_file(subject):
    told = on_file(PAGE)[subject]
    shown = now({subject: told}, say)[subject]
    found = {one: first_difference(text, shown[one]) for one, text in told.items()}
    assert {one: own for one, own in found.items() if own} == {}


@pytest.mark.parametrize("name", [*rs.shipped_robots()])
def test_robots_show_their_legs(name):
    robot = rs.load(name)
    text = text_of(robot._repr_html_())
    assert all(words in text for words in (robot.title, *(leg.name for leg in robot.legs)))


def _of_cables(result: Any) -> list[float]:
    columns = zip(result.placed.lengths, result.axial, result.tensions, strict=True)
    return [*(float(x) for cable in columns for x in cable), *result.K.ravel()]


#: Results, and numbers that their tables hold one after the other, with all their digits.
NUMBERS: dict[str, tuple[Callable[[], Any], Callable[[Any], Any]]] = {
    "stiffness": (lambda: rs.stiffness(load("gough-stewart-a")), lambda one: one.K.ravel()),
    "cables": (lambda: rs.stiffness(load("cable-8")), _of_cables),
    "load on cables": (
        lambda: rs.cable_response(load("cable-8"), wrench=[0, 0, -200, 0, 0, 0]),
        lambda one: one.after.K.ravel(),
    ),
    "equilibrium": (
        lambda: rs.equilibrium(load("3-rrr"), wrench=[50.0, 0, 0]),
        lambda one: one.K.ravel(),
    ),
    "modes": (
        lambda: rs.modes(load("3-rrr"), masses={"platform": 2.0}),
        lambda one: one.frequencies[:10],
    ),
    "indices": (lambda: rs.indices(rs.stiffness(load("3-rrr"))), lambda one: [
        *one.principal.translational, *one.principal.rotational
    ]),
}  # fmt: skip


@pytest.mark.parametrize("name", NUMBERS)
def test_tables_keep_all_digits(name):
    make, numbers = NUMBERS[name]
    result = make()
    kept = [float(value) for value in re.findall('<data value="(.*?)">', result._repr_html_())]
    wanted = [float(x) for x in numbers(result)]
    assert any(kept[i : i + len(wanted)] == wanted for i in range(len(kept)))


def test_rotations_that_are_rounding_are_shown_as_zero():
    bent = rs.deflection(load("double-pantograph"), wrench=[0, 0, -100, 0, 0, 0])
    rounded = np.add(bent.twist, [0, 0, 0, 1e-14, 0, -1e-14])
    bent = replace(bent, of_loads=replace(bent.elements, twist=rounded))
    found = re.findall(r'<data value="([^"]*)">[^<]*</data>\sµrad', bent._repr_html_())
    assert [float(value) for value in found] == [0, 0, 0]


def test_derivations_show_typeset_formulas():
    derivation = rs.derive(load("planar-link", "L"))
    assert "<math" in derivation._repr_html_()
    assert "<mi>L</mi>" in derivation._repr_html_()
    derivative = differentiate(derivation, derivation.symbols[0])
    assert "<mo>∂</mo>" in derivative._repr_html_()


def _picture(result):
    """The title of the picture, and the size of its PNG."""
    tables, html = result._repr_html_(), result._repr_mimebundle_()["text/html"]
    assert html.startswith(tables)
    ((title, data),) = re.findall('<img alt="(.*?)".*?base64,(.*?)">', html[len(tables) :])
    png = base64.b64decode(data)
    assert png.startswith(b"\x89PNG\r\n")
    return title, struct.unpack(">II", png[16:24])


PICTURES: list[tuple[str, Callable[[], Any]]] = [
    ("3-rrr", lambda: load("3-rrr")),
    ("3-rrr", lambda: rs.deflection(load("3-rrr"), wrench=[1, 0, 0])),
    ("3-rrr: translational compliance", lambda: rs.stiffness(load("3-rrr"), [0.01, 0, 0])),
    ("3-rrr under load", lambda: rs.equilibrium(load("3-rrr"), wrench=[50.0, 0, 0])),
    ("3-rrr, mode 1", lambda: rs.modes(load("3-rrr"), masses={"platform": 2.0})),
    ("ur5", lambda: load("examples/ur5.urdf")),
    ("portal", lambda: load("examples/portal.json")),
    ("cable-8", lambda: load("cable-8")),
    ("double-pantograph", lambda: rs.load_linkage("double-pantograph")),
    ("hexapod", lambda: rs.find_posture(load("hexapod")).snapshot.one(0)),
]


@pytest.mark.parametrize(("title", "make"), PICTURES)
def test_notebooks_show_pictures_below_the_tables(title, make):
    shown, (width, height) = _picture(make())
    assert shown.startswith(title)
    assert width == 1003
    assert height > 400


def test_what_has_no_answer_shows_no_picture():
    robot = load("3-rrr")
    results: list[Any] = [
        rs.stiffness(robot, FAR),
        rs.stiffness(robot, np.zeros((4, 3))),
        rs.deflection(robot, FAR, [1, 0, 0]),
        rs.equilibrium(robot, FAR, [1.0, 0, 0]),
        rs.modes(robot, FAR, masses={"platform": 2.0}),
        rs.deflection(robot, loads={"platform": [rs.Mass(2.0)]}, gravity=[0, -9.81, 0]),
    ]
    for result in results:
        assert result._repr_mimebundle_() == {"text/html": result._repr_html_()}


def test_terminals_and_machines_without_matplotlib_draw_nothing(monkeypatch):
    robot = load("3-rrr")
    monkeypatch.setattr(writers, "find_spec", lambda _: None)
    assert robot._repr_mimebundle_() == {"text/html": robot._repr_html_()}
    terminal = SimpleNamespace(display_formatter=SimpleNamespace(active_types=["text/plain"]))
    ipython = SimpleNamespace(get_ipython=lambda: terminal)
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    assert robot._repr_mimebundle_() == {}


def test_ipython_takes_the_tables_with_the_picture():
    formatter = pytest.importorskip("IPython.core.formatters").DisplayFormatter()
    shown, _ = formatter.format(rs.load("3-rrr"))
    assert set(shown) == {"text/html", "text/plain"}
    assert "<img" in shown["text/html"]


if __name__ == "__main__":
    write(PAGE, now(on_file(PAGE), say))
