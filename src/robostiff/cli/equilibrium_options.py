"""Options of ``robostiff equilibrium``."""

from __future__ import annotations

from typing import Annotated

import typer

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
