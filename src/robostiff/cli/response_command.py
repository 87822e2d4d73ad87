"""The command ``response``; heavy imports happen inside it."""

from __future__ import annotations

from typing import Annotated

import typer

from robostiff.cli.failure import reported
from robostiff.cli.shared_options import JsonOption


@reported
def response(
    network: Annotated[
        str, typer.Argument(metavar="FILE", help="A snapshot file with a graph: a network.")
    ],
    load: Annotated[
        list[str] | None,
        typer.Option(
            "--load",
            metavar='"NODE=fx fy fz [mx my mz]"',
            help="Force [N], and moment [N m], at the point of a node; repeatable.",
        ),
    ] = None,
    along: Annotated[
        list[str] | None,
        typer.Option(
            "--along",
            metavar='"BEAM=qx qy qz"',
            help="Uniform force along a whole beam [N/m]; repeatable.",
        ),
    ] = None,
    on: Annotated[
        list[str] | None,
        typer.Option(
            "--on",
            metavar='"BEAM=s fx fy fz"',
            help="Force [N] on a beam at the distance s [m] from its start; repeatable.",
        ),
    ] = None,
    settle: Annotated[
        list[str] | None,
        typer.Option(
            "--settle",
            metavar='"NODE=x y z rx ry rz"',
            help="Displacement [m] and rotation [rad] of a fixed node; repeatable.",
        ),
    ] = None,
    json_: JsonOption = False,
) -> int:
    """Print displacements, reactions and beam forces of a network under loads, all together.

    Example: robostiff response portal.json --along "beam=0 0 -2 kN/m" --load "corner=100 N 0 0"

    Exit status: 0 for an answer, 1 for none, 2 for bad input.
    """
    from robostiff.cli.commands_response import WrittenNetworkLoads, print_response

    written = WrittenNetworkLoads(load or [], along or [], on or [], settle or [])
    return print_response(network, written, json_)
