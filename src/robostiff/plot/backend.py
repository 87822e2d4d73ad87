"""Backends: programs that draw pictures, with their options; pages with a figure that swings."""

from __future__ import annotations

import json
from enum import Enum
from importlib.resources import files
from io import StringIO
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from robostiff.errors import InputError, needs_extra
from robostiff.frozen import frozen
from robostiff.plot.picture import Bands, Bars, Curves, Field, Matrix, Picture, Scene, with_words
from robostiff.plot.theme import Palette, Theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from plotly.graph_objects import Figure
    from typing_extensions import TypeVar

    Drawn = TypeVar("Drawn", default=Axes)
    Drawn_co = TypeVar("Drawn_co", covariant=True)
else:
    from typing import TypeVar

    Drawn = TypeVar("Drawn")
    Drawn_co = TypeVar("Drawn_co", covariant=True)


class PlotBackend(Protocol[Drawn_co]):
    """Draws pictures: `Matplotlib` returns axes, `Plotly` a figure of a scene."""

    def draw(self, picture: Picture) -> Drawn_co:
        """Draw a picture, without showing it."""
        ...


class Width(Enum):
    """Width of a figure in a paper [mm]."""

    HALF = 85.0
    FULL = 170.0


@frozen
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

        Raises InputError when Matplotlib is missing, or the axes given do not suit the picture.
        """
        with needs_extra("plots", "plot"):
            import matplotlib as mpl

        from robostiff.plot import matplotlib_charts as charts
        from robostiff.plot import matplotlib_scene as scene
        from robostiff.plot.matplotlib_charts import Canvas, style

        kinds: dict[type, Any] = {
            Scene: scene.draw_scene,
            Matrix: charts.draw_matrix,
            Bars: charts.draw_bars,
            Field: charts.draw_field,
            Bands: charts.draw_bands,
            Curves: charts.draw_curves,
        }
        palette = self.theme.palette
        settings: Any = style(palette)
        with mpl.rc_context(settings):
            canvas = Canvas(self.ax, self.width.value / 25.4, palette)
            # A dollar would begin a formula.
            shown = with_words(picture, lambda text: text.replace("$", r"\$"))
            return canvas.finish(kinds[type(picture)](shown, canvas))

    def svg(self, picture: Picture, *, letters: bool = False) -> str:
        """A picture as SVG, with letters as text or as paths, without a date."""
        figure: Any = self.draw(picture).figure
        import matplotlib as mpl

        written = StringIO()
        # deterministic names of clips
        settings: Any = {"svg.hashsalt": "robostiff", "svg.fonttype": "none" if letters else "path"}
        with mpl.rc_context(settings):
            figure.savefig(written, format="svg", metadata={"Date": None})
        return written.getvalue()


@frozen
class Plotly:
    """Draws scenes as figures of Plotly, to be turned in a browser; shows and writes nothing.

    ``figure.write_html("robot.html")`` writes what was drawn.

    Attributes
    ----------
    theme : Theme
    """

    theme: Theme = Theme.LIGHT

    def draw(self, picture: Picture) -> Figure:
        """Draw a scene; InputError when Plotly is missing, or the picture is a chart."""
        return plotly_figure(picture, self.theme.palette)


@frozen
class PictureData:
    """Returns pictures themselves, as data: their lines, marks, colours and words."""

    def draw(self, picture: Picture) -> Any:
        """The picture."""
        return picture


def plotly_figure(picture: Picture, palette: Palette) -> Figure:
    """A scene as a figure of Plotly, in the colours of a palette or in names of colours.

    Raises InputError when Plotly is missing, or the picture is a chart.
    """
    if not isinstance(picture, Scene):
        raise InputError(
            "picture of Plotly",
            got=type(picture).__name__.lower(),
            expected="a scene, which can be turned; charts are drawn by Matplotlib",
            hint="write backend=rs.plot.Matplotlib()",
        )
    with needs_extra("plots", "plot"):
        import plotly.graph_objects  # noqa: F401

    from robostiff.plot.plotly_scene import draw_scene

    # Plotly interprets text as HTML.
    shown = with_words(picture, lambda text: text.replace("&", "&amp;").replace("<", "&lt;"))
    return draw_scene(shown, palette)


# Any, since a default cannot have the type that the caller chooses.
PAPER: Any = Matplotlib()
DATA = PictureData()


def drawn_by(backend: PlotBackend[Drawn], picture: Picture) -> Drawn:
    """The picture, drawn; InputError when `backend` cannot draw."""
    if isinstance(backend, type) or not callable(getattr(backend, "draw", None)):
        expected = "Matplotlib() or Plotly()"
        hint = "write backend=rs.plot.Matplotlib()"
        raise InputError("backend of a plot", got=backend, expected=expected, hint=hint)
    return backend.draw(picture)


def swinging_script() -> str:
    """The script with ``swing(place, other)``, which moves a figure to other traces and back."""
    return files("robostiff.plot").joinpath("swinging.js").read_text(encoding="utf-8")


def places(figure: Any) -> list[dict[str, list[float | None]]]:
    """Coordinates x, y, z of each trace of a figure; None for those between lines."""
    traces = []
    for trace in figure.data:
        coordinates = {}
        for axis in "xyz":
            values = getattr(trace, axis, None)
            if values is not None:
                numbers = np.asarray(values, dtype=float)
                coordinates[axis] = [float(x) if np.isfinite(x) else None for x in numbers]
        traces.append(coordinates)
    return traces


def swinging_page(one: Any, other: Any) -> str:
    """A page with a figure of Plotly that moves to another one, of the same traces, and back."""
    data = json.dumps(places(other))
    start = f'swing(document.getElementById("{{plot_id}}"), {data});'
    return one.to_html(post_script=swinging_script() + start)
