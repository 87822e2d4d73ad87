"""Contents of a robot, a snapshot or a network as plain data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robostiff.analysis import CableStiffness, RobotStiffness, stiffness
from robostiff.kinematics import find_posture, with_body_springs, with_masses
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Actuated, Passive, PlacedLeg, PlacedMass, Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.model.in_words import elements_in_words, placed_in_words
from robostiff.network import Network


def head_facts(
    robot: Robot | CableRobot | Snapshot | Network, kind: str, legs: list[dict[str, Any]]
) -> dict[str, Any]:
    """What is printed of every kind of robot; snapshots and networks have only a description."""
    is_frozen = isinstance(robot, Snapshot | Network)
    return {
        "name": robot.name,
        "kind": kind,
        "title": robot.description if is_frozen else robot.title,
        "source": "" if is_frozen else robot.source,
        "space": robot.space.name.lower(),
        "coordinates": [] if is_frozen else [own.value for own in robot.coordinates],
        "legs": legs,
    }


def network_facts(network: Network) -> dict[str, Any]:
    """Facts for ``robostiff check``, without the stiffness."""
    freedoms = [f for joint in network.joints for f in joint.freedoms]
    return {
        **head_facts(network, "network", []),
        "bodies": len(network.nodes),
        "beams": len(network.beams),
        "springs": len(network.springs),
        "joints": len(network.joints),
        "passive_freedoms": sum(f.is_passive for f in freedoms),
        "elastic_freedoms": sum(f.stiffness is not None for f in freedoms),
    }


def platform_facts(robot: Robot) -> dict[str, Any]:
    """Nodes, parts, tool, and the node that holds each leg; nothing for a rigid platform."""
    platform = robot.platform
    if platform is None:
        return {}
    names = [leg.name for leg in robot.legs]
    return {
        "nodes": [node.name for node in platform.nodes],
        "parts": [part.name for part in platform.parts],
        "tool": platform.tool,
        "legs": dict(zip(names, robot.holds, strict=True)),
    }


def robot_facts(robot: Robot) -> dict[str, Any]:
    """Facts for ``robostiff check`` about a robot, its stiffness at home included.

    Springs between bodies are listed; the stiffness is that of the legs.
    """
    home = stiffness(robot.with_springs())
    of_platform = {} if robot.platform is None else {"platform": platform_facts(robot)}
    legs = [
        {
            "name": leg.name,
            "elements": elements_in_words(leg.chain),
            "passive_freedoms": sum(isinstance(r, Passive) for r in leg.chain.roles),
            "actuated_freedoms": sum(isinstance(r, Actuated) for r in leg.chain.roles),
        }
        for leg in robot.legs
    ]
    return {
        **head_facts(robot, "model", legs),
        **of_platform,
        **mass_facts(robot),
        "home": home_facts(home),
    }


def mass_facts(robot: Robot) -> dict[str, Any]:
    """Masses at home by parts, their sum and centre, gravity, springs between bodies."""
    posture = find_posture(robot)
    R, p = turn_by_vector(posture.pose[0, 3:]), posture.pose[0, :3]
    placed = [
        (f"{leg.name}/{mass.name}", float(mass.value), mass.centre)
        for leg in with_masses(posture).one(0).legs
        for mass in _masses(leg)
    ]
    for mass in robot.in_floats.platform_masses:
        centre = p if mass.centre is None else p + R @ mass.centre
        placed.append((f"platform/{mass.name}", mass.value, centre))
    total = sum(value for _, value, _ in placed)
    facts: dict[str, Any] = {}
    if placed:
        parts: dict[str, float] = {}
        for name, value, _ in placed:
            parts[name] = parts.get(name, 0.0) + value
        facts["masses"] = {"total": total, "parts": parts}
        if total > 0:
            centre = np.sum([value * centre for _, value, centre in placed], axis=0) / total
            facts["masses"]["centre"] = centre.tolist()
    if robot.gravity is not None:
        facts["gravity"] = robot.in_floats.gravity.tolist()
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


def _masses(leg: PlacedLeg) -> Iterator[PlacedMass]:
    yield from leg.masses
    for block in leg.blocks:
        for branch in block.branches:
            yield from _masses(branch)


def snapshot_facts(snapshot: Snapshot) -> dict[str, Any]:
    """Facts for ``robostiff check`` about a snapshot, its stiffness included."""
    legs = [
        {
            "name": leg.name,
            "elements": placed_in_words(leg),
            "passive_freedoms": sum(freedom.is_passive for freedom in leg.freedoms),
            "actuated_freedoms": sum(not freedom.is_passive for freedom in leg.freedoms),
        }
        for leg in snapshot.legs
    ]
    home = home_facts(stiffness(snapshot))
    return {**head_facts(snapshot, "snapshot", legs), "home": home}


def home_facts(home: RobotStiffness | CableStiffness) -> dict[str, Any]:
    """Status, rank and free motions at home."""
    return {
        "status": str(home.status),
        "rank": int(home.rank),
        "free_motions": [str(motion) for motion in home.free_motions],
        "advice": list(home.advice),
    }
