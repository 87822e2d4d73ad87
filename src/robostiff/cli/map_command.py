"""The command ``map``; heavy imports happen inside it."""

from __future__ import annotations

from typing import Annotated

import typer

from robostiff.cli.failure import reported
from robostiff.cli.shared_options import (
    JsonOption,
    NearOption,
    OverwriteOption,
    RobotArgument,
    SetOption,
    SideOption,
    XacroOption,
)


def _axis(name: str, unit: str) -> typer.models.OptionInfo:
    return typer.Option(
        f"--{name}", metavar='"START STOP COUNT"', help=f"Values of {name} [{unit}]."
    )


XOption = Annotated[str | None, _axis("x", "m")]
YOption = Annotated[str | None, _axis("y", "m")]
ZOption = Annotated[str | None, _axis("z", "m")]
RxOption = Annotated[str | None, _axis("rx", "rad")]
RyOption = Annotated[str | None, _axis("ry", "rad")]
RzOption = Annotated[str | None, _axis("rz", "rad")]
JointOption = Annotated[
    list[str] | None,
    typer.Option(
        "--joint",
        metavar='"NAME START STOP COUNT"',
        help="Values of a joint of a serial arm or a linkage [m or rad]; repeatable.",
    ),
]
PosesOption = Annotated[
    str | None,
    typer.Option(
        "--poses",
        metavar="FILE.csv",
        help="Poses from a file in place of a grid: a line of names, such as 'time, x [mm], rz "
        "[deg]', then a line a pose.",
    ),
]
RandomOption = Annotated[
    int | None,
    typer.Option(
        "--random",
        metavar="COUNT",
        help="Random poses in place of a grid; --x and the like then hold START and STOP.",
    ),
]
SeedOption = Annotated[int, typer.Option("--seed", metavar="NUMBER", help="Seed of random poses.")]
QuantityOption = Annotated[
    list[str] | None,
    typer.Option(
        "--quantity",
        metavar="NAME",
        help="stiffness, principal-stiffness (when left out), worst-deflection, indices, "
        "deflection or actuator-forces; repeatable. Rank and status are always included.",
    ),
]
WrenchOption = Annotated[
    str | None,
    typer.Option(
        "--wrench",
        metavar='"fx fy fz mx my mz"',
        help="Load about the reference point [N, N m], for deflection and actuator-forces.",
    ),
]
LengthOption = Annotated[
    str | None,
    typer.Option(
        "--length",
        metavar="LENGTH",
        help="Characteristic length of the indices [m]; that of the robot at home when left out.",
    ),
]
OutputOption = Annotated[
    str,
    typer.Option(
        "-o",
        "--output",
        metavar="FILE",
        help="FILE.zarr (of any size, can be resumed), FILE.nc (NetCDF), FILE.csv, or - for "
        "CSV on standard output.",
    ),
]
ResumeOption = Annotated[
    bool, typer.Option("--resume", help="Continue an interrupted map in FILE.zarr.")
]
WorkersOption = Annotated[
    int | None,
    typer.Option("--workers", metavar="COUNT", help="Processes of this machine to start."),
]
ThreadsOption = Annotated[
    int | None,
    typer.Option(
        "--threads", metavar="COUNT", help="Threads; as many as processors when left out."
    ),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="A Dask scheduler, such as tcp://host:8786; its workers must see FILE.zarr.",
    ),
]
BatchedOption = Annotated[
    bool,
    typer.Option(
        "--batched",
        help="Compute every pose as 'stiffness' does, without a kernel; large maps have one "
        "otherwise.",
    ),
]

PlotOption = Annotated[
    str | None,
    typer.Option(
        "--plot",
        metavar="FILE",
        help="Draw the first quantity over the first two coordinates: .png, .svg, .pdf or .html; "
        "'robostiff plot FILE.nc' draws others.",
    ),
]


@reported
def map_(
    robot: RobotArgument,
    output: OutputOption,
    x: XOption = None,
    y: YOption = None,
    z: ZOption = None,
    rx: RxOption = None,
    ry: RyOption = None,
    rz: RzOption = None,
    joint: JointOption = None,
    poses: PosesOption = None,
    random: RandomOption = None,
    seed: SeedOption = 0,
    quantity: QuantityOption = None,
    wrench: WrenchOption = None,
    length: LengthOption = None,
    near: NearOption = None,
    resume: ResumeOption = False,
    plot: PlotOption = None,
    overwrite: OverwriteOption = False,
    workers: WorkersOption = None,
    threads: ThreadsOption = None,
    scheduler: SchedulerOption = None,
    batched: BatchedOption = False,
    side: SideOption = None,
    allow_xacro: XacroOption = False,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Compute stiffness at many poses: over a grid, along a trajectory, or at random.

    Coordinates left out stay at home.

    Examples
    --------
    robostiff map hexapod --x "-100 mm 100 mm 41" --rz "0 20 deg 5" -o map.nc

    robostiff map hexapod --poses path.csv --quantity deflection --wrench "0 0 -500 N 0 0 0"
    -o path.csv

    robostiff map hexapod --random 1000000 --x "-0.1 0.1" --y "-0.1 0.1" -o map.zarr --resume

    Exit status: 0 for a map, 1 when no pose can be reached, 2 for bad input, 130 when interrupted.
    """
    from robostiff.cli.commands_map import Asked, Run, make_map
    from robostiff.cli.written_arguments import SideFile

    axes = {"x": x, "y": y, "z": z, "rx": rx, "ry": ry, "rz": rz}
    asked = Asked(
        {name: text for name, text in axes.items() if text is not None},
        joint or [],
        poses,
        random,
        seed,
        quantity or [],
        wrench,
        length,
        near,
    )
    run = Run(output, resume, workers, threads, scheduler, batched, overwrite, plot)
    described = SideFile(side, allow_xacro)
    return make_map(robot, asked, run, set_ or [], json_, described)
