"""Figures of Plotly whose lines move between two ends of a vibration."""

from __future__ import annotations

from importlib.resources import files
from typing import Any


def swinging_script() -> str:
    """The script with ``swing(place, other)``, which moves a figure to other traces and back."""
    return files("robostiff.plot.on_plotly").joinpath("swinging.js").read_text(encoding="utf-8")


def swinging_page(one: Any, other: Any) -> str:
    """A page with a figure that moves to another one and back.

    Parameters
    ----------
    one, other : plotly.graph_objects.Figure
        With the same traces in other places.
    """
    import json

    from plotly.utils import PlotlyJSONEncoder

    data = json.dumps(other.to_plotly_json()["data"], cls=PlotlyJSONEncoder)
    start = f'swing(document.getElementById("{{plot_id}}"), {data});'
    return one.to_html(post_script=swinging_script() + start)
