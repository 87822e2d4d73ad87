"""Axes of a picture, and their common elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import ScaledTranslation
from mpl_toolkits.mplot3d import Axes3D

from robostiff.errors import InputError
from robostiff.plot.picture import ColourScale
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
        "xtick.labelsize": SMALL,
        "ytick.labelsize": SMALL,
        "legend.fontsize": SMALL,
        "legend.title_fontsize": SMALL,
        "legend.frameon": False,
        "hatch.linewidth": 0.5,
        "axes.linewidth": 0.6,
        "grid.linewidth": 0.5,
        "grid.color": palette.faint,
        "axes.facecolor": palette.ground,
        "figure.facecolor": palette.ground,
        "savefig.facecolor": palette.ground,
        "text.color": palette.ink,
        "axes.labelcolor": palette.ink,
        "axes.titlecolor": palette.ink,
        "axes.edgecolor": palette.muted,
        "xtick.color": palette.ink,
        "ytick.color": palette.ink,
    }


@dataclass(frozen=True)
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
            own = 'projection="3d"' if in_space else ""
            raise InputError(
                "ax of Matplotlib",
                got=type(self.ax).__name__,
                expected="axes of a space" if in_space else "plain axes of Matplotlib",
                hint=f"write figure.add_subplot({own})",
            )
        return self.ax

    def finish(self, ax: Axes) -> Axes:
        """Fit the height of a new figure to its contents."""
        if self.ax is not None:
            return ax
        figure: Any = ax.figure
        figure.get_layout_engine().execute(figure)
        figure.set_layout_engine("none")
        box = self._within_width(figure)
        tall = figure.get_figheight()
        low, whole = box.y0 - _EDGE, box.height + 2 * _EDGE
        for own in figure.axes:
            x, y, width, height = own.get_position(original=True).bounds
            own.set_position((x, (y * tall - low) / whole, width, height * tall / whole))
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
            for own in figure.axes:
                x, y, width, height = own.get_position(original=True).bounds
                own.set_position((left + part * x, y, part * width, height))
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
        figure = self.ax.figure
        return float(figure.get_figwidth() * self.ax.get_position().width)

    def columns(self, labels: Sequence[str]) -> int:
        """How many columns of a legend fit."""
        longest = max(map(len, labels), default=1)
        letters = self.room / _LETTER
        return int(min(max(1, letters // (longest + 7)), max(len(labels), 1)))


def colour_map(scale: ColourScale, palette: Palette) -> LinearSegmentedColormap:
    """Colours of a scale."""
    return LinearSegmentedColormap.from_list(scale.ramp.value, list(scale.ramp.stops(palette)))


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


def norm(scale: ColourScale) -> Normalize:
    """Position of a value on the colour scale."""
    high = scale.high if scale.high > scale.low else scale.low + abs(scale.low or 1.0)
    return Normalize(scale.low, high)


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
