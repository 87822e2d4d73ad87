"""Figures of a page in a light and a dark theme, as data for the script of the page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from robostiff.plot import Plotly, Theme
from robostiff.plot.on_plotly.swinging import places
from robostiff.plot.picture import Picture


@dataclass(frozen=True)
class Level:
    """One position of a slider.

    Attributes
    ----------
    label : str
        Such as ``z = 0.4 m``.
    other : Picture or None
        The other end of a vibration, between which and `picture` the page moves the lines.
    """

    label: str
    picture: Picture
    other: Picture | None = None

    @property
    def drawn(self) -> dict[str, Any]:
        """In both themes, and the other end where there is one."""
        own: dict[str, Any] = {theme.value: _drawn(self.picture, theme) for theme in Theme}
        if self.other is not None:
            own["other"] = places(Plotly().draw(self.other))
        return own


@dataclass(frozen=True)
class Figure:
    """One picture, or several behind a slider.

    Attributes
    ----------
    name : str
        Of its place in the page.
    caption : str
        What it shows, in a sentence.
    levels : tuple of Level
        One for a figure without a slider.
    start : int
        Which level is shown first.
    """

    name: str
    caption: str
    levels: tuple[Level, ...]
    start: int = 0

    @property
    def data(self) -> dict[str, Any]:
        """Data for the script: the name, and each level with its label in both themes."""
        return {
            "name": self.name,
            "start": self.start,
            "labels": [level.label for level in self.levels],
            "levels": [level.drawn for level in self.levels],
        }


def one_figure(name: str, caption: str, picture: Picture) -> Figure:
    """A figure without a slider."""
    return Figure(name, caption, (Level("", picture),))


def figures_json(figures: Sequence[Figure]) -> str:
    """The figures of a page as JSON."""
    return json.dumps([figure.data for figure in figures])


def _drawn(picture: Picture, theme: Theme) -> dict[str, Any]:
    drawn = Plotly(theme).draw(picture).to_plotly_json()
    return json.loads(_encoded(drawn))


def _encoded(drawn: dict[str, Any]) -> str:
    from plotly.utils import PlotlyJSONEncoder

    return json.dumps(drawn, cls=PlotlyJSONEncoder)
