"""Backends: programs that draw pictures, with their options."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from robostiff.errors import InputError
from robostiff.plot.on_matplotlib.backend import Matplotlib
from robostiff.plot.picture import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from typing_extensions import TypeVar

    Drawn = TypeVar("Drawn", default=Axes)
    Drawn_co = TypeVar("Drawn_co", covariant=True)
else:
    from typing import TypeVar

    Drawn = TypeVar("Drawn")
    Drawn_co = TypeVar("Drawn_co", covariant=True)


class PlotBackend(Protocol[Drawn_co]):
    """Draws pictures: `Matplotlib` returns its axes, `Plotly` a figure."""

    def draw(self, picture: Picture) -> Drawn_co:
        """Draw a picture, without showing it."""
        ...


# Any, since a default cannot have the type that the caller chooses.
PAPER: Any = Matplotlib()


def drawn_by(backend: PlotBackend[Drawn], picture: Picture) -> Drawn:
    """The picture, drawn.

    Raises
    ------
    InputError
        When `backend` cannot draw.
    """
    if isinstance(backend, type) or not callable(getattr(backend, "draw", None)):
        raise InputError(
            "backend of a plot",
            got=backend,
            expected="Matplotlib() or Plotly()",
            hint="write backend=rs.plot.Plotly()",
        )
    return backend.draw(picture)
