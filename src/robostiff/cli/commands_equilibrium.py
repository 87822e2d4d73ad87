"""The commands ``equilibrium`` and ``modes``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import numpy as np

from robostiff.cli.answer_commands import Vibration, Wanted, WrittenLoads
from robostiff.cli.command import answered
from robostiff.cli.options import Answer, Model, Place, Replacing, named_once, named_values
from robostiff.cli.output import draw, picture_beside
from robostiff.cli.written_arguments import (
    gravity_from,
    loaded,
    where_from,
    wrench_from,
)
from robostiff.errors import InputError
from robostiff.io.results.equilibrium import equilibrium_data, equilibrium_text
from robostiff.io.units import Dimension, parse_quantities, to_si
from robostiff.linkage import Linkage
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
    robot, source = loaded(model, place), model.source
    if not isinstance(robot, Robot | Snapshot | Network | Linkage):
        raise InputError(
            f"equilibrium of {source!r}",
            got=type(robot).__name__,
            expected="a robot or a snapshot of legs, a network or a linkage",
            hint=f"cables have 'robostiff cables {source} --wrench ...'",
        )
    F = None if written.wrench is None else wrench_from(written.wrench, robot.space)
    for option, asked in (("--critical", wanted.critical), ("--factors", wanted.factors)):
        if F is None and asked:
            raise InputError(option, expected='--wrench beside it, such as "0 0 -1 kN 0 0 0"')
    picture = picture_beside(wanted.plot, replacing)
    options = _options(robot, place, written)
    factors = None if wanted.factors is None else _factors(wanted.factors)
    result = cast("Equilibrium", equilibrium(robot, wrench=F, **options))  # of one pose
    critical = curve = None
    if wanted.critical:
        critical = critical_load(robot, wrench=F or (), **options)
    if factors is not None:
        curve = load_path(robot, wrench=F or (), factors=factors, **options)
    if picture is not None:
        from robostiff.plot.loaded_robot import equilibrium_picture, load_curve_picture

        draw(equilibrium_picture(result) if curve is None else load_curve_picture(curve), picture)
    return answered(
        result,
        answer,
        lambda own: equilibrium_data(own, critical, curve),
        lambda own: "\n\n".join(
            [equilibrium_text(own, critical), *(() if curve is None else (_curve_text(curve),))]
        ),
    )


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
    robot = loaded(model, place)
    if not isinstance(robot, Robot | Snapshot | Network | Linkage):
        raise InputError(
            f"modes of {model.source!r}",
            got=type(robot).__name__,
            expected="a robot or a snapshot of legs, a network or a linkage",
        )
    F = None if written.wrench is None else wrench_from(written.wrench, robot.space)
    moving: dict[str, list[float]] = {}
    for name, mass in _named("--mass", shown.masses, _kilograms):
        moving.setdefault(name, []).append(mass)
    found = modes(robot, masses=moving, wrench=F, **_options(robot, place, written))
    if picture is not None:
        from robostiff.plot.loaded_robot import mode_picture

        number = shown.number
        draw(mode_picture(found, number), picture, mode_picture(found, number, -1.0))
    return answered(found, answer, modes_data, modes_text)


def _options(
    robot: Robot | Snapshot | Network | Linkage, place: Place, written: WrittenLoads
) -> dict[str, Any]:
    """Place, and loads beside the wrench."""
    return {
        **where_from(robot, place),
        "loads": body_loads(written),
        "gravity": gravity_from(written.gravity),
        "preload": _pushes(robot, written.preloads),
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
    force = parse_quantities(text, [Dimension.FORCE] * 3, ["fx", "fy", "fz"], "--load")
    return DeadForce(force)


def _pushes(
    robot: Robot | Snapshot | Network | Linkage, texts: tuple[str, ...]
) -> dict[str, float]:
    """Preloads of joints: forces of slides, moments of turns."""
    moments = {name: screw.turns for name, screw in _freedoms(robot)}

    def push(name: str, text: str) -> float:
        # A name that is none is refused where the joints are.
        turns = moments.get(name, False)
        return to_si(text, Dimension.MOMENT if turns else Dimension.FORCE, subject="--preload")

    given = named_once("--preload", texts, _expected("--preload"))
    return {name: push(name, value) for name, value in given.items()}


def _freedoms(robot: Robot | Snapshot | Network | Linkage) -> Iterator[tuple[str, Screw]]:
    """Freedoms by the names of their joints, as preloads name them."""
    if isinstance(robot, Linkage):
        yield from ((joint.name, own) for joint in robot.joints for own in joint.freedoms)
        return
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
