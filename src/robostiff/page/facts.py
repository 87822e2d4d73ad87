"""Contents of a robot, a snapshot or a network."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import singledispatch
from typing import Any

import numpy as np

from robostiff.analysis import CableStiffness, Stiffness, cable_stiffness, stiffness
from robostiff.analysis.parts_at_home import part_in_words
from robostiff.elastostatics import Status
from robostiff.kinematics import find_posture, with_body_springs, with_masses
from robostiff.linkage import Linkage
from robostiff.markup import STIFFNESS_UNITS, Block, Bullets, Facts, Page, Table, row
from robostiff.model import Actuated, Joint, Passive, PlacedMass, Robot, Role, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.model.in_words import elements_in_words, placed_in_words
from robostiff.network import Network

#: Of the parts of those that have no legs.
_HEADS = {"network": "parts of the network", "cable robot": "cables at home"}
#: Words whose singular is not their plural without an s.
_ONE = {"bodies": "body"}


def machine_page(machine: Robot | CableRobot | Snapshot | Network | Linkage) -> Page:
    """A machine in short: title, symbols, its parts, free coordinates and source."""
    facts = {
        "symbols": ", ".join(map(str, getattr(machine, "symbols", ()))),
        "free coordinates": " ".join(one.value for one in getattr(machine, "coordinates", ())),
        "source": machine.source,
    }
    blocks: list[Block] = [
        *_parts_of(machine),
        Facts(tuple((name, words) for name, words in facts.items() if words)),
    ]
    return Page(machine.name, f": {machine.title}" if machine.title else "", blocks=blocks)


@singledispatch
def _parts_of(machine: Any) -> list[Block]:
    """Legs, cables, joints, or how many parts there are of each kind."""
    raise TypeError(type(machine).__name__)


@_parts_of.register
def _(robot: Robot) -> list[Block]:
    legs = [[leg.name, ", ".join(elements_in_words(leg.chain))] for leg in robot.legs]
    return [Table(["leg", "from base to platform"], legs)]


@_parts_of.register
def _(snapshot: Snapshot) -> list[Block]:
    legs = [[leg.name, ", ".join(placed_in_words(leg))] for leg in snapshot.legs]
    return [Table(["leg", "from base to platform"], legs)]


@_parts_of.register
def _(robot: CableRobot) -> list[Block]:
    return [Facts((("cables", ", ".join(robot.cable_names)),))]


@_parts_of.register
def _(network: Network) -> list[Block]:
    return [Facts((("parts", _counted(_network_facts(network))),))]


@_parts_of.register
def _(linkage: Linkage) -> list[Block]:
    joints = [
        [own.name, f"{c.a}, {c.b}", own.kind.value, type(own.role).__name__.lower()]
        for c in linkage.connections
        if isinstance(own := c.element, Joint)
    ]
    return [Table(["joint", "between", "kind", "role"], joints)]


def facts_page(facts: Mapping[str, Any]) -> Page:
    """All parts of a robot, its masses, and its stiffness at home.

    Parameters
    ----------
    facts : mapping of str to values
        As of `facts_of`; besides ``mobility``, ``parts``, ``warnings`` and ``picture`` where they
        are known.
    """
    blocks: list[Block] = [Bullets(tuple(_fact_lines(facts)))]
    for leg, parts in facts.get("parts", {}).items():
        head = _HEADS.get(facts["kind"], f"{leg} at home, from base to platform")
        blocks.append(Bullets((head, *(f"  {part_in_words(part)}" for part in parts))))
    blocks.append(Bullets(tuple(_home_lines(facts))))
    place = f": {facts['kind']}, {facts['space']}"
    return Page(facts["name"], place, None, blocks, facts["home"]["advice"], facts)


def facts_of(robot: Robot | CableRobot | Snapshot | Network) -> dict[str, Any]:
    """Plain data, the stiffness at home included.

    Springs between bodies are listed; the stiffness is that of the legs.
    """
    legs: list[dict[str, Any]] = []
    own: dict[str, Any] = {}
    if isinstance(robot, CableRobot):
        kind, home, own = "cable robot", cable_stiffness(robot), {"cables": robot.cable_names}
    elif isinstance(robot, Network):
        kind, home, own = "network", stiffness(robot), _network_facts(robot)
    elif isinstance(robot, Snapshot):
        kind, home = "snapshot", stiffness(robot)
        own = _mass_facts(_masses_of(robot), robot.gravity)
        for leg in robot.legs:
            roles = [one.role for one in leg.freedoms]
            legs.append(_leg(leg.name, placed_in_words(leg), roles))
    else:
        kind, home = "model", stiffness(robot.with_springs())
        own = {} if robot.platform is None else {"platform": _platform_facts(robot)}
        own |= {} if Status.UNREACHABLE in home.status else _placed_facts(robot)
        for leg in robot.legs:
            legs.append(_leg(leg.name, elements_in_words(leg.chain), leg.chain.roles))
    units = {"length": "m", "angle": "rad", "force": "N", "mass": "kg"}
    return {
        "name": robot.name,
        "kind": kind,
        "title": robot.title,
        "source": robot.source,
        "space": robot.space.name.lower(),
        "coordinates": [one.value for one in robot.coordinates],
        "units": {**units, "stiffness": asdict(STIFFNESS_UNITS)},
        "legs": legs,
        **own,
        "home": _home_facts(home),
    }


def _network_facts(network: Network) -> dict[str, Any]:
    freedoms = [f for joint in network.joints for f in joint.freedoms]
    return {
        "bodies": len(network.nodes),
        "beams": len(network.beams),
        "springs": len(network.springs),
        "joints": len(network.joints),
        "passive_freedoms": sum(f.is_passive for f in freedoms),
        "elastic_freedoms": sum(f.stiffness is not None for f in freedoms),
        **_mass_facts(_in_parts(network), network.gravity),
    }


def _platform_facts(robot: Robot) -> dict[str, Any]:
    """Nodes, parts, tool, and the node that holds each leg; nothing for a rigid platform."""
    platform: Any = robot.platform
    names = [leg.name for leg in robot.legs]
    return {
        "nodes": [node.name for node in platform.nodes],
        "parts": [part.name for part in platform.parts],
        "tool": platform.tool,
        "legs": dict(zip(names, robot.holds, strict=True)),
    }


def _leg(name: str, elements: list[str], roles: Sequence[Role]) -> dict[str, Any]:
    passive = sum(isinstance(role, Passive) for role in roles)
    driven = sum(isinstance(role, Actuated) for role in roles)
    return {
        "name": name,
        "elements": elements,
        "passive_freedoms": passive,
        "actuated_freedoms": driven,
    }


def _placed_facts(robot: Robot) -> dict[str, Any]:
    """Masses at home, gravity, springs between bodies."""
    posture = find_posture(robot)
    snapshot = with_masses(posture).one(0)
    facts = _mass_facts(_masses_of(snapshot), snapshot.gravity)
    if robot.springs:
        placed_springs = with_body_springs(posture).one(0).springs
        facts["springs"] = [
            {
                "name": own.name,
                "bodies": list(own.bodies),
                "stiffness": own.stiffness,
                "length": length,
                "tension": own.tension + own.stiffness * (length - own.length),
            }
            for own in placed_springs
            for length in [float(np.linalg.norm(own.points[1] - own.points[0]))]
        ]
    return facts


def _mass_facts(
    masses: Iterable[tuple[str, PlacedMass]], gravity: np.ndarray | None
) -> dict[str, Any]:
    """Masses by names, their sum and centre, and gravity."""
    facts: dict[str, Any] = {}
    parts: dict[str, float] = {}
    moment = np.zeros(3)
    for name, mass in masses:
        parts[name] = parts.get(name, 0.0) + float(mass.value)
        moment = moment + mass.value * mass.centre
    if parts:
        total = sum(parts.values())
        facts["masses"] = {"total": total, "parts": parts}
        if total > 0:
            facts["masses"]["centre"] = (moment / total).tolist()
    if gravity is not None:
        facts["gravity"] = gravity.tolist()
    return facts


def _masses_of(snapshot: Snapshot) -> Iterator[tuple[str, PlacedMass]]:
    return ((f"{owner}/{mass.name}", mass) for owner, mass in snapshot.named_masses)


def _in_parts(network: Network) -> Iterator[tuple[str, PlacedMass]]:
    """Masses of a network; that of a beam has the beam's name."""
    for own in (*network.nodes, *network.beams, *network.springs):
        for mass in own.masses:
            yield own.name if mass.name == own.name else f"{own.name}/{mass.name}", mass


def _home_facts(home: Stiffness | CableStiffness) -> dict[str, Any]:
    """Status, rank and free motions at home."""
    return {
        "status": str(home.status),
        "rank": int(home.rank),
        "free_motions": [str(motion) for motion in home.free_motions],
        "advice": list(home.advice),
    }


def _fact_lines(facts: Mapping[str, Any]) -> Iterator[str]:
    for key in ("title", "source"):
        if facts[key]:
            yield f"{key}: {' '.join(facts[key].split())}"
    if facts["coordinates"]:
        yield f"free coordinates: {' '.join(facts['coordinates'])}"
    for leg in facts["legs"]:
        freedoms = f"{leg['passive_freedoms']} passive, {leg['actuated_freedoms']} actuated"
        yield f"{leg['name']}: {', '.join(leg['elements'])}; {freedoms}"
    if "platform" in facts:
        platform = facts["platform"]
        held = ", ".join(f"{leg} at {node}" for leg, node in platform["legs"].items())
        parts = ", ".join(platform["parts"])
        yield f"flexible platform: {parts}; tool at {platform['tool']}, {held}"
    if facts["kind"] == "cable robot":
        yield f"cables: {', '.join(facts['cables'])}"
    if facts["kind"] == "network":
        yield _counted(facts)
    yield from _mass_lines(facts)


def _counted(facts: Mapping[str, Any]) -> str:
    """Bodies and parts of a network in words."""
    counted = ("bodies", "beams", "springs", "joints", "passive_freedoms", "elastic_freedoms")
    words = [(facts[key], key.replace("_", " ")) for key in counted if facts[key]]
    return ", ".join(f"{n} {_ONE.get(own, own[:-1]) if n == 1 else own}" for n, own in words)


def _home_lines(facts: Mapping[str, Any]) -> Iterator[str]:
    mobility = facts.get("mobility")
    if mobility and mobility["freedoms"] != len(facts["coordinates"]):
        count, free = mobility["freedoms"], " ".join(mobility["coordinates"])
        yield f"this platform has {count} freedoms at home: {free}; poses outside are unreachable"
    home = facts["home"]
    rank = f"rank {home['rank']}, " if home["rank"] >= 0 else ""
    yield f"at home: {rank}status {home['status']}"
    yield from (f"free: {motion}" for motion in home["free_motions"])
    if "picture" in facts:
        yield f"picture: {facts['picture']}"


def _mass_lines(facts: Mapping[str, Any]) -> list[str]:
    """Masses of a robot at home, those that are equal in all its legs together, and its gravity."""
    lines = masses_in_words(facts)
    if "gravity" in facts:
        lines.append(f"gravity: ({row(np.array(facts['gravity']))}) m/s^2")
    for own in facts.get("springs", ()) if facts["kind"] == "model" else ():
        lines.append(
            f"spring {own['name']} between {' and '.join(own['bodies'])}: "
            f"{own['stiffness']:.4g} N/m, {own['length']:.4g} m long at home, "
            f"tension {own['tension']:.4g} N; under finite loads alone"
        )
    return lines


def masses_in_words(facts: Mapping[str, Any], label: str = "masses") -> list[str]:
    """Masses as one line, those that are equal in all legs together; none without any."""
    if "masses" not in facts:
        return []
    masses = facts["masses"]
    values: dict[str, dict[str, str]] = {}
    for name, value in masses["parts"].items():
        leg, _, part = name.partition("/")
        called = name if leg == "platform" or facts["kind"] == "network" else part
        values.setdefault(called, {})[name] = f"{value:.4g} kg"
    parts = []
    for called, own in values.items():
        if len(own) > 1 and len(set(own.values())) == 1:
            parts.append(f"{len(own)} x {called} {next(iter(own.values()))}")
        else:
            names = [called] if len(own) == 1 else own
            parts += [f"{n} {v}" for n, v in zip(names, own.values(), strict=True)]
    at = f" at ({row(np.array(masses['centre']))}) m" if "centre" in masses else ""
    return [f"{label}: {', '.join(parts)}; {masses['total']:.4g} kg in all{at}"]


def masses_at_home(robot: Robot | CableRobot | Snapshot | Network | Linkage) -> dict[str, Any]:
    """Masses of the model, as `masses_in_words` takes them; nothing where there are none."""
    if isinstance(robot, Linkage):
        robot = robot.network_at({})
    if isinstance(robot, Network):
        return {"kind": "network", **_mass_facts(_in_parts(robot), None)}
    if isinstance(robot, Snapshot):
        return {"kind": "snapshot", **_mass_facts(_masses_of(robot), None)}
    if isinstance(robot, Robot):
        return {"kind": "model", **_placed_facts(robot)}
    return {}
