"""Axes of a picture on Matplotlib, and bars, bands, curves, fields and matrices on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.text import Text
from matplotlib.transforms import ScaledTranslation
from mpl_toolkits.mplot3d import Axes3D

from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.markup import number, short
from robostiff.plot.picture import (
    Bands,
    Bars,
    ColourScale,
    Curves,
    Field,
    Matrix,
    Panel,
    RegionStyle,
    colour_of,
)
from robostiff.plot.theme import Palette

SMALL = 7.0  # points
_LETTER = 0.056  # inches of small text
_TRIES = 4
_NARROWEST = 0.4  # of what axes have, in one try
_EDGE = 0.05  # inches around all that is drawn


def style(palette: Palette) -> dict[str, Any]:
    """Settings of Matplotlib while a picture is drawn."""
    return {
        "font.family": "DejaVu Sans",
        "font.size": 8.0,
        "axes.titlesize": 8.5,
        "axes.labelsize": 8.0,
        **dict.fromkeys(("xtick.labelsize", "ytick.labelsize"), SMALL),
        **dict.fromkeys(("legend.fontsize", "legend.title_fontsize"), SMALL),
        "legend.frameon": False,
        "hatch.linewidth": 0.5,
        "axes.linewidth": 0.6,
        "grid.linewidth": 0.5,
        "grid.color": palette.faint,
        "axes.edgecolor": palette.muted,
        **{f"{part}.facecolor": palette.ground for part in ("axes", "figure", "savefig")},
        **{f"{part}.color": palette.ink for part in ("text", "xtick", "ytick")},
        **dict.fromkeys(("axes.labelcolor", "axes.titlecolor"), palette.ink),
    }


@frozen
class Canvas:
    """Axes to draw on, or none yet; the width of a new figure [inches]."""

    ax: Any
    width: float
    palette: Palette

    def axes(self, height: float, *, in_space: bool = False) -> Any:
        """Plain axes, or those of a space; those of a new figure have a height [inches]."""
        if self.ax is None:
            figure = Figure(figsize=(self.width, height), layout="constrained")
            FigureCanvasAgg(figure)
            return figure.add_subplot(projection="3d" if in_space else None)
        if not isinstance(self.ax, Axes) or isinstance(self.ax, Axes3D) != in_space:
            projection = 'projection="3d"' if in_space else ""
            raise InputError(
                "ax of Matplotlib",
                got=type(self.ax).__name__,
                expected="axes of a space" if in_space else "plain axes of Matplotlib",
                hint=f"write figure.add_subplot({projection})",
            )
        return self.ax

    def finish(self, ax: Axes) -> Axes:
        """Fit the height of a new figure to its contents."""
        if self.ax is not None:
            return ax
        figure: Any = ax.figure
        for panel in figure.axes:  # ticks that are found later look like those of now
            panel.tick_params(labelsize=SMALL, colors=self.palette.ink)
        figure.get_layout_engine().execute(figure)
        figure.set_layout_engine("none")
        box = self._within_width(figure)
        tall = figure.get_figheight()
        low, whole = box.y0 - _EDGE, box.height + 2 * _EDGE
        for panel in figure.axes:
            x, y, width, height = panel.get_position(original=True).bounds
            panel.set_position((x, (y * tall - low) / whole, width, height * tall / whole))
        figure.set_figheight(whole)
        self._within_width(figure)  # another height has other ticks
        return ax

    def _within_width(self, figure: Any) -> Any:
        """Make axes narrower until their labels fit; the box around all that is drawn."""
        renderer = figure.canvas.get_renderer()
        box = figure.get_tightbbox(renderer)
        for _ in range(_TRIES):  # labels in space are wider than the layout assumes
            out = max(0.0, -box.x0) + max(0.0, box.x1 - self.width)
            if out == 0:
                break
            part = max(_NARROWEST, 1 - out / self.width)
            left = max(0.0, -box.x0) / self.width
            for panel in figure.axes:
                x, y, width, height = panel.get_position(original=True).bounds
                panel.set_position((left + part * x, y, part * width, height))
            box = figure.get_tightbbox(renderer)
        return box

    @property
    def is_narrow(self) -> bool:
        """Whether there is room for one column only."""
        return self.room < 4.5

    @property
    def room(self) -> float:
        """Width of the axes, or of the new figure [inches]."""
        if self.ax is None:
            return self.width
        return float(self.ax.figure.get_figwidth() * self.ax.get_position().width)

    def columns(self, labels: Sequence[str]) -> int:
        """How many columns of a legend fit."""
        longest = max(map(len, labels), default=1)
        letters = self.room / _LETTER
        return int(min(max(1, letters // (longest + 7)), max(len(labels), 1)))


def colours(scale: ColourScale, palette: Palette) -> dict[str, Any]:
    """Colours of a scale, and positions of values on it, as Matplotlib takes them."""
    high = scale.high if scale.high > scale.low else scale.low + abs(scale.low or 1.0)
    stops = list(scale.ramp.stops(palette))
    ramp = LinearSegmentedColormap.from_list(scale.ramp.value, stops)
    return {"cmap": ramp, "norm": Normalize(scale.low, high)}


def colour_bar(
    ax: Axes, drawn: Any, scale: ColourScale, shrink: float = 1.0, pad: float = 0.03
) -> None:
    """The scale beside the axes."""
    figure = ax.figure
    bar = figure.colorbar(drawn, ax=ax, shrink=shrink, aspect=24 * shrink, pad=pad)
    bar.set_label(scale.label, fontsize=SMALL)
    bar.outline.set_linewidth(0.5)
    if scale.ticks:
        bar.set_ticks([place for place, _ in scale.ticks], labels=[t for _, t in scale.ticks])


def legend_below(
    ax: Axes,
    canvas: Canvas,
    handles: Sequence[Any],
    labels: Sequence[str],
    notes: Sequence[str] = (),
    below: float = 0.0,
) -> None:
    """A legend some inches below the axes, headed by the notes."""
    if not labels and not notes:
        return
    lower = ScaledTranslation(0, -below, ax.figure.dpi_scale_trans)
    legend = ax.legend(
        handles,
        labels,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=ax.transAxes + lower,
        ncols=canvas.columns(labels),
        title="; ".join(notes) or None,
        borderaxespad=0.2,
        handlelength=1.8,
        columnspacing=1.2,
        labelcolor=canvas.palette.ink,
    )
    title: Text = legend.get_title()
    title.set_color(canvas.palette.muted)


_NAMES, _LINE = 0.5, 0.17  # inches: beside bars, and a line of the legend
_ROOM = 0.32  # of the longest bar, for what is written behind it


def draw_bars(picture: Bars, canvas: Canvas) -> Axes:
    """Draw bars, a panel above another."""
    rows = [
        len(panel.groups) * (1 if picture.is_stacked else len(panel.series) + 1)
        for panel in picture.panels
    ]
    listed = [series.name for series in picture.panels[-1].series if series.name]
    below = _LINE * -(-len(listed) // canvas.columns(listed))
    ax = canvas.axes(0.9 + 0.19 * sum(rows) + 0.5 * len(rows) + below)
    panels = [ax] if len(picture.panels) == 1 else _stacked_axes(ax, rows, canvas.room)
    handles, labels = [], []
    named = any(series.name for panel in picture.panels for series in panel.series)
    for panel, axes in zip(picture.panels, panels, strict=True):
        handles = (_stacked_bars if picture.is_stacked else _grouped_bars)(axes, panel, canvas)
        labels = [series.name for series in panel.series] if named else []
        axes.set_xlabel(panel.label)
        axes.set_yticks(range(len(panel.groups)), panel.groups)
        axes.invert_yaxis()
        axes.tick_params(axis="y", length=0)
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(True, axis="x")
        axes.set_axisbelow(True)
    ax.set_title(picture.title)
    last = panels[-1]
    legend_below(last, canvas, handles if named else [], labels, picture.notes, 0.42)
    return ax


def _stacked_axes(ax: Axes, rows: list[int], room: float) -> list[Axes]:
    """Axes within the axes, top to bottom, with room for the labels beside and between them."""
    ax.set_axis_off()
    left = _NAMES / room
    gap = 3.0
    whole = sum(rows) + gap * (len(rows) - 1)
    insets, top = [], 1.0
    for count in rows:
        insets.append(ax.inset_axes((left, top - count / whole, 1 - left, count / whole)))
        top -= (count + gap) / whole
    return insets


def _stacked_bars(ax: Axes, panel: Panel, canvas: Canvas) -> list:
    start = np.zeros(len(panel.groups))
    handles = []
    for series in panel.series:
        look = {"color": colour_of(series.paint, canvas.palette), "height": 0.7, "left": start}
        look |= {"edgecolor": canvas.palette.ground, "linewidth": 0.4}
        handles.append(ax.barh(np.arange(len(panel.groups)), series.values, **look))
        start = start + series.values
    for i, note in enumerate(panel.notes):
        _text(ax, start[i], i, note)
    ax.set_xlim(0, (1 + 0.5 * _ROOM) * (start.max() or 1.0))
    return handles


def _grouped_bars(ax: Axes, panel: Panel, canvas: Canvas) -> list:
    count = len(panel.series)
    height = 0.8 / count
    handles = []
    for k, series in enumerate(panel.series):
        places = np.arange(len(panel.groups)) + (k - (count - 1) / 2) * height
        colour = colour_of(series.paint, canvas.palette)
        handles.append(ax.barh(places, series.values, height=0.9 * height, color=colour))
        for place, value, text in zip(places, series.values, series.texts, strict=True):
            _text(ax, value, place, text)
    values = np.concatenate([series.values for series in panel.series])
    size = float(np.abs(values).max()) or 1.0
    room = _ROOM * (2.0 if canvas.is_narrow else 1.0)
    low = float(values.min())
    ax.set_xlim(low - room * size if low < 0 else 0.0, max(float(values.max()), 0.0) + room * size)
    if low < 0:
        ax.axvline(0, color=canvas.palette.muted, linewidth=0.8)
    return handles


def _text(ax: Axes, value: float, place: float, text: str) -> None:
    side = -1 if value < 0 else 1
    ax.annotate(
        text,
        (value, place),
        (3 * side, 0),
        textcoords="offset points",
        ha="left" if side > 0 else "right",
        va="center",
        fontsize=SMALL - 0.5,
    )


def cell_edges(values: np.ndarray) -> np.ndarray:
    """Edges (n + 1,) of cells around values (n,): half-way between them."""
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


def region_patch(
    x_edges: np.ndarray, y_edges: np.ndarray, where: np.ndarray, style: RegionStyle
) -> PathPatch:
    """Cells (y, x) of a region as one patch, so that its hatching runs through."""
    rectangles = []
    for i, row in enumerate(where):
        ends = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(int)))
        for start, stop in ends.reshape(-1, 2):
            low, high = y_edges[i], y_edges[i + 1]
            left, right = x_edges[start], x_edges[stop]
            corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
            rectangles.append(Path(corners, closed=True))
    return PathPatch(Path.make_compound_path(*rectangles), **vars(style))


_STRIP = (0.0, -0.24, 1.0, 0.18)


def draw_bands(picture: Bands, canvas: Canvas) -> Axes:
    """Draw bands between percentiles, and under them the shares of poses in regions."""
    ax = canvas.axes(canvas.width * (1.15 if canvas.is_narrow else 0.55))
    palette = canvas.palette
    colour = palette.categories[0]
    x = picture.x.values
    percents, middle = picture.percents, len(picture.percents) // 2
    handles, labels = [], []
    for i in range(middle):
        low, high = picture.values[i], picture.values[-1 - i]
        fill = palette.along((palette.ground, colour), 0.22 + 0.4 * i / max(middle, 1))
        handles.append(ax.fill_between(x, low, high, color=fill, linewidth=0))
        ends = f"{number(percents[i])} to {number(percents[-1 - i])}"
        labels.append(f"{ends} % of the poses with a value")
    if percents:
        median = picture.values[middle]
        marker = "." if np.isfinite(median).sum() < 20 else ""
        line = ax.plot(x, median, color=colour, marker=marker)
        if middle:
            handles, labels = [*handles, *line], [*labels, "median"]
    ax.set(ylabel=picture.label, title=picture.title)
    ax.grid(True)
    ax.set_axisbelow(True)
    ax.margins(x=0.02)
    lowest = ax
    if picture.shares:
        if percents:
            lowest = ax.inset_axes(_STRIP, sharex=ax)
            ax.tick_params(labelbottom=False)
        start = np.zeros(len(x))
        for region in picture.shares:
            look = vars(region.key_style(palette))
            top = start + 100 * region.where
            lowest.fill_between(x, start, top, step="mid", **look)
            handles.append(Patch(**look))
            labels.append(region.reason)
            start = top
        lowest.set(ylim=(0, 100), yticks=[0, 100], yticklabels=["0 %", "100 %"])
    lowest.set_xlabel(picture.x.label)
    legend_below(lowest, canvas, handles, labels, picture.notes, 0.42)
    return ax


def draw_field(picture: Field, canvas: Canvas) -> Axes:
    """Draw values over a plane."""
    ax = canvas.axes(canvas.width * (0.85 if canvas.is_narrow else 0.62))
    palette = canvas.palette
    x_edges, y_edges = cell_edges(picture.x.values), cell_edges(picture.y.values)
    values = np.ma.masked_invalid(picture.values)
    if picture.scale is not None:
        look = colours(picture.scale, palette)
        shown = ax.pcolormesh(x_edges, y_edges, values, rasterized=True, **look)
        if values.count():
            colour_bar(ax, shown, picture.scale)
    handles, labels = [], []
    for region in picture.regions:
        ax.add_patch(region_patch(x_edges, y_edges, region.where, region.style(palette)))
        handles.append(Patch(**vars(region.key_style(palette))))
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
    ax.set(xlim=x_edges[[0, -1]], ylim=y_edges[[0, -1]], title=picture.title)
    ax.set(xlabel=picture.x.label, ylabel=picture.y.label)
    if picture.x.label.rpartition("[")[2] == picture.y.label.rpartition("[")[2]:
        ax.set_aspect("equal")
    legend_below(ax, canvas, handles, labels, picture.notes, 0.45)
    return ax


def draw_matrix(picture: Matrix, canvas: Canvas) -> Axes:
    """Draw a matrix with its numbers."""
    rows, columns = picture.shades.shape
    ax = canvas.axes(canvas.width * (0.78 if canvas.is_narrow else 0.62))
    palette = canvas.palette
    shades = np.ma.masked_invalid(picture.shades)
    shown = ax.imshow(shades, aspect="auto", **colours(picture.scale, palette))
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
    d = picture.split
    ax.axhline(d - 0.5, color=palette.ink, linewidth=0.9)
    ax.axvline(d - 0.5, color=palette.ink, linewidth=0.9)
    for k, unit in enumerate(picture.units):
        above, middle = k < 2, (d - 1 + (k % 2) * columns) / 2
        ax.annotate(
            unit,
            (middle, 1.0 if above else 0.0),
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


def draw_curves(picture: Curves, canvas: Canvas) -> Axes:
    """Draw curves over common axes."""
    ax = canvas.axes(canvas.width * (1.0 if canvas.is_narrow else 0.6))
    handles = []
    for curve in picture.curves:
        style = "--" if curve.is_dashed else "none" if curve.has_marks else "-"
        marker = "o" if curve.has_marks else ""
        colour = colour_of(curve.paint, canvas.palette)
        look = {"linestyle": style, "color": colour, "marker": marker, "markersize": 4}
        handles += ax.plot(curve.x, curve.y, **look)
    ax.set(xlabel=picture.x_label, ylabel=picture.y_label, title=picture.title)
    if "[" not in picture.x_label:  # a number of points
        ax.xaxis.get_major_locator().set_params(integer=True)
    if picture.is_log:
        ax.set_yscale("log")
    ax.grid(True)
    ax.set_axisbelow(True)
    legend_below(ax, canvas, handles, [curve.name for curve in picture.curves], picture.notes, 0.42)
    return ax
