"""Plotly as a backend: one figure a picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from robostiff.errors import needs_extra
from robostiff.plot.picture import Bands, Bars, Curves, Field, Matrix, Picture, Scene
from robostiff.plot.picture.charts import with_words
from robostiff.plot.theme import Theme

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


def escape_letters(text: str) -> str:
    """Text escaped for Plotly, which interprets HTML."""
    return text.replace("&", "&amp;").replace("<", "&lt;")


@dataclass(frozen=True)
class Plotly:
    """Draws figures of Plotly, to be turned and zoomed in a browser; shows and writes nothing.

    ``figure.write_html("robot.html")`` writes what was drawn.

    Attributes
    ----------
    theme : Theme
    """

    theme: Theme = Theme.LIGHT

    def draw(self, picture: Picture) -> Figure:
        """Draw a picture.

        Raises
        ------
        InputError
            When Plotly is missing.
        """
        with needs_extra("plots", "plot"):
            import plotly.graph_objects  # noqa: F401

        from robostiff.plot.on_plotly import charts, curves, scene

        draws = {
            Scene: scene.draw_scene,
            Matrix: charts.draw_matrix,
            Bars: charts.draw_bars,
            Field: charts.draw_field,
            Bands: charts.draw_bands,
            Curves: curves.draw_curves,
        }
        # Plotly interprets text as HTML.
        return draws[type(picture)](with_words(picture, escape_letters), self.theme.palette)
