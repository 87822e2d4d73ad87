"""The commands ``equilibrium`` and ``modes``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import numpy as np

from robostiff.cli.answer_commands import Vibration, Wanted, WrittenLoads
from robostiff.cli.command import BAD_STATUS
from robostiff.cli.options import Answer, Model, Place, Replacing, named_once, named_values
from robostiff.cli.output import print_data, say
from robostiff.cli.pictures import draw, picture_beside
from robostiff.cli.written_arguments import (
    gravity_from,
    near_from,
    point_from,
    pose_from,
    wrench_from,
)
from robostiff.errors import InputError
from robostiff.io.results.equilibrium import equilibrium_data, equilibrium_text
from robostiff.io.units import Dimension, parse_quantities, to_si
from robostiff.model import Mass, PlacedLeg, Robot, Snapshot
from robostiff.network import Network
from robostiff.spatial import Screw
from robostiff.statics import DeadForce, Equilibrium, critical_load, equilibrium, load_path, modes

_MOST_FACTORS = 1000


def print_equilibrium(
    model: Model,
    place: Place,
    written: WrittenLoads,
    wanted: Wanted,
    replacing: Replacing,
    answer: Answer,
) -> int:
    """Print where a robot comes to rest under loads; 1 for a bad status."""
    robot, source = model.load(), model.source
    if not isinstance(robot, Robot | Snapshot | Network):
        raise InputError(
            f"equilibrium of {source!r}",
            got=type(robot).__name__,
            expected="a robot or a snapshot of legs, or a network",
            hint=f"cables have 'robostiff cables {source} --wrench ...'",
        )
    F = None if written.wrench is None else wrench_from(written.wrench, robot.space)
    for option, asked in (("--critical", wanted.critical), ("--factors", wanted.factors)):
        if F is None and asked:
            raise InputError(option, expected='--wrench beside it, such as "0 0 -1 kN 0 0 0"')
    picture = picture_beside(wanted.plot, replacing)
    options = _options(robot, place, written)
    pose = pose_from(robot, place)
    factors = None if wanted.factors is None else _factors(wanted.factors)
    result = cast("Equilibrium", equilibrium(robot, pose, F, **options))  # of one pose
    critical = curve = None
    if wanted.critical:
        critical = critical_load(robot, pose, F or (), **options)
    if factors is not None:
        curve = load_path(robot, pose, F or (), factors, **options)
    if picture is not None:
        from robostiff.plot.load_curve import load_curve_picture
        from robostiff.plot.loaded_robot import equilibrium_picture

        draw(equilibrium_picture(result) if curve is None else load_curve_picture(curve), picture)
    if answer.as_json:
        print_data(equilibrium_data(result, critical, curve))
    else:
        text = equilibrium_text(result, critical)
        say(text if curve is None else f"{text}\n\n{_curve_text(curve)}")
    return BAD_STATUS if result.status.is_bad else 0


def print_modes(
    model: Model,
    place: Place,
    shown: Vibration,
    written: WrittenLoads,
    replacing: Replacing,
    answer: Answer,
) -> int:
    """Print how a robot vibrates about its equilibrium; 1 for a bad status."""
    from robostiff.io.results.equilibrium import modes_data, modes_text

    picture = picture_beside(shown.plot, replacing)
    robot = model.load()
    if not isinstance(robot, Robot | Snapshot | Network):
        raise InputError(
            f"modes of {model.source!r}",
            got=type(robot).__name__,
            expected="a robot or a snapshot of legs, or a network",
        )
    F = None if written.wrench is None else wrench_from(written.wrench, robot.space)
    moving: dict[str, list[float]] = {}
    for name, mass in _named("--mass", shown.masses, _kilograms):
        moving.setdefault(name, []).append(mass)
    pose = pose_from(robot, place)
    found = modes(robot, pose, moving, wrench=F, **_options(robot, place, written))
    if picture is not None:
        from robostiff.plot.loaded_robot import mode_picture

        number = shown.number
        draw(mode_picture(found, number), picture, mode_picture(found, number, -1.0))
    if answer.as_json:
        print_data(modes_data(found))
    else:
        say(modes_text(found))
    return BAD_STATUS if found.status.is_bad else 0


def _options(
    robot: Robot | Snapshot | Network, place: Place, written: WrittenLoads
) -> dict[str, Any]:
    """Loads beside the wrench, and where they act."""
    return {
        "at": point_from(place),
        "loads": _loads(written),
        "gravity": gravity_from(written.gravity),
        "preload": _pushes(robot, written.preloads),
        "near": near_from(robot, place),
    }


def _curve_text(curve: Any) -> str:
    from robostiff.markup import row
    from robostiff.statics import EquilibriumStatus

    lines = [f"{'factor':>10}  displacement ({' '.join(map(str, curve.twist.values))}) [m, rad]"]
    rows = zip(
        curve.factor.values, curve.displacement.values, curve.status_code.values, strict=True
    )
    for factor, moved, code in rows:
        status = EquilibriumStatus(int(code))
        words = "none" if np.isnan(moved).any() else row(moved)
        lines.append(f"{factor:10.5g}  {words}" + (f"  {status}" if status else ""))
    return "\n".join(lines)


def _loads(written: WrittenLoads) -> dict[str, list[Mass | DeadForce]]:
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
    force = parse_quantities(text, [Dimension.FORCE] * 3, ["fx", "fy", "fz"], "--load")
    return DeadForce(force)


def _pushes(robot: Robot | Snapshot | Network, texts: tuple[str, ...]) -> dict[str, float]:
    """Preloads of joints: forces of slides, moments of turns."""
    moments = {name: screw.turns for name, screw in _freedoms(robot)}

    def push(name: str, text: str) -> float:
        # A name that is none is refused where the joints are.
        turns = moments.get(name, False)
        return to_si(text, Dimension.MOMENT if turns else Dimension.FORCE, subject="--preload")

    given = named_once("--preload", texts, _expected("--preload"))
    return {name: push(name, value) for name, value in given.items()}


def _freedoms(robot: Robot | Snapshot | Network) -> Iterator[tuple[str, Screw]]:
    """Freedoms by the names of their joints, as preloads name them."""
    if isinstance(robot, Network):
        for joint in robot.joints:
            yield from ((own.name, own) for own in joint.freedoms)
        return
    for leg in robot.legs:
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
