"""The command ``response``: a network under loads and with supports that settle."""

from __future__ import annotations

from functools import partial
from typing import Any

from robostiff.cli.answer_commands import WrittenNetworkLoads
from robostiff.cli.command import answered
from robostiff.cli.options import Answer, named_once, named_values
from robostiff.errors import InputError
from robostiff.io.results.equilibrium import response_data, response_text
from robostiff.io.units import Dimension, parse_quantities
from robostiff.network import DistributedForce, ForceOnBeam, Network, network_response
from robostiff.robots import load
from robostiff.spatial import Space

_FORCE = ("fx", "fy", "fz")
_EXPECTED = "NAME=NUMBERS, such as tip=0 0 -80 N"


def print_response(written: WrittenNetworkLoads, answer: Answer) -> int:
    """Print how a network answers its loads."""
    source, network = written.source, load(written.source)
    if not isinstance(network, Network):
        raise InputError(
            f"response of {source!r}",
            got=type(network).__name__,
            expected="a network: a snapshot file with a graph",
            hint=f"write one: robostiff convert {source} --to graph -o network.json",
        )
    loads = _loads(written, network.space)
    moved = named_once("--settle", written.settlements, _EXPECTED)
    twist = _twist(network.space)
    settlements = {name: _row("--settle", values, twist) for name, values in moved.items()}
    if not loads and not settlements:
        raise InputError(
            f"loads of {source!r}", got="none", expected="--load, --along, --on or --settle"
        )
    result = network_response(network, loads, settlements=settlements)
    return answered(
        result, answer, partial(response_data, network), partial(response_text, network)
    )


Row = dict[str, Dimension]


def _loads(written: WrittenNetworkLoads, space: Space) -> dict[str, Any]:
    at_nodes = named_once("--load", written.at_nodes, _EXPECTED)
    loads: dict[str, Any] = {n: _force_or_wrench(own, space) for n, own in at_nodes.items()}
    on_beams: dict[str, list[DistributedForce | ForceOnBeam]] = {}
    for name, values in named_values("--along", written.along_beams, _EXPECTED):
        q = _row("--along", values, dict.fromkeys(("qx", "qy", "qz"), Dimension.FORCE_PER_LENGTH))
        on_beams.setdefault(name, []).append(DistributedForce(q))
    for name, values in named_values("--on", written.on_beams, _EXPECTED):
        numbers = {"s": Dimension.LENGTH, **dict.fromkeys(_FORCE, Dimension.FORCE)}
        s, *force = _row("--on", values, numbers)
        on_beams.setdefault(name, []).append(ForceOnBeam(force, s))
    for name in on_beams.keys() & loads.keys():
        raise InputError("--load", got=name, expected="the name of a node, which no beam has")
    return loads | on_beams


def _wrench(space: Space) -> Row:
    names, d = space.wrench_order, space.translations
    return {n: Dimension.FORCE if i < d else Dimension.MOMENT for i, n in enumerate(names)}


def _twist(space: Space) -> Row:
    names, d = space.twist_order, space.translations
    return {n: Dimension.LENGTH if i < d else Dimension.ANGLE for i, n in enumerate(names)}


def _row(option: str, text: str, numbers: Row) -> list[float]:
    return parse_quantities(text, list(numbers.values()), list(numbers), option)


def _force_or_wrench(text: str, space: Space) -> list[float]:
    """Three forces, or in space three forces and three moments."""
    wrench = _wrench(space)
    force = {name: wrench[name] for name in space.wrench_order[:3]}
    try:
        return _row("--load", text, force)
    except InputError as of_three:
        if wrench == force:
            raise
        try:
            return _row("--load", text, wrench)
        except InputError as of_six:
            for error in (of_six, of_three):
                if error.subject != "--load":  # one of the numbers, and not how many they are
                    raise error from None
            count = f"3 numbers ({' '.join(force)}) or 6 ({' '.join(wrench)})"
            raise InputError("--load", got=text, expected=count) from None
