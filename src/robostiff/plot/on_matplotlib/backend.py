"""Matplotlib as a backend: one axes a picture."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from robostiff.errors import needs_extra
from robostiff.plot.picture import Bands, Bars, Curves, Field, Matrix, Picture, Scene
from robostiff.plot.picture.charts import with_words
from robostiff.plot.theme import Theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Width(Enum):
    """Width of a figure in a paper [mm]."""

    HALF = 85.0
    FULL = 170.0


@dataclass(frozen=True)
class Matplotlib:
    """Draws on Matplotlib's axes, those of a new figure or those given; shows and saves nothing.

    ``axes.figure.savefig("k.pdf")`` writes what was drawn. Text has 8 points, so that a figure goes
    into a paper as it is.

    Attributes
    ----------
    ax : Axes or None
        Where to draw; pictures of space want axes with ``projection="3d"``, planar robots and
        everything else want plain ones.
    width : Width
        Of a new figure.
    theme : Theme
    """

    ax: Any = None
    width: Width = Width.FULL
    theme: Theme = Theme.LIGHT

    def draw(self, picture: Picture) -> Axes:
        """Draw a picture.

        Raises
        ------
        InputError
            When Matplotlib is missing, or the axes given do not suit the picture.
        """
        with needs_extra("plots", "plot"):
            import matplotlib as mpl

        from robostiff.plot.on_matplotlib import charts, curves, scene
        from robostiff.plot.on_matplotlib.canvas import Canvas, style

        draws = {
            Scene: scene.draw_scene,
            Matrix: charts.draw_matrix,
            Bars: charts.draw_bars,
            Field: charts.draw_field,
            Bands: charts.draw_bands,
            Curves: curves.draw_curves,
        }
        palette = self.theme.palette
        settings: Any = style(palette)
        with mpl.rc_context(settings):
            canvas = Canvas(self.ax, self.width.value / 25.4, palette)
            # A dollar would begin a formula.
            shown = with_words(picture, lambda text: text.replace("$", r"\$"))
            return canvas.finish(draws[type(picture)](shown, canvas))
