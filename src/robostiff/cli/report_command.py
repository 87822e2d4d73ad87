"""The command ``report``; heavy imports happen inside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from robostiff.cli.failure import reported
from robostiff.cli.shared_options import (
    AtOption,
    JointsOption,
    JsonOption,
    NearOption,
    OverwriteOption,
    PoseOption,
    RobotArgument,
    SetOption,
    SideOption,
    XacroOption,
)

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


@reported
def report(
    robot: RobotArgument,
    output: OutputOption,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    at: AtOption = None,
    wrench: WrenchOption = None,
    map_: MapOption = None,
    finite: FiniteOption = False,
    pdf: PdfOption = False,
    compare: CompareOption = None,
    project: ProjectOption = "",
    author: AuthorOption = "",
    date: DateOption = "",
    revision: RevisionOption = "",
    overwrite: OverwriteOption = False,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Write all results about a robot as one self-contained HTML page, or as a PDF.

    Example: robostiff report hexapod --wrench "500 N 0 0 0 0 0" -o hexapod.html

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands_report import Pages, make_report
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    block = title_block(project, author, date, revision)
    pages = Pages(wrench, map_, output, pdf, overwrite, finite, compare, block)
    described, place = SideFile(side, allow_xacro), PoseArguments(pose, joints, at, near)
    return make_report(robot, place, pages, set_ or [], described, as_json=json_)
