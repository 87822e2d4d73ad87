"""Contents of a robot, a snapshot or a network: its legs, masses and parts, and each in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from functools import singledispatch
from typing import Any

import numpy as np

from robostiff.analysis import stiffness
from robostiff.elasticity import Elasticity
from robostiff.elastostatics import Status
from robostiff.kinematics import find_posture, with_body_springs, with_masses
from robostiff.kinematics.closure.loops import fitting_coordinates, platform_mobility
from robostiff.linkage import Linkage, network_at
from robostiff.markup import (
    STIFFNESS_UNITS,
    Block,
    Bullets,
    Cell,
    Facts,
    Number,
    Page,
    Table,
    number,
    row,
)
from robostiff.model import (
    Actuated,
    Chain,
    CoupledFreedom,
    Joint,
    Link,
    ParallelBlock,
    Passive,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    Robot,
    Snapshot,
    Telescope,
)
from robostiff.model.cable import CableRobot
from robostiff.network import Network

#: Names of the parts of those that have no legs.
_WHOLE = ("network", "cables")
#: Words whose singular is not their plural without an s.
_ONE = {"bodies": "body"}


def machine_page(machine: Any) -> Page:
    """A machine of any kind in short: title, symbols, parts, free coordinates and source."""
    blocks: list[Block | None] = [leg_table(machine)]
    facts: dict[str, str] = {}
    if hasattr(machine, "cables"):
        facts["cables"] = ", ".join(machine.cable_names)
    elif isinstance(machine, Network):
        facts["parts"] = _counts(_network_facts(machine))
    elif isinstance(machine, Linkage):
        joints = [
            [joint.name, f"{c.a}, {c.b}", joint.kind.value, type(joint.role).__name__.lower()]
            for c in machine.connections
            if isinstance(joint := c.element, Joint)
        ]
        blocks.append(Table(["joint", "between", "kind", "role"], joints))
    blocks.append(Facts(tuple(facts.items())) if facts else None)
    facts = {
        "symbols": ", ".join(map(str, getattr(machine, "symbols", ()))),
        "free coordinates": " ".join(coordinate.value for coordinate in machine.coordinates),
        "source": machine.source,
    }
    blocks.append(Facts(tuple((name, words) for name, words in facts.items() if words)))
    return Page(machine.name, f": {machine.title}" if machine.title else "", blocks=blocks)


def leg_table(machine: Any) -> Table | None:
    """The elements of every leg; None of a machine without legs."""
    rows = [[leg["name"], ", ".join(leg["elements"])] for leg in _legs(machine)]
    return Table(["leg", "from base to platform"], rows) if rows else None


def facts_page(facts: Mapping[str, Any]) -> Page:
    """All parts of a robot, its masses, and its stiffness at home, of facts as `facts_of` has them.

    Besides ``mobility``, ``parts``, ``warnings`` and ``picture`` where they are known.
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
    blocks += part_tables(facts.get("parts", {}))
    blocks.append(Bullets(tuple(lines)))
    place = f": {facts['kind']}, {facts['space']}"
    return Page(facts["name"], place, None, blocks, home["advice"], facts)


def facts_of(robot: Any, with_parts: bool = False) -> dict[str, Any]:
    """Plain data of a robot of legs or cables, a snapshot or a network, as far as they have it.

    The stiffness at home is included, that of the legs where there are springs between bodies; and
    each part where it is wanted.
    """
    of_kind: dict[str, Any] = {}
    home = stiffness(robot.with_springs() if hasattr(robot, "with_springs") else robot)
    if hasattr(robot, "nodes"):
        of_kind = _network_facts(robot)
    elif hasattr(robot, "cables"):
        of_kind["cables"] = robot.cable_names
    elif Status.UNREACHABLE not in home.status:
        of_kind = masses_at_home(robot)
    platform: Any = getattr(robot, "platform", None)
    if platform is not None and not robot.is_frozen:
        shape = {
            "nodes": [node.name for node in platform.nodes],
            "parts": [part.name for part in platform.parts],
            "tool": platform.tool,
            "legs": dict(zip((leg.name for leg in robot.legs), robot.holds, strict=True)),
        }
        of_kind = {"platform": shape, **of_kind}
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
        "coordinates": [coordinate.value for coordinate in robot.coordinates],
        "units": {**units, "stiffness": asdict(STIFFNESS_UNITS)},
        "legs": legs,
        **of_kind,
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
    legs = []
    for leg in getattr(machine, "legs", ()):
        if isinstance(leg, PlacedLeg):
            words, roles = leg.in_words(), [freedom.role for freedom in leg.freedoms]
        else:
            words, roles = leg.chain.in_words, leg.chain.roles
        facts = {
            "name": leg.name,
            "elements": words,
            "passive_freedoms": sum(isinstance(role, Passive) for role in roles),
            "actuated_freedoms": sum(isinstance(role, Actuated) for role in roles),
        }
        legs.append(facts)
    return legs


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
                "name": spring.name,
                "bodies": list(spring.bodies),
                "stiffness": spring.stiffness,
                "length": length,
                "tension": spring.tension + spring.stiffness * (length - spring.length),
            }
            for spring in with_body_springs(posture).one(0).springs
            for length in [float(np.linalg.norm(spring.points[1] - spring.points[0]))]
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
        nodes = ", ".join(f"{leg} at {node}" for leg, node in platform["legs"].items())
        parts = ", ".join(platform["parts"])
        yield f"flexible platform: {parts}; tool at {platform['tool']}, {nodes}"
    if facts["kind"] == "cable robot":
        yield f"cables: {', '.join(facts['cables'])}"
    if facts["kind"] == "network":
        yield _counts(facts)
    yield from masses_in_words(facts)
    if "gravity" in facts:
        yield f"gravity: ({row(np.array(facts['gravity']))}) m/s^2"
    for spring in facts.get("springs", ()) if facts["kind"] == "model" else ():
        yield (
            f"spring {spring['name']} between {' and '.join(spring['bodies'])}: "
            f"{number(spring['stiffness'])} N/m, {number(spring['length'])} m long at home, "
            f"tension {number(spring['tension'])} N; under finite loads alone"
        )


def _counts(facts: Mapping[str, Any]) -> str:
    """Bodies and parts of a network in words."""
    counted = ("bodies", "beams", "springs", "joints", "passive_freedoms", "elastic_freedoms")
    words = [(facts[key], key.replace("_", " ")) for key in counted if facts[key]]
    return ", ".join(f"{n} {_ONE.get(word, word[:-1]) if n == 1 else word}" for n, word in words)


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
    for called, texts in values.items():
        if len(texts) > 1 and len(set(texts.values())) == 1:
            parts.append(f"{len(texts)} x {called} {next(iter(texts.values()))}")
        else:
            names = [called] if len(texts) == 1 else texts
            parts += [f"{n} {v}" for n, v in zip(names, texts.values(), strict=True)]
    centre = f", centre of mass ({row(np.array(masses['centre']))}) m" if "centre" in masses else ""
    return [f"{label}: {', '.join(parts)}; {number(masses['total'])} kg in all{centre}"]


@singledispatch
def parts_at_home(robot: Any) -> dict[str, list[dict[str, Any]]]:
    """The joints and elastic parts of each leg, from base to platform, as plain data.

    Those of a network, and cables, are one list.
    """
    posture = find_posture(robot)
    parts = {}
    legs = zip(robot.legs, posture.snapshot.one(0).legs, posture.coordinates, strict=True)
    for leg, placed, q in legs:
        joints = map(float, leg.chain.joint_coordinates(np.ravel(q)))
        known = dict(zip(leg.chain.joint_names, joints, strict=True))
        lengths = dict(_lengths(leg.chain, "", known))
        parts[leg.name] = [_part(part, known, lengths) for part in placed.parts]
    return parts


@parts_at_home.register
def _(snapshot: Snapshot) -> dict[str, list[dict[str, Any]]]:
    return {leg.name: [_part(part, {}, {}) for part in leg.parts] for leg in snapshot.legs}


def mobility_at_home(robot: Robot) -> dict[str, Any]:
    """How many freedoms the legs leave the platform at home, and coordinates that fit them."""
    posture = find_posture(robot)
    q = [np.ravel(x) for x in posture.coordinates]
    mobility = platform_mobility(robot, np.ravel(posture.pose), q, posture.length)
    fitting = fitting_coordinates(mobility)
    return {"freedoms": len(fitting), "coordinates": [c.value for c in fitting]}


@parts_at_home.register
def _(network: Network) -> dict[str, list[dict[str, Any]]]:
    elements: list[tuple[Any, np.ndarray, dict[str, float], Elasticity]] = [
        (beam, beam.end, {"length": beam.length}, Elasticity(beam.tip_compliance))
        for beam in network.beams
    ]
    elements += [
        (spring, spring.point, {}, spring.elasticity)
        for spring in network.springs
        if np.any(spring.elasticity.compliance) or np.any(spring.elasticity.freedoms)
    ]
    parts = [
        {
            "name": element.name,
            "kind": "elastic",
            "between": [element.a, element.b],
            "point": point.tolist(),
            **length,
            **_alone(elasticity),
        }
        for element, point, length, elasticity in elements
    ]
    for joint in network.joints:
        for freedom in joint.freedoms:
            part = _part(freedom, {}, {})
            name = part["name"] if part["name"] == joint.name else f"{joint.name}/{part['name']}"
            parts.append({**part, "name": name, "between": [joint.a, joint.b]})
    return {"network": parts}


@parts_at_home.register
def _(robot: CableRobot) -> dict[str, list[dict[str, Any]]]:
    cables = []
    for cable in robot.cables:
        end = robot.home.R @ cable.attachment + robot.home.p
        greatest = float(cable.greatest_tension)
        facts = {
            "name": cable.name,
            "kind": "cable",
            "exit": cable.exit_point.tolist(),
            "point": end.tolist(),
            "length": float(np.linalg.norm(end - cable.exit_point)),
            "guide_length": float(cable.guide_length),
            "EA": None if cable.EA is None else float(cable.EA),
            "winch_stiffness": cable.winch_stiffness,
            "tension_limits": [float(cable.least_tension), greatest if greatest < np.inf else None],
        }
        cables.append(facts)
    return {"cables": cables}


JOINT_UNITS = ("N/m", "N m/rad")
"""Of the stiffness of a slide and of a turn."""


def part_tables(parts: Mapping[str, list[dict[str, Any]]]) -> list[Table]:
    """Tables of joints, elastic parts and cables, as `parts_at_home` has them."""
    listed = [
        part if leg in _WHOLE else {**part, "name": f"{leg}/{part['name']}"}
        for leg, of in parts.items()
        for part in of
    ]
    tables = []
    for kind, cells in _CELLS.items():
        rows = [cells(part) for part in listed if part["kind"] == kind]
        # without columns in which none has anything
        heads = [name for name in rows[0] if any(line[name] != "" for line in rows)] if rows else []
        if heads:
            tables.append(Table(heads, [[line[name] for name in heads] for line in rows]))
    return tables


def _joint(part: dict[str, Any]) -> dict[str, Cell]:
    stiffness: Cell = "" if part["role"] == "passive" else "rigid"
    if part["stiffness"] is not None:
        stiffness = Number(part["stiffness"], JOINT_UNITS[part["unit"] != "m"])
    limits, at_home = part.get("limits"), part.get("coordinate")
    return {
        "joint": part["name"],
        "between": ", ".join(part.get("between", ())),
        "motion": f"{part['motion']}, {part['role']}",
        "point": f"({row(part['point'])})",
        "axis": f"({row(part['axis'])})",
        "at home": "" if at_home is None else Number(round(at_home, 12), part["unit"]),
        "stiffness": stiffness,
        "limits": "" if limits is None else f"{' to '.join(map(number, limits))} {part['unit']}",
    }


def _elastic(part: dict[str, Any]) -> dict[str, Cell]:
    return {
        "elastic part": part["name"],
        "between": ", ".join(part.get("between", ())),
        "end": f"({row(part['point'])})",
        "forces x y z [N/m]": _in_a_row(part["translation"]),
        "moments x y z [N m/rad]": _in_a_row(part["rotation"]),
        "length": Number(part["length"], "m") if "length" in part else "",
    }


def _cable(part: dict[str, Any]) -> dict[str, Cell]:
    (least, most), EA, winch = (part[n] for n in ("tension_limits", "EA", "winch_stiffness"))
    return {
        "cable": part["name"],
        "exit point [m]": f"({row(part['exit'])})",
        "end at home [m]": f"({row(part['point'])})",
        "length": Number(part["length"], "m"),
        "guide": Number(part["guide_length"], "m") if part["guide_length"] else "",
        "EA": "rigid" if EA is None else Number(EA, "N"),
        "winch": "rigid" if winch is None else Number(winch, "N/m"),
        "tension limits [N]": f"{number(least)} to {'any' if most is None else number(most)}",
    }


_CELLS = {"joint": _joint, "elastic": _elastic, "cable": _cable}


def _in_a_row(values: list[float | None]) -> str:
    """Load over displacement in each direction alone."""
    words = ["rigid" if v is None else "free" if v == 0 else number(v) for v in values]
    return "rigid" if set(words) == {"rigid"} else ", ".join(words)


def _lengths(chain: Chain, prefix: str, q: dict[str, float]) -> Iterator[tuple[str, float]]:
    for element in chain.elements:
        if isinstance(element, ParallelBlock):
            for branch in element.branches:
                yield from _lengths(branch.chain, f"{prefix}{element.name}/{branch.name}/", q)
        elif isinstance(element, Telescope):
            name = f"{prefix}{element.name}"
            for i, beam in enumerate(element.beams, 1):
                label = f"{name}.beam{i if len(element.beams) > 1 else ''}"
                yield label, float(beam.fixed + beam.share * q[name])
        elif isinstance(element, Link):
            length = float(np.linalg.norm(element.to.astype(float)))
            if length:
                yield prefix + element.name, length


def _part(
    part: PlacedFreedom | PlacedSpring, known: dict[str, float], lengths: dict[str, float]
) -> dict[str, Any]:
    point = np.ravel(part.point).tolist()
    if isinstance(part, CoupledFreedom):
        part = part.alone  # what couples it is listed by itself
    if isinstance(part, PlacedSpring):
        length = {"length": lengths[part.name]} if part.name in lengths else {}
        facts = {"name": part.name, "kind": "elastic", "point": point}
        return {**facts, **length, **_alone(part.elasticity)}
    limits = part.role.limits if isinstance(part.role, Actuated) else None
    coordinate = {"coordinate": known[part.name]} if part.name in known else {}
    return {
        "name": part.name,
        "kind": "joint",
        "motion": "slides" if part.pitch is None else "turns" if part.pitch == 0 else "screws",
        "role": type(part.role).__name__.lower(),
        "point": point,
        "axis": np.ravel(part.axis).tolist(),
        **coordinate,
        "unit": part.unit,
        "stiffness": None if part.stiffness is None else float(part.stiffness),
        "limits": None if limits is None else list(limits),
    }


def _alone(elasticity: Elasticity) -> dict[str, list[float | None]]:
    """Load over displacement in each direction alone: 0 where free, None where rigid."""
    C = np.reshape(elasticity.compliance, (-1, 6, 6))[0].astype(float)
    free = np.any(np.asarray(elasticity.freedoms, dtype=float) != 0, axis=1)
    values = [
        0.0 if is_free else None if c == 0 else 1 / float(c)
        for c, is_free in zip(np.diag(C), free, strict=True)
    ]
    return {"translation": values[:3], "rotation": values[3:]}
