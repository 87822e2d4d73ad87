"""Bars on Plotly."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from robostiff.plot.on_plotly.layout import figure
from robostiff.plot.picture import Bars, Panel
from robostiff.plot.picture.paint import colour_of
from robostiff.plot.theme import Palette

_ROW, _GAP = 24, 70  # pixels


def draw_bars(picture: Bars, palette: Palette) -> go.Figure:
    """Draw bars, a panel above another."""
    traces: list[Any] = []
    for k, panel in enumerate(picture.panels):
        names = [group.name for group in panel.groups]
        for series in panel.series:
            traces.append(
                go.Bar(
                    y=names,
                    x=series.values,
                    name=series.name,
                    legendgroup=series.name,
                    showlegend=k == 0,
                    orientation="h",
                    marker={"color": colour_of(series.paint, palette)},
                    text=list(series.texts) or None,
                    textposition="outside" if series.texts else "none",
                    textfont={"color": palette.ink},
                    cliponaxis=False,
                    hovertemplate="%{y}: %{x:.3g}<extra>" + series.name + "</extra>",
                    xaxis=f"x{k + 1}" if k else "x",
                    yaxis=f"y{k + 1}" if k else "y",
                )
            )
    rows = [
        len(panel.groups) * (1.0 if picture.is_stacked else len(panel.series) + 0.5)
        for panel in picture.panels
    ]
    height = int(_ROW * sum(rows) + _GAP * (len(rows) - 1))
    made = figure(palette, picture.title, traces, picture.notes, height)
    made.update_layout(barmode="stack" if picture.is_stacked else "group", bargap=0.25)
    top = 1.0
    for k, (panel, own) in enumerate(zip(picture.panels, rows, strict=True)):
        part = _ROW * own / height
        name = str(k + 1) if k else ""
        low = max(top - part, 0.0)
        made.update_layout(
            {
                f"xaxis{name}": {
                    "title": {"text": panel.label},
                    "anchor": f"y{name}",
                    "range": _range(panel, picture.is_stacked),
                },
                f"yaxis{name}": {
                    "anchor": f"x{name}",
                    "domain": [low, top],
                    "autorange": "reversed",
                    "showgrid": False,
                    "ticks": "",
                },
            }
        )
        if picture.is_stacked:
            _totals(made, panel)
        top -= part + _GAP / height
    return made


def _range(panel: Panel, is_stacked: bool) -> list[float]:
    values = np.array([series.values for series in panel.series])
    if is_stacked:
        return [0.0, 1.14 * float(values.sum(axis=0).max() or 1.0)]
    size = float(np.abs(values).max()) or 1.0
    low, high = float(values.min()), float(values.max())
    return [low - 0.3 * size if low < 0 else 0.0, max(high, 0.0) + 0.3 * size]


def _totals(made: go.Figure, panel: Panel) -> None:
    ends = np.sum([series.values for series in panel.series], axis=0)
    for group, end in zip(panel.groups, ends, strict=True):
        made.add_annotation(
            x=end, y=group.name, text=group.note, showarrow=False, xanchor="left", xshift=4
        )
