"""Arguments of the commands ``schema``, ``new`` and ``convert``."""

from __future__ import annotations

from typing import Annotated

import typer

from robostiff.cli.failure import reported
from robostiff.cli.shared_options import (
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

OutputOption = Annotated[
    str | None,
    typer.Option(
        "-o", "--output", metavar="FILE", help="The file to write; standard output when left out."
    ),
]


@reported
def schema(
    form: Annotated[
        str, typer.Argument(metavar="[model|snapshot|graph]", help="The file format.")
    ] = "model",
    output: OutputOption = None,
    overwrite: OverwriteOption = False,
) -> int:
    """Print the JSON schema of a file format, by which editors complete and explain keys.

    Example: robostiff schema model -o robostiff.schema.json

    Exit status: 0 for a schema, 2 for bad input.
    """
    from robostiff.cli.commands_files import print_schema

    return print_schema(form, output, overwrite)


@reported
def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the robot, and of NAME.yaml.")],
    template: Annotated[
        str,
        typer.Option(
            "--template",
            metavar="NAME",
            help="arm (by a table of Denavit and Hartenberg), beams (an arm element by element), "
            "parallel, planar, cables, or a shipped robot to copy.",
        ),
    ] = "parallel",
    json_: JsonOption = False,
) -> int:
    """Write a model file to begin with, which can be used as it is. Nothing is replaced.

    Examples
    --------
    robostiff new my-arm --template arm

    robostiff new my-delta --template delta

    Exit status: 0 for a new file, 2 for bad input.
    """
    from robostiff.cli.commands_files import write_new

    return write_new(name, template, json_)


@reported
def convert(
    robot: RobotArgument,
    to: Annotated[
        str,
        typer.Option(
            "--to",
            metavar="snapshot|graph|matlab|opensees|calculix",
            help="By legs, as bodies and joints, the results at the pose as a .mat file, or a "
            "model of OpenSees (.tcl or .py) or CalculiX (.inp).",
        ),
    ] = "snapshot",
    output: OutputOption = None,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    overwrite: OverwriteOption = False,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Write a robot at a pose as a file: a snapshot, a finite element model, results for MATLAB.

    Examples
    --------
    robostiff convert hexapod --pose "0 0 0.85 0 0 0" --to graph -o hexapod.json

    robostiff convert hexapod --pose "0 0 0.85 0 0 0" --to matlab -o hexapod.mat

    robostiff convert hexapod --pose "0 0 0.85 0 0 0" --to opensees -o hexapod.tcl

    Exit status: 0 for a file, 1 when the pose is out of reach, 2 for bad input.
    """
    from robostiff.cli.commands_files import Converted
    from robostiff.cli.commands_files import convert as write_converted
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    place, described = PoseArguments(pose, joints, None, near), SideFile(side, allow_xacro)
    wanted = Converted(to, output, overwrite, as_json=json_)
    return write_converted(robot, place, wanted, set_ or [], described)
