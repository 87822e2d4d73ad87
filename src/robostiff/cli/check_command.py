"""The command ``check``; heavy imports happen inside it."""

from __future__ import annotations

from typing import Annotated

import typer

from robostiff.cli.failure import reported
from robostiff.cli.shared_options import (
    JsonOption,
    OverwriteOption,
    RobotArgument,
    SetOption,
    SideOption,
    XacroOption,
)

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
    typer.Option("--plot", metavar="FILE", help="Draw the robot: .png, .svg, .pdf or .html."),
]


@reported
def check(
    robot: RobotArgument,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    parts: PartsOption = False,
    plot: PlotOption = None,
    overwrite: OverwriteOption = False,
    json_: JsonOption = False,
) -> int:
    """Check a model or snapshot file, and list the parts of the robot.

    Example: robostiff check hexapod --parts --plot hexapod.png

    Exit status: 0 when it can be used, 2 when it cannot.
    """
    from robostiff.cli.commands import Details, check_robot
    from robostiff.cli.written_arguments import SideFile

    described = SideFile(side, allow_xacro)
    return check_robot(robot, set_ or [], json_, described, Details(parts, plot, overwrite))
