"""Bodies and what connects them, by which a robot at a pose, or a network, is loaded.

A member leads from one body to another through parts in series: the run of a leg between two
parallel blocks, a beam or a joint of a network, a part of a flexible platform. Numbers, or entries
of a record.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from robostiff.analysis import CableStiffness
from robostiff.elasticity import Elasticity
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.kinematics.spanning_tree import connected_parts
from robostiff.model import (
    CoupledFreedom,
    Locked,
    PlacedBlock,
    PlacedBodySpring,
    PlacedFreedom,
    PlacedLeg,
    PlacedMass,
    PlacedPlatform,
    PlacedSpring,
    Snapshot,
)
from robostiff.model.body_spring import BASE, PLATFORM
from robostiff.network import BeamElement, JointElement, Network, SpringElement
from robostiff.statics.chains.beam_bowing import is_rigid, moves
from robostiff.statics.loading.given_loads import DeadForce

Body = str
Part = PlacedFreedom | PlacedSpring


class NamedBody(NamedTuple):
    """A body: behind so many parts of a member, or, without a member, itself; where it counts."""

    body: Body = ""
    member: int | None = None
    parts: int = 0
    leg: int = 0


@frozen
class Member:
    """Parts in series from body a to body b; without parts these are one body."""

    a: Body
    b: Body
    parts: tuple[Part, ...]
    leg: int


@frozen
class SumOfJoints:
    """A sum of coordinates of joints, by members and parts, that a drive holds."""

    name: str  # under which it takes a preload
    drive: PlacedFreedom
    follows: tuple[int, int]
    terms: tuple[tuple[tuple[int, int], Any], ...]


@dataclass
class Assembly:
    """A machine at a posture.

    Attributes
    ----------
    base, platform : str
        Bodies, as those of members; a body is known by a key, which is no name.
    legs : list of str
        Names of what members belong to.
    members : list of Member
    points : dict of body to (3,) array
        A point of each body between members [m].
    names : dict of str to (NamedBody, (3,) array)
        What carries loads and masses, and where it is when nothing else is said [m].
    frames : dict of str to ((3, 3), (3,) arrays)
        Axes and origin of bodies that have them.
    joints : dict of str to (int, int)
        Member and part of what takes a preload.
    couplings : list of SumOfJoints
    masses : list of (PlacedMass, NamedBody)
    springs : tuple of PlacedBodySpring
    nodes : dict of str to body
        Bodies that results list by name.
    expected : str
        Names of bodies in words.
    steady : sequence of DeadForce
        On the platform at any load: with a moment (r,) [N m] besides, in balance with cables at
        that posture.
    """

    base: Body
    platform: Body
    legs: list[str] = field(default_factory=list)
    members: list[Member] = field(default_factory=list)
    points: dict[Body, np.ndarray] = field(default_factory=dict)
    names: dict[str, tuple[NamedBody, np.ndarray]] = field(default_factory=dict)
    frames: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    joints: dict[str, tuple[int, int]] = field(default_factory=dict)
    couplings: list[SumOfJoints] = field(default_factory=list)
    masses: list[tuple[PlacedMass, NamedBody]] = field(default_factory=list)
    springs: tuple[PlacedBodySpring, ...] = ()
    nodes: dict[str, Body] = field(default_factory=dict)
    expected: str = "platform or leg/part"
    steady: Sequence[DeadForce] = ()
    moment: np.ndarray = field(default_factory=lambda: np.zeros(6))


@singledispatch
def assembly_of(posed: Any) -> Assembly:
    """A robot at one pose, or a network."""
    raise TypeError(type(posed).__name__)


@assembly_of.register
def _(posed: Snapshot) -> Assembly:
    return of_legs(posed.legs, posed.platform, posed.masses, posed.springs)


def of_legs(
    legs: Sequence[PlacedLeg],
    platform: PlacedPlatform | None = None,
    masses: Iterable[PlacedMass] = (),
    springs: tuple[PlacedBodySpring, ...] = (),
) -> Assembly:
    """Legs between the base and a platform, with masses on it and springs between bodies."""
    found = Assembly(BASE, PLATFORM, springs=springs)
    ends = [PLATFORM] * len(legs)
    if platform is not None:
        ends = [platform_body(platform, node) for node in platform.holds]
    for leg, end in zip(legs, ends, strict=True):
        found.legs.append(leg.name)
        whole = _Leg(found, f"{leg.name}/", len(found.legs) - 1)
        whole.along(leg, BASE, end)
        for name, place, point in whole.blocks:  # named where nothing else has their names
            found.names.setdefault(whole.prefix + name, (place, point))
    found.masses += [(mass, NamedBody(PLATFORM)) for mass in masses]
    if platform is None:
        return found
    # the parts between its nodes, one more leg
    model, number = platform.platform, len(found.legs)
    found.legs.append(PLATFORM)
    for node in model.nodes:
        body, at = platform_body(platform, node.name), platform.in_world(model.point_of(node.name))
        found.points[body], found.nodes[node.name] = at, body
        found.names[f"{PLATFORM}/{node.name}"] = NamedBody(body, leg=number), at
        found.frames[f"{PLATFORM}/{node.name}"] = platform.rotation, at
    for part in model.parts:
        a, b = (platform_body(platform, node) for node in (part.a, part.b))
        axes = platform.rotation @ part.axes
        spring = PlacedSpring(part.name, platform.in_world(part.point), axes, part.elasticity)
        parts = () if is_rigid(spring) else (spring,)
        place = NamedBody(b, len(found.members), len(parts), number)
        found.masses += [(mass, place) for mass in platform.masses[part.name]]
        found.members.append(Member(a, b, parts, number))
    found.nodes.setdefault(model.tool, PLATFORM)
    return found


@dataclass
class _Leg:
    """A leg as members, as they are found on the way from base to platform."""

    found: Assembly
    prefix: str
    number: int
    blocks: list[tuple[str, NamedBody, np.ndarray]] = field(default_factory=list)
    named: set[str] = field(default_factory=set)

    def along(self, leg: PlacedLeg, start: Body, end: Body) -> NamedBody:
        """Add what leads from one body to another; the body behind the last element."""
        elements = [e.alone if isinstance(e, CoupledFreedom) else e for e in leg.elements]
        behind, run = [NamedBody(start, leg=self.number)], []
        goes_on = True
        for i, element in enumerate(elements):
            if not isinstance(element, PlacedBlock):
                run.append(element)
                continue
            start = self.run(run, start, None, behind)
            run, goes_on = [], any(moves(later) for later in elements[i + 1 :])
            target = self.body(element.branches[0].end) if goes_on else end
            each = [self.along(branch, start, target) for branch in element.branches]
            behind.append(each[-1])
            self.blocks.append((element.name, each[-1], np.asarray(element.branches[0].end)))
            start = target
        self.run(run, start, end if goes_on else None, behind)
        self.found.masses += [(mass, behind[mass.after]) for mass in leg.masses]
        for element in leg.elements:
            if isinstance(element, CoupledFreedom) and len(element.sum) > 1:
                joints, name = self.found.joints, self.prefix + element.name
                # one that a rigid drive holds does not move
                each = ((joints.get(self.prefix + joint), factor) for joint, factor in element.sum)
                terms = tuple((at, factor) for at, factor in each if at is not None)
                follows = self.prefix + element.joint
                self.found.names[name] = self.found.names[follows]
                self.found.couplings.append(SumOfJoints(name, element, joints[follows], terms))
        return behind[-1]

    def run(
        self, run: Sequence[Part], start: Body, end: Body | None, behind: list[NamedBody]
    ) -> Body:
        """A member to a body, or a new one; the place behind every element. The body at its end.

        What does not move before a block, or behind the last, is part of the body before it.
        """
        moving = [element for element in run if moves(element)]
        if end is None and not moving:
            for element in run:
                behind.append(behind[-1])
                self.name(element, behind[-1])
            return start
        end = self.body(moving[-1].point) if end is None else end
        number, count = len(self.found.members), 0
        for element in run:
            joint = None
            if moves(element):
                joint = (number, count) if isinstance(element, PlacedFreedom) else None
                count += 1
            behind.append(NamedBody(start, number, count, self.number))
            self.name(element, behind[-1], joint)
        self.found.members.append(Member(start, end, tuple(moving), self.number))
        return end

    def body(self, point: np.ndarray) -> Body:
        """A new body between members, by a point of it."""
        body = f"{self.prefix}{len(self.found.points)}"
        self.found.points[body] = np.asarray(point)
        return body

    def name(self, element: Part, place: NamedBody, joint: tuple[int, int] | None = None) -> None:
        """A part by its name; a joint has its body behind the last freedom, its point at the first.

        Raises
        ------
        InputError
            When another part of the leg has the name.
        """
        names, name = self.found.names, self.prefix + element.name
        if name in self.named:
            raise InputError(
                "parts of a snapshot under load",
                got=Words(f"{name}, twice"),
                expected="each name once in a leg: loads and masses are known by it",
            )
        self.named.add(name)
        names[name] = place, np.asarray(element.point)
        if joint is not None:
            self.found.joints[name] = joint
        whole = self.prefix + element.name.partition("[")[0]
        if whole != name:
            names[whole] = place, names.get(whole, names[name])[1]


def platform_body(placed: PlacedPlatform, node: str) -> Body:
    """A node of a flexible platform; its tool is the platform."""
    return PLATFORM if node == placed.platform.tool else f"{PLATFORM}/{node}"


@assembly_of.register
def _of_cables(before: CableStiffness) -> Assembly:
    """A platform in its cables, as they are without the loads.

    What cables and weight leave is held by others, as a force at the reference point and a moment.
    """
    placed, rows = before.placed, list(before.space.rows)
    missing = np.zeros(6)
    if before.answered:
        missing[rows] = before.missing_wrench
    ends = zip(placed.exit_points, placed.attachments, strict=True)
    each = zip(before.cable_names, ends, before.axial, placed.lengths, before.tensions, strict=True)
    return Assembly(
        BASE,
        PLATFORM,
        springs=tuple(
            PlacedBodySpring(name, (BASE, PLATFORM), at, *map(float, numbers), is_cable=True)
            for name, at, *numbers in each
        ),
        expected="body but the platform",
        steady=(
            DeadForce(placed.weight_force, placed.weight_point),
            DeadForce(missing[:3], placed.reference_point),
        ),
        moment=np.where(np.arange(6) < 3, 0.0, missing)[rows],
    )


@assembly_of.register
def _of_network(network: Network) -> Assembly:
    """A network, all of it one leg."""
    found = Assembly(
        network.fixed[0],
        network.platform,
        [network.name],
        nodes={node.name: node.name for node in network.nodes},
    )
    for node in network.nodes:
        found.points[node.name] = at = np.asarray(node.point, dtype=float)
        found.names[node.name] = NamedBody(node.name), at
        found.frames[node.name] = np.eye(3), at
        found.masses += [(mass, NamedBody(node.name)) for mass in node.masses]
    places: dict[tuple[str, str, str, int], tuple[int, int]] = {}
    for number, e in enumerate(network.elements):
        parts: tuple[Part, ...]
        if isinstance(e, BeamElement):
            parts = (
                PlacedSpring(e.name, e.end, e.rotation, Elasticity(e.tip_compliance, segments=())),
            )
        elif isinstance(e, SpringElement):
            parts = (PlacedSpring(e.name, e.point, e.rotation, e.elasticity),)
        else:
            several = len(e.freedoms) > 1
            names = [f"{e.name}[{i}]" if several else e.name for i in range(len(e.freedoms))]
            named = (replace(freedom, name=n) for freedom, n in zip(e.freedoms, names, strict=True))
            parts = tuple(filter(moves, named))
        if all(map(is_rigid, parts)):
            parts = ()
        found.members.append(Member(e.a, e.b, parts, 0))
        if isinstance(e, JointElement):
            moving = [i for i, freedom in enumerate(e.freedoms) if moves(freedom)]
            for k, i in enumerate(moving):
                places[e.name, e.a, e.b, i] = number, k
                found.joints.setdefault(parts[k].name, (number, k))
            continue
        for mass in e.masses:
            along = mass.start is not None and bool(parts)
            place = NamedBody(e.b, number, 1) if along else NamedBody(e.b)
            found.masses.append((mass, place))
    found.members += [Member(network.fixed[0], other, (), 0) for other in network.fixed[1:]]
    of_body = connected_parts(
        (network.fixed[0], network.platform, *found.points),
        [(m.a, m.b) for m in found.members if not m.parts],
    )
    if of_body[network.platform] == network.fixed[0]:
        raise InputError(
            f"platform of {network.name!r}",
            got=Words("one that rigid parts hold"),
            expected="one that moves against the fixed bodies",
        )
    others = [name for name in dict.fromkeys(of_body.values()) if name != network.fixed[0]]
    listed = ", ".join([str(name) for name in others if name != network.platform][:5])
    found.expected = f"the name of a body that moves, or platform: {listed}"
    still = {name for name, body in of_body.items() if body == network.fixed[0]}
    found.names = {name: at for name, at in found.names.items() if name not in still}
    moving = ((m, at) for m, at in found.masses if at.member is not None or at.body not in still)
    found.masses = list(moving)
    for one in network.couplings:
        terms = [
            (places[key], joint.freedoms[i], factor)
            for joint, i, factor in one.terms
            if (key := (joint.name, joint.a, joint.b, i)) in places
        ]
        if terms:
            follows, freedom, _ = terms[0]
            role = Locked(one.stiffness)
            drive = replace(freedom, name=one.name, role=role, coordinate=None)
            every = tuple((at, factor) for at, _, factor in terms)
            found.couplings.append(SumOfJoints(one.name, drive, follows, every))
    return found
