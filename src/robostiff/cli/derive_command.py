"""The command ``derive``; heavy imports happen inside it."""

from __future__ import annotations

from typing import Annotated

import typer

from robostiff.cli.failure import reported
from robostiff.cli.shared_options import (
    JsonOption,
    OverwriteOption,
    RobotArgument,
    SetOption,
)

FORMATS = ("text", "latex", "pdf", "md", "html", "json", "python", "c", "julia", "matlab")

PoseOption = Annotated[
    str,
    typer.Option(
        "--pose",
        metavar="POSE",
        help="home; symbolic, a general pose in symbols; or coordinates with units, such as "
        "'x=100 mm, gamma=10 deg' (q1, q2 ... of a serial arm). Others stay at home.",
    ),
]
SymbolsOption = Annotated[
    str,
    typer.Option(
        "--symbols",
        metavar="NAMES",
        help="Parameters that are symbols, such as R,r,h; all; or none. The others are numbers.",
    ),
]
AnglesOption = Annotated[
    str | None,
    typer.Option(
        "--angles",
        metavar="NAME",
        help="Coordinates of the rotation of --pose: rpy, quaternion, or Euler angles such as ZXZ "
        "(axes that move along) or xyz (axes that stay).",
    ),
]
LegOption = Annotated[
    str | None,
    typer.Option(
        "--leg",
        metavar="NAME",
        help="One leg alone: its stiffness without passive joints, then joint by joint.",
    ),
]
StepsOption = Annotated[
    bool, typer.Option("--steps", help="Named steps of moderate size; the default away from home.")
]
ClosedOption = Annotated[
    bool, typer.Option("--closed", help="One expression for each entry; the default at home.")
]
LimitOption = Annotated[
    int | None,
    typer.Option(
        "--limit", metavar="TERMS", min=1, help="Most terms of an entry of a closed form."
    ),
]
BudgetOption = Annotated[
    float,
    typer.Option(
        "--budget",
        metavar="SECONDS",
        help="Computing time of a closed form; named steps are the answer when it ends.",
    ),
]
FormatOption = Annotated[
    str | None,
    typer.Option(
        "--format",
        metavar="NAME",
        help=f"{', '.join(FORMATS)}; that of the file's name, or text, when left out.",
    ),
]
OutputOption = Annotated[
    str | None,
    typer.Option("-o", "--output", metavar="FILE", help="A new file in place of standard output."),
]
DerivativeOption = Annotated[
    str | None,
    typer.Option("--derivative", metavar="SYMBOL", help="dK by a symbol in place of K."),
]
RankOption = Annotated[
    bool, typer.Option("--rank", help="Print the rank of K and where it drops, in place of K.")
]
FreeMotionsOption = Annotated[
    bool, typer.Option("--free-motions", help="Print the free motions, in place of K.")
]
EigenvaluesOption = Annotated[
    bool,
    typer.Option(
        "--eigenvalues", help="Print the principal stiffnesses in translation and in rotation."
    ),
]


@reported
def derive(
    robot: RobotArgument,
    pose: PoseOption = "home",
    angles: AnglesOption = None,
    symbols: SymbolsOption = "all",
    set_: SetOption = None,
    leg: LegOption = None,
    steps: StepsOption = False,
    closed: ClosedOption = False,
    limit: LimitOption = None,
    budget: BudgetOption = 20.0,
    format_: FormatOption = None,
    output: OutputOption = None,
    overwrite: OverwriteOption = False,
    derivative: DerivativeOption = None,
    rank: RankOption = False,
    free_motions: FreeMotionsOption = False,
    eigenvalues: EigenvaluesOption = False,
    json_: JsonOption = False,
) -> int:
    """Write the stiffness matrix of a robot as a formula: text, LaTeX, PDF, Python, C, Julia.

    Examples
    --------
    robostiff derive gough-stewart-b

    robostiff derive gough-stewart-a --rank --free-motions --eigenvalues

    robostiff derive 3-rpr --pose symbolic --steps -o stiffness.pdf

    robostiff derive hexapod --pose symbolic --angles ZXZ

    robostiff derive hexapod --symbols R,r --pose "z=0.85, gamma=10 deg" -o hexapod.py

    robostiff derive gough-stewart-b-beams --leg leg1

    Exit status: 0 for a formula, 2 for bad input or a formula beyond the limit, 130 when
    interrupted.
    """
    from robostiff.cli.commands_derive import FormulaRequest, Questions, Sheet, print_formula

    asked = FormulaRequest(pose, symbols, steps, closed, limit, budget, derivative, leg, angles)
    questions = Questions(rank, free_motions, eigenvalues)
    sheet = Sheet(format_, output, overwrite, as_json=json_)
    return print_formula(robot, asked, sheet, questions, set_ or [])
