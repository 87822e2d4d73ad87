"""Machines of any kind as lines, faces and joints, each with the body that it belongs to."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from functools import singledispatch
from typing import Any

import numpy as np

from robostiff.frozen import frozen
from robostiff.kept import kept
from robostiff.markup import quantity
from robostiff.model import PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring, Role, Snapshot
from robostiff.network import Network, SpringElement
from robostiff.plot.displacement import PLATFORM, end_key, node_key
from robostiff.plot.picture import LineWeight, PlainColour, Shape
from robostiff.plot.surfaces import plate
from robostiff.spatial import Space

_IN_PLANE = 1e-3  # of the machine
_SAME = 1e-9  # of the machine: closer points are one
_SEEN = 1e-3  # of the machine: a line
_NAMED = 24  # joints of a network: more names would cover the picture
_LISTED = 8  # parts of a network that have names in the legend
_GROUND = ""


@frozen
class PointOfBody:
    """A point (3,) of a body [m]."""

    point: np.ndarray
    body: str


@frozen
class Line:
    """A line between two bodies."""

    start: PointOfBody
    end: PointOfBody
    leg: str = ""
    part: str = ""  # of the leg; none where it is rigid
    weight: LineWeight = LineWeight.BOLD
    bends: bool = False  # whether it is bent as its ends move, as a beam
    paint: PlainColour | None = None  # None for the colour of the part
    is_dashed: bool = False
    about: str = ""  # its description, where it is not the name
    label: str = ""  # its name in the legend
    has_ghost: bool = True  # whether it is drawn at rest, too, beside a deformed shape


@frozen
class Plate:
    """A face between points of a body."""

    corners: np.ndarray  # (n, 3)
    body: str
    paint: PlainColour
    label: str = ""


@frozen
class JointPoint:
    """A freedom, in the leg or the joint that owns it."""

    at: PointOfBody
    owner: str
    name: str
    role: Role


@frozen
class Spots:
    """Marks at points; those of a part have its colour."""

    at: tuple[PointOfBody, ...]
    shape: Shape
    label: str
    names: tuple[str, ...] = ()
    part: str = ""


@frozen
class Outline:
    """What is drawn of a machine."""

    point: PointOfBody  # the reference point of the platform
    size: float  # length of the machine [m]
    is_level: bool  # whether it is planar, or lies in one plane z = constant
    lines: tuple[Line, ...]
    plates: tuple[Plate, ...]
    joints: tuple[JointPoint, ...] = ()
    spots: tuple[Spots, ...] = ()
    words: tuple[tuple[PointOfBody, str], ...] = ()  # names of joints
    part_names: tuple[str, ...] = ()  # of parts that colours distinguish
    is_named: bool = False  # whether parts and joints always are, as of an arm and of a network
    has_legend: bool = True  # whether its parts are few enough for one

    @property
    def anchors(self) -> list[PointOfBody]:
        """Points that move with the bodies."""
        ends = [end for line in self.lines for end in (line.start, line.end)]
        return [self.point, *ends, *(joint.at for joint in self.joints)]


@singledispatch
def outline_of(posed: Any) -> Outline:
    """The outline of a snapshot, a network or a cable robot with its tensions."""
    placed, known = posed.placed, bool(np.all(posed.answered))
    return of_cables(
        posed.cable_names,
        (placed.exit_points, placed.attachments),
        placed.reference_point,
        posed.space,
        posed.tensions if known else None,
    )


@outline_of.register(Snapshot)
@kept
def _of_snapshot(snapshot: Snapshot) -> Outline:
    """The outline of a robot of legs at a single pose."""
    at, feet = snapshot.reference_point, [_foot(leg) for leg in snapshot.legs]
    points = [[leg.end, *(part.point for part in leg.parts)] for leg in snapshot.legs]
    size = size_of([at, *feet, *(p for group in points for p in group)])
    joints = [list(_joints(leg, f"{leg.name}/", _GROUND, leg.name)) for leg in snapshot.legs]
    # of legs whose joints have the same names, those of the first
    named = {tuple(joint.name for joint in group): group for group in reversed(joints)}
    # the face between the ends of the legs; a point away from it, or from one leg, is tied
    ends = np.array([leg.end for leg in snapshot.legs])
    top, weight, tied = plate(ends), LineWeight.THIN, ends.mean(axis=0)[None]
    if top is None:
        away = np.linalg.norm(ends - at, axis=1)
        weight, tied = LineWeight.LINE, ends[: len(ends) if away.max() > _SAME else 0]
    plates = [] if top is None else [Plate(top, PLATFORM, PlainColour.PLATE, "platform")]
    to, muted = PointOfBody(at, PLATFORM), PlainColour.MUTED
    lines = [
        Line(PointOfBody(p, PLATFORM), to, weight=weight, paint=muted, has_ghost=False)
        for p in tied
    ]
    base = plate(np.array(feet))
    names = [
        part.name
        for leg in snapshot.legs
        for part in leg.parts
        if isinstance(part, PlacedSpring) or part.slides or not part.is_passive
    ]
    if snapshot.platform is not None:
        tree = snapshot.platform.platform
        nodes = {
            node.name: PointOfBody(snapshot.platform.in_world(node.at), node_key(node.name))
            for node in tree.nodes
        }
        plates = []
        lines = [Line(nodes[p.a], nodes[p.b], PLATFORM, p.name, bends=True) for p in tree.parts]
        names += [part.name for part in tree.parts if np.any(part.elasticity.compliance)]
    for i, leg in enumerate(snapshot.legs):
        # without rigid lines too short to be visible
        apart = _SAME * (size_of([feet[i], *points[i]]) or 1.0)
        for line in _along(leg, leg.name, _GROUND, end_key(snapshot, i), []):
            if line.part or np.linalg.norm(line.end.point - line.start.point) > apart:
                lines.append(line)
    if base is not None:
        plates.insert(0, Plate(base, _GROUND, PlainColour.FAINT))
    level = np.ptp([p[2] for p in (at, *(x for group in points for x in group))]) <= _SAME * size
    return Outline(
        PointOfBody(at, PLATFORM),
        size,
        snapshot.space is Space.PLANAR or bool(level),
        tuple(lines),
        tuple(plates),
        tuple(joint for leg in joints for joint in leg),
        words=tuple((joint.at, joint.name) for leg in reversed(named.values()) for joint in leg),
        part_names=tuple(names),
        is_named=len(snapshot.legs) == 1,
    )


def _along(
    leg: PlacedLeg, name: str, body: str, end: str, starts: list[PointOfBody]
) -> Iterator[Line]:
    """Lines from places, or from the first element, to the end of a leg or a branch."""
    first = leg.elements[0]
    if isinstance(first, PlacedSpring):
        clamped = PointOfBody(clamped_end(first), body)
        yield from (Line(place, clamped, name, weight=LineWeight.LINE) for place in starts)
        starts = [clamped]
    slid = ""
    for element in leg.elements:
        behind = f"{name}/{element.name}"
        if isinstance(element, PlacedBlock):
            # a block begins where its branches begin; ends of a block before it meet at the first
            yield from (_rigid_line(place, starts[0], name, "") for place in starts[1:])
            for branch in element.branches:
                yield from _along(branch, name, body, behind, starts[:1])
            starts, slid = [PointOfBody(branch.end, behind) for branch in element.branches], ""
        elif isinstance(element, PlacedSpring):
            at = PointOfBody(element.point, behind)
            yield from (Line(place, at, name, element.name, bends=True) for place in starts)
            starts, slid = [at], ""
        else:
            at = PointOfBody(element.point, body)
            yield from (_rigid_line(place, at, name, slid) for place in starts)
            # a rail belongs to the body before the slide, whatever the position of the slide
            starts, slid = [at], element.name if element.slides else ""
        body = behind
    yield from (_rigid_line(place, PointOfBody(leg.end, end), name, slid) for place in starts)


def _rigid_line(start: PointOfBody, end: PointOfBody, leg: str, slid: str) -> Line:
    """A rigid line, or the rail of a slide."""
    return Line(start, end, leg, slid, LineWeight.BOLD if slid else LineWeight.LINE)


def _joints(leg: PlacedLeg, prefix: str, body: str, owner: str) -> Iterator[JointPoint]:
    """Joints of a leg, with the body before them; those of branches are the leg's."""
    for element in leg.elements:
        if isinstance(element, PlacedFreedom):
            yield JointPoint(PointOfBody(element.point, body), owner, element.name, element.role)
        elif isinstance(element, PlacedBlock):
            for branch in element.branches:
                yield from _joints(branch, prefix, body, owner)
        body = prefix + element.name


def _foot(leg: PlacedLeg) -> np.ndarray:
    """Point of a leg on the base (3,) [m]: its first joint, or the start of its first beam."""
    first = leg.elements[0]
    if isinstance(first, PlacedBlock):
        return np.mean([_foot(branch) for branch in first.branches], axis=0)
    return first.point if isinstance(first, PlacedFreedom) else clamped_end(first)


def clamped_end(spring: PlacedSpring | SpringElement) -> np.ndarray:
    """Start (3,) of an elastic part of which only the far end is given.

    Its centre of compliance, where a force alone does not turn it, lies half-way: exact for a
    uniform beam; a spring in a point begins where it ends.
    """
    C = spring.elasticity.compliance
    if not np.any(C[:3, 3:]):
        return spring.point
    coupling = C[:3, 3:] @ np.linalg.pinv(C[3:, 3:])
    to_centre = 0.5 * np.array(
        [
            coupling[2, 1] - coupling[1, 2],
            coupling[0, 2] - coupling[2, 0],
            coupling[1, 0] - coupling[0, 1],
        ]
    )
    return spring.point + 2 * spring.rotation @ to_centre


@outline_of.register(Network)
@kept
def _of_network(network: Network) -> Outline:
    """The outline of bodies, beams, springs and joints in any arrangement."""
    # points of attachment of each body that has some, each point once
    bodies, attached = {}, defaultdict(list)
    for place, point in zip(*network.attachments, strict=True):
        attached[network.nodes[place].name].append(point)
    for name, attachments in attached.items():
        whole = [*attachments, *([network.reference_point] if name == network.platform else [])]
        extent = float(np.max(np.ptp(np.array(whole), axis=0)))
        apart: list[np.ndarray] = []
        for point in whole:
            if all(np.linalg.norm(point - other) > _SAME * extent for other in apart):
                apart.append(point)
        bodies[name] = np.array(apart)
    points = np.concatenate([network.reference_point[None], *bodies.values()])
    size = size_of(points)
    lines: list[Line] = []
    plates: list[Plate] = []
    for name, of_body in bodies.items():
        is_fixed = name in network.fixed
        corners = _flat_face(of_body)
        if corners is not None:
            paint = PlainColour.FAINT if is_fixed else PlainColour.PLATE
            label = PLATFORM if name == network.platform else ""
            plates.append(Plate(corners, name, paint, label))
        middle = PointOfBody(of_body.mean(axis=0) if len(of_body) > 2 else of_body[-1], name)
        paint = PlainColour.MUTED if is_fixed else PlainColour.INK
        for p in of_body if len(of_body) > 2 else of_body[:-1]:
            lines.append(
                Line(
                    middle,
                    PointOfBody(p, name),
                    weight=LineWeight.THIN,
                    paint=paint,
                    about=name,
                    has_ghost=not is_fixed,
                )
            )
    for beam in network.beams:
        a, b = PointOfBody(beam.start, beam.a), PointOfBody(beam.end, beam.b)
        lines.append(Line(a, b, part=beam.name, bends=True))
    elastic = [spring for spring in network.springs if np.any(spring.elasticity.compliance)]
    spots: list[Spots] = []
    for spring in elastic:
        a, b = PointOfBody(clamped_end(spring), spring.a), PointOfBody(spring.point, spring.b)
        if np.linalg.norm(a.point - b.point) > _SEEN * size:
            lines.append(Line(a, b, part=spring.name, bends=True, has_ghost=False))
        else:
            label = "" if spots else "elastic part"
            spots.append(Spots((b,), Shape.DIAMOND, label, (spring.name,), spring.name))
    joints = [joint for joint in network.joints if joint.freedoms]
    names = tuple(part.name for part in (*network.beams, *elastic))
    return Outline(
        PointOfBody(network.reference_point, network.platform),
        size,
        network.space is Space.PLANAR or _is_level(points),
        tuple(lines),
        tuple(plates),
        tuple(
            JointPoint(PointOfBody(freedom.point, joint.a), joint.name, freedom.name, freedom.role)
            for joint in joints
            for freedom in joint.freedoms
        ),
        tuple(spots),
        tuple((PointOfBody(joint.freedoms[0].point, joint.a), joint.name) for joint in joints)
        if len(joints) <= _NAMED
        else (),
        names,
        is_named=True,
        has_legend=len(set(names)) <= _LISTED,
    )


def of_cables(
    names: Sequence[str],
    ends: tuple[np.ndarray, np.ndarray],
    point: np.ndarray,
    space: Space,
    tensions: np.ndarray | None = None,
) -> Outline:
    """The outline of a cable robot, whose reference point is at a point (3,) [m].

    `ends` are where the cables leave the base and where they hold the platform (m, 3) [m]; those
    without any of `tensions` (m,) are dashed.
    """
    exits, attachments = ends
    plates = []
    for points, body, paint, label in (
        (exits, _GROUND, PlainColour.FAINT, ""),
        (attachments, PLATFORM, PlainColour.PLATE, PLATFORM),
    ):
        corners = _flat_face(points)
        if corners is not None:
            plates.append(Plate(corners, body, paint, label))
    feet = [PointOfBody(p, _GROUND) for p in exits]
    holds = [PointOfBody(p, PLATFORM) for p in attachments]
    lines, label = [], "slack cable"
    for i, (name, a, b) in enumerate(zip(names, feet, holds, strict=True)):
        T = None if tensions is None else float(tensions[i])
        about = name if T is None else f"{name}: {quantity(T, 'N', 4)}"
        is_slack = T == 0
        weight = LineWeight.THIN if is_slack else LineWeight.LINE
        shown = label if is_slack else ""
        lines.append(Line(a, b, weight=weight, is_dashed=is_slack, about=about, label=shown))
        label = "" if is_slack else label
    points = np.concatenate([exits, attachments])
    return Outline(
        PointOfBody(point, PLATFORM),
        size_of(points),
        space is Space.PLANAR or _is_level(points),
        tuple(lines),
        tuple(plates),
        spots=(
            Spots(tuple(feet), Shape.SQUARE, "winch", tuple(names)),
            Spots(tuple(holds), Shape.RING, "attachment"),
        ),
    )


def _flat_face(points: np.ndarray) -> np.ndarray | None:
    """Corners of the face through points in one plane (n, 3); None where they are not."""
    if len(points) < 3:
        return None
    *_, out = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return plate(points) if out <= _IN_PLANE * size_of(points) else None


def size_of(points: Any) -> float:
    """Length of the diagonal of the box around points (n, 3) [m]."""
    return float(np.linalg.norm(np.ptp(np.array(points), axis=0)))


def _is_level(points: np.ndarray) -> bool:
    """Whether points (n, 3) lie in one plane z = constant."""
    return bool(np.ptp(points[:, 2]) <= _SAME * size_of(points))
