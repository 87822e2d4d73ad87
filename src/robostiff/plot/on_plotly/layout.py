"""Common layout of Plotly figures: colours, fonts, title and notes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import plotly.graph_objects as go

from robostiff.plot.picture import ColourScale
from robostiff.plot.theme import Palette

_LINE = 20  # pixels a line of the legend
_PLOT, _ABOVE, _BELOW = 430, 64, 56


def template(palette: Palette) -> dict[str, Any]:
    """A template in the colours of a theme; it is not registered anywhere."""
    axis = {
        "gridcolor": palette.faint,
        "linecolor": palette.muted,
        "zeroline": False,
        "ticks": "outside",
        "tickcolor": palette.muted,
        "showline": True,
        "automargin": True,
    }
    space = {
        "gridcolor": palette.faint,
        "linecolor": palette.muted,
        "showbackground": False,
        "zeroline": False,
    }
    return {
        "layout": {
            "paper_bgcolor": palette.ground,
            "plot_bgcolor": palette.ground,
            "font": {"color": palette.ink, "size": 12, "family": "Open Sans, Arial, sans-serif"},
            "title": {"font": {"size": 15}, "x": 0.02, "xanchor": "left"},
            "colorway": list(palette.categories),
            "xaxis": axis,
            "yaxis": axis,
            "scene": {"xaxis": space, "yaxis": space, "zaxis": space},
            "legend": {"bgcolor": "rgba(0,0,0,0)"},
            "hoverlabel": {"bgcolor": palette.ground, "font": {"color": palette.ink}},
        }
    }


def figure(
    palette: Palette,
    title: str,
    traces: Sequence[Any],
    notes: Sequence[str] = (),
    plot_height: int = _PLOT,
    below: int = _BELOW,
    left: int = 64,
    **layout: Any,
) -> go.Figure:
    """A figure with a title, its notes, and a legend below with room for all its lines.

    Traces may be plain mappings. All is given at once: Plotly checks whatever it is given anew.
    """
    named = sum(1 for trace in traces if trace["showlegend"] and trace["name"])
    below += _LINE * named
    heading = title
    if notes:
        heading += (
            f"<br><span style='font-size:12px;color:{palette.muted}'>{'; '.join(notes)}</span>"
        )
    title_place = {"y": 1, "yref": "container", "yanchor": "top", "pad": {"t": 14}}
    common = {
        "template": template(palette),
        "title": {"text": heading, **title_place},
        "height": _ABOVE + plot_height + below,
        "margin": {"l": left, "r": 16, "t": _ABOVE, "b": below},
        "legend": {
            "orientation": "v",
            "yref": "container",
            "y": 0.0,
            "yanchor": "bottom",
            "x": 0,
            "xanchor": "left",
            "itemsizing": "constant",
            "tracegroupgap": 0,
            "font": {"size": 11},
        },
        "showlegend": named > 0,
    }
    return go.Figure(list(traces), {**common, **layout})


def colour_scale(scale: ColourScale, palette: Palette) -> list[list[Any]]:
    """Colours of a scale."""
    stops = scale.ramp.stops(palette)
    return [[i / (len(stops) - 1), colour] for i, colour in enumerate(stops)]


def colour_bar(scale: ColourScale) -> dict[str, Any]:
    """The scale beside the plot."""
    ticks: dict[str, Any] = {}
    if scale.ticks:
        ticks = {
            "tickvals": [place for place, _ in scale.ticks],
            "ticktext": [text for _, text in scale.ticks],
        }
    return {
        "title": {"text": scale.label, "side": "right"},
        "thickness": 14,
        "outlinewidth": 0,
        **ticks,
    }
