"""Poses, points and loads as they are written on the command line."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any, TypeVar

import numpy as np

from robostiff.cli.options import Loads, Model, Posing, named_once, named_values
from robostiff.errors import InputError, Location, Words
from robostiff.io.suggest import did_you_mean
from robostiff.io.units import Dimension, parse_quantities, question, to_si
from robostiff.kinematics import ActuatorCoordinates, JointCoordinates, ToolPose, actuator_names
from robostiff.kinematics.pose import home_coordinates
from robostiff.model import Actuated, Coordinate, Mass
from robostiff.spatial import Space


def load_machine(
    model: Model,
    place: Posing | None = None,
    *,
    by_joints: bool = False,
    moved: Mapping[str, str] | None = None,
) -> Any:
    """The robot of a name or file; its linkage where joints move a network, or legs `by_joints`.

    Without a place, as for maps and views, a network is to be moved; parameters are `moved`, too.
    """
    robot = model.load(moved)
    is_moved = place is None or place.joints is not None or place.pose is not None
    if is_moved and (robot.is_frozen or by_joints):
        from robostiff.robots.descriptions import describes_bodies, load_linkage

        # an arm has its joints as they are
        if describes_bodies(model.source) and not getattr(robot, "is_serial", False):
            parameters, options = {**model.parameters, **(moved or {})}, model.files
            return load_linkage(model.source, parameters, **options)
    return robot


def check_kind(machine: Any, kinds: Collection[str], subject: str, **words: Any) -> None:
    """Raise an InputError, with these words, where a machine is of none of these kinds."""
    if machine.kind not in kinds:
        raise InputError(subject, got=Words(f"a {machine.kind}"), **words)


def pose(robot: Any, place: Posing) -> Any:
    """The pose of a machine of any kind, as the library takes it; None for its own."""
    if place.pose is not None and place.joints is not None:
        raise InputError("--pose and --joints", expected="one of them")
    text = place.joints if place.pose is None else place.pose
    if text is None:
        return None
    option = "--joints" if place.pose is None else "--pose"
    if robot.is_frozen:
        expected = f"none: a {robot.kind} is frozen at its own pose"
        hint = "describe the robot in a model file to move it"
        raise InputError(option, got=text, expected=expected, hint=hint)
    if option == "--joints":
        if robot.kind not in ("robot", "linkage"):
            raise InputError(option, got=text, expected="--pose: cables have no joints")
        return _by_joints(robot, text)
    if not (robot.coordinates or hasattr(robot, "legs")):
        expected = f"--joints: a {robot.kind} is moved by its joints"
        raise InputError(option, got=text, expected=expected)
    if text.split()[:1] == ["tip"]:
        return _tool_pose(text)
    names = [coordinate.value for coordinate in robot.coordinates]
    free = {name: _SIX[name] for name in names} or _SIX
    if "=" in text:
        home = dict(zip(_SIX, home_coordinates(robot).tolist(), strict=True))
        return np.array(_some_by_name("--pose", text, free, home))
    return np.array(_few_or_all("--pose", text, free, _SIX))


_SIX = {coordinate.value: Dimension.of(coordinate.unit) for coordinate in Coordinate}


def six_coordinates(text: str, option: str) -> list[float]:
    """A place and a rotation vector (6,) [m, rad]."""
    return _row(option, text, _SIX)


_TOOL_POSE = re.compile(r"\s*tip\s(?P<tip>.+?)\saxis\s(?P<axis>.+?)(?:\sspin\s(?P<spin>.+))?\s*$")


def _tool_pose(text: str) -> ToolPose:
    """Tip and axis of the tool, and the turn about it: ``tip 0.1 0 -1.6 axis 0 0.1 1``."""
    match = _TOOL_POSE.match(text)
    if match is None:
        raise InputError("--pose", got=text, expected="tip x y z axis i j k, or with spin ANGLE")
    tip = three_lengths(match["tip"], "--pose tip")
    axis = _row("--pose axis", match["axis"], dict.fromkeys("ijk", Dimension.NUMBER))
    if match["spin"] is None:
        return ToolPose(tip, axis)
    (spin,) = _row("--pose spin", match["spin"], {"spin": Dimension.ANGLE})
    return ToolPose(tip, axis, spin=spin)


def _few_or_all(
    option: str, text: str, few: Mapping[str, Dimension], whole: Mapping[str, Dimension]
) -> list[float]:
    """Some coordinates or components, or all of them, as their number says."""
    try:
        return _row(option, text, few)
    except InputError as of_few:
        if few == whole:
            raise
        try:
            return _row(option, text, whole)
        except InputError as of_all:
            for error in (of_all, of_few):
                if error.subject != option:  # one of the numbers, and not how many they are
                    raise error from None
            count = f"{len(few)} numbers ({' '.join(few)}) or {len(whole)} ({' '.join(whole)})"
            raise InputError(option, got=text, expected=count) from None


def _by_joints(robot: Any, text: str) -> Any:
    """Some joints by name; or all of a serial arm, the actuated ones of any other machine."""
    is_linkage, is_arm, by_name = robot.kind == "linkage", False, "=" in text
    if is_linkage:
        units = {j.name: [Dimension.of(s.unit) for s in j.freedoms] for j in robot.joints}
        driven = [joint.name for joint in robot.joints if isinstance(joint.role, Actuated)]
        names = list(units) if by_name else driven
    else:
        units = {name: [dimension] for name, dimension in _dimensions(robot).items()}
        is_arm = not by_name and robot.is_serial and not robot.legs[0].chain.has_blocks
        names = list(units) if is_arm else list(actuator_names(robot))
    if by_name:
        numbers = _numbers_by_name("--joints", text, {name: units[name] for name in names})
    else:
        pairs = [(name, dimension) for name in names for dimension in units[name]]
        words, dimensions = [name for name, _ in pairs], [dimension for _, dimension in pairs]
        entries = iter(parse_quantities(text, dimensions, words, "--joints"))
        numbers = {name: [next(entries) for _ in units[name]] for name in names}
    values = {name: q[0] if len(q) == 1 else q for name, q in numbers.items()}
    if is_linkage:
        return values
    if by_name:
        return ActuatorCoordinates(values)
    return (JointCoordinates if is_arm else ActuatorCoordinates)(list(values.values()))


def _numbers_by_name(
    option: str, text: str, units: Mapping[str, Sequence[Dimension]]
) -> dict[str, list[float]]:
    """Some numbers by their names: ``slide=20 mm, turn=3 deg``."""
    numbers: dict[str, list[float]] = {}
    for part in text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if "=" in value:
            raise InputError(
                option, got=part.strip(), expected="a comma before each further NAME=VALUE"
            )
        if not equals or name not in units or name in numbers:
            expected = f"NAME=VALUE, each name once: {', '.join(units)}"
            hint = None if name in units else did_you_mean(name, units)
            raise InputError(option, got=part.strip(), expected=expected, hint=hint)
        numbers[name] = parse_quantities(value, units[name], [name] * len(units[name]), option)
    return numbers


def _some_by_name(
    option: str, text: str, units: Mapping[str, Dimension], others: Mapping[str, float]
) -> list[float]:
    """Numbers in the order of their units, of which those left out are as in `others`."""
    given = _numbers_by_name(option, text, {name: [dimension] for name, dimension in units.items()})
    return [given[name][0] if name in given else others[name] for name in units]


def gravity(text: str | None) -> str | list[float] | None:
    """Acceleration of free fall, as three numbers or the name of an axis."""
    if text is None or text.strip().lstrip("+-") in {"x", "y", "z"}:
        return text
    return _row("--gravity", text, dict.fromkeys(("gx", "gy", "gz"), Dimension.ACCELERATION))


def near(robot: Any, place: Posing) -> list[float] | None:
    """Joint coordinates that choose a posture."""
    if place.near is None:
        return None
    if robot.is_frozen or not hasattr(robot, "legs"):
        expected = "none: only robots of joints and legs have postures"
        raise InputError("--near", got=place.near, expected=expected)
    return _row("--near", place.near, _dimensions(robot))  # of all legs, one after the other


def _dimensions(robot: Any) -> dict[str, Dimension]:
    """What each coordinate of all legs measures, by its name."""
    return {
        name if robot.is_serial else f"{leg.name}/{name}": Dimension.of(screw.unit)
        for leg in robot.legs
        for screw, name in zip(leg.chain.freedoms, leg.chain.coordinate_names, strict=True)
    }


def three_lengths(text: str, option: str) -> list[float]:
    """A place (3,) [m]."""
    point = _row(option, text, dict.fromkeys("xyz", Dimension.LENGTH))
    question(max(point, key=abs), Dimension.LENGTH, lambda _: Location(option))
    return point


def force(text: str, option: str) -> list[float]:
    """A force (3,) [N]."""
    return _row(option, text, dict.fromkeys(("Fx", "Fy", "Fz"), Dimension.FORCE))


def wrench(text: str | None, space: Space, option: str = "--wrench") -> Any:
    """A load, from forces and moments with units, all or some by name; None without one."""
    if text is None:
        return None
    units = _of_wrench(space)
    if "=" not in text:
        return _row(option, text, units)
    return _some_by_name(option, text, units, dict.fromkeys(units, 0.0))


def _of_wrench(space: Space) -> dict[str, Dimension]:
    return dict(zip(space.wrench_order, map(Dimension.of, space.wrench_units), strict=True))


def _row(option: str, text: str, numbers: Mapping[str, Dimension]) -> list[float]:
    return parse_quantities(text, list(numbers.values()), list(numbers), option)


def length(text: str | None, option: str = "--length") -> float | None:
    """A length; None without one."""
    if text is None:
        return None
    (value,) = _row(option, text, {option.removeprefix("--"): Dimension.LENGTH})
    question(value, Dimension.LENGTH, lambda _: Location(option))
    return value


def where(robot: Any, place: Posing) -> dict[str, Any]:
    """Pose, point and posture, as `robostiff.stiffness` takes them."""
    return {
        "pose": pose(robot, place),
        "at": None if place.at is None else three_lengths(place.at, "--at"),
        "near": near(robot, place),
    }


_Chosen = TypeVar("_Chosen")


def choice(option: str, name: str, allowed: Mapping[str, _Chosen]) -> _Chosen:
    """What a name stands for; InputError when it is none of those allowed."""
    if name not in allowed:
        expected, hint = ", ".join(allowed), did_you_mean(name, tuple(allowed))
        raise InputError(option, got=name, expected=expected, hint=hint)
    return allowed[name]


_MOST_FACTORS = 1000
_FORCE: dict[str, Dimension] = dict.fromkeys(("fx", "fy", "fz"), Dimension.FORCE)
_FOR_NETWORKS = "NAME=NUMBERS, such as tip=0 0 -80 N"
_EXPECTED = "LEG/PART=VALUE, such as "
_SUCH_AS = {
    "--weight": '"leg1/strut=12 kg"',
    "--mass": '"leg1/strut=12 kg"',
    "--load": '"leg1/strut=0 0 -80 N"',
    "--preload": '"leg1/strut=2 kN"',
}


def loading(robot: Any, place: Posing, written: Loads) -> dict[str, Any]:
    """Place, loads beside the wrench, and preloads: forces of slides, moments of turns."""
    options = {
        **where(robot, place),
        "loads": body_loads(written),
        "gravity": gravity(written.gravity),
        "preload": {},
    }
    turns: dict[str, bool] = {}  # by the names of joints, as preloads name them
    for joint in getattr(robot, "joints", ()):
        turns |= {getattr(freedom, "name", joint.name): freedom.turns for freedom in joint.freedoms}
    for leg in getattr(robot, "legs", ()):
        chain = getattr(leg, "chain", None)
        names = [f.name for f in leg.freedoms] if chain is None else chain.coordinate_names
        freedoms = leg.freedoms if chain is None else chain.freedoms
        pairs = zip(names, freedoms, strict=True)
        turns |= {f"{leg.name}/{name}": screw.turns for name, screw in pairs}
    expected = _EXPECTED + _SUCH_AS["--preload"]
    for pattern, text in named_once("--preload", written.preloads, expected).items():
        fits = () if pattern in turns else [name for name in turns if fnmatchcase(name, pattern)]
        for name in fits or [pattern]:  # a name that is none is refused where the joints are
            dimension = Dimension.MOMENT if turns.get(name, False) else Dimension.FORCE
            options["preload"][name] = to_si(text, dimension, subject=f"--preload of {name!r}")
    if written.elements is not None:
        from robostiff.statics import Bowing

        options["beams"] = Bowing(written.elements)
    return options


def body_loads(written: Loads) -> dict[str, list[Any]]:
    """Weights and forces by the names of parts."""
    from robostiff.statics import DeadForce

    weights = by_part("--weight", written.weights, lambda text: Mass(kilograms(text)))
    forces = by_part("--load", written.forces, lambda text: DeadForce(_row("--load", text, _FORCE)))
    return {name: weights.get(name, []) + forces.get(name, []) for name in weights | forces}


def by_part(
    option: str, texts: tuple[str, ...], read: Callable[[str], Any]
) -> dict[str, list[Any]]:
    """What is written for parts, by their names."""
    by_name: dict[str, list[Any]] = {}
    for name, value in named_values(option, texts, _EXPECTED + _SUCH_AS[option]):
        try:
            by_name.setdefault(name, []).append(read(value))
        except InputError as error:
            where = f"{option} of {name!r}: {error.subject.removeprefix(option).lstrip(', ')}"
            raise InputError(
                where.removesuffix(": "), got=error.got, expected=error.expected, hint=error.hint
            ) from None
    return by_name


def kilograms(text: str) -> float:
    """A mass [kg]."""
    return to_si(text, Dimension.MASS, subject="mass")


def factors(text: str) -> np.ndarray:
    """Multiples of a wrench (n,)."""
    names = ("START", "STOP", "COUNT")
    start, stop, count = _row("--factors", text, dict.fromkeys(names, Dimension.NUMBER))
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
    from robostiff.network import DistributedForce, ForceOnBeam

    wrench = _of_wrench(space)
    force = {name: wrench[name] for name in space.wrench_order[:3]}
    nodes = named_once("--load", at_nodes, _FOR_NETWORKS)
    loads: dict[str, Any] = {
        name: _few_or_all("--load", text, force, wrench) for name, text in nodes.items()
    }
    on_beams: dict[str, list[DistributedForce | ForceOnBeam]] = {}
    for name, values in named_values("--along", along_beams, _FOR_NETWORKS):
        q = _row("--along", values, dict.fromkeys(("qx", "qy", "qz"), Dimension.FORCE_PER_LENGTH))
        on_beams.setdefault(name, []).append(DistributedForce(q))
    for name, values in named_values("--on", forces_on_beams, _FOR_NETWORKS):
        s, *F = _row("--on", values, {"s": Dimension.LENGTH, **_FORCE})
        on_beams.setdefault(name, []).append(ForceOnBeam(F, s))
    for name in on_beams.keys() & loads.keys():
        raise InputError("--load", got=name, expected="the name of a node, which no beam has")
    return loads | on_beams


def settlements(written: tuple[str, ...], space: Space) -> dict[str, list[float]]:
    """Twists of fixed nodes [m, rad], by their names."""
    moved = named_once("--settle", written, _FOR_NETWORKS)
    twist = dict(zip(space.twist_order, map(Dimension.of, space.twist_units), strict=True))
    return {name: _row("--settle", values, twist) for name, values in moved.items()}
