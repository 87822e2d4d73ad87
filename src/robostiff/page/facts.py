"""Contents of a robot, a snapshot or a network."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from robostiff.analysis import stiffness
from robostiff.analysis.parts_at_home import mobility_at_home, part_in_words, parts_at_home
from robostiff.elastostatics import Status
from robostiff.kinematics import find_posture, with_body_springs, with_masses
from robostiff.linkage import Linkage, network_at
from robostiff.markup import STIFFNESS_UNITS, Block, Bullets, Facts, Page, Table, number, row
from robostiff.model import Actuated, Joint, Passive, PlacedLeg, Robot
from robostiff.network import Network

#: Of the parts of those that have no legs.
_HEADS = {"network": "parts of the network", "cable robot": "cables at home"}
#: Words whose singular is not their plural without an s.
_ONE = {"bodies": "body"}


def machine_page(machine: Any) -> Page:
    """A machine of any kind in short: title, symbols, parts, free coordinates and source."""
    blocks: list[Block | None] = [leg_table(machine)]
    facts: dict[str, str] = {}
    if hasattr(machine, "cables"):
        facts["cables"] = ", ".join(machine.cable_names)
    elif isinstance(machine, Network):
        facts["parts"] = _counted(_network_facts(machine))
    elif isinstance(machine, Linkage):
        joints = [
            [own.name, f"{c.a}, {c.b}", own.kind.value, type(own.role).__name__.lower()]
            for c in machine.connections
            if isinstance(own := c.element, Joint)
        ]
        blocks.append(Table(["joint", "between", "kind", "role"], joints))
    blocks.append(Facts(tuple(facts.items())) if facts else None)
    facts = {
        "symbols": ", ".join(map(str, getattr(machine, "symbols", ()))),
        "free coordinates": " ".join(one.value for one in machine.coordinates),
        "source": machine.source,
    }
    blocks.append(Facts(tuple((name, words) for name, words in facts.items() if words)))
    return Page(machine.name, f": {machine.title}" if machine.title else "", blocks=blocks)


def leg_table(machine: Any) -> Table | None:
    """The elements of every leg; None of a machine without legs."""
    rows = [[own["name"], ", ".join(own["elements"])] for own in _legs(machine)]
    return Table(["leg", "from base to platform"], rows) if rows else None


def facts_page(facts: Mapping[str, Any]) -> Page:
    """All parts of a robot, its masses, and its stiffness at home.

    Parameters
    ----------
    facts : mapping of str to values
        As of `facts_of`; besides ``mobility``, ``parts``, ``warnings`` and ``picture`` where they
        are known.
    """
    blocks: list[Block] = [Bullets(tuple(_fact_lines(facts)))]
    home, mobility, lines = facts["home"], facts.get("mobility"), []
    if mobility and mobility["freedoms"] != len(facts["coordinates"]):
        count, free = mobility["freedoms"], " ".join(mobility["coordinates"])
        words = f"this platform has {count} freedoms at home: {free}"
        lines.append(f"{words}; poses outside are unreachable")
    rank = f"rank {home['rank']}, " if home["rank"] >= 0 else ""
    lines.append(f"at home: {rank}status {home['status']}")
    lines += [f"free: {motion}" for motion in home["free_motions"]]
    lines += [f"picture: {facts['picture']}"] if "picture" in facts else []
    for leg, parts in facts.get("parts", {}).items():
        head = _HEADS.get(facts["kind"], f"{leg} at home, from base to platform")
        blocks.append(Bullets((head, *(f"  {part_in_words(part)}" for part in parts))))
    blocks.append(Bullets(tuple(lines)))
    place = f": {facts['kind']}, {facts['space']}"
    return Page(facts["name"], place, None, blocks, home["advice"], facts)


def facts_of(robot: Any, with_parts: bool = False) -> dict[str, Any]:
    """Plain data of a robot of legs or cables, a snapshot or a network, as far as they have it.

    The stiffness at home is included, that of the legs where there are springs between bodies; and
    each part where it is wanted.
    """
    own: dict[str, Any] = {}
    home = stiffness(robot.with_springs() if hasattr(robot, "with_springs") else robot)
    if hasattr(robot, "nodes"):
        own = _network_facts(robot)
    elif hasattr(robot, "cables"):
        own["cables"] = robot.cable_names
    elif Status.UNREACHABLE not in home.status:
        own = masses_at_home(robot)
    platform: Any = getattr(robot, "platform", None)
    if platform is not None and not robot.is_frozen:
        shape = {
            "nodes": [node.name for node in platform.nodes],
            "parts": [part.name for part in platform.parts],
            "tool": platform.tool,
            "legs": dict(zip((leg.name for leg in robot.legs), robot.holds, strict=True)),
        }
        own = {"platform": shape, **own}
    legs = _legs(robot)
    units = {"length": "m", "angle": "rad", "force": "N", "mass": "kg"}
    known: dict[str, Any] = {
        "home": {
            "status": str(home.status),
            "rank": int(home.rank),
            "free_motions": [str(motion) for motion in home.free_motions],
            "advice": list(home.advice),
        }
    }
    if robot.coordinates and legs:
        known["mobility"] = mobility_at_home(robot)
    if with_parts and Status.UNREACHABLE not in home.status:
        known["parts"] = parts_at_home(robot)
    return {
        "name": robot.name,
        "kind": _kind_of(robot),
        "title": robot.title,
        "source": robot.source,
        "space": robot.space.name.lower(),
        "coordinates": [one.value for one in robot.coordinates],
        "units": {**units, "stiffness": asdict(STIFFNESS_UNITS)},
        "legs": legs,
        **own,
        **known,
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
        **masses_at_home(network),
    }


def _legs(machine: Any) -> list[dict[str, Any]]:
    """Elements of every leg in words, and how many freedoms are passive and actuated."""
    found = []
    for leg in getattr(machine, "legs", ()):
        if isinstance(leg, PlacedLeg):
            words, roles = leg.in_words(), [one.role for one in leg.freedoms]
        else:
            words, roles = leg.chain.in_words, leg.chain.roles
        passive = sum(isinstance(role, Passive) for role in roles)
        driven = sum(isinstance(role, Actuated) for role in roles)
        found.append(
            {
                "name": leg.name,
                "elements": words,
                "passive_freedoms": passive,
                "actuated_freedoms": driven,
            }
        )
    return found


def masses_at_home(machine: Any) -> dict[str, Any]:
    """Masses, gravity and springs between bodies at home, as `masses_in_words` takes them."""
    if isinstance(machine, Linkage):
        machine = network_at(machine, {})
    posture = find_posture(machine) if isinstance(machine, Robot) else None
    placed: Any = machine if posture is None else with_masses(posture).one(0)
    facts: dict[str, Any] = {"kind": _kind_of(machine)}
    parts: dict[str, float] = {}
    moment = np.zeros(3)
    for owner, mass in getattr(placed, "named_masses", ()):
        name = owner if mass.name == owner else f"{owner}/{mass.name}"
        parts[name] = parts.get(name, 0.0) + float(mass.value)
        moment = moment + mass.value * mass.centre
    if parts:
        total = sum(parts.values())
        facts["masses"] = {"total": total, "parts": parts}
        if total > 0:
            facts["masses"]["centre"] = (moment / total).tolist()
    if getattr(placed, "gravity", None) is not None:
        facts["gravity"] = placed.gravity.tolist()
    if posture is not None and machine.springs:
        facts["springs"] = [
            {
                "name": own.name,
                "bodies": list(own.bodies),
                "stiffness": own.stiffness,
                "length": length,
                "tension": own.tension + own.stiffness * (length - own.length),
            }
            for own in with_body_springs(posture).one(0).springs
            for length in [float(np.linalg.norm(own.points[1] - own.points[0]))]
        ]
    return facts


def _kind_of(machine: Any) -> str:
    """In words; a robot is called by its file."""
    kind: str = machine.kind
    return {"robot": "model"}.get(kind, kind)


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
    yield from masses_in_words(facts)
    if "gravity" in facts:
        yield f"gravity: ({row(np.array(facts['gravity']))}) m/s^2"
    for own in facts.get("springs", ()) if facts["kind"] == "model" else ():
        yield (
            f"spring {own['name']} between {' and '.join(own['bodies'])}: "
            f"{number(own['stiffness'])} N/m, {number(own['length'])} m long at home, "
            f"tension {number(own['tension'])} N; under finite loads alone"
        )


def _counted(facts: Mapping[str, Any]) -> str:
    """Bodies and parts of a network in words."""
    counted = ("bodies", "beams", "springs", "joints", "passive_freedoms", "elastic_freedoms")
    words = [(facts[key], key.replace("_", " ")) for key in counted if facts[key]]
    return ", ".join(f"{n} {_ONE.get(own, own[:-1]) if n == 1 else own}" for n, own in words)


def masses_in_words(facts: Mapping[str, Any], label: str = "masses") -> list[str]:
    """Masses as one line, those that are equal in all legs together; none without any."""
    if "masses" not in facts:
        return []
    masses = facts["masses"]
    values: dict[str, dict[str, str]] = {}
    for name, value in masses["parts"].items():
        leg, _, part = name.partition("/")
        called = name if leg == "platform" or facts["kind"] == "network" else part
        values.setdefault(called, {})[name] = f"{number(value)} kg"
    parts = []
    for called, own in values.items():
        if len(own) > 1 and len(set(own.values())) == 1:
            parts.append(f"{len(own)} x {called} {next(iter(own.values()))}")
        else:
            names = [called] if len(own) == 1 else own
            parts += [f"{n} {v}" for n, v in zip(names, own.values(), strict=True)]
    centre = f", centre of mass ({row(np.array(masses['centre']))}) m" if "centre" in masses else ""
    return [f"{label}: {', '.join(parts)}; {number(masses['total'])} kg in all{centre}"]
