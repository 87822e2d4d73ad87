"""The command ``view``; heavy imports happen inside it."""

from __future__ import annotations

from typing import Annotated

import typer

from robostiff.cli.failure import reported
from robostiff.cli.shared_options import (
    JointsOption,
    PoseOption,
    RobotArgument,
    SetOption,
    SideOption,
    XacroOption,
)

WrenchOption = Annotated[
    str | None,
    typer.Option(
        "--wrench",
        metavar='"fx fy fz mx my mz"',
        help="Load on the platform at the beginning [N, N m].",
    ),
]
PortOption = Annotated[
    int,
    typer.Option(
        "--port",
        min=1,
        max=65535,
        help="Where to listen on this computer; the next free port is taken where it is in use.",
    ),
]
NoBrowserOption = Annotated[
    bool, typer.Option("--no-browser", help="Print the address, and open no browser.")
]


@reported
def view(
    robot: RobotArgument,
    pose: PoseOption = None,
    joints: JointsOption = None,
    wrench: WrenchOption = None,
    port: PortOption = 8080,
    no_browser: NoBrowserOption = False,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
) -> int:
    """Show a robot in the browser, with sliders for its pose, its parameters and a load.

    Stiffness, ellipsoids, free motions, deflection and elastic energy follow the sliders. Only
    this computer can open the page. Ctrl-C ends it.

    Example: robostiff view hexapod --wrench "500 N 0 0 0 0 0"

    Exit status: 0 when it is ended, 2 for bad input.
    """
    from robostiff.cli.commands_view import Page, show_view
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    page = Page(wrench, port, not no_browser)
    place = PoseArguments(pose, joints, None)
    return show_view(robot, place, page, set_ or [], SideFile(side, allow_xacro))
