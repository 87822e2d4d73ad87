"""Values over a plane on Matplotlib."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.patheffects import AbstractPathEffect, withStroke

from robostiff.plot.on_matplotlib.canvas import (
    SMALL,
    Canvas,
    colour_bar,
    colour_map,
    legend_below,
    norm,
)
from robostiff.plot.on_matplotlib.cells import cell_edges, patch_look, region_patch
from robostiff.plot.picture import Cover, Field
from robostiff.plot.prefix import short
from robostiff.plot.region_style import RegionStyle, region_style


def draw_field(picture: Field, canvas: Canvas) -> Axes:
    """Draw values over a plane."""
    ax = canvas.axes(canvas.width * (0.85 if canvas.is_narrow else 0.62))
    palette = canvas.palette
    x_edges, y_edges = cell_edges(picture.x.values), cell_edges(picture.y.values)
    values = np.ma.masked_invalid(picture.values)
    shown = ax.pcolormesh(
        x_edges,
        y_edges,
        values,
        cmap=colour_map(picture.scale, palette),
        norm=norm(picture.scale),
        rasterized=True,
    )
    handles, labels = [], []
    for region in picture.regions:
        style = region_style(region, palette)
        ax.add_patch(region_patch(x_edges, y_edges, region.where, style))
        key = style
        if region.cover is Cover.OVER:  # white lines want a ground in the legend
            key = RegionStyle(palette.values[3], style.hatch, style.line)
        handles.append(Patch(**patch_look(key)))
        labels.append(region.name)
    if picture.isolines and values.count() and min(values.shape) > 1:
        lines = ax.contour(
            picture.x.values,
            picture.y.values,
            values,
            levels=picture.isolines,
            colors="#ffffff",
            linewidths=0.9,
        )
        around: list[AbstractPathEffect] = [withStroke(linewidth=2.0, foreground="#222222")]
        lines.set_path_effects(around)
        for text in ax.clabel(lines, fmt=lambda v: short(v, 4), fontsize=SMALL - 1):
            text.set_path_effects(around)
    ax.set_xlim(x_edges[0], x_edges[-1])
    ax.set_ylim(y_edges[0], y_edges[-1])
    if picture.x.label.rpartition("[")[2] == picture.y.label.rpartition("[")[2]:
        ax.set_aspect("equal")
    ax.set_xlabel(picture.x.label)
    ax.set_ylabel(picture.y.label)
    ax.set_title(picture.title)
    colour_bar(ax, shown, picture.scale)
    legend_below(ax, canvas, handles, labels, picture.notes, 0.45)
    return ax
