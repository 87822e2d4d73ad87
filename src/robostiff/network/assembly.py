"""A robot of legs as bodies, and as members in series between them; the network of these.

A member leads from one body to another through parts in series: the run of a leg between two
parallel blocks, a part of a flexible platform, an element of a network. Numbers, or entries of a
record.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any, NamedTuple

import numpy as np

from robostiff.errors import InputError
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.model import (
    CoupledFreedom,
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
from robostiff.model.snapshot import PlacedElement
from robostiff.network.elements import CouplingElement, JointElement, Node, SpringElement
from robostiff.network.network import Network

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
    """A machine at a posture."""

    #: base, platform: bodies, as those of members; a body is known by a key, which is no name
    base: Body
    platform: Body
    legs: list[str] = field(default_factory=list)  #: names of what members belong to
    members: list[Member] = field(default_factory=list)
    #: a point of each body between members [m]
    points: dict[Body, np.ndarray] = field(default_factory=dict)
    #: what carries loads and masses, and where it is when nothing else is said [m]
    names: dict[str, tuple[NamedBody, np.ndarray]] = field(default_factory=dict)
    #: axes and origin of bodies that have them
    frames: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    #: member and part of what takes a preload
    joints: dict[str, tuple[int, int]] = field(default_factory=dict)
    couplings: list[SumOfJoints] = field(default_factory=list)
    #: list of (PlacedMass, NamedBody)
    masses: list[tuple[PlacedMass, NamedBody]] = field(default_factory=list)
    springs: tuple[PlacedBodySpring, ...] = ()
    nodes: dict[str, Body] = field(default_factory=dict)  #: bodies that results list by name
    expected: str = "platform or leg/part"  #: names of bodies in words
    #: sequence of DeadForce: on the platform at any load: with a moment (r,) [N m] besides, in
    #: balance with cables at that posture
    steady: Sequence[Any] = ()
    moment: np.ndarray = field(default_factory=lambda: np.zeros(6))

    def body_of_name(self, name: str, subject: str) -> tuple[NamedBody, np.ndarray | None]:
        """A body by its name, and its point; None of the platform, which has its own.

        Raises InputError when there is none.
        """
        if name == PLATFORM:
            return NamedBody(self.platform), None
        if name not in self.names:
            raise unknown_name(subject, name, self.names, self.expected)
        return self.names[name]


def unknown_name(subject: str, name: object, known: Iterable[str], what: str) -> InputError:
    """An error that names what is alike to a name, or the first that there are."""
    known = list(known)
    near = ", ".join(map(repr, get_close_matches(str(name), known, n=3) or known[:3]))
    alone = what.removeprefix("a ").removeprefix("an ")
    expected = f"{what}, such as {near}" if known else f"none: there is no {alone}"
    return InputError(subject, got=name, expected=expected)


def moves(element: PlacedElement) -> bool:
    """Whether it is no joint that is held rigidly."""
    if isinstance(element, PlacedFreedom):
        return element.is_passive or element.stiffness is not None
    return True


def is_rigid(element: PlacedElement) -> bool:
    """Whether it is an elastic part without compliance."""
    return isinstance(element, PlacedSpring) and element.elasticity.is_rigid


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
        """A part by its name; of a joint its last body, and the point of its first freedom."""
        names, name = self.found.names, self.prefix + element.name
        names[name] = place, np.asarray(element.point)
        if joint is not None:
            self.found.joints[name] = joint
        whole = self.prefix + element.name.partition("[")[0]
        if whole != name:
            names[whole] = place, names.get(whole, names[name])[1]


def platform_body(placed: PlacedPlatform, node: str) -> Body:
    """A node of a flexible platform; its tool is the platform."""
    return PLATFORM if node == placed.platform.tool else f"{PLATFORM}/{node}"


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
    return network_of_legs(snapshot).network


class LegsInNetwork(NamedTuple):
    """A robot of legs as a network, and where its bodies are in it."""

    network: Network
    of_parts: dict[str, str]  # node behind each part, by leg/part
    of_platform: dict[str, str]  # node of each node of a flexible platform


@kept
def network_of_legs(snapshot: Snapshot) -> LegsInNetwork:
    """As `network_of_snapshot`, with where bodies are in it."""
    found = of_legs(snapshot.legs, snapshot.platform, snapshot.masses)
    points = {BASE: snapshot.centre, **found.points, PLATFORM: snapshot.reference_point}
    along, masses = (defaultdict[Any, list[PlacedMass]](list) for _ in range(2))
    for mass, at in found.masses:
        if mass.start is not None and at.parts:
            along[at.member, at.parts - 1].append(replace(mass, after=0))
    bodies: list[list[str]] = []
    joints: dict[tuple[int, int], JointElement] = {}
    springs: list[SpringElement] = []
    for i, member in enumerate(found.members):
        leg, last = found.legs[member.leg], len(member.parts) - 1
        bodies.append([member.a])
        for k, part in enumerate(member.parts):
            body = member.b if k == last else f"{i + 1} {leg}, after {k + 1} {part.name}"
            points.setdefault(body, np.asarray(part.point, dtype=float))
            ends = bodies[-1][-1], body
            bodies[-1].append(body)
            if isinstance(part, PlacedFreedom):
                joints[i, k] = JointElement(leg, *ends, (part,))
            else:
                own = part.point, part.rotation, part.elasticity, tuple(along[i, k])
                springs.append(SpringElement(f"{leg}/{part.name}", *ends, *own))
        if not member.parts:
            joints[i, 0] = JointElement(leg, member.a, member.b)

    def node(at: NamedBody) -> str:
        return at.body if at.member is None else bodies[at.member][at.parts]

    for mass, at in found.masses:
        if mass.start is None or not at.parts:
            masses[node(at)].append(replace(mass, after=0))
    couplings = []
    for own in found.couplings:
        terms = tuple((joints[at], 0, factor) for at, factor in own.terms)
        couplings.append(CouplingElement(own.name, terms, own.drive.stiffness))
    network = Network(
        snapshot.name,
        tuple(Node(name, at, tuple(masses[name])) for name, at in points.items()),
        (BASE,),
        PLATFORM,
        snapshot.reference_point,
        springs=tuple(springs),
        joints=tuple(joints.values()),
        space=snapshot.space,
        description=snapshot.description,
        couplings=tuple(couplings),
        gravity=snapshot.gravity,
    )
    of_parts = {name: node(at) for name, (at, _) in found.names.items()}
    return LegsInNetwork(network, of_parts, found.nodes)
