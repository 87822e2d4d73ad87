"""Percentiles along a coordinate on Matplotlib."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from robostiff.plot.on_matplotlib.canvas import Canvas, legend_below
from robostiff.plot.on_matplotlib.cells import patch_look
from robostiff.plot.picture import Bands
from robostiff.plot.region_style import region_style

_STRIP = (0.0, -0.24, 1.0, 0.18)


def draw_bands(picture: Bands, canvas: Canvas) -> Axes:
    """Draw bands between percentiles, and under them the share of poses without a value."""
    ax = canvas.axes(canvas.width * (1.15 if canvas.is_narrow else 0.55))
    palette = canvas.palette
    colour = palette.categories[0]
    x = picture.x.values
    middle = len(picture.percentiles) // 2
    handles, labels = [], []
    for i in range(middle):
        low, high = picture.percentiles[i], picture.percentiles[-1 - i]
        fill = palette.along((palette.ground, colour), 0.22 + 0.4 * i / max(middle, 1))
        handles.append(ax.fill_between(x, low.values, high.values, color=fill, linewidth=0))
        labels.append(f"{low.percent:g} to {high.percent:g} % of the poses with a value")
    median = picture.percentiles[middle]
    lone = np.isfinite(median.values)
    handles += ax.plot(x, median.values, color=colour, marker="." if lone.sum() < 20 else "")
    labels.append("median")
    ax.set_ylabel(picture.label)
    ax.set_title(picture.title)
    ax.grid(True)
    ax.set_axisbelow(True)
    ax.margins(x=0.02)
    lowest = ax
    if picture.left_out:
        lowest = ax.inset_axes(_STRIP, sharex=ax)
        ax.tick_params(labelbottom=False)
        start = np.zeros(len(x))
        for region in picture.left_out:
            look = patch_look(region_style(region, palette))
            top = start + 100 * region.where
            lowest.fill_between(x, start, top, **look)
            handles.append(Patch(**look))
            labels.append(f"no value: {region.name}")
            start = top
        lowest.set_ylim(0, 100)
        lowest.set_yticks([0, 100], ["0 %", "100 %"])
    lowest.set_xlabel(picture.x.label)
    legend_below(lowest, canvas, handles, labels, picture.notes, 0.42)
    return ax
