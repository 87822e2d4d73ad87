"""Values over a plane on Plotly."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from robostiff.plot.on_plotly.layout import colour_bar, colour_scale, figure
from robostiff.plot.picture import Cover, Field, Region
from robostiff.plot.prefix import short
from robostiff.plot.region_style import region_style
from robostiff.plot.theme import Palette


def draw_field(picture: Field, palette: Palette) -> go.Figure:
    """Draw values over a plane."""
    x, y = picture.x.values, picture.y.values
    scale = picture.scale
    traces: list[Any] = [
        go.Heatmap(
            x=x,
            y=y,
            z=picture.values,
            zmin=scale.low,
            zmax=scale.high if scale.high > scale.low else scale.low + abs(scale.low or 1.0),
            colorscale=colour_scale(scale, palette),
            colorbar=colour_bar(scale),
            hoverongaps=False,
            hovertemplate=f"{picture.x.label} %{{x:.4g}}<br>{picture.y.label} %{{y:.4g}}<br>"
            "%{z:.4g}<extra></extra>",
            showlegend=False,
        )
    ]
    for region in picture.regions:
        traces += _region(region, x, y, palette)
    traces += [_isoline(picture, level) for level in picture.isolines]
    made = figure(palette, picture.title, traces, picture.notes)
    made.update_xaxes(title=picture.x.label, showgrid=False, constrain="domain")
    made.update_yaxes(title=picture.y.label, showgrid=False, constrain="domain")
    if picture.x.label.rpartition("[")[2] == picture.y.label.rpartition("[")[2]:
        made.update_yaxes(scaleanchor="x")
    return made


def _region(region: Region, x: np.ndarray, y: np.ndarray, palette: Palette) -> list[Any]:
    """Cells of one colour, or marks over values; and a name in the legend."""
    style = region_style(region, palette)
    if region.cover is Cover.OVER:
        rows, columns = np.nonzero(region.where)
        # dark on light, to be seen on every value
        marker = {"symbol": "x", "size": 6, "color": "#ffffff"}
        marker["line"] = {"color": "#222222", "width": 1}
        marks = go.Scatter(
            x=x[columns],
            y=y[rows],
            mode="markers",
            marker=marker,
            name=region.name,
            hoverinfo="skip",
            showlegend=True,
        )
        return [marks]
    cells = go.Heatmap(
        x=x,
        y=y,
        z=np.where(region.where, 1.0, np.nan),
        colorscale=[[0, style.fill], [1, style.fill]],
        showscale=False,
        hoverongaps=False,
        hovertemplate=region.name + "<extra></extra>",
        legendgroup=region.name,
        showlegend=False,
    )
    marker = {
        "symbol": "square",
        "size": 12,
        "color": style.fill,
        "line": {"color": style.line, "width": 1},
    }
    key = go.Scatter(
        x=[None],
        y=[None],
        mode="markers",
        marker=marker,
        name=region.name,
        legendgroup=region.name,
        showlegend=True,
    )
    return [cells, key]


def _isoline(picture: Field, level: float) -> Any:
    return go.Contour(
        x=picture.x.values,
        y=picture.y.values,
        z=picture.values,
        contours={
            "type": "constraint",
            "operation": "=",
            "value": level,
            "showlabels": True,
            "labelfont": {"size": 10, "color": "#ffffff"},
        },
        line={"color": "#ffffff", "width": 1.5},
        connectgaps=False,
        name=short(level, 4),
        hoverinfo="skip",
        showlegend=False,
    )
