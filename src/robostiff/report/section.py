"""Sections of a report with their figures, and the paragraph before them."""

from __future__ import annotations

import json
from base64 import b64decode
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from robostiff.analysis import CableStiffness
from robostiff.analytic import RobotDerivation
from robostiff.elastostatics import Status
from robostiff.markup import Block, Table, row
from robostiff.model import Robot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.plot import Matplotlib, Theme
from robostiff.plot.backend import plotly_figure
from robostiff.plot.on_plotly.swinging import places
from robostiff.plot.picture import Picture, Scene
from robostiff.plot.theme import Palette, named_colours
from robostiff.report.contents import ReportContents

# colours of charts that the style of a page has too, by which they follow its theme
_IN_STYLE = ("ground", "ink", "muted", "faint")


@dataclass(frozen=True)
class Level:
    """One position of a slider."""

    label: str  # such as ``z = 0.4 m``
    picture: Picture
    # the other end of a vibration, between which and `picture` the page moves the lines
    other: Picture | None = None

    def drawn(self, palette: Palette) -> dict[str, Any]:
        """For the script: a chart, or the figure of a scene and its other end if it has one."""
        if not isinstance(self.picture, Scene):
            svg = Matplotlib().svg(self.picture, letters=True)
            for name in _IN_STYLE:
                svg = svg.replace(getattr(Theme.LIGHT.palette, name), f"var(--{name})")
            svg = svg.replace("#000000", "var(--ink)")  # a colour of parts, dark on dark
            return {"chart": svg[svg.index("<svg") :]}
        own: dict[str, Any] = {"drawn": plotly_figure(self.picture, palette).to_dict()}
        if self.other is not None:
            own["other"] = places(plotly_figure(self.other, palette))
        return own


@dataclass(frozen=True)
class Figure:
    """One picture, or several behind a slider."""

    name: str  # of its place in the page
    caption: str  # what it shows, in a sentence
    levels: tuple[Level, ...]  # one for a figure without a slider
    start: int = 0  # which level is shown first

    @property
    def is_scene(self) -> bool:
        """Whether it can be turned, and is no chart."""
        return isinstance(self.levels[0].picture, Scene)

    def data(self, palette: Palette) -> dict[str, Any]:
        """Data for the script: the name, and each level with its label."""
        return {
            "name": self.name,
            "start": self.start,
            "labels": [level.label for level in self.levels],
            "levels": [level.drawn(palette) for level in self.levels],
        }


def one_figure(name: str, caption: str, picture: Picture) -> Figure:
    """A figure without a slider."""
    return Figure(name, caption, (Level("", picture),))


def figures_json(figures: Sequence[Figure]) -> str:
    """The figures of a page as JSON, with the colours of each theme for the names in them."""
    named = named_colours()
    drawn = [figure.data(named) for figure in figures]
    colours = {
        theme.value: own for theme, own in zip(Theme, zip(*named.every, strict=True), strict=True)
    }
    return json.dumps(_short({"colours": colours, "figures": drawn}), separators=(",", ":"))


def _short(value: Any) -> Any:
    """What Plotly gives, with lists in place of arrays, seven digits a number, and null for NaN."""
    if isinstance(value, np.ndarray):
        return _short(value.tolist())
    if isinstance(value, dict):
        if "bdata" in value:
            flat = np.frombuffer(b64decode(value["bdata"]), dtype=value["dtype"])
            shape = value.get("shape", str(len(flat)))
            return _short(flat.reshape([int(n) for n in shape.split(",")]))
        return {key: _short(own) for key, own in value.items()}
    if isinstance(value, list | tuple):
        return [_short(own) for own in value]
    if isinstance(value, float):
        return float(f"{value:.7g}") if isfinite(value) else None
    return value


@dataclass(frozen=True)
class FormulaBlock:
    """A block with a derivation, typeset step by step."""

    derivation: RobotDerivation


@dataclass(frozen=True)
class Verbatim:
    """Text as it is, line by line."""

    text: str


@dataclass(frozen=True)
class Folded:
    """Blocks that are collapsed below a title; on paper they are shown."""

    title: str
    parts: tuple[Block | FormulaBlock | Verbatim, ...]


@dataclass(frozen=True)
class SideBySide:
    """Blocks beside each other if there is room."""

    blocks: tuple[Block, ...]


_NARROW, _LONG = 3, 12  # columns and rows


def in_halves(table: Table) -> bool:
    """Whether a table is set in two halves on paper."""
    return len(table.header) <= _NARROW and len(table.rows) > _LONG


Part = Block | Figure | Folded | FormulaBlock | SideBySide | Verbatim


@dataclass(frozen=True)
class Section:
    """A part of the report."""

    anchor: str  # name in links
    title: str
    parts: tuple[Part, ...]

    @property
    def figures(self) -> list[Figure]:
        """Its figures."""
        return [part for part in self.parts if isinstance(part, Figure)]


def section(anchor: str, title: str, parts: Iterable[Part | None]) -> Section:
    """A section; parts that are None are left out."""
    return Section(anchor, title, tuple(part for part in parts if part is not None))


@dataclass(frozen=True)
class Verdict:
    """Place, status and advice of a report."""

    place: str  # the pose, or that there is none
    status: Status
    kind: str  # ok, note or bad
    rank: str  # in words; empty where there is none
    advice: tuple[str, ...]


def report_title(contents: ReportContents) -> str:
    """Name and title of the robot."""
    robot = contents.robot
    words = robot.title if isinstance(robot, Robot | CableRobot) else robot.description
    return f"{robot.name}: {words}" if words else robot.name


def verdict_of(contents: ReportContents) -> Verdict:
    """Status of the stiffness and, under a load, of the deflection, with all advice."""
    result, bent = contents.stiffness, contents.deflection
    status = contents.status
    of_load = () if bent is None else (own for own in bent.advice if own not in result.advice)
    is_placed = isinstance(result, CableStiffness) or Status.UNREACHABLE not in result.status
    reached = is_placed and int(result.rank) >= 0
    kind = "network" if isinstance(contents.robot, Network) else "snapshot"
    place = (
        f"At {', '.join(contents.given) or 'home'}"
        if contents.joints
        else f"At the pose of the {kind}"
        if result.pose is None
        else f"At the pose [{row(result.pose)}] (m, rad)"
    )
    return Verdict(
        place=place,
        status=status,
        kind="bad" if status.is_bad else "note" if status else "ok",
        rank=f", rank {int(result.rank)} of {result.space.size}" if reached else "",
        advice=(*result.advice, *(f"under the load: {own}" for own in of_load)),
    )
