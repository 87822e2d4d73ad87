"""Options of ``robostiff map``."""

from __future__ import annotations

from typing import Annotated

import typer


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
        help="Values of a joint of a serial arm [m or rad]; repeatable.",
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
