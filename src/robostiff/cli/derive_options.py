"""Options of ``robostiff derive``."""

from __future__ import annotations

from typing import Annotated

import typer

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
