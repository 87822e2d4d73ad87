"""Bars on Matplotlib."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from robostiff.plot.on_matplotlib.canvas import SMALL, Canvas, legend_below
from robostiff.plot.picture import Bars, Panel
from robostiff.plot.picture.paint import colour_of

_NAMES = 0.5  # inches
_ROOM = 0.32  # of the longest bar, for what is written behind it


def draw_bars(picture: Bars, canvas: Canvas) -> Axes:
    """Draw bars, a panel above another."""
    rows = [_rows(panel, picture.is_stacked) for panel in picture.panels]
    ax = canvas.axes(0.9 + 0.19 * sum(rows) + 0.5 * len(rows))
    panels = [ax] if len(picture.panels) == 1 else _stacked_axes(ax, rows, canvas.room)
    handles, labels = [], []
    for panel, own in zip(picture.panels, panels, strict=True):
        handles = (_stacked if picture.is_stacked else _grouped)(own, panel, canvas)
        labels = [series.name for series in panel.series]
        own.set_xlabel(panel.label)
        own.set_yticks(range(len(panel.groups)), [group.name for group in panel.groups])
        own.invert_yaxis()
        own.tick_params(axis="y", length=0)
        own.spines[["top", "right"]].set_visible(False)
        own.grid(True, axis="x")
        own.set_axisbelow(True)
    ax.set_title(picture.title)
    last = panels[-1]
    legend_below(last, canvas, handles, labels, picture.notes, 0.42)
    return ax


def _rows(panel: Panel, is_stacked: bool) -> int:
    return len(panel.groups) * (1 if is_stacked else len(panel.series) + 1)


def _stacked_axes(ax: Axes, rows: list[int], room: float) -> list[Axes]:
    """Axes within the axes, top to bottom, with room for the labels beside and between them."""
    ax.set_axis_off()
    left = _NAMES / room
    gap = 3.0
    whole = sum(rows) + gap * (len(rows) - 1)
    found, top = [], 1.0
    for own in rows:
        found.append(ax.inset_axes((left, top - own / whole, 1 - left, own / whole)))
        top -= (own + gap) / whole
    return found


def _stacked(ax: Axes, panel: Panel, canvas: Canvas) -> list:
    start = np.zeros(len(panel.groups))
    handles = []
    for series in panel.series:
        colour = colour_of(series.paint, canvas.palette)
        places = np.arange(len(panel.groups))
        handles.append(
            ax.barh(
                places,
                series.values,
                left=start,
                height=0.7,
                color=colour,
                edgecolor=canvas.palette.ground,
                linewidth=0.4,
            )
        )
        start = start + series.values
    for i, group in enumerate(panel.groups):
        _text(ax, start[i], i, group.note)
    ax.set_xlim(0, (1 + 0.5 * _ROOM) * (start.max() or 1.0))
    return handles


def _grouped(ax: Axes, panel: Panel, canvas: Canvas) -> list:
    count = len(panel.series)
    height = 0.8 / count
    handles = []
    for k, series in enumerate(panel.series):
        places = np.arange(len(panel.groups)) + (k - (count - 1) / 2) * height
        colour = colour_of(series.paint, canvas.palette)
        handles.append(ax.barh(places, series.values, height=0.9 * height, color=colour))
        for place, value, text in zip(places, series.values, series.texts, strict=True):
            _text(ax, value, place, text)
    values = np.concatenate([series.values for series in panel.series])
    size = float(np.abs(values).max()) or 1.0
    room = _ROOM * (2.0 if canvas.is_narrow else 1.0)
    low = float(values.min())
    ax.set_xlim(low - room * size if low < 0 else 0.0, max(float(values.max()), 0.0) + room * size)
    if low < 0:
        ax.axvline(0, color=canvas.palette.muted, linewidth=0.8)
    return handles


def _text(ax: Axes, value: float, place: float, text: str) -> None:
    side = -1 if value < 0 else 1
    ax.annotate(
        text,
        (value, place),
        (3 * side, 0),
        textcoords="offset points",
        ha="left" if side > 0 else "right",
        va="center",
        fontsize=SMALL - 0.5,
    )
