"""Commands of ``robostiff``; heavy imports happen inside them, so that help is fast."""

from __future__ import annotations

import gc
import os
from typing import Annotated

import typer

from robostiff.cli.cable_command import cables
from robostiff.cli.check_command import check
from robostiff.cli.derive_command import derive
from robostiff.cli.equilibrium_command import equilibrium, modes
from robostiff.cli.failure import ready_streams, reported
from robostiff.cli.file_formats import convert, new, schema
from robostiff.cli.map_command import map_
from robostiff.cli.plot_command import plot
from robostiff.cli.report_command import report
from robostiff.cli.response_command import response
from robostiff.cli.shared_options import (
    AtOption,
    JointsOption,
    JsonOption,
    NearOption,
    PoseOption,
    RobotArgument,
    SetOption,
    SideOption,
    XacroOption,
)
from robostiff.cli.view_command import view
from robostiff.version import __version__

app = typer.Typer(
    name="robostiff",
    help="Cartesian stiffness of robots with elastic links, elastic actuators and passive joints.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def start_quickly() -> None:
    """Spare a command what a process that ends soon does not need.

    Modules are never garbage: while they are loaded, nothing is gained by looking for it. And
    validation would look for plugins among the entry points of all installed packages.
    """
    gc.set_threshold(100_000)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"robostiff {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    pass


@app.command()
@reported
def robots(json_: JsonOption = False) -> int:
    """List the shipped robots with their sources."""
    from robostiff.cli.commands_robots import list_robots

    return list_robots(json_)


app.command()(check)


@app.command()
@reported
def stiffness(
    robot: RobotArgument,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    at: AtOption = None,
    method: Annotated[
        str,
        typer.Option(
            "--method",
            metavar="NAME",
            help="wrench-basis, saddle-point, block, recursive or index-rules.",
        ),
    ] = "wrench-basis",
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Print the Cartesian stiffness matrix of a robot at a pose, its rank and free motions.

    Example: robostiff stiffness gough-stewart-b --pose "10 mm 0 0.8 0 0 10 deg"

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands import print_stiffness
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    described, place = SideFile(side, allow_xacro), PoseArguments(pose, joints, at, near)
    return print_stiffness(robot, place, method, set_ or [], json_, described)


@app.command()
@reported
def deflection(
    robot: RobotArgument,
    wrench: Annotated[
        str,
        typer.Option(
            "--wrench",
            metavar='"fx fy fz mx my mz"',
            help="Force [N] and moment [N m] on the platform about the reference point.",
        ),
    ],
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    at: AtOption = None,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Print deflection, elastic energy of parts and actuator loads of a robot under a load.

    Example: robostiff deflection gough-stewart-b-beams --wrench "200 N 0 -500 0 0 0"

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands import print_deflection
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    described, place = SideFile(side, allow_xacro), PoseArguments(pose, joints, at, near)
    return print_deflection(robot, place, wrench, set_ or [], json_, described)


for _command in (equilibrium, modes, response):
    app.command()(_command)


@app.command()
@reported
def indices(
    robot: RobotArgument,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    at: AtOption = None,
    length: Annotated[
        str | None,
        typer.Option(
            "--length",
            metavar="LENGTH",
            help="Characteristic length of the indices that need one [m]; by default that of "
            "the robot at the pose.",
        ),
    ] = None,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Print stiffness indices: principal stiffnesses, directions, centres and axes.

    Example: robostiff indices hexapod --pose "60 mm 0 0.9 0 10 deg 0" --length "100 mm"

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands import print_indices
    from robostiff.cli.written_arguments import PoseArguments

    return print_indices(robot, PoseArguments(pose, joints, at, near), length, set_ or [], json_)


@app.command()
@reported
def verify(
    robot: RobotArgument,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Compute the stiffness matrix by all methods, and report whether they agree.

    Example: robostiff verify gough-stewart-b --pose "10 mm 0 0.8 0 0 10 deg"

    Exit status: 0 when the methods agree, 1 when they do not, 2 for bad input.
    """
    from robostiff.cli.commands_verify import print_verification
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    described, place = SideFile(side, allow_xacro), PoseArguments(pose, joints, None, near)
    return print_verification(robot, place, set_ or [], json_, described)


for _command in (plot, report):
    app.command()(_command)
app.command("map")(map_)
for _command in (derive, cables, view, schema, new, convert):
    app.command()(_command)


def main() -> None:
    """Run the command line."""
    start_quickly()
    ready_streams()
    app()


if __name__ == "__main__":
    main()
