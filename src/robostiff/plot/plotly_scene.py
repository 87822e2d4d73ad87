"""A scene on Plotly: in space, or from above."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
import plotly.graph_objects as go

from robostiff.plot.picture import (
    Arrow,
    Face,
    Item,
    Marks,
    Mesh,
    Path,
    Scene,
    Shape,
    Text,
    colour_of,
)
from robostiff.plot.theme import Palette

_SYMBOLS = {
    Shape.RING: ("circle-open", 4),
    Shape.SQUARE: ("square", 4),
    Shape.DIAMOND: ("diamond", 4),
    Shape.CROSS: ("cross", 5),  # "x" is a letter in space, which not all fonts have
    Shape.DOT: ("circle", 1.6),
}
_WIDER = 1.8  # pixels of a line to a point of its width
# pixels: of the scene, a line of the legend, above it, below a scene and below flat axes
_SCENE, _LINE, _ABOVE_PLOT, _BELOW, _BELOW_CHART = 500, 20, 64, 16, 56
_MARGIN = 0.04  # of the longest side of the box
_NUMBERS = 7  # on an axis of a cube; two at least
_TOWARDS_EYE = np.array([0.58, -0.735, 0.354])
# Of half the diagonal of the box, about: numbers and names on its axes, those of joints at its top,
# and where the camera looks below its middle, as the former stand below and the front is nearer.
_TEXT, _ABOVE, _BELOW_MIDDLE = 0.15, 0.06, 0.12
_HALF_VIEW = {"up": 0.42, "right": 0.5}  # tangents


def draw_scene(picture: Scene, palette: Palette) -> go.Figure:
    """Draw a scene."""
    low, high = picture.box
    pencil = _PlotlyPencil(picture, palette)
    traces = [trace for item in picture.items for trace in pencil.traces(item)]
    if picture.scale is not None:
        # the scale of values, attached to an invisible mark
        scale, stops = picture.scale, picture.scale.ramp.stops(palette)
        title = {"text": scale.label, "side": "right"}
        bar: dict[str, Any] = {"title": title, "thickness": 14, "outlinewidth": 0, "len": 0.7}
        if scale.ticks:
            bar["tickvals"], bar["ticktext"] = map(list, zip(*scale.ticks, strict=True))
        marker = {
            "color": [scale.low],
            "cmin": scale.low,
            "cmax": scale.high if scale.high > scale.low else scale.low + 1,
            "colorscale": [[i / (len(stops) - 1), colour] for i, colour in enumerate(stops)],
            "colorbar": bar,
            "showscale": True,
            "size": 0.1,
        }
        look = {"mode": "markers", "marker": marker, "hoverinfo": "skip", "showlegend": False}
        place: dict[str, Any] = {"type": "scatter", "x": [None], "y": [None]}
        if not picture.is_flat:
            place |= {"type": "scatter3d", "z": [None]}
        traces.append(place | look)
    if picture.is_flat:
        across, up = {"title": picture.axes[0]}, {"title": picture.axes[1], "scaleanchor": "x"}
        return _figure(palette, picture, traces, _BELOW_CHART, 64, xaxis=across, yaxis=up)
    # axes as long as the box, which is always as long from corner to corner
    margin = _MARGIN * float(np.max(high - low)) or 1.0
    if picture.frame is None:
        low, high = low - margin, high + margin
    ratio = high - low if picture.is_equal else np.ones(3)
    ratio = ratio * np.sqrt(3) / np.linalg.norm(ratio)
    # the eye is so far from the middle of the box that all its corners are seen
    right = np.cross([0, 0, 1], _TOWARDS_EYE)
    right /= np.linalg.norm(right)
    corners = np.array(list(product((-0.5, 0.5), repeat=3))) * ratio
    above = corners @ np.cross(_TOWARDS_EYE, right) + _BELOW_MIDDLE
    upward = np.maximum(above + _ABOVE, 2 * _TEXT - above) / _HALF_VIEW["up"]
    across = np.maximum(upward, (np.abs(corners @ right) + _TEXT) / _HALF_VIEW["right"])
    eye = np.max(across + corners @ _TOWARDS_EYE) * _TOWARDS_EYE
    scene = {
        "camera": {
            "eye": dict(zip("xyz", eye.tolist(), strict=True)),
            "center": {"x": 0, "y": 0, "z": -_BELOW_MIDDLE},
        },
        "domain": {"x": [0, 1 if picture.scale is None else 0.9], "y": [0, 1]},
        "aspectmode": "manual",
        "aspectratio": dict(zip("xyz", ratio.tolist(), strict=True)),
        **{
            f"{axis}axis": {
                "title": title,
                "range": limits,
                "nticks": max(2, round(_NUMBERS * part)),
            }
            for axis, title, limits, part in zip(
                "xyz", picture.axes, np.stack([low, high], axis=-1).tolist(), ratio, strict=True
            )
        },
    }
    return _figure(palette, picture, traces, _BELOW, 16, scene=scene)


class _PlotlyPencil:
    """Makes the traces of items."""

    def __init__(self, picture: Scene, palette: Palette) -> None:
        self.picture, self.palette, self.size = picture, palette, picture.size

    def traces(self, item: Item) -> list[Any]:
        colour = colour_of(item.paint, self.palette, self.picture.scale)
        if isinstance(item, Path):
            line = {
                "color": colour,
                "width": _WIDER * item.weight.value,
                "dash": "dash" if item.dashed else "solid",
            }
            return [self._scatter(item.points, item, "lines", line=line, text=item.about)]
        if isinstance(item, Marks):
            symbol, size = _SYMBOLS[item.shape]
            size *= 2 if self.picture.is_flat else 1
            marker = {"symbol": symbol, "size": size, "color": colour}
            text = list(item.about) or item.label
            return [self._scatter(item.points, item, "markers", marker=marker, text=text)]
        if isinstance(item, Arrow):
            points = [item.start, item.tip]
            # heads of four barbs, visible from every side
            for tip, foot, u, v in item.heads(self.size):
                for side in (u, -u, v, -v):
                    points += [np.full(3, np.nan), tip, foot + 0.35 * side]
            line = {"color": colour, "width": 4}
            return [self._scatter(np.array(points), item, "lines", line=line, text=item.label)]
        if isinstance(item, Text):
            look: dict[str, Any] = {"textfont": {"color": colour, "size": 11}}
            # beside the mark, not on it
            words, look["textposition"] = f"  {item.words}", "top right"
            if self.picture.is_on_the_right(item.point):
                words, look["textposition"] = f"{item.words}  ", "top left"
            return [self._scatter(item.point[None], item, "text", text=[words], **look)]
        return [self._surface(item, colour)]

    def _surface(self, item: Face | Mesh, colour: str) -> Any:
        is_face = isinstance(item, Face)
        naming = {"name": item.label, "showlegend": bool(item.label), "hoverinfo": "skip"}
        common = {"opacity": item.opacity, **naming}
        if self.picture.is_flat:
            corners = item.corners if is_face else item.vertices
            x, y, _ = np.concatenate([corners, corners[:1]]).T
            look = {"fill": "toself", "mode": "none", "fillcolor": colour}
            return {"type": "scatter", "x": x, "y": y, **look, **common}
        vertices, triangles = item.fan if is_face else (item.vertices, item.triangles)
        places = dict(zip("xyzijk", (*vertices.T, *triangles.T), strict=True))
        return {"type": "mesh3d", **places, "color": colour, "flatshading": is_face, **common}

    def _scatter(self, points: np.ndarray, item: Any, mode: str, **look: Any) -> Any:
        look |= {"mode": mode, "name": item.label, "showlegend": bool(item.label)}
        look["hoverinfo"] = "text" if look["text"] else "skip"
        x, y, z = points.T
        if self.picture.is_flat:
            return {"type": "scatter", "x": x, "y": y, **look}
        return {"type": "scatter3d", "x": x, "y": y, "z": z, **look}


def _figure(
    palette: Palette, picture: Scene, traces: Sequence[Any], below: int, left: int, **layout: Any
) -> go.Figure:
    """A figure with title, notes, and a legend below with room for all its lines.

    Traces are plain mappings. All is given at once: Plotly checks whatever it is given anew.
    """
    named = sum(1 for trace in traces if trace["showlegend"] and trace["name"])
    below += _LINE * named
    # a template in the colours of the theme; it is not registered anywhere
    lines = {"gridcolor": palette.faint, "linecolor": palette.muted, "zeroline": False}
    ticks = {"ticks": "outside", "tickcolor": palette.muted}
    axis = {**lines, **ticks, "showline": True, "automargin": True}
    space = {**lines, "showbackground": False}
    template = {
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
    heading = picture.title
    if picture.notes:
        notes = "; ".join(picture.notes)
        heading += f"<br><span style='font-size:12px;color:{palette.muted}'>{notes}</span>"
    title_place = {"y": 1, "yref": "container", "yanchor": "top", "pad": {"t": 14}}
    common = {
        "template": {"layout": template},
        "title": {"text": heading, **title_place},
        "height": _ABOVE_PLOT + _SCENE + below,
        "margin": {"l": left, "r": 16, "t": _ABOVE_PLOT, "b": below},
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
