"""The command ``plot``; heavy imports happen inside it."""

from __future__ import annotations

from typing import Annotated

import typer

from robostiff.cli.failure import reported
from robostiff.cli.shared_options import (
    AtOption,
    JointsOption,
    JsonOption,
    NearOption,
    OverwriteOption,
    PoseOption,
    SetOption,
    SideOption,
    XacroOption,
    robot_names,
)

WHAT = (
    "robot",
    "deflection",
    "energy",
    "ellipsoids",
    "free-motions",
    "matrix",
    "modes",
    "map",
)
"""What can be drawn."""

SubjectArgument = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT|MAP",
        help="A shipped robot (see 'robostiff robots'), a model file, a snapshot or network, a "
        "robot description (URDF, xacro, MJCF), or a map: FILE.zarr or FILE.nc.",
        autocompletion=robot_names,
    ),
]
WhatOption = Annotated[
    str | None,
    typer.Option(
        "--what",
        metavar="|".join(WHAT),
        help="What is drawn: the robot with its parts and joints named, when left out; under "
        "--wrench its deflection.",
    ),
]
OutputOption = Annotated[
    str,
    typer.Option(
        "--output", "-o", metavar="FILE", help="FILE.png, .svg or .pdf, or .html to be turned."
    ),
]
WrenchOption = Annotated[
    str | None,
    typer.Option(
        "--wrench",
        metavar='"fx fy fz mx my mz"',
        help="A load on the platform, for deflection and energy.",
    ),
]
QualityOption = Annotated[
    str,
    typer.Option(
        "--quality",
        metavar="NAME",
        help="Of ellipsoids: compliance, stiffness, rotational-compliance or rotational-stiffness.",
    ),
]
ModeOption = Annotated[
    int, typer.Option("--mode", metavar="NUMBER", help="Of modes: which, 1 for the slowest.")
]
QuantityOption = Annotated[
    str | None,
    typer.Option(
        "--quantity",
        metavar="NAME",
        help="Of a map: worst_deflection, rank, status or any other variable of it.",
    ),
]
CutOption = Annotated[
    list[str] | None,
    typer.Option(
        "--cut",
        metavar="NAME=VALUE",
        help="Of a map: where a coordinate is cut, or which component is shown, such as z=0.3 or "
        "displacement_axis=dz; repeatable.",
    ),
]


@reported
def plot(
    subject: SubjectArgument,
    output: OutputOption,
    what: WhatOption = None,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    at: AtOption = None,
    wrench: WrenchOption = None,
    quality: QualityOption = "compliance",
    mode: ModeOption = 1,
    quantity: QuantityOption = None,
    cut: CutOption = None,
    overwrite: OverwriteOption = False,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Draw a robot, a snapshot, a network, a cable robot, or a map.

    Examples
    --------
    robostiff plot hexapod --wrench "500 N 0 0 0 0 0" -o hexapod.png

    robostiff plot cable-8 --what ellipsoids -o cables.html

    robostiff plot map.nc --quantity status --cut z=0.3 -o map.pdf

    Exit status: 0 for a picture, 1 where there is nothing to draw, 2 for bad input.
    """
    from robostiff.cli.commands_plot import Asked, make_plot
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    asked = Asked(what, wrench, quality, mode, quantity, cut or [], output, overwrite, json_)
    place, described = PoseArguments(pose, joints, at, near), SideFile(side, allow_xacro)
    return make_plot(subject, place, asked, set_ or [], described)
