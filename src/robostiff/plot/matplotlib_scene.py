"""A scene on Matplotlib: in space, or from above."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from robostiff.plot.matplotlib_charts import Canvas, colour_bar, colours, legend_below
from robostiff.plot.picture import (
    Arrow,
    Face,
    Item,
    LineWeight,
    Marks,
    Path,
    Scene,
    Shape,
    Text,
    colour_of,
)

_MARKERS = {
    Shape.RING: ("o", 3.4),
    Shape.SQUARE: ("s", 3.6),
    Shape.DIAMOND: ("D", 3.2),
    Shape.CROSS: ("x", 6.0),
    Shape.DOT: (".", 2.5),
}
_MARGIN = 0.03
_THINNEST = 0.3  # axis beside the longest


def draw_scene(picture: Scene, canvas: Canvas) -> Axes:
    """Draw a scene."""
    height = canvas.width * (1.15 if canvas.is_narrow else 0.66)
    ax = canvas.axes(height, in_space=not picture.is_flat)
    pencil = _MatplotlibPencil(ax, picture, canvas)
    for item in picture.items:
        pencil.draw(item)
    _frame(ax, picture, canvas)
    if picture.scale is not None:
        shown = ScalarMappable(**colours(picture.scale, canvas.palette))
        wide = 0.2 if canvas.is_narrow else 0.08  # the label of z stands in between
        colour_bar(ax, shown, picture.scale, 0.6, 0.03 if picture.is_flat else wide)
    ax.set_title(picture.title)
    below = 0.45 if picture.is_flat else 0.38
    legend_below(ax, canvas, pencil.handles, pencil.labels, picture.notes, below)
    return ax


class _MatplotlibPencil:
    """Draws items, and keeps those that the legend names."""

    def __init__(self, ax: Any, picture: Scene, canvas: Canvas) -> None:
        self.ax, self.picture, self.palette, self.size = ax, picture, canvas.palette, picture.size
        self.handles: list[Any] = []
        self.labels: list[str] = []

    def draw(self, item: Item) -> None:
        colour = colour_of(item.paint, self.palette, self.picture.scale)
        handle: Any
        if isinstance(item, Path):
            handle = self._line(item.points, colour, item.weight, item.dashed)
        elif isinstance(item, Marks):
            marker, size = _MARKERS[item.shape]
            inside, edge = self.palette.ground if item.shape is Shape.RING else colour, colour
            if isinstance(item.paint, float):  # a value, as wide as the line of a part
                size, inside, edge = 1.8 * size, colour, self.palette.ink
            (handle,) = self.ax.plot(
                *self._places(item.points),
                linestyle="none",
                marker=marker,
                markersize=size,
                markeredgecolor=edge,
                markerfacecolor=inside,
                markeredgewidth=1.2 if item.shape is Shape.CROSS else 0.8,
            )
        elif isinstance(item, Arrow):
            ends = np.stack([item.start, item.tip])
            handle = self._line(ends, colour, LineWeight.LINE, False)
            # crosses of two flat heads, visible from every side
            for tip, foot, *sides in item.heads(self.size):
                for side in sides:
                    corners = np.array([tip, foot + 0.3 * side, foot - 0.3 * side])
                    self._polygons([corners], colour, 1.0, colour)
        elif isinstance(item, Text):
            place = tuple(self._places(item.point[None])[:, 0])
            look = {"color": colour, "fontsize": "x-small", "va": "bottom"}  # above its own line
            right = self.picture.is_on_the_right(item.point)
            words = f"{item.words}  " if right else f"  {item.words}"
            halo: list[AbstractPathEffect] = [
                withStroke(linewidth=1.5, foreground=self.palette.ground)
            ]
            look |= {"path_effects": halo, "zorder": 50}
            handle = self.ax.text(*place, words, ha="right" if right else "left", **look)
        else:
            is_face = isinstance(item, Face)
            corners = [item.corners] if is_face else item.vertices[item.triangles]
            self._polygons(corners, colour, item.opacity, colour if is_face else None)
            handle = Patch(facecolor=colour, alpha=item.opacity, edgecolor=colour)
        if item.label:
            self.handles.append(handle)
            self.labels.append(item.label)

    def _line(self, points: np.ndarray, colour: str, weight: LineWeight, dashed: bool) -> Line2D:
        look = {"color": colour, "linewidth": weight.value, "solid_capstyle": "round"}
        style = (0, (4, 2.5)) if dashed else "-"
        return self.ax.plot(*self._places(points), linestyle=style, **look)[0]

    def _polygons(self, corners: Any, colour: str, opacity: float, edge: str | None) -> None:
        look: dict[str, Any] = {
            "facecolors": to_rgba(colour, opacity),
            "edgecolors": to_rgba(edge or colour, min(1.0, 2 * opacity) if edge else 0.0),
            "linewidths": 0.6 if edge else 0.0,
        }
        if isinstance(self.ax, Axes3D):
            # Shades show the curvature of a closed surface.
            self.ax.add_collection3d(Poly3DCollection(corners, shade=edge is None, **look))
        else:
            flat = [polygon[:, :2] for polygon in corners]
            self.ax.add_collection(PolyCollection(flat, **look))

    def _places(self, points: np.ndarray) -> np.ndarray:
        return points[:, :2].T if self.picture.is_flat else points.T


def _frame(ax: Any, picture: Scene, canvas: Canvas) -> None:
    low, high = picture.box
    margin = _MARGIN * float(np.max(high - low)) or 1.0
    if picture.is_equal:
        low, high = low - margin, high + margin
        # A thin box has no room for the numbers along its axes.
        lacking = np.maximum(_THINNEST * np.max(high - low) - (high - low), 0) / 2
        low, high = low - lacking, high + lacking
    x, y, z = picture.axes
    limits = np.stack([low, high], axis=-1)
    ax.set(xlabel=x, ylabel=y, xlim=limits[0], ylim=limits[1])
    if picture.is_flat:
        ax.set_aspect("equal")
        ax.grid(True)
        ax.set_axisbelow(True)
        return
    ax.set(zlabel=z, zlim=limits[2])
    ax.set_box_aspect(high - low if picture.is_equal else (1, 1, 1), zoom=1.0)
    ax.view_init(elev=22, azim=-52)
    shown = canvas.palette
    axes = (ax.xaxis, ax.yaxis, ax.zaxis)
    for axis, start, length in zip(axes, low, high - low, strict=True):
        share = 1.0 if not picture.is_equal else length / float(np.max(high - low))
        most = max(3, round((4 if canvas.is_narrow else 5) * share))
        # away from the corners, where the numbers of two axes would meet
        places = MaxNLocator(most).tick_values(start, start + length)
        inset, end = 0.08 * length, start + length
        axis.set_ticks([x for x in places if start + inset <= x <= end - inset])
        axis.set_pane_color(shown.ground)
        axis.line.set_color(shown.muted)
        axis._axinfo["grid"].update(color=shown.faint, linewidth=0.4)
        axis.labelpad = -4 if canvas.is_narrow else 0
    ax.tick_params(pad=-2)
    ax.set_facecolor(shown.ground)
