"""A robot of legs as a network: one more body after every element of every leg."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field, replace

import numpy as np

from robostiff.errors import InputError
from robostiff.model import (
    CoupledFreedom,
    PlacedBlock,
    PlacedFreedom,
    PlacedLeg,
    PlacedMass,
    PlacedPlatform,
    PlacedSpring,
    Snapshot,
)
from robostiff.network.elements import CouplingElement, JointElement, Node, SpringElement
from robostiff.network.network import Network

_GROUND, _PLATFORM = "ground", "platform"


def network_of_snapshot(snapshot: Snapshot) -> Network:
    """A robot at one pose as a network of rigid bodies, springs and joints.

    Nothing is condensed and no leg treated apart: each element connects two bodies, and
    `condense` finds the stiffness of the platform without the forms of K_C.

    Parameters
    ----------
    snapshot : Snapshot
        At one pose.

    Raises
    ------
    InputError
        When it holds several poses, or springs of formulas.

    Examples
    --------
    >>> import robostiff as rs
    >>> posture = rs.find_posture(rs.load("hexapod"))
    >>> network = network_of_snapshot(posture.snapshot.one(0))
    >>> len(network.nodes), len(network.joints), len(network.springs)
    (56, 36, 24)
    """
    if snapshot.reference_point.ndim != 1:
        raise InputError(
            f"poses of snapshot {snapshot.name!r}",
            got=snapshot.reference_point.shape[:-1],
            expected="one pose",
            hint="take one of them: snapshot.one(0)",
        )
    parts = _Parts([Node(_GROUND, snapshot.centre), Node(_PLATFORM, snapshot.reference_point)])
    if snapshot.platform is not None:
        _add_platform(snapshot.platform, parts)
    for number, leg in enumerate(snapshot.legs):
        end = _PLATFORM
        if snapshot.platform is not None:
            end = platform_node(snapshot.platform, snapshot.platform.holds[number])
        _add_chain(leg, f"{number + 1} {leg.name}", leg.name, (_GROUND, end), parts)
    parts.masses[_PLATFORM] += snapshot.masses
    return Network(
        snapshot.name,
        tuple(replace(node, masses=tuple(parts.masses[node.name])) for node in parts.nodes),
        (_GROUND,),
        _PLATFORM,
        snapshot.reference_point,
        springs=tuple(parts.springs),
        joints=tuple(parts.joints),
        couplings=tuple(parts.couplings),
        space=snapshot.space,
        description=snapshot.description,
        gravity=snapshot.gravity,
    )


@dataclass
class _Parts:
    """Nodes and elements of a network while it is built."""

    nodes: list[Node]
    springs: list[SpringElement] = field(default_factory=list)
    joints: list[JointElement] = field(default_factory=list)
    couplings: list[CouplingElement] = field(default_factory=list)
    masses: dict[str, list[PlacedMass]] = field(default_factory=lambda: defaultdict(list))


def _add_chain(
    leg: PlacedLeg, prefix: str, name: str, ends: tuple[str, str], parts: _Parts
) -> None:
    """A leg or a branch between two bodies, with one more body after every element but the last."""
    before, last = ends
    alone = [e.alone if isinstance(e, CoupledFreedom) else e for e in leg.elements]
    elements = [(k, e) for k, e in enumerate(alone, start=1) if not _is_rigid(e)]
    joints: dict[str, JointElement] = {}
    bodies = [(0, before)]
    for i, (k, element) in enumerate(elements):
        if i == len(elements) - 1:
            after = last
        else:
            after = f"{prefix}, after {i + 1} {element.name}"
            parts.nodes.append(Node(after, _point_of(element)))
        own = f"{name}/{element.name}"
        if isinstance(element, PlacedBlock):
            for j, branch in enumerate(element.branches):
                own_prefix = f"{prefix}, {i + 1} {element.name}, {j + 1} {branch.name}"
                _add_chain(branch, own_prefix, f"{own}/{branch.name}", (before, after), parts)
        elif isinstance(element, PlacedSpring):
            masses = tuple(
                replace(m, after=0) for m in leg.masses if m.start is not None and m.after == k
            )
            place = element.point, element.rotation, element.elasticity
            parts.springs.append(SpringElement(own, before, after, *place, masses))
        else:
            joints[element.name] = JointElement(name, before, after, (element,))
            parts.joints.append(joints[element.name])
        before = after
        bodies.append((k, after))
    for mass in leg.masses:
        if mass.start is None:
            carrier = next(body for k, body in reversed(bodies) if k <= mass.after)
            parts.masses[carrier].append(replace(mass, after=0))
    for one in leg.elements:
        if isinstance(one, CoupledFreedom) and len(one.sum) > 1:
            # A joint that a rigid drive holds is no joint of the network, and does not turn.
            terms = tuple((joints[own], 0, a) for own, a in one.sum if own in joints)
            parts.couplings.append(CouplingElement(f"{name}/{one.name}", terms, one.stiffness))
    if not elements:
        parts.joints.append(JointElement(name, *ends))


def _add_platform(placed: PlacedPlatform, parts: _Parts) -> None:
    platform = placed.platform
    for node in platform.nodes:
        if node.name != platform.tool:
            parts.nodes.append(Node(platform_node(placed, node.name), placed.in_world(node.at)))
    for part in platform.parts:
        parts.springs.append(
            SpringElement(
                f"{_PLATFORM}/{part.name}",
                platform_node(placed, part.a),
                platform_node(placed, part.b),
                placed.in_world(part.point),
                placed.rotation @ part.axes,
                part.elasticity,
            )
        )


def platform_node(placed: PlacedPlatform, name: str) -> str:
    """Name in the network of a node of a flexible platform; its tool is the platform."""
    return _PLATFORM if name == placed.platform.tool else f"{_PLATFORM}, {name}"


def _point_of(element: PlacedFreedom | PlacedSpring | PlacedBlock) -> np.ndarray:
    """A point of a body, for its node."""
    point = element.branches[0].end if isinstance(element, PlacedBlock) else element.point
    return np.asarray(point, dtype=float)


def _is_rigid(element: PlacedFreedom | PlacedSpring | PlacedBlock) -> bool:
    return (
        isinstance(element, PlacedFreedom) and not element.is_passive and element.stiffness is None
    )
