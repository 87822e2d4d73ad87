"""The commands ``equilibrium``, ``modes`` and ``response``: loads on a robot or a network."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import numpy as np

from robostiff.cli.command import answered
from robostiff.cli.options import Posing, named_once, named_values
from robostiff.cli.options_of_answers import (
    PrintEquilibrium,
    PrintModes,
    PrintResponse,
    WrittenLoads,
)
from robostiff.cli.output import draw, picture_beside
from robostiff.cli.written_arguments import (
    gravity_from,
    load_dimensions,
    loaded,
    where_from,
    wrench_from,
)
from robostiff.errors import InputError, Words
from robostiff.io.units import Dimension, parse_quantities, to_si
from robostiff.linkage import Linkage
from robostiff.model import Mass, PlacedLeg
from robostiff.model.cable import CableRobot
from robostiff.network import DistributedForce, ForceOnBeam, Network
from robostiff.page.loads import equilibrium_page, modes_page
from robostiff.spatial import Screw, Space
from robostiff.statics import DeadForce, Equilibrium, critical_load, equilibrium, load_path, modes

_MOST_FACTORS = 1000
_FORCE = ("fx", "fy", "fz")
_FOR_NETWORKS = "NAME=NUMBERS, such as tip=0 0 -80 N"


def print_equilibrium(asked: PrintEquilibrium) -> int:
    """Print where a robot comes to rest under loads; 1 for a bad status."""
    robot, written = loaded(asked.model, asked.place), asked.loads
    F = None if written.wrench is None else wrench_from(written.wrench, robot.space)
    for option, own in (("--critical", asked.critical), ("--factors", asked.factors)):
        if F is None and own:
            raise InputError(option, expected='--wrench beside it, such as "0 0 -1 kN 0 0 0"')
    picture = picture_beside(asked.plot, asked.answer, is_scene=asked.factors is None)
    options = _options(robot, asked.place, written)
    factors = None if asked.factors is None else _factors(asked.factors)
    result = cast("Equilibrium", equilibrium(robot, wrench=F, **options))  # of one pose
    critical = curve = None
    if asked.critical:
        critical = critical_load(robot, wrench=F or (), **options)
    if factors is not None:
        curve = load_path(robot, wrench=F or (), factors=factors, **options)
    if picture is not None:
        from robostiff import plot

        data = plot.PictureData()
        if curve is None:
            draw(plot.equilibrium(result, backend=data), picture)
        else:
            draw(plot.load_curve(curve, backend=data), picture)
    return answered(equilibrium_page(result, critical, curve), asked.answer)


def print_modes(asked: PrintModes) -> int:
    """Print how a robot vibrates about its equilibrium; 1 for a bad status."""
    from robostiff.page.facts import masses_at_home, masses_in_words

    picture = picture_beside(asked.plot, asked.answer)
    robot, written = loaded(asked.model, asked.place), asked.loads
    F = None if written.wrench is None else wrench_from(written.wrench, robot.space)
    moving: dict[str, list[float]] = {}
    for name, mass in _named("--mass", asked.masses, _kilograms):
        moving.setdefault(name, []).append(mass)
    found = modes(robot, masses=moving, wrench=F, **_options(robot, asked.place, written))
    if picture is not None:
        from robostiff import plot

        number = asked.number
        data = plot.PictureData()
        other_end = plot.mode(found, number, -1.0, backend=data)
        draw(plot.mode(found, number, backend=data), picture, other_end)
    masses = masses_at_home(robot)
    words = masses_in_words(masses, "masses of the model")
    return answered(modes_page(found, masses.get("masses"), tuple(words)), asked.answer)


def _options(robot: Any, place: Posing, written: WrittenLoads) -> dict[str, Any]:
    """Place, and loads beside the wrench."""
    return {
        **where_from(robot, place),
        "loads": body_loads(written),
        "gravity": gravity_from(written.gravity),
        "preload": _pushes(robot, written.preloads),
    }


def body_loads(written: WrittenLoads) -> dict[str, list[Mass | DeadForce]]:
    """Weights and forces by the names of parts."""
    loads: dict[str, list[Mass | DeadForce]] = {}
    for name, mass in _named("--weight", written.weights, lambda text: Mass(_kilograms(text))):
        loads.setdefault(name, []).append(mass)
    for name, force in _named("--load", written.forces, _force):
        loads.setdefault(name, []).append(force)
    return loads


def _named(option: str, texts: tuple[str, ...], read: Any) -> list[tuple[str, Any]]:
    found = []
    for name, value in named_values(option, texts, _expected(option)):
        try:
            found.append((name, read(value)))
        except InputError as error:
            where = f"{option} of {name!r}: {error.subject.removeprefix(option).lstrip(', ')}"
            raise InputError(
                where.removesuffix(": "), got=error.got, expected=error.expected, hint=error.hint
            ) from None
    return found


def _expected(option: str) -> str:
    return f"LEG/PART=VALUE, such as {_SUCH_AS[option]}"


_SUCH_AS = {
    "--weight": '"leg1/strut=12 kg"',
    "--mass": '"leg1/strut=12 kg"',
    "--load": '"leg1/strut=0 0 -80 N"',
    "--preload": '"leg1/strut=2 kN"',
}


def _kilograms(text: str) -> float:
    return to_si(text, Dimension.MASS, subject="mass")


def _force(text: str) -> DeadForce:
    return DeadForce(parse_quantities(text, [Dimension.FORCE] * 3, _FORCE, "--load"))


def _pushes(robot: Any, texts: tuple[str, ...]) -> dict[str, float]:
    """Preloads of joints: forces of slides, moments of turns."""
    moments = {name: screw.turns for name, screw in _freedoms(robot)}

    def push(name: str, text: str) -> float:
        # A name that is none is refused where the joints are.
        turns = moments.get(name, False)
        return to_si(text, Dimension.MOMENT if turns else Dimension.FORCE, subject="--preload")

    given = named_once("--preload", texts, _expected("--preload"))
    return {name: push(name, value) for name, value in given.items()}


def _freedoms(robot: Any) -> Iterator[tuple[str, Screw]]:
    """Freedoms by the names of their joints, as preloads name them."""
    if isinstance(robot, Linkage):
        yield from ((joint.name, own) for joint in robot.joints for own in joint.freedoms)
        return
    if isinstance(robot, Network):
        for joint in robot.joints:
            yield from ((own.name, own) for own in joint.freedoms)
        return
    for leg in () if isinstance(robot, CableRobot) else robot.legs:
        if isinstance(leg, PlacedLeg):
            yield from ((f"{leg.name}/{own.name}", own) for own in leg.freedoms)
        else:
            names = (f"{leg.name}/{name}" for name in leg.chain.coordinate_names)
            yield from zip(names, leg.chain.freedoms, strict=True)


def _factors(text: str) -> np.ndarray:
    dimensions, names = [Dimension.NUMBER] * 3, ["START", "STOP", "COUNT"]
    start, stop, count = parse_quantities(text, dimensions, names, "--factors")
    if not (count == int(count) and 1 <= count <= _MOST_FACTORS):
        raise InputError("--factors", got=text, expected=f"a whole COUNT from 1 to {_MOST_FACTORS}")
    return np.linspace(start, stop, int(count))


def print_response(asked: PrintResponse) -> int:
    """Print how a network answers its loads."""
    from robostiff.network import network_response
    from robostiff.page.loads import response_page
    from robostiff.robots import load

    source, network = asked.source, load(asked.source)
    if not isinstance(network, Network):
        raise InputError(
            f"response of {source!r}",
            got=Words("cables" if isinstance(network, CableRobot) else "legs"),
            expected="a network: a snapshot file with a graph",
            hint=f"write 'robostiff cables {source} --wrench ...'"
            if isinstance(network, CableRobot)
            else f"write one: robostiff convert {source} --to graph -o network.json",
        )
    loads = _network_loads(asked, network.space)
    moved = named_once("--settle", asked.settlements, _FOR_NETWORKS)
    lengths = [Dimension.LENGTH if u == "m" else Dimension.ANGLE for u in network.space.twist_units]
    twist = dict(zip(network.space.twist_order, lengths, strict=True))
    settlements = {name: _row("--settle", values, twist) for name, values in moved.items()}
    if not loads and not settlements:
        raise InputError(
            f"loads of {source!r}", got="none", expected="--load, --along, --on or --settle"
        )
    result = network_response(network, loads, settlements=settlements)
    return answered(response_page(result), asked.answer)


Row = dict[str, Dimension]


def _network_loads(written: PrintResponse, space: Space) -> dict[str, Any]:
    at_nodes = named_once("--load", written.at_nodes, _FOR_NETWORKS)
    loads: dict[str, Any] = {n: _force_or_wrench(own, space) for n, own in at_nodes.items()}
    on_beams: dict[str, list[DistributedForce | ForceOnBeam]] = {}
    for name, values in named_values("--along", written.along_beams, _FOR_NETWORKS):
        q = _row("--along", values, dict.fromkeys(("qx", "qy", "qz"), Dimension.FORCE_PER_LENGTH))
        on_beams.setdefault(name, []).append(DistributedForce(q))
    for name, values in named_values("--on", written.on_beams, _FOR_NETWORKS):
        numbers = {"s": Dimension.LENGTH, **dict.fromkeys(_FORCE, Dimension.FORCE)}
        s, *force = _row("--on", values, numbers)
        on_beams.setdefault(name, []).append(ForceOnBeam(force, s))
    for name in on_beams.keys() & loads.keys():
        raise InputError("--load", got=name, expected="the name of a node, which no beam has")
    return loads | on_beams


def _row(option: str, text: str, numbers: Row) -> list[float]:
    return parse_quantities(text, list(numbers.values()), list(numbers), option)


def _force_or_wrench(text: str, space: Space) -> list[float]:
    """Three forces, or in space three forces and three moments."""
    wrench = dict(zip(space.wrench_order, load_dimensions(space), strict=True))
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
