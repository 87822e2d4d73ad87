"""Random linkages moved by their joints: networks, records and maps against forces by hand.

A linkage is drawn as circuits of bodies that close at home by construction. Its stiffness follows
from the wrenches of all connections, see `reference`, and places of axes from products of
exponentials. Nothing of this is shared with networks, records or closures but the elements.
"""
# pyright: reportArgumentType=false

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.linkage import Configuration, Connection, Linkage, essential
from robostiff.model import Joint, JointKind, PlacedFreedom, PlacedSpring, cylindrical, planar
from tests.campaign.answers import Complaint, Judge
from tests.campaign.reference import Carriers, Reference, Whole

_BASE, _TOOL = "base", "tool"
_AGREEMENT = 1e-6  # of floats, with wrenches of all connections at once
_CLOSED = 1e-6
_RECORDED = 0.3  # part of the linkages whose record is made as well
_FOLLOWING = 0.3  # part of those of several drives, of which one is not given, and follows


def motion(joint: Joint, q: Sequence[float]) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Rotation and shift of a joint, and columns (6,) of its freedoms about where it begins."""
    if joint.kind is JointKind.SPHERICAL:
        R = Rotation.from_rotvec(q).as_matrix()
        return R, np.zeros(3), [np.concatenate([np.zeros(3), e]) for e in np.eye(3)]
    R, p, columns = np.eye(3), np.zeros(3), []
    for screw, x in zip(joint.freedoms, q, strict=True):
        axis = R @ screw.axis
        turns = screw.pitch is not None
        along = axis * (screw.pitch if turns else 1.0)
        # A turn about a line through p moves the origin by p x axis.
        columns.append(
            np.concatenate([np.cross(p, axis) + along, axis])
            if turns
            else np.concatenate([axis, np.zeros(3)])
        )
        if turns:
            R = Rotation.from_rotvec(axis * x).as_matrix() @ R
        p = p + along * x
    return R, p, columns


def by_forces(linkage: Linkage, found: Configuration) -> Reference | None:
    """The stiffness of a linkage in a configuration, from the wrenches of all its connections."""
    tool, places = found.frames[linkage.platform], [f.p for f in found.frames.values()]
    point = tool.p + tool.R @ linkage.reference_point
    length = max(float(np.abs(p - point).max()) for p in places) or 1.0
    whole = Whole(range(6), point, length, places)

    def made() -> list[Carriers]:
        own = Carriers()
        on: dict[str, dict[int, float]] = {body: {} for body in linkage.bodies}
        for c in linkage.connections:
            k, at = own.chain(), found.frames[c.a] @ c.before
            on[c.a][k], on[c.b][k] = -1.0, 1.0  # what is carried acts on body b
            if isinstance(c.element, rs.Link):
                end, axes = at.p + at.R @ c.element.to, at.R @ c.element.axes
                whole.spring(own.chains[k], PlacedSpring(c.name, end, axes, c.element.elasticity))
            if isinstance(c.element, Joint):
                for v in motion(c.element, found.coordinates[c.name].tolist())[2]:
                    shift, turn = at.R @ v[:3], at.R @ v[3:]
                    turns, place = np.any(turn), at.p + np.cross(turn, shift)
                    axis, pitch = (turn, float(shift @ turn)) if turns else (shift, None)
                    freedom = PlacedFreedom(axis, place, pitch, c.name, c.element.role)
                    whole.joint(own.chains[k], freedom)
        own.ends = on.pop(linkage.platform)
        own.balances += [on[body] for body in on if body != linkage.base]
        return [own]

    return whole.answer(made)


def open_by(linkage: Linkage, found: Configuration) -> float:
    """How far a configuration is open, by products of exponentials."""
    widest = 0.0
    for c in linkage.connections:
        R, p = np.eye(3), np.zeros(3)
        if isinstance(c.element, Joint):
            R, p, _ = motion(c.element, found.coordinates[c.name].tolist())
        elif isinstance(c.element, rs.Link):
            p = np.asarray(c.element.to)
        there = found.frames[c.a] @ c.before @ rs.Frame(R, p) @ c.after
        b = found.frames[c.b]
        widest = max(widest, np.abs(there.R - b.R).max(), np.abs(there.p - b.p).max())
    return float(widest)


def random_linkage(rng: np.random.Generator) -> Linkage:
    """One to three circuits of bodies, in space, in a plane, or about a point."""
    style = str(rng.choice(["space", "plane", "point", "even"], p=[0.4, 0.35, 0.1, 0.15]))
    frames = {_BASE: rs.Frame.identity()}
    connections: list[Connection] = []
    for circuit in range(int(rng.integers(1, 4))):
        bodies = list(frames)
        start, stop = (
            (_BASE, _BASE) if len(bodies) == 1 else tuple(rng.choice(bodies, 2, replace=False))
        )
        elements = _circuit(rng, style, first=circuit == 0)
        names = [f"{circuit}.{i}" for i in range(len(elements))]
        path = [str(start), *(f"body {name}" for name in names[1:]), str(stop)]
        for body in path[1:-1]:
            frames[body] = random_frame(rng, style)
        for name, element, a, b in zip(names, elements, path, path[1:], strict=False):
            own = replace(element, name=name)
            if rng.random() < 0.3:
                a, b = b, a  # noqa: PLW2901
            connections.append(fitting(rng, style, name, a, b, frames, own))
    tool = str(rng.choice([body for body in frames if body != _BASE]))
    order = rng.permutation(len(connections))
    tip = rng.normal(size=3) * 0.3
    return Linkage("random", tuple(connections[i] for i in order), _BASE, tool, tip)


def random_frame(rng: np.random.Generator, style: str = "space") -> rs.Frame:
    """A frame of a body; in a plane, or even, where the style says so."""
    place = rng.normal(size=3) * (np.array([1, 1, 0]) if style in ("plane", "even") else 1.0)
    if style == "even":
        return rs.Frame(np.eye(3), np.round(2 * place) / 2)
    turn = np.array([0, 0, rng.uniform(-3, 3)]) if style == "plane" else rng.normal(size=3)
    return rs.Frame(Rotation.from_rotvec(turn).as_matrix(), place)


def _circuit(rng: np.random.Generator, style: str, *, first: bool) -> list[Joint | rs.Link]:
    """Elements of a circuit, about as many freedoms as close it and move."""
    needed = {"space": 6, "point": 3}.get(style, 3) + int(rng.integers(-1, 2)) + int(first)
    joints: list[Joint] = []
    while sum(joint.size for joint in joints) < needed or len(joints) < 2:
        joints.append(_joint(rng, style))
    drive = int(rng.integers(len(joints)))
    if rng.random() < 0.7 and joints[drive].size == 1:
        role = rs.Actuated(float(10 ** rng.uniform(4, 6)) if rng.random() < 0.8 else None)
        joints[drive] = replace(joints[drive], role=role)
    elements: list[Joint | rs.Link] = list(joints)
    for _ in range(int(rng.integers(0, 4))):
        place = int(rng.integers(len(elements) + 1))
        to = rng.normal(size=3) * (np.array([1, 1, 0]) if style in ("plane", "even") else 1.0)
        elements.insert(place, rs.beam_link(to, rs.material("steel"), rs.circle(0.03)))
    if rng.random() < 0.2:
        elements.insert(0, rs.revolute([0, 0, 1], rs.Locked(1e5)))
    return elements


def _joint(rng: np.random.Generator, style: str) -> Joint:
    home = rng.uniform(-0.5, 0.5, 3) * (style != "even")
    z = np.array([0.0, 0, 1])
    if style in ("plane", "even"):
        if rng.random() < 0.75:
            return rs.revolute(z, rs.Passive(), home=home[:1])
        along = np.array([*rng.normal(size=2), 0.0])
        if style == "even":
            along = np.eye(3)[rng.integers(2)]
        return rs.prismatic(along, rs.Passive(), home=home[:1])
    axis, other = rng.normal(size=3), rng.normal(size=3)
    if style == "point":
        return rs.revolute(axis, rs.Passive(), home=home[:1])
    match str(
        rng.choice(["R", "P", "U", "S", "C", "H", "E"], p=[0.35, 0.15, 0.15, 0.15, 0.1, 0.07, 0.03])
    ):
        case "P":
            return rs.prismatic(axis, rs.Passive(), home=home[:1])
        case "U":
            return rs.universal(axis, other, rs.Passive(), home=home[:2])
        case "S":
            return rs.spherical(rs.Passive(), home=home)
        case "C":
            return cylindrical(axis, rs.Passive(), home=home[:2])
        case "H":
            return rs.helical(axis, 0.1, rs.Passive(), home=home[:1])
        case "E":
            return planar(axis, rs.Passive(), home=home)
    return rs.revolute(axis, rs.Passive(), home=home[:1])


def fitting(
    rng: np.random.Generator,
    style: str,
    name: str,
    a: str,
    b: str,
    frames: dict[str, rs.Frame],
    element: Joint | rs.Link,
) -> Connection:
    """A connection that closes at home."""
    before = random_frame(rng, style)
    if style == "point" and isinstance(element, Joint):  # its axis meets the origin of the base
        seen = frames[a].inverse
        before = rs.Frame(before.R, seen.p)
    start = frames[a] @ before
    R, p = np.eye(3), np.zeros(3)
    if isinstance(element, Joint):
        R, p, _ = motion(element, list(element.home))
    else:
        p = np.asarray(element.to)
    return Connection(name, a, b, before, element, (start @ rs.Frame(R, p)).inverse @ frames[b])


def moved_linkage(rng: np.random.Generator) -> list[Complaint]:
    """A linkage at home, near it and far from it, by networks, by its record, and by hand."""
    judge = Judge(None, 1.0, False)
    linkage = random_linkage(rng)
    try:
        part = essential(linkage)
    except rs.InputError:  # a circuit that ends where it begins is left out
        return []
    actuated = [joint for joint in part.joints if isinstance(joint.role, rs.Actuated)]
    if len(actuated) > 1 and rng.random() < _FOLLOWING:
        actuated.pop()
    spread = np.array([0.0, 0.05, -0.1, 0.4, -1.5])
    ways = rng.uniform(-1, 1, len(actuated))
    values = {
        joint.name: float(joint.home[0]) + spread * way
        for joint, way in zip(actuated, ways, strict=True)
    }
    networks = rs.stiffness(linkage, values)
    asked: Any = networks.question
    configurations = asked.driven.at(asked.numbers)
    for i, found in enumerate(configurations):
        one = networks[i] if networks.batch_shape else networks
        _judge(judge, f"network {i}", part, found, one.status, int(one.rank), one.matrix)
    answer = _by_record(linkage, values) if actuated and rng.random() < _RECORDED else None
    if answer is not None:
        for i in np.flatnonzero(~answer.guarded).tolist():
            status, rank = rs.Status(int(answer.status_codes[i])), int(answer.rank[i])
            K = answer.values["K"][i]
            _judge(judge, f"record {i}", part, configurations[i], status, rank, K)
    return judge.complaints


def _by_record(linkage: Linkage, values: dict[str, np.ndarray]) -> rs.CompiledAnswer | None:
    try:
        fast = rs.compile(linkage, joints=[*values], backend=rs.Backend.ARRAYS)
    except (rs.InputError, rs.NoAnswerError):  # rigid, undetermined, singular: with the reason
        return None
    return fast.evaluate(values, again=False) if fast.verified else None


def _judge(
    judge: Judge,
    way: str,
    part: Linkage,
    found: Configuration,
    status: rs.Status,
    rank: int,
    K: np.ndarray,
) -> None:
    """Complain where an answer at a configuration is not what forces and exponentials say."""
    if status & (rs.Status.ILL_CONDITIONED | rs.Status.UNREACHABLE):
        if rs.Status.UNREACHABLE in status and found.is_closed:
            judge.say(way, "unreachable, and closed", str(status))
        return
    if (gap := open_by(part, found)) > _CLOSED:
        judge.say(way, "open", f"{gap:.1e}")
        return
    truth = by_forces(part, found)
    if truth is None or truth.in_doubt:
        return
    if truth.rank != rank:
        judge.say(way, "another rank", f"{rank} for {truth.rank}")
    elif (truth.K is None) != bool(status & rs.Status.RIGID_DIRECTION):
        judge.say(way, "another answer about rigid directions", str(status))
    elif truth.K is not None and np.any(truth.K):
        size = np.sqrt(np.abs(np.diag(truth.K)))
        size = np.maximum(size, 1e-3 * np.repeat([size[:3].max(), size[3:].max()], 3))
        off = float(np.max(np.abs(K - truth.K) / np.outer(size, size)))
        if not off <= _AGREEMENT:
            judge.say(way, "another K", f"{off:.2e}, {status}")
