"""A matrix on Matplotlib."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from robostiff.plot.on_matplotlib.canvas import SMALL, Canvas, colour_bar, colour_map, norm
from robostiff.plot.picture import Matrix
from robostiff.plot.picture.paint import colour_of


def draw_matrix(picture: Matrix, canvas: Canvas) -> Axes:
    """Draw a matrix with its numbers."""
    rows, columns = picture.shades.shape
    ax = canvas.axes(canvas.width * (0.78 if canvas.is_narrow else 0.62))
    palette = canvas.palette
    shown = ax.imshow(
        np.ma.masked_invalid(picture.shades),
        cmap=colour_map(picture.scale, palette),
        norm=norm(picture.scale),
        aspect="auto",
    )
    size = 5.8 if canvas.is_narrow else SMALL
    for (i, j), shade in np.ndenumerate(picture.shades):
        plain = np.isnan(shade)
        cell = palette.ground if plain else colour_of(float(shade), palette, picture.scale)
        ink = palette.muted if plain else palette.on(cell)
        text = picture.texts[i][j]
        ax.text(j, i, text, ha="center", va="center", fontsize=size, color=ink)
    ax.set_xticks(range(columns), picture.columns)
    ax.set_yticks(range(rows), picture.rows)
    ax.xaxis.tick_top()
    ax.tick_params(length=0, pad=2)
    last = picture.units[-1]
    ax.axhline(last.rows[0] - 0.5, color=palette.ink, linewidth=0.9)
    ax.axvline(last.columns[0] - 0.5, color=palette.ink, linewidth=0.9)
    for unit in picture.units:
        above = unit.rows[0] == 0
        ax.annotate(
            unit.unit,
            ((sum(unit.columns) - 1) / 2, 1.0 if above else 0.0),
            (0, 13 if above else -4),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha="center",
            va="bottom" if above else "top",
            fontsize=SMALL,
            color=palette.muted,
        )
    ax.set_title(picture.title, pad=26)
    colour_bar(ax, shown, picture.scale)
    return ax
