"""Options of the command ``check``."""

from __future__ import annotations

from typing import Annotated

import typer

PartsOption = Annotated[
    bool,
    typer.Option(
        "--parts",
        help="List joints and elastic parts at home: where they are, coordinates, lengths, "
        "stiffnesses of each direction alone in the part's own axes, limits.",
    ),
]
PlotOption = Annotated[
    str | None,
    typer.Option("--plot", metavar="FILE", help="Draw the robot at home: .png, .svg or .pdf."),
]
