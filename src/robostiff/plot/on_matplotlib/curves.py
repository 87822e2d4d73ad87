"""Curves on Matplotlib."""

from __future__ import annotations

from matplotlib.axes import Axes

from robostiff.plot.on_matplotlib.canvas import Canvas, legend_below
from robostiff.plot.picture import Curves
from robostiff.plot.picture.paint import colour_of


def draw_curves(picture: Curves, canvas: Canvas) -> Axes:
    """Draw curves over common axes."""
    ax = canvas.axes(canvas.width * (1.0 if canvas.is_narrow else 0.6))
    handles = []
    for curve in picture.curves:
        style = "--" if curve.is_dashed else "" if curve.has_marks else "-"
        marker = "o" if curve.has_marks else ""
        colour = colour_of(curve.paint, canvas.palette)
        handles += ax.plot(curve.x, curve.y, style, color=colour, marker=marker, markersize=4)
    ax.set_xlabel(picture.x_label)
    ax.set_ylabel(picture.y_label)
    ax.set_title(picture.title)
    ax.grid(True)
    ax.set_axisbelow(True)
    legend_below(ax, canvas, handles, [curve.name for curve in picture.curves], picture.notes, 0.42)
    return ax
