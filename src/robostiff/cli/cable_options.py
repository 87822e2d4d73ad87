"""Options of ``robostiff cables``."""

from __future__ import annotations

from typing import Annotated

import typer

WrenchOption = Annotated[
    str | None,
    typer.Option(
        "--wrench",
        metavar='"fx fy fz mx my mz"',
        help="A load on top of the weight while the winches are locked [N, N m]: how the "
        "platform moves, and which cables become slack.",
    ),
]
BalanceOption = Annotated[
    str | None,
    typer.Option(
        "--balance",
        metavar='"fx fy fz mx my mz"',
        help="A wrench that the tensions balance at the pose itself [N, N m].",
    ),
]
RuleOption = Annotated[
    str,
    typer.Option("--rule", metavar="NAME", help="Of the tensions: nearest or closed-form."),
]
LevelOption = Annotated[
    float | None,
    typer.Option(
        "--level",
        help="Where between least (0) and greatest (1) tensions they aim.",
    ),
]
TensionsOption = Annotated[
    str | None,
    typer.Option(
        "--tensions", metavar='"t1 t2 ..."', help="The tensions themselves [N], one a cable."
    ),
]
