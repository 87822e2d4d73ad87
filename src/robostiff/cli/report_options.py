"""Options of ``robostiff report``."""

from __future__ import annotations

from typing import Annotated

import typer

OutputOption = Annotated[
    str,
    typer.Option("--output", "-o", metavar="FILE", help="What to write: FILE.html, or FILE.pdf."),
]
WrenchOption = Annotated[
    str | None,
    typer.Option(
        "--wrench",
        metavar='"fx fy fz mx my mz"',
        help="A load on the platform: adds the deflection and the elastic energy of parts.",
    ),
]
MapOption = Annotated[
    str | None,
    typer.Option(
        "--map",
        metavar="FILE",
        help="A map of the robot, .zarr or .nc: adds slices of the workspace.",
    ),
]
PdfOption = Annotated[bool, typer.Option("--pdf", help="Write FILE.pdf besides FILE.html.")]
FiniteOption = Annotated[
    bool,
    typer.Option(
        "--finite-load",
        help="With --wrench: where the robot comes to rest under it, its stiffness there, the "
        "critical load, and the force-deflection curve.",
    ),
]
