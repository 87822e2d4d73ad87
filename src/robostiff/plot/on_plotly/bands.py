"""Percentiles along a coordinate on Plotly."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from robostiff.plot.on_plotly.layout import figure
from robostiff.plot.picture import Bands
from robostiff.plot.region_style import region_style
from robostiff.plot.theme import Palette

_STRIP, _VALUES = (0.0, 0.16), (0.26, 1.0)  # of the height


def draw_bands(picture: Bands, palette: Palette) -> go.Figure:
    """Draw bands between percentiles, and under them the share of poses without a value."""
    x, colour = picture.x.values, palette.categories[0]
    middle = len(picture.percentiles) // 2
    traces: list[Any] = []
    for i in range(middle):
        low, high = picture.percentiles[i], picture.percentiles[-1 - i]
        fill = palette.along((palette.ground, colour), 0.22 + 0.4 * i / max(middle, 1))
        name = f"{low.percent:g} to {high.percent:g} % of the poses with a value"
        traces += _band(x, low.values, high.values, fill, name)
    median = picture.percentiles[middle].values
    line = {"color": colour, "width": 2}
    traces.append(
        go.Scatter(x=x, y=median, mode="lines+markers", line=line, name="median", showlegend=True)
    )
    for region in picture.left_out:
        style = region_style(region, palette)
        traces.append(
            go.Scatter(
                x=x,
                y=100 * region.where,
                stackgroup="no value",
                mode="none",
                fillpattern={
                    "shape": style.hatch[0],
                    "bgcolor": style.fill,
                    "fgcolor": style.line,
                    "size": 6,
                },
                name=f"no value: {region.name}",
                showlegend=True,
                yaxis="y2",
            )
        )
    made = figure(palette, picture.title, traces, picture.notes)
    made.update_xaxes(title=picture.x.label)
    made.update_layout(yaxis={"title": {"text": picture.label}})
    if picture.left_out:
        made.update_layout(
            xaxis={"anchor": "y2"},
            yaxis={"domain": _VALUES},
            yaxis2={
                "domain": _STRIP,
                "range": [0, 100],
                "tickvals": [0, 100],
                "ticksuffix": " %",
            },
        )
    return made


def _band(x: np.ndarray, low: np.ndarray, high: np.ndarray, fill: str, name: str) -> list[Any]:
    """A band for each run of places that have values."""
    known = np.isfinite(low) & np.isfinite(high)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(int)))
    bands = []
    for start, stop in ends.reshape(-1, 2):
        run = slice(start, stop)
        bands.append(
            go.Scatter(
                x=np.concatenate([x[run], x[run][::-1]]),
                y=np.concatenate([low[run], high[run][::-1]]),
                fill="toself",
                mode="none",
                fillcolor=fill,
                name=name,
                legendgroup=name,
                showlegend=not bands,
                hoverinfo="skip",
            )
        )
    return bands
