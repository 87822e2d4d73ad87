"""Joints and elastic parts of a robot at home: where they are, how long and how stiff."""

from __future__ import annotations

from collections.abc import Iterator
from functools import singledispatch
from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.kinematics import find_posture
from robostiff.kinematics.closure.loops import fitting_coordinates, platform_mobility
from robostiff.markup import number
from robostiff.model import (
    Actuated,
    Chain,
    CoupledFreedom,
    Link,
    ParallelBlock,
    PlacedFreedom,
    PlacedSpring,
    Robot,
    Snapshot,
)
from robostiff.model.cable import CableRobot
from robostiff.network import Network


@singledispatch
def parts_at_home(robot: Any) -> dict[str, list[dict[str, Any]]]:
    """The joints and elastic parts of each leg, from base to platform, as plain data.

    Those of a network, and cables, are one list.
    """
    posture = find_posture(robot)
    found = {}
    each = zip(robot.legs, posture.snapshot.one(0).legs, posture.coordinates, strict=True)
    for leg, placed, q in each:
        joints = map(float, leg.chain.joint_coordinates(np.ravel(q)))
        known = dict(zip(leg.chain.joint_names, joints, strict=True))
        lengths = dict(_lengths(leg.chain, ""))
        found[leg.name] = [_part(part, known, lengths) for part in placed.parts]
    return found


@parts_at_home.register
def _(snapshot: Snapshot) -> dict[str, list[dict[str, Any]]]:
    return {leg.name: [_part(part, {}, {}) for part in leg.parts] for leg in snapshot.legs}


def mobility_at_home(robot: Robot) -> dict[str, Any]:
    """How many freedoms the legs leave the platform at home, and coordinates that fit them."""
    posture = find_posture(robot)
    q = [np.ravel(own) for own in posture.coordinates]
    mobility = platform_mobility(robot, np.ravel(posture.pose), q, posture.length)
    fitting = fitting_coordinates(mobility)
    return {"freedoms": len(fitting), "coordinates": [c.value for c in fitting]}


@parts_at_home.register
def _(network: Network) -> dict[str, list[dict[str, Any]]]:
    found = [
        {
            "name": beam.name,
            "kind": "elastic",
            "between": [beam.a, beam.b],
            "point": beam.end.tolist(),
            "length": beam.length,
            **_alone(Elasticity(beam.tip_compliance)),
        }
        for beam in network.beams
    ]
    found += [
        {
            "name": spring.name,
            "kind": "elastic",
            "between": [spring.a, spring.b],
            "point": spring.point.tolist(),
            **_alone(spring.elasticity),
        }
        for spring in network.springs
        if np.any(spring.elasticity.compliance) or np.any(spring.elasticity.freedoms)
    ]
    for joint in network.joints:
        for freedom in joint.freedoms:
            part = _part(freedom, {}, {})
            name = part["name"] if part["name"] == joint.name else f"{joint.name}/{part['name']}"
            found.append({**part, "name": name, "between": [joint.a, joint.b]})
    return {"network": found}


@parts_at_home.register
def _(robot: CableRobot) -> dict[str, list[dict[str, Any]]]:
    found = []
    for cable in robot.cables:
        end = robot.home.R @ cable.attachment + robot.home.p
        greatest = float(cable.greatest_tension)
        own = {
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
        found.append(own)
    return {"cables": found}


def part_in_words(part: dict[str, Any]) -> str:
    """One part in a line."""
    if part["kind"] == "cable":
        exit_point, end = (_rounded(*part[key]) for key in ("exit", "point"))
        least, greatest = part["tension_limits"]
        EA, winch = part["EA"], part["winch_stiffness"]
        most = "" if greatest is None else f" to {number(greatest)} N"
        words = [f"{part['name']}: from ({exit_point}) m to ({end}) m"]
        words.append(f"length {part['length']:.6g} m")
        if part["guide_length"]:
            words.append(f"guide {part['guide_length']:.6g} m")
        words.append("EA rigid" if EA is None else f"EA {number(EA)} N")
        words.append("winch rigid" if winch is None else f"winch {number(winch)} N/m")
        return ", ".join([*words, f"tension from {number(least)} N{most}"])
    between = f"between {' and '.join(part['between'])}, " if "between" in part else ""
    at = between + f"at ({_rounded(*part['point'])}) m"
    if part["kind"] == "joint":
        motion = f"{part['motion']} {'along' if part['unit'] == 'm' else 'about'}"
        words = [f"{part['name']}: {motion} ({_rounded(*part['axis'])}), {part['role']}, {at}"]
        if "coordinate" in part:
            words.append(f"home {_rounded(part['coordinate'])} {part['unit']}")
        if part["stiffness"] is not None:
            unit = "N/m" if part["unit"] == "m" else "N m/rad"
            words.append(f"stiffness {number(part['stiffness'])} {unit}")
        if part.get("limits"):
            low, high = part["limits"]
            words.append(f"limits {low:.6g} to {high:.6g} {part['unit']}")
        return ", ".join(words)
    words = [f"{part['name']}: elastic, end {at}"]
    if "length" in part:
        words.append(f"length {part['length']:.6g} m")
    words.append(f"forces {_stiffnesses(part['translation'], 'N/m')}")
    words.append(f"moments {_stiffnesses(part['rotation'], 'N m/rad')}")
    return ", ".join(words)


def _rounded(*values: float) -> str:
    """Values in metres and radians; what rounding leaves beside them is zero."""
    return ", ".join(f"{round(x, 12) + 0.0:.6g}" for x in values)


def _stiffnesses(values: list[float | None], unit: str) -> str:
    if all(value is None for value in values):
        return "rigid"
    each = " ".join("rigid" if value is None else f"{value:.4g}" for value in values)
    return f"{each} {unit}"


def _lengths(chain: Chain, prefix: str) -> Iterator[tuple[str, float]]:
    for element in chain.elements:
        if isinstance(element, ParallelBlock):
            for branch in element.branches:
                yield from _lengths(branch.chain, f"{prefix}{element.name}/{branch.name}/")
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
        return {
            "name": part.name,
            "kind": "elastic",
            "point": point,
            **length,
            **_alone(part.elasticity),
        }
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
