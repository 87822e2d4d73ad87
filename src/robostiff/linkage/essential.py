"""The part of a linkage that determines the stiffness of its platform, as a network or a robot."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.kinematics import PlacedChain, place_chain
from robostiff.kinematics.masses_and_springs import placed_with_masses
from robostiff.kinematics.spanning_tree import branches, connected_parts, spanning_tree
from robostiff.linkage.linkage import Configuration, Connection, Linkage, turned_round
from robostiff.model import (
    Chain,
    Coupling,
    Element,
    Joint,
    Leg,
    Link,
    Mass,
    PlacedLeg,
    Rigid,
    Robot,
    Role,
    Snapshot,
)
from robostiff.network import JointElement, Network, Node, SpringElement
from robostiff.spatial import Frame

_APART = 1e-9


def essential(linkage: Linkage) -> Linkage:
    """The linkage between base and platform, with welded bodies merged.

    What remains are the connections on the ways from base to platform that pass no body twice.
    Fingers of a gripper, a second arm without contact and a loop on the tool are left out.

    Raises
    ------
    InputError
        When nothing connects the platform with the base, the two are welded together, or welds
        between the same bodies contradict each other.
    """
    places = welded_places(linkage)
    if places[linkage.base][0] == places[linkage.platform][0]:
        raise InputError(
            f"platform {linkage.platform!r}",
            got=Words(f"a body that is fixed to the base {linkage.base!r}"),
            expected="one that joints or elastic parts connect with the base",
        )
    kept = []
    for c in linkage.connections:
        (a, at_a), (b, at_b) = places[c.a], places[c.b]
        if c.element is not None and a != b:
            moved = replace(c, a=a, b=b, before=at_a @ c.before, after=c.after @ at_b.inverse)
            kept.append(moved)
    masses: dict[str, list[Mass]] = defaultdict(list)
    for body, several in linkage.masses.items():
        if body in places:
            whole, place = places[body]
            masses[whole] += [mass.seen_from(place) for mass in several]
    return _between_base_and_platform(_with(linkage, tuple(kept), masses))


def welded_places(linkage: Linkage) -> dict[str, tuple[str, Frame]]:
    """For every body the one that it becomes part of, and its frame in that one.

    Raises
    ------
    InputError
        When welds contradict each other.
    """
    welds = [c for c in linkage.connections if c.element is None]
    places: dict[str, tuple[str, Frame]] = {}
    for whole in (linkage.base, linkage.platform, *linkage.bodies):
        if whole in places:
            continue
        tree = spanning_tree(whole, welds)
        for body, way in tree.ways.items():
            frame = Frame.identity()
            if way:
                weld, sign = way[-1]
                across = weld.before @ weld.after
                start = places[weld.a if sign > 0 else weld.b][1]
                frame = start @ (across if sign > 0 else across.inverse)
            places[body] = whole, frame
        for weld in tree.cuts:
            one, other = places[weld.a][1] @ weld.before @ weld.after, places[weld.b][1]
            size = 1.0 + float(np.abs(one.p).max())
            apart = np.abs(one.p - other.p).max() / size, np.abs(one.R - other.R).max()
            if max(apart) > _APART:
                raise InputError(
                    f"weld {weld.name!r} between {weld.a!r} and {weld.b!r}",
                    got=Words("bodies that are fixed to each other elsewhere, in another place"),
                    expected="a weld that fits",
                )
    return places


def _between_base_and_platform(linkage: Linkage) -> Linkage:
    """Connections of bodies that no single other body separates from base and platform.

    Only a body at which connections branch does so, or base or platform.
    """
    ground, at = {linkage.base, linkage.platform}, defaultdict[str, set[str]](set)
    ends = {c.name: (c.a, c.b) for c in linkage.connections}
    for name, pair in ends.items():
        for body in pair:
            at[body].add(name)
    loose = [body for body, names in at.items() if len(names) == 1 and body not in ground]
    for body in loose:  # what hangs on one connection, then what hung on that
        for name in at.pop(body):
            (other,) = set(ends.pop(name)) - {body}
            at[other].discard(name)
            if len(at[other]) == 1 and other not in ground:
                loose.append(other)
    bodies = set(at)
    for cut in [body for body, names in at.items() if len(names) != 2 or body in ground]:
        rest = [body for body in at if body != cut]
        first = connected_parts(rest, [pair for pair in ends.values() if cut not in pair])
        grounded = {first[body] for body in ground - {cut}}
        bodies -= {body for body, part in first.items() if part not in grounded}
    kept = tuple(c for c in linkage.connections if {c.a, c.b} <= bodies)
    others = [c for c in linkage.connections if not {c.a, c.b} <= bodies]
    return _with(linkage, kept, _with_others(linkage.masses, kept, others))


def _with_others(
    masses: Mapping[str, Sequence[Mass]], kept: Sequence[Connection], others: list[Connection]
) -> dict[str, list[Mass]]:
    """Masses of the bodies that connections keep, and of what hangs on these by others.

    What hangs there, such as the fingers of a gripper, carries no load: it is where its joints are
    at home.
    """
    carriers = {body: (body, Frame.identity()) for c in kept for body in (c.a, c.b)}
    waiting = list(carriers)
    total = {body: list(masses.get(body, ())) for body in carriers}
    rest = list(others)
    while waiting:
        body = waiting.pop()
        whole, place = carriers[body]
        for c in [one for one in rest if body in (one.a, one.b)]:
            rest.remove(c)
            start = Frame.identity() if body == c.a else _across(c).inverse
            if isinstance(c.element, Link):
                begin, to = place @ start @ c.before, c.element.to
                total[whole] += [_of_rod(mass, to).seen_from(begin) for mass in c.element.masses]
            other = c.b if body == c.a else c.a
            if other not in carriers:
                seen = place @ (_across(c) if body == c.a else start)
                carriers[other] = whole, seen
                waiting.append(other)
                total[whole] += [mass.seen_from(seen) for mass in masses.get(other, ())]
    return total


def _of_rod(mass: Mass, to: np.ndarray) -> Mass:
    """The same mass of a link without load: one that is spread along it as of a thin rod."""
    if mass.centre is not None:
        return mass
    (first, last), inertia = mass.span or (0.0, 1.0), mass.inertia
    if mass.is_spread and mass.value > 0:
        inertia = mass.value * (last - first) ** 2 / 12 * (to @ to * np.eye(3) - np.outer(to, to))
    return replace(mass, centre=0.5 * (first + last) * to, span=None, inertia=inertia)


def _across(c: Connection) -> Frame:
    """Frame of body b in that of body a, its joint at home."""
    end = place_chain(c.chain, c.home, c.before.R, c.before.p)
    return Frame(end.R, end.p) @ c.after


def _with(
    linkage: Linkage, kept: tuple[Connection, ...], masses: Mapping[str, Sequence[Mass]]
) -> Linkage:
    ends = {body for c in kept for body in (c.a, c.b)}
    if not {linkage.base, linkage.platform} <= ends:
        raise InputError(
            f"platform {linkage.platform!r}",
            got=Words(f"nothing between it and the base {linkage.base!r}"),
            expected="joints or elastic parts that connect them",
            hint="floating joints connect nothing",
        )
    fixed = linkage.held & {c.name for c in kept}
    of_bodies = {body: tuple(several) for body, several in masses.items() if several}
    return replace(linkage, connections=kept, held=fixed, masses=of_bodies)


def placed_branches(
    part: Linkage,
    q: Mapping[str, np.ndarray],
    start_of: Callable[[Connection], tuple[np.ndarray, np.ndarray]],
) -> Iterator[tuple[str, str, list[tuple[Connection, PlacedChain]]]]:
    """Series paths between bodies at which connections branch: the bodies, and what is between.

    Connections are placed where they begin in the world, at coordinates of numbers or of entries.
    """
    for a, b, path in branches([(c.a, c.b) for c in part.connections], (part.base, part.platform)):
        connections = (part.connections[i] for i, _ in path)
        yield a, b, [(c, place_chain(c.chain, q[c.name], *start_of(c))) for c in connections]


def branches_of_linkage(
    part: Linkage, samples: Sequence[Configuration]
) -> tuple[Snapshot, list[tuple[int, int]]]:
    """Series paths between the bodies of an essential linkage, placed at N configurations.

    With them come the bodies between which each leads: 0 the base, 1 the platform.
    """

    def frame_of(body: str) -> tuple[np.ndarray, np.ndarray]:
        R, p = zip(*(one.places[body] for one in samples), strict=True)
        return np.array(R), np.array(p)

    def start_of(c: Connection) -> tuple[np.ndarray, np.ndarray]:
        R, p = frame_of(c.a)
        return R @ c.before.R, p + R @ c.before.p

    q = {}
    for c in part.connections:
        rows = np.array([one.coordinates.get(c.name, ()) for one in samples])
        q[c.name] = rows.reshape(len(samples), c.chain.size)
    legs, ends, number = [], [], {part.base: 0, part.platform: 1}
    for a, b, path in placed_branches(part, q, start_of):
        elements = [
            replace(element, name=f"{c.name}/{element.name}")
            for c, placed in path
            for element in placed.elements
        ]
        legs.append(PlacedLeg(f"branch {len(legs)}", tuple(elements), path[-1][1].p))
        ends.append((number.setdefault(a, len(number)), number.setdefault(b, len(number))))
    R, p = frame_of(part.platform)
    return Snapshot(part.name, tuple(legs), p + R @ part.reference_point), ends


def network_of(part: Linkage, found: Configuration) -> Network:
    """An essential linkage in a closed configuration as a network."""
    platform = found.frames[part.platform]
    joints, springs, nodes = [], [], []
    for body in part.bodies:
        frame = found.frames[body]
        at_node = (mass.placed(mass.name, frame.R, frame.p) for mass in part.masses.get(body, ()))
        nodes.append(Node(body, frame.p, tuple(chain.from_iterable(at_node))))
    for c in part.connections:
        base = found.frames[c.a] @ c.before
        leg = placed_with_masses(c.name, c.chain, found.coordinates[c.name], base.R, base.p)
        if isinstance(c.element, Link):
            (spring,) = leg.springs
            masses = tuple(replace(mass, after=0) for mass in leg.masses)
            place = spring.point, spring.rotation, spring.elasticity
            springs.append(SpringElement(c.name, c.a, c.b, *place, masses))
        else:
            joints.append(JointElement(c.name, c.a, c.b, tuple(leg.freedoms)))
    return Network(
        part.name,
        tuple(nodes),
        (part.base,),
        part.platform,
        platform.p + platform.R @ part.reference_point,
        springs=tuple(springs),
        joints=tuple(joints),
        description=part.title,
    )


def with_roles(part: Linkage, roles: Mapping[str, Role]) -> Linkage:
    """The linkage with other roles of some of its joints, by their names."""
    connections = tuple(
        replace(c, element=replace(c.element, role=roles[c.name]))
        if c.name in roles and isinstance(c.element, Joint)
        else c
        for c in part.connections
    )
    return replace(part, connections=connections)


def robot_of(
    part: Linkage, found: Configuration, couplings: Sequence[Coupling] = ()
) -> Robot | None:
    """An essential linkage as a serial arm or a parallel robot; None when its legs are connected.

    A closed configuration becomes the home configuration. All six coordinates of the platform are
    its coordinates; a serial arm has none, and is posed by its joints.

    Parameters
    ----------
    part : Linkage
        From `essential`.
    found : Configuration
        Of that part, closed.
    couplings : sequence of Coupling
        Of its joints, each between those of one leg.

    Raises
    ------
    InputError
        When a leg has no compliance at all, or joints of different legs are coupled.
    """
    ends, connections = (part.base, part.platform), []
    # A description has zero coordinates where no posture was chosen.
    chosen = any(np.any(q) for q in found.coordinates.values())
    for c in part.connections:
        element = c.element
        if isinstance(element, Joint):
            home = tuple(found.coordinates[c.name].tolist())
            element = replace(element, home=home, home_given=chosen)
        connections.append(replace(c, element=element))
    ways = list(branches([(c.a, c.b) for c in connections], ends))
    if any((a, b) != ends for a, b, _ in ways):
        return None
    legs, serial = [], len(ways) == 1
    for path in sorted((path for *_, path in ways), key=lambda path: path[0]):
        way = [connections[i] if forward else turned_round(connections[i]) for i, forward in path]
        elements, end = _elements(way, part.masses), way[-1].after
        if serial:  # an arm ends in the frame of the platform
            elements += _rigid(end, "the platform")
            legs.append(Leg(part.name, way[0].before, Chain(tuple(elements)), Frame.identity()))
        else:  # a leg ends where it meets the platform
            attachment = Frame(end.inverse.R + 0.0, end.inverse.p + 0.0)  # without negative zeros
            legs.append(Leg(way[0].name, way[0].before, Chain(tuple(elements)), attachment))
    legs = _coupled(legs, couplings)
    robot = Robot(
        part.name,
        legs,
        home=found.frames[part.platform],
        reference_point=part.reference_point,
        title=part.title,
        source=part.source,
        platform_masses=part.masses.get(part.platform, ()),
    )
    return replace(robot, home=None, coordinates=()) if serial else robot


def _coupled(legs: Sequence[Leg], couplings: Sequence[Coupling]) -> tuple[Leg, ...]:
    of_leg: dict[int, list[Coupling]] = {}
    for one in couplings:
        names = {name for name, _ in one.terms}
        fits = [i for i, leg in enumerate(legs) if names <= {e.name for e, _ in leg.chain.moving}]
        if not fits:
            raise InputError(
                f"joints {', '.join(map(repr, sorted(names)))}",
                got=Words("joints of different legs, one of which follows the other"),
                expected=f"joints of one leg, or a role of its own for {one.terms[0][0]!r}",
            )
        of_leg.setdefault(fits[0], []).append(one)
    return tuple(
        replace(leg, chain=Chain(leg.chain.elements, tuple(of_leg.get(i, ()))))
        for i, leg in enumerate(legs)
    )


def _elements(chain: list[Connection], masses: Mapping[str, tuple[Mass, ...]]) -> list[Element]:
    elements: list[Element] = []
    way = Frame.identity()
    for i, connection in enumerate(chain):
        if i > 0:
            to, body = way @ connection.before, connection.a
            mass = tuple(m.seen_from(way) for m in masses.get(body, ()))
            elements += [Rigid(to, f"body {body}", mass)] if mass else _rigid(to, connection.name)
        if connection.element is not None:
            elements.append(connection.element)
        way = connection.after
    return elements


def _rigid(frame: Frame, name: str) -> list[Element]:
    if np.array_equal(frame.R, np.eye(3)) and not np.any(frame.p):
        return []
    return [Rigid(frame, f"before {name}")]
