"""Options that several commands share."""

from __future__ import annotations

from typing import Annotated

import typer


def robot_names(incomplete: str) -> list[str]:
    """Shipped robots whose names begin so; the shell itself completes files."""
    from robostiff.robots import shipped_cable_robots, shipped_linkages, shipped_robots

    names = (*shipped_robots(), *shipped_cable_robots(), *shipped_linkages())
    return sorted(name for name in names if name.startswith(incomplete))


RobotArgument = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="A shipped robot (see 'robostiff robots'), a model file, a snapshot file, a robot "
        "description (URDF, xacro, MJCF), or - for standard input.",
        autocompletion=robot_names,
    ),
]
PoseOption = Annotated[
    str | None,
    typer.Option(
        "--pose",
        metavar='"x y z rx ry rz"',
        help="Platform pose: point [m] and rotation vector [rad], units may be written ('10 mm 0 "
        "0.5 0 0 10 deg'); or the robot's free coordinates alone; or tip and axis of the tool, "
        "'tip 0.1 0 0.5 axis 0 0.1 1'. Home when left out.",
    ),
]
JointsOption = Annotated[
    str | None,
    typer.Option(
        "--joints",
        metavar='"q1 q2 ..."',
        help="Joint coordinates of a serial arm, or those of the actuators of any other robot "
        "[m, rad], in place of --pose; or some of the latter by name, 'leg1/slide=20 mm'.",
    ),
]
NearOption = Annotated[
    str | None,
    typer.Option(
        "--near",
        metavar='"q1 q2 ..."',
        help="Joint coordinates of all legs, one after the other [m, rad]: the nearest posture is "
        "taken. By default that of home.",
    ),
]
AtOption = Annotated[
    str | None,
    typer.Option(
        "--at",
        metavar='"x y z"',
        help="Point of the platform, in world coordinates, about which the answer is given [m].",
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Give a parameter of the model file another value, such as --set R=350mm; repeatable.",
    ),
]
SideOption = Annotated[
    str | None,
    typer.Option(
        "--side",
        metavar="FILE",
        help="Stiffnesses, passive joints and loops of a robot description (URDF, xacro, MJCF). "
        "By default NAME.stiffness.yaml beside it.",
    ),
]
XacroOption = Annotated[
    bool,
    typer.Option(
        "--allow-xacro",
        help="Expand a xacro that is named in a side file, which runs the Python written in it.",
    ),
]
OverwriteOption = Annotated[
    bool,
    typer.Option("--overwrite", help="Replace a file that is there already."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
