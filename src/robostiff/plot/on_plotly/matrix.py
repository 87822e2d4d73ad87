"""A matrix on Plotly."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from robostiff.plot.on_plotly.layout import colour_bar, colour_scale, figure
from robostiff.plot.picture import Matrix
from robostiff.plot.picture.paint import colour_of
from robostiff.plot.theme import Palette


def draw_matrix(picture: Matrix, palette: Palette) -> go.Figure:
    """Draw a matrix with its numbers."""
    rows, columns = picture.shades.shape
    cells = go.Heatmap(
        z=picture.shades,
        zmin=picture.scale.low,
        zmax=picture.scale.high,
        colorscale=colour_scale(picture.scale, palette),
        colorbar=colour_bar(picture.scale),
        customdata=_told(picture),
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


def _told(picture: Matrix) -> np.ndarray:
    """What the pointer tells of each cell: row, column, number, unit."""
    told = np.empty(picture.shades.shape, dtype=object)
    for unit in picture.units:
        for i in range(*unit.rows):
            for j in range(*unit.columns):
                text = picture.texts[i][j]
                told[i, j] = f"{picture.rows[i]} / {picture.columns[j]}: {text} {unit.unit}"
    return told
