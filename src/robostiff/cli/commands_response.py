"""The command ``response``: a network under loads and with supports that settle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from robostiff.cli.failure import BAD_STATUS
from robostiff.cli.output import print_data, say
from robostiff.errors import InputError
from robostiff.io.results.network import response_data, response_text
from robostiff.io.units import Dimension, parse_quantities
from robostiff.network import DistributedForce, ForceOnBeam, Network, network_response
from robostiff.robots import load as load_robot
from robostiff.spatial import Space

_FORCE = ("fx", "fy", "fz")


@dataclass(frozen=True)
class WrittenNetworkLoads:
    """Loads of a network as written on the command line, each ``NAME=NUMBERS``."""

    at_nodes: Sequence[str]
    along_beams: Sequence[str]
    on_beams: Sequence[str]
    settlements: Sequence[str]


def print_response(source: str, written: WrittenNetworkLoads, as_json: bool) -> int:
    """Print how a network answers its loads."""
    network = load_robot(source)
    if not isinstance(network, Network):
        raise InputError(
            f"response of {source!r}",
            got=type(network).__name__,
            expected="a network: a snapshot file with a graph",
            hint=f"write one: robostiff convert {source} --to graph -o network.json",
        )
    loads = _loads(written, network.space)
    settlements: dict[str, list[float]] = {}
    for text in written.settlements:
        name, values = _named("--settle", text)
        _check_once("--settle", name, settlements)
        settlements[name] = _row("--settle", values, _twist(network.space))
    if not loads and not settlements:
        raise InputError(
            f"loads of {source!r}", got="none", expected="--load, --along, --on or --settle"
        )
    result = network_response(network, loads, settlements=settlements)
    if as_json:
        print_data(response_data(network, result))
    else:
        say(response_text(network, result))
    return BAD_STATUS if result.status.is_bad else 0


Row = dict[str, Dimension]


def _loads(written: WrittenNetworkLoads, space: Space) -> dict[str, Any]:
    loads: dict[str, Any] = {}
    for text in written.at_nodes:
        name, values = _named("--load", text)
        _check_once("--load", name, loads)
        loads[name] = _force_or_wrench(values, space)
    on_beams: dict[str, list[DistributedForce | ForceOnBeam]] = {}
    for text in written.along_beams:
        name, values = _named("--along", text)
        q = _row("--along", values, dict.fromkeys(("qx", "qy", "qz"), Dimension.FORCE_PER_LENGTH))
        on_beams.setdefault(name, []).append(DistributedForce(q))
    for text in written.on_beams:
        name, values = _named("--on", text)
        numbers = {"s": Dimension.LENGTH, **dict.fromkeys(_FORCE, Dimension.FORCE)}
        s, *force = _row("--on", values, numbers)
        on_beams.setdefault(name, []).append(ForceOnBeam(force, s))
    for name in on_beams:
        _check_once("--load", name, loads)
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


def _named(option: str, text: str) -> tuple[str, str]:
    name, equals, values = (part.strip() for part in text.rpartition("="))
    if not (name and equals and values):
        raise InputError(option, got=text, expected="NAME=NUMBERS, such as tip=0 0 -80 N")
    return name, values


def _check_once(option: str, name: str, known: dict[str, Any]) -> None:
    if name in known:
        raise InputError(option, got=name, expected="each name once")
