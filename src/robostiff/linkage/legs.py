"""A linkage whose bodies form legs between base and platform, as a robot of the model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from robostiff.elasticity import moved
from robostiff.errors import InputError
from robostiff.linkage.closure import Configuration
from robostiff.linkage.linkage import Connection, Linkage
from robostiff.model import (
    Chain,
    Coupling,
    Element,
    Joint,
    JointKind,
    Leg,
    Link,
    Mass,
    Rigid,
    Robot,
    Role,
)
from robostiff.spatial import Frame


def turned_round(connection: Connection) -> Connection:
    """The same connection from body b to body a; home coordinates give the same configuration.

    A joint keeps its coordinates, in reverse order, for its axes are reversed.
    """
    element = connection.element
    if isinstance(element, Joint):
        element = _joint(element)
    elif isinstance(element, Link):
        element = _link(element)
    return Connection(
        connection.name,
        connection.b,
        connection.a,
        connection.after.inverse,
        element,
        connection.before.inverse,
    )


def _joint(joint: Joint) -> Joint:
    if joint.kind is JointKind.SPHERICAL:  # whose coordinates are a rotation vector
        return replace(joint, home=tuple(-x for x in joint.home))
    freedoms = tuple(replace(screw, axis=-screw.axis) for screw in reversed(joint.freedoms))
    return replace(joint, freedoms=freedoms, home=joint.home[::-1])


def _link(link: Link) -> Link:
    # By energy: the wrench is the same at both ends, taken about the other one.
    to = np.asarray(link.to)
    elasticity = moved(link.elasticity, link.axes, -to)
    return Link(-to, elasticity, np.eye(3), link.name, tuple(_mass(m, to) for m in link.masses))


def _mass(mass: Mass, to: np.ndarray) -> Mass:
    """The same mass seen from the other end of its link."""
    if mass.centre is not None:
        return replace(mass, centre=mass.centre - to)
    return mass if mass.span is None else replace(mass, span=(1 - mass.span[1], 1 - mass.span[0]))


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
    chains = _chains(_with_closed_home(part, found))
    if chains is None:
        return None
    serial = len(chains) == 1
    if serial:
        legs = (_arm(part.name, chains[0], part.masses),)
    else:
        legs = tuple(_leg(chain[0].name, chain, part.masses) for chain in chains)
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
    own: dict[int, list[Coupling]] = {}
    for one in couplings:
        names = {name for name, _ in one.terms}
        fits = [i for i, leg in enumerate(legs) if names <= {e.name for e, _ in leg.chain.moving}]
        if not fits:
            raise InputError(
                f"joints {', '.join(map(repr, sorted(names)))}",
                got="joints of different legs, one of which follows the other",
                expected=f"joints of one leg, or a role of its own for {one.terms[0][0]!r}",
            )
        own.setdefault(fits[0], []).append(one)
    return tuple(
        replace(leg, chain=Chain(leg.chain.elements, tuple(own.get(i, ()))))
        for i, leg in enumerate(legs)
    )


def _with_closed_home(part: Linkage, found: Configuration) -> Linkage:
    at_home = []
    # A description has zero coordinates where no posture was chosen.
    chosen = any(np.any(q) for q in found.coordinates.values())
    for c in part.connections:
        element = c.element
        if isinstance(element, Joint):
            home = tuple(found.coordinates[c.name].tolist())
            element = replace(element, home=home, home_given=chosen)
        at_home.append(replace(c, element=element))
    return replace(part, connections=tuple(at_home))


def _chains(part: Linkage) -> list[list[Connection]] | None:
    """Connections of each leg from base to platform, or None."""
    ends = Counter(body for c in part.connections for body in (c.a, c.b))
    between = {body for body in ends if body not in (part.base, part.platform)}
    if any(ends[body] != 2 for body in between):
        return None
    at: dict[str, list[Connection]] = {body: [] for body in ends}
    for c in part.connections:
        at[c.a].append(c)
        at[c.b].append(c)
    chains = []
    for first in at[part.base]:
        chain, body, step = [], part.base, first
        while True:
            forward = step.a == body
            chain.append(step if forward else turned_round(step))
            body = step.b if forward else step.a
            if body == part.platform:
                break
            (step,) = (c for c in at[body] if c is not step)
        chains.append(chain)
    return chains


_Masses = Mapping[str, tuple[Mass, ...]]


def _arm(name: str, chain: list[Connection], masses: _Masses) -> Leg:
    """A serial arm, whose chain ends in the frame of the platform."""
    end = _rigid(chain[-1].after, "the platform")
    elements = Chain((*_elements(chain, masses), *end))
    return Leg(name, chain[0].before, elements, Frame.identity())


def _leg(name: str, chain: list[Connection], masses: _Masses) -> Leg:
    """A leg, whose chain ends where it meets the platform."""
    end = chain[-1].after.inverse
    attachment = Frame(end.R + 0.0, end.p + 0.0)  # without negative zeros
    return Leg(name, chain[0].before, Chain(tuple(_elements(chain, masses))), attachment)


def _elements(chain: list[Connection], masses: _Masses) -> list[Element]:
    elements: list[Element] = []
    way = Frame.identity()
    for i, connection in enumerate(chain):
        if i > 0:
            to, body = way @ connection.before, connection.a
            own = tuple(mass.seen_from(way) for mass in masses.get(body, ()))
            elements += [Rigid(to, f"body {body}", own)] if own else _rigid(to, connection.name)
        if connection.element is not None:
            elements.append(connection.element)
        way = connection.after
    return elements


def _rigid(frame: Frame, name: str) -> list[Element]:
    if np.array_equal(frame.R, np.eye(3)) and not np.any(frame.p):
        return []
    return [Rigid(frame, f"before {name}")]
