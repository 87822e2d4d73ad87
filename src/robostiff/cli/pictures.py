"""Pictures as files of commands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from robostiff.cli.options import Replacing
from robostiff.cli.output import new_file
from robostiff.errors import InputError
from robostiff.io.whole_file import whole_file

if TYPE_CHECKING:
    from robostiff.plot.picture import Picture

ON_PAPER = (".png", ".svg", ".pdf")


def picture_file(option: str, name: str, overwrite: bool) -> Path:
    """A picture to be written, checked before anything is computed.

    Raises
    ------
    InputError
        As `new_file`, and for another ending.
    """
    path = new_file(option, name, overwrite)
    if path.suffix.lower() not in {*ON_PAPER, ".html"}:
        endings = ", ".join((*ON_PAPER, ".html"))
        raise InputError(option, got=name, expected=f"a name that ends in {endings}")
    return path


def picture_beside(plot: str | None, replacing: Replacing) -> Path | None:
    """The picture of ``--plot``, if it is wanted; see `picture_file`."""
    return None if plot is None else picture_file("--plot", plot, replacing.overwrite)


def draw(picture: Picture, path: Path, other: Picture | None = None) -> None:
    """Into a file; on a page, moving to another picture and back."""
    from robostiff import plot

    with whole_file(path) as begun:
        if path.suffix.lower() != ".html":
            figure: Any = plot.Matplotlib().draw(picture).figure
            figure.savefig(begun, format=path.suffix.lower()[1:], dpi=200, bbox_inches="tight")
            return
        drawn = plot.Plotly().draw(picture)
        if other is None:
            begun.write_text(drawn.to_html(), "utf-8")
            return
        from robostiff.plot.on_plotly.swinging import swinging_page

        begun.write_text(swinging_page(drawn, plot.Plotly().draw(other)), "utf-8")
