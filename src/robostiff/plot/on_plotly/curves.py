"""Curves on Plotly."""

from __future__ import annotations

from typing import Any

import plotly.graph_objects as go

from robostiff.plot.on_plotly.layout import figure
from robostiff.plot.picture import Curves
from robostiff.plot.picture.paint import colour_of
from robostiff.plot.theme import Palette


def draw_curves(picture: Curves, palette: Palette) -> go.Figure:
    """Draw curves over common axes."""
    traces: list[Any] = []
    for curve in picture.curves:
        colour = colour_of(curve.paint, palette)
        traces.append(
            go.Scatter(
                x=curve.x,
                y=curve.y,
                mode="markers" if curve.has_marks else "lines",
                line={"color": colour, "width": 2, "dash": "dash" if curve.is_dashed else "solid"},
                marker={"color": colour, "size": 7},
                name=curve.name,
                showlegend=True,
            )
        )
    made = figure(palette, picture.title, traces, picture.notes)
    made.update_xaxes(title=picture.x_label)
    made.update_layout(yaxis={"title": {"text": picture.y_label}})
    return made
