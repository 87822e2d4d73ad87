"""The command ``cables``; heavy imports happen inside it."""

from __future__ import annotations

from typing import Annotated

import typer

from robostiff.cli.failure import reported
from robostiff.cli.shared_options import (
    JsonOption,
    PoseOption,
    RobotArgument,
    SetOption,
)

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


@reported
def cables(
    robot: RobotArgument,
    pose: PoseOption = None,
    wrench: WrenchOption = None,
    balance: BalanceOption = None,
    rule: RuleOption = "nearest",
    level: LevelOption = None,
    tensions: TensionsOption = None,
    set_: SetOption = None,
    json_: JsonOption = False,
) -> int:
    """Print tensions and stiffness of a cable robot, and which cables become slack under a load.

    Example: robostiff cables cable-8 --pose "0.5 0.2 1 0 0 0" --wrench "0 0 -200 N 0 0 0"

    Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input.
    """
    from robostiff.cli.commands_cables import print_cables
    from robostiff.cli.written_arguments import PoseArguments

    place = PoseArguments(pose, None, None)
    return print_cables(robot, place, (wrench, balance), (rule, level, tensions), set_ or [], json_)
