"""Loads on robots and networks as they are written on the command line."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from robostiff.cli import arguments
from robostiff.cli.options import Loads, Posing, named_once, named_values
from robostiff.errors import InputError
from robostiff.io.units import Dimension, parse_quantities, to_si
from robostiff.model import Mass
from robostiff.network import DistributedForce, ForceOnBeam
from robostiff.spatial import Screw, Space
from robostiff.statics import DeadForce

_MOST_FACTORS = 1000
_FORCE = ("fx", "fy", "fz")
_FOR_NETWORKS = "NAME=NUMBERS, such as tip=0 0 -80 N"
_EXPECTED = "LEG/PART=VALUE, such as "
_SUCH_AS = {
    "--weight": '"leg1/strut=12 kg"',
    "--mass": '"leg1/strut=12 kg"',
    "--load": '"leg1/strut=0 0 -80 N"',
    "--preload": '"leg1/strut=2 kN"',
}


def loading(robot: Any, place: Posing, written: Loads) -> dict[str, Any]:
    """Place, and loads beside the wrench."""
    return {
        **arguments.where(robot, place),
        "loads": body_loads(written),
        "gravity": arguments.gravity(written.gravity),
        "preload": _preloads(robot, written.preloads),
    }


def body_loads(written: Loads) -> dict[str, list[Mass | DeadForce]]:
    """Weights and forces by the names of parts."""
    weights = by_part("--weight", written.weights, lambda text: Mass(kilograms(text)))
    forces = by_part("--load", written.forces, _force)
    return {name: weights.get(name, []) + forces.get(name, []) for name in weights | forces}


def by_part(
    option: str, texts: tuple[str, ...], read: Callable[[str], Any]
) -> dict[str, list[Any]]:
    """What is written for parts, by their names."""
    found: dict[str, list[Any]] = {}
    for name, value in named_values(option, texts, _EXPECTED + _SUCH_AS[option]):
        try:
            found.setdefault(name, []).append(read(value))
        except InputError as error:
            where = f"{option} of {name!r}: {error.subject.removeprefix(option).lstrip(', ')}"
            raise InputError(
                where.removesuffix(": "), got=error.got, expected=error.expected, hint=error.hint
            ) from None
    return found


def kilograms(text: str) -> float:
    """A mass [kg]."""
    return to_si(text, Dimension.MASS, subject="mass")


def _force(text: str) -> DeadForce:
    return DeadForce(parse_quantities(text, [Dimension.FORCE] * 3, _FORCE, "--load"))


def _preloads(robot: Any, texts: tuple[str, ...]) -> dict[str, float]:
    """Preloads of joints: forces of slides, moments of turns."""
    turns = {name: screw.turns for name, screw in _freedoms(robot)}
    given = named_once("--preload", texts, _EXPECTED + _SUCH_AS["--preload"])
    found = {}
    for name, text in given.items():
        # a name that is none is refused where the joints are
        dimension = Dimension.MOMENT if turns.get(name, False) else Dimension.FORCE
        found[name] = to_si(text, dimension, subject="--preload")
    return found


def _freedoms(robot: Any) -> Iterator[tuple[str, Screw]]:
    """Freedoms by the names of their joints, as preloads name them."""
    for joint in getattr(robot, "joints", ()):
        yield from ((getattr(own, "name", joint.name), own) for own in joint.freedoms)
    for leg in getattr(robot, "legs", ()):
        chain = getattr(leg, "chain", None)
        names = [own.name for own in leg.freedoms] if chain is None else chain.coordinate_names
        freedoms = leg.freedoms if chain is None else chain.freedoms
        yield from zip((f"{leg.name}/{name}" for name in names), freedoms, strict=True)


def factors(text: str) -> np.ndarray:
    """Multiples of a wrench (n,)."""
    dimensions, names = [Dimension.NUMBER] * 3, ["START", "STOP", "COUNT"]
    start, stop, count = parse_quantities(text, dimensions, names, "--factors")
    if not (count == int(count) and 1 <= count <= _MOST_FACTORS):
        raise InputError("--factors", got=text, expected=f"a whole COUNT from 1 to {_MOST_FACTORS}")
    return np.linspace(start, stop, int(count))


def network_loads(
    at_nodes: tuple[str, ...],
    along_beams: tuple[str, ...],
    forces_on_beams: tuple[str, ...],
    space: Space,
) -> dict[str, Any]:
    """Loads on nodes and beams, by their names."""
    nodes = named_once("--load", at_nodes, _FOR_NETWORKS)
    loads: dict[str, Any] = {n: _force_or_wrench(own, space) for n, own in nodes.items()}
    on_beams: dict[str, list[DistributedForce | ForceOnBeam]] = {}
    for name, values in named_values("--along", along_beams, _FOR_NETWORKS):
        q = _row("--along", values, dict.fromkeys(("qx", "qy", "qz"), Dimension.FORCE_PER_LENGTH))
        on_beams.setdefault(name, []).append(DistributedForce(q))
    for name, values in named_values("--on", forces_on_beams, _FOR_NETWORKS):
        numbers = {"s": Dimension.LENGTH, **dict.fromkeys(_FORCE, Dimension.FORCE)}
        s, *force = _row("--on", values, numbers)
        on_beams.setdefault(name, []).append(ForceOnBeam(force, s))
    for name in on_beams.keys() & loads.keys():
        raise InputError("--load", got=name, expected="the name of a node, which no beam has")
    return loads | on_beams


def settlements(written: tuple[str, ...], space: Space) -> dict[str, list[float]]:
    """Twists of fixed nodes [m, rad], by their names."""
    moved = named_once("--settle", written, _FOR_NETWORKS)
    lengths = [Dimension.LENGTH if u == "m" else Dimension.ANGLE for u in space.twist_units]
    twist = dict(zip(space.twist_order, lengths, strict=True))
    return {name: _row("--settle", values, twist) for name, values in moved.items()}


def _row(option: str, text: str, numbers: Mapping[str, Dimension]) -> list[float]:
    return parse_quantities(text, list(numbers.values()), list(numbers), option)


def _force_or_wrench(text: str, space: Space) -> list[float]:
    """Three forces, or in space three forces and three moments."""
    wrench = dict(zip(space.wrench_order, arguments.load_dimensions(space), strict=True))
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
