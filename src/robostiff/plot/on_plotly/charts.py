"""Bars, bands, curves, fields and matrices on Plotly."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from robostiff.plot.on_plotly.layout import colour_bar, colour_scale, figure
from robostiff.plot.picture import Bands, Bars, Cover, Curves, Field, Matrix, Panel, Region
from robostiff.plot.picture.scene import colour_of
from robostiff.plot.prefix import short
from robostiff.plot.theme import Palette

_STRIP, _VALUES = (0.0, 0.16), (0.26, 1.0)  # of the height


def draw_bands(picture: Bands, palette: Palette) -> go.Figure:
    """Draw bands between percentiles, and under them the shares of poses in regions."""
    x, colour = picture.x.values, palette.categories[0]
    middle = len(picture.percentiles) // 2
    traces: list[Any] = []
    for i in range(middle):
        low, high = picture.percentiles[i], picture.percentiles[-1 - i]
        fill = palette.along((palette.ground, colour), 0.22 + 0.4 * i / max(middle, 1))
        name = f"{low.percent:g} to {high.percent:g} % of the poses with a value"
        traces += _band(x, low.values, high.values, fill, name)
    for median in picture.percentiles[middle : middle + 1]:
        look = {"mode": "lines+markers", "line": {"color": colour, "width": 2}}
        traces.append(
            go.Scatter(x=x, y=median.values, name="median", showlegend=middle > 0, **look)
        )
    for region in picture.shares:
        style = region.key_style(palette)
        traces.append(
            go.Scatter(
                x=x,
                y=100 * region.where,
                stackgroup="shares",
                mode="none",
                line={"shape": "hvh"},
                fillpattern={
                    "shape": style.hatch[:1],
                    "bgcolor": style.fill,
                    "fgcolor": style.line,
                    "size": 6,
                },
                name=region.reason,
                showlegend=True,
                yaxis="y2",
            )
        )
    made = figure(palette, picture.title, traces, picture.notes)
    made.update_xaxes(title=picture.x.label)
    made.update_layout(yaxis={"title": {"text": picture.label}})
    if picture.shares:
        made.update_layout(
            xaxis={"anchor": "y2"},
            yaxis={"domain": _VALUES},
            yaxis2={
                "domain": _STRIP if picture.percentiles else (0.0, 1.0),
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


def draw_field(picture: Field, palette: Palette) -> go.Figure:
    """Draw values over a plane."""
    x, y = picture.x.values, picture.y.values
    scale = picture.scale
    traces: list[Any] = []
    if scale is not None:
        values = go.Heatmap(
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
        traces.append(values)
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
    style = region.style(palette)
    if region.cover is Cover.OVER:
        rows, columns = np.nonzero(region.where)
        # dark on light, visible on every value
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


def draw_matrix(picture: Matrix, palette: Palette) -> go.Figure:
    """Draw a matrix with its numbers."""
    rows, columns = picture.shades.shape
    cells = go.Heatmap(
        z=picture.shades,
        zmin=picture.scale.low,
        zmax=picture.scale.high,
        colorscale=colour_scale(picture.scale, palette),
        colorbar=colour_bar(picture.scale),
        customdata=_hover_text(picture),
        hovertemplate="%{customdata}<extra></extra>",
        hoverongaps=True,
        showlegend=False,
    )
    made = figure(palette, picture.title, [cells])
    for (i, j), shade in np.ndenumerate(picture.shades):
        plain = np.isnan(shade)
        cell = palette.ground if plain else colour_of(float(shade), palette, picture.scale)
        ink = palette.muted if plain else palette.on(cell)
        text = {"text": picture.texts[i][j], "font": {"color": ink, "size": 12}}
        made.add_annotation(x=j, y=i, showarrow=False, **text)
    last = picture.units[-1]
    line = {"color": palette.ink, "width": 1.5}
    down, across = last.rows[0] - 0.5, last.columns[0] - 0.5
    made.add_shape(type="line", x0=-0.5, x1=columns - 0.5, y0=down, y1=down, line=line)
    made.add_shape(type="line", x0=across, x1=across, y0=-0.5, y1=rows - 0.5, line=line)
    for unit in picture.units:
        above = unit.rows[0] == 0
        made.add_annotation(
            x=(sum(unit.columns) - 1) / 2,
            y=1 if above else 0,
            yref="paper",
            yshift=34 if above else -14,
            text=unit.unit,
            showarrow=False,
            font={"color": palette.muted, "size": 12},
        )
    bare = {"showgrid": False, "ticks": "", "showline": False}
    made.update_xaxes(side="top", tickvals=list(range(columns)), ticktext=picture.columns, **bare)
    made.update_yaxes(
        autorange="reversed", tickvals=list(range(rows)), ticktext=picture.rows, **bare
    )
    made.update_layout(margin={"t": 100, "b": 40}, height=560)
    return made


def _hover_text(picture: Matrix) -> np.ndarray:
    """Hover text of each cell: row, column, number, unit."""
    texts = np.empty(picture.shades.shape, dtype=object)
    for unit in picture.units:
        for i in range(*unit.rows):
            for j in range(*unit.columns):
                text = picture.texts[i][j]
                texts[i, j] = f"{picture.rows[i]} / {picture.columns[j]}: {text} {unit.unit}"
    return texts


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
