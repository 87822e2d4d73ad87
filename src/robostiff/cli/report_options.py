"""Options of ``robostiff report``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from robostiff.report import TitleBlock

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
CompareOption = Annotated[
    str | None,
    typer.Option(
        "--compare",
        metavar="ROBOT",
        help="Another design beside it, at the same pose and under the same load.",
    ),
]
ProjectOption = Annotated[str, typer.Option("--project", help="Line of the title block.")]
AuthorOption = Annotated[str, typer.Option("--author", help="Line of the title block.")]
DateOption = Annotated[
    str, typer.Option("--date", help="Line of the title block, such as 2026-11-22, or 'today'.")
]
RevisionOption = Annotated[str, typer.Option("--revision", help="Line of the title block.")]


def title_block(project: str, author: str, date: str, revision: str) -> TitleBlock:
    """The title block of a report."""
    from datetime import date as day

    from robostiff.report import TitleBlock

    given = day.today().isoformat() if date == "today" else date
    return TitleBlock(project, author, given, revision)
