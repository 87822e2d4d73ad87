"""The commands ``equilibrium`` and ``modes``; heavy imports happen inside them."""

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
        help="Force [N] and moment [N m] on the platform about the point --at, which moves along.",
    ),
]
WeightOption = Annotated[
    list[str] | None,
    typer.Option(
        "--weight",
        metavar='"LEG/PART=MASS"',
        help="A mass [kg] on the body behind a part, or on 'platform'; repeatable.",
    ),
]
LoadOption = Annotated[
    list[str] | None,
    typer.Option(
        "--load",
        metavar='"LEG/PART=fx fy fz"',
        help="A force [N] on the body behind a part, or on 'platform'; repeatable.",
    ),
]
GravityOption = Annotated[
    str | None,
    typer.Option(
        "--gravity",
        metavar='"gx gy gz"',
        help="Acceleration of free fall [m/s^2], or an axis along which it is, such as -z; '0 0 0' "
        "for none. By default that of the model file.",
    ),
]
PreloadOption = Annotated[
    list[str] | None,
    typer.Option(
        "--preload",
        metavar='"LEG/PART=FORCE"',
        help="With how much a drive pushes along its coordinate [N or N m]; repeatable.",
    ),
]
MassOption = Annotated[
    list[str] | None,
    typer.Option(
        "--mass",
        metavar='"LEG/PART=MASS"',
        help="A mass [kg] that moves with the body behind a part, or with 'platform', and has no "
        "weight; repeatable.",
    ),
]
CriticalOption = Annotated[
    bool, typer.Option("--critical", help="Find the critical load, and how the robot leaves.")
]
FactorsOption = Annotated[
    str | None,
    typer.Option(
        "--factors",
        metavar='"START STOP COUNT"',
        help="Multiples of the wrench at which to give the force-deflection curve.",
    ),
]
PlotOption = Annotated[
    str | None,
    typer.Option(
        "--plot",
        metavar="FILE",
        help="Draw the loaded shape, or with --factors the curve, into a new file: .svg, .png, "
        ".pdf or .html.",
    ),
]
PlotModeOption = Annotated[
    str | None,
    typer.Option(
        "--plot",
        metavar="FILE",
        help="Draw a mode into a new file: .html, in which it moves, .svg, .png or .pdf.",
    ),
]
ModeOption = Annotated[
    int, typer.Option("--mode", metavar="NUMBER", help="Which mode to draw, 1 for the slowest.")
]


@reported
def equilibrium(
    robot: RobotArgument,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    wrench: WrenchOption = None,
    at: AtOption = None,
    weight: WeightOption = None,
    load: LoadOption = None,
    gravity: GravityOption = None,
    preload: PreloadOption = None,
    critical: CriticalOption = False,
    factors: FactorsOption = None,
    plot: PlotOption = None,
    overwrite: OverwriteOption = False,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Print where a robot comes to rest under finite loads, its stiffness there, and its stability.

    Examples
    --------
    robostiff equilibrium hexapod --wrench "0 0 -50 kN 0 0 0" --weight "leg1/strut=12 kg" --critical

    robostiff equilibrium six-joint-arm --gravity=-z --wrench "0 0 -150 N 0 0 0" --factors "0 4 9"

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands_equilibrium import Wanted, WrittenLoads, print_equilibrium
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    place = PoseArguments(pose, joints, at, near)
    loads = WrittenLoads(wrench, weight or [], load or [], gravity, preload or [])
    wanted = Wanted(critical, factors, json_, plot, overwrite)
    described = SideFile(side, allow_xacro)
    return print_equilibrium(robot, place, loads, wanted, set_ or [], described)


@reported
def modes(
    robot: RobotArgument,
    pose: PoseOption = None,
    joints: JointsOption = None,
    near: NearOption = None,
    mass: MassOption = None,
    wrench: WrenchOption = None,
    at: AtOption = None,
    weight: WeightOption = None,
    load: LoadOption = None,
    gravity: GravityOption = None,
    preload: PreloadOption = None,
    mode: ModeOption = 1,
    plot: PlotModeOption = None,
    overwrite: OverwriteOption = False,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Print natural frequencies and modes about the equilibrium, without load or under one.

    Masses are those of the model, and those of --mass.

    Examples
    --------
    robostiff modes hexapod --mass "platform=150 kg"

    robostiff modes six-joint-arm --gravity=-z --plot first-mode.html

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands_equilibrium import ShownModes, WrittenLoads, print_modes
    from robostiff.cli.written_arguments import PoseArguments, SideFile

    place = PoseArguments(pose, joints, at, near)
    loads = WrittenLoads(wrench, weight or [], load or [], gravity, preload or [])
    described = SideFile(side, allow_xacro)
    shown = ShownModes(json_, plot, mode, overwrite)
    return print_modes(robot, place, loads, mass or [], set_ or [], described, shown)
