"""Figures of Plotly whose lines move between two ends of a vibration."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import numpy as np


def swinging_script() -> str:
    """The script with ``swing(place, other)``, which moves a figure to other traces and back."""
    return files("robostiff.plot.on_plotly").joinpath("swinging.js").read_text(encoding="utf-8")


def places(figure: Any) -> list[dict[str, list[float | None]]]:
    """Coordinates x, y, z of each trace of a figure; None for those between lines."""
    found = []
    for trace in figure.data:
        own = {}
        for axis in "xyz":
            values = getattr(trace, axis, None)
            if values is not None:
                numbers = np.asarray(values, dtype=float)
                own[axis] = [float(x) if np.isfinite(x) else None for x in numbers]
        found.append(own)
    return found


def swinging_page(one: Any, other: Any) -> str:
    """A page with a figure of Plotly that moves to another one, of the same traces, and back."""
    data = json.dumps(places(other))
    start = f'swing(document.getElementById("{{plot_id}}"), {data});'
    return one.to_html(post_script=swinging_script() + start)
