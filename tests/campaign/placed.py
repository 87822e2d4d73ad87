"""Random robots frozen at a pose: every kind of spring and joint, ordinary and singular."""
# pyright: reportCallIssue=false

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity, elasticity_from_stiffness
from robostiff.model import (
    Actuated,
    CoupledFreedom,
    Locked,
    Passive,
    PlacedBlock,
    PlacedElement,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    Snapshot,
)
from robostiff.spatial import Screw, Space
from tests.generators.chains import (
    ball,
    beam_compliance_of,
    drawn_pitch,
    planar_chain,
    random_rotation,
    snapshot_of,
)
from tests.generators.nested import nested_snapshot
from tests.generators.platforms import KINDS_OF_PARTS, on_platform
from tests.generators.robots import KINDS_OF_ROBOTS, random_robot


def random_snapshot(rng: np.random.Generator, kind: str) -> Snapshot:
    """A robot of a kind of `KINDS`, with one or two peculiarities now and then."""
    snapshot = KINDS[kind](rng)
    if rng.uniform() < 0.5 and kind != "platform":
        names = rng.permutation(list(PECULIARITIES))[: int(rng.integers(1, 3))]
        for name in names:
            snapshot = PECULIARITIES[str(name)](rng, snapshot)
    return snapshot


def _parallel(rng: np.random.Generator) -> Snapshot:
    kind = KINDS_OF_ROBOTS[rng.integers(len(KINDS_OF_ROBOTS))]
    return random_robot(rng, kind, int(rng.integers(1, 4)))


def _nested(rng: np.random.Generator) -> Snapshot:
    number, depth = int(rng.integers(1, 3)), int(rng.integers(1, 4))
    rigid, clamps = bool(rng.uniform() < 0.7), bool(rng.uniform() < 0.7)
    return nested_snapshot(rng, Space.SPATIAL, rigid, number, depth, clamps)


def _nested_planar(rng: np.random.Generator) -> Snapshot:
    rigid, number = bool(rng.integers(2)), int(rng.integers(1, 3))
    return nested_snapshot(rng, Space.PLANAR, rigid, number, 1, bool(rng.integers(2)))


def _planar(rng: np.random.Generator) -> Snapshot:
    chains = [planar_chain(rng, int(rng.integers(0, 3))) for _ in range(int(rng.integers(1, 4)))]
    reference = np.append(rng.uniform(-1, 1, 2), 0.0)
    return replace(snapshot_of(chains, reference), space=Space.PLANAR)


def _platform(rng: np.random.Generator) -> Snapshot:
    kind = KINDS_OF_ROBOTS[rng.integers(len(KINDS_OF_ROBOTS))]
    robot = random_robot(rng, kind, int(rng.integers(1, 3)))
    parts = KINDS_OF_PARTS[rng.integers(len(KINDS_OF_PARTS))]
    count, closing = int(rng.integers(2, 5)), int(rng.integers(0, 3))
    return on_platform(rng, robot, parts, count, closing)


def _drives(rng: np.random.Generator) -> Snapshot:
    """Rigid links and elastic drives: K may not exist, and the compliance does."""
    reference = rng.uniform(-0.5, 0.5, 3)
    kind = rng.integers(3)
    legs = []
    if kind == 0:  # a serial arm
        joints = int(rng.integers(5, 8))
        legs.append(
            PlacedLeg("arm", tuple(_any_drive(rng, f"j{i}") for i in range(joints)), reference)
        )
    elif kind == 1:  # six struts, each with its drive alone
        for i in range(6):
            tip = reference + rng.uniform(-0.4, 0.4, 3)
            legs.append(_strut(rng, f"leg{i}", rng.uniform(-1, 1, 3) - [0, 0, 1.5], tip))
    else:  # three legs that carry a force along the rod and two couples more than their drives feel
        for i in range(3):
            e = rng.normal(size=3)
            turns = [
                PlacedFreedom(_unit(e), rng.uniform(-1, 1, 3), 0.0, f"t{k}", Passive())
                for k in range(2)
            ]
            elements = [_drive(rng, "drive", None), *turns]
            legs.append(PlacedLeg(f"leg{i}", tuple(elements), reference))
    return Snapshot("drives", tuple(legs), reference)


def _thin(rng: np.random.Generator) -> Snapshot:
    """Beams from stout to very slender, between joints or clamped."""
    reference = rng.uniform(-0.3, 0.3, 3)
    legs = []
    for i in range(int(rng.integers(1, 7))):
        start, tip = rng.uniform(-1, 1, 3) - [0, 0, 1], reference + rng.uniform(-0.3, 0.3, 3)
        beam = slender_beam(rng, f"beam{i}", start, tip)
        joints: list[PlacedElement] = []
        if rng.uniform() < 0.7:
            first = ball(start, random_rotation(rng))[: int(rng.integers(1, 4))]
            last = ball(tip, random_rotation(rng))[: int(rng.integers(1, 4))]
            joints = [
                PlacedFreedom(_unit(t.axis), t.point, 0.0, f"r{k}", Passive())
                for k, t in enumerate((*first, *last))
            ]
        legs.append(PlacedLeg(f"leg{i}", (beam, *joints), tip))
    return Snapshot("thin", tuple(legs), reference)


def _mixed(rng: np.random.Generator) -> Snapshot:
    """Springs that are rigid in some directions and free in others, drives, and passive joints."""
    reference = rng.uniform(-0.3, 0.3, 3)
    legs = []
    for i in range(int(rng.integers(1, 5))):
        elements: list[PlacedElement] = []
        for k in range(int(rng.integers(1, 4))):
            point, turn = rng.uniform(-1, 1, 3), random_rotation(rng)
            elements.append(PlacedSpring(f"s{k}", point, turn, partial_spring(rng)))
        for k in range(int(rng.integers(0, 4))):
            role = (Passive(), Passive(), Locked(), Locked(1e5), Actuated(1e4))[rng.integers(5)]
            pitch = drawn_pitch(1 - rng.uniform(), 0.25, 0.45)
            axis, point = _unit(rng.normal(size=3)), rng.uniform(-1, 1, 3)
            elements.append(PlacedFreedom(axis, point, pitch, f"j{k}", role))
        order = rng.permutation(len(elements))
        legs.append(PlacedLeg(f"leg{i}", tuple(elements[m] for m in order), reference))
    return Snapshot("mixed", tuple(legs), reference)


KINDS: dict[str, Callable[[np.random.Generator], Snapshot]] = {
    "parallel": _parallel,
    "nested": _nested,
    "nested planar": _nested_planar,
    "planar": _planar,
    "platform": _platform,
    "drives": _drives,
    "thin": _thin,
    "mixed": _mixed,
}


def slender_beam(rng: np.random.Generator, name: str, a: np.ndarray, b: np.ndarray) -> PlacedSpring:
    """A steel rod of radius 0.1 to 1e-5 of its length."""
    length = float(np.linalg.norm(b - a))
    radius = length * 10 ** rng.uniform(-5, -1)
    A, I, E, G = np.pi * radius**2, np.pi * radius**4 / 4, 2.1e11, 8.1e10
    C = beam_compliance_of(length, E * A, E * I, E * I, G * 2 * I)
    x = (b - a) / length
    y = _unit(np.cross(x, rng.normal(size=3)))
    return PlacedSpring(name, b, np.stack([x, y, np.cross(x, y)], axis=-1), Elasticity(C))


def partial_spring(rng: np.random.Generator) -> Elasticity:
    """Compliant in 1 to 6 directions, diagonal or coupled, the others rigid; or free in some."""
    number = int(rng.integers(1, 7))
    s = np.repeat([1e-3, 1e-2], 3)
    if rng.uniform() < 0.5:
        C = np.zeros(6)
        C[rng.permutation(6)[:number]] = 10 ** rng.uniform(-9, -4, number)
        return Elasticity(np.diag(C))
    root = rng.normal(size=(6, number)) * s[:, None]
    if rng.uniform() < 0.7 or number < 2:
        return Elasticity(root @ root.T)
    return elasticity_from_stiffness(np.diag(1 / s) @ (root @ root.T) @ np.diag(1 / s) * 1e10)


def _any_drive(rng: np.random.Generator, name: str) -> PlacedFreedom:
    return _drive(rng, name, drawn_pitch(1 - rng.uniform(), 0.3, 0.5))


def _drive(rng: np.random.Generator, name: str, pitch: float | None) -> PlacedFreedom:
    axis = _unit(rng.normal(size=3))
    k = float(10 ** rng.uniform(4, 7))
    return PlacedFreedom(axis, rng.uniform(-1, 1, 3), pitch, name, Actuated(k))


def _strut(rng: np.random.Generator, name: str, base: np.ndarray, tip: np.ndarray) -> PlacedLeg:
    turns = (*ball(base, random_rotation(rng))[:2], *ball(tip, random_rotation(rng)))
    joints = [
        PlacedFreedom(_unit(t.axis), t.point, 0.0, f"r{k}", Passive()) for k, t in enumerate(turns)
    ]
    drive = replace(_drive(rng, "drive", None), point=base, axis=_unit(tip - base))
    return PlacedLeg(name, (*joints[:2], drive, *joints[2:]), tip)


def _unit(v: np.ndarray) -> np.ndarray:
    return np.asarray(v, dtype=float) / np.linalg.norm(v)


# What makes a robot peculiar ------------------------------------------------------------------


def _rounded(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    """Points on a grid of 0.2 m, axes along the world's: special positions without rounding."""

    def one(part: PlacedFreedom | PlacedSpring) -> PlacedFreedom | PlacedSpring:
        point = np.round(part.point * 5) / 5
        if isinstance(part, PlacedSpring):
            return replace(part, point=point)
        axis = np.zeros(3)
        axis[np.argmax(np.abs(part.axis))] = 1.0
        return replace(part, point=point, axis=axis)

    return with_parts(snapshot, one)


def _spread(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    """Stiffnesses that differ by up to 10^13."""
    width = rng.uniform(1, 6.5)
    return with_parts(snapshot, lambda part: _softer(part, 10 ** rng.uniform(-width, width)))


def _soft(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    """Everything softer or stiffer by the same, up to 10^15."""
    factor = 10 ** rng.uniform(-15, 15)
    return with_parts(snapshot, lambda part: _softer(part, factor))


def _softer(part: PlacedFreedom | PlacedSpring, factor: float) -> PlacedFreedom | PlacedSpring:
    if isinstance(part, PlacedSpring):
        own = part.elasticity
        return replace(part, elasticity=Elasticity(own.compliance * factor, own.freedoms))
    if part.stiffness is None:
        return part
    return replace(part, role=type(part.role)(part.stiffness / factor))


def _driven(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    """Some passive joints are driven, or locked."""

    def one(part: PlacedFreedom | PlacedSpring) -> PlacedFreedom | PlacedSpring:
        if isinstance(part, PlacedSpring) or rng.uniform() < 0.6:
            return part
        role = (Actuated(float(10 ** rng.uniform(3, 7))), Locked(), Locked(1e6))[rng.integers(3)]
        return replace(part, role=role)

    return with_parts(snapshot, one)


def _in_one_point(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    """A robot without extent, at the origin or elsewhere, the reference point with it or not."""
    place = np.zeros(3) if rng.uniform() < 0.5 else rng.uniform(-1, 1, 3)
    if snapshot.space is Space.PLANAR:
        place[2] = 0.0
    apart = np.zeros(3) if rng.uniform() < 0.5 else np.array([0.3, 0.1, 0.0])
    moved = with_parts(snapshot, lambda part: replace(part, point=place), lambda end: place)
    return replace(moved, reference_point=place + apart)


def _twice(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    """Passive joints that occur twice, and legs that are there twice."""
    legs = []
    for leg in snapshot.legs:
        elements = list(leg.elements)
        again = [e for e in elements if isinstance(e, PlacedFreedom) and e.is_passive]
        if again and rng.uniform() < 0.7:
            one = again[rng.integers(len(again))]
            place = int(rng.integers(len(elements) + 1))
            elements.insert(place, replace(one, name=f"{one.name} again"))
        legs.append(replace(leg, elements=tuple(elements)))
    if rng.uniform() < 0.3 and len(legs) < 5:
        legs.append(replace(legs[-1], name="last again"))
    return replace(snapshot, legs=tuple(legs))


def _far(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    """A reference point 10 to 1000 m away, or the whole robot far from the origin."""
    away = 10 ** rng.uniform(1, 3) * _unit(rng.normal(size=3))
    if snapshot.space is Space.PLANAR:
        away[2] = 0.0
    if rng.uniform() < 0.5:
        return replace(snapshot, reference_point=snapshot.reference_point + away)
    moved = with_parts(
        snapshot, lambda part: replace(part, point=part.point + away), lambda end: end + away
    )
    return replace(moved, reference_point=snapshot.reference_point + away)


def _nearly(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    """Special positions missed by 1e-14 to 1e-3."""
    size = 10.0 ** -rng.integers(3, 15)
    rounded = _rounded(rng, snapshot)
    planar = snapshot.space is Space.PLANAR

    def one(part: PlacedFreedom | PlacedSpring) -> PlacedFreedom | PlacedSpring:
        d = rng.normal(size=(2, 3)) * size
        if planar:
            d[:, 2] = 0.0
        if isinstance(part, PlacedFreedom):
            part = replace(part, axis=_unit(part.axis + (0 if planar else 1) * d[1]))
        return replace(part, point=part.point + d[0])

    return with_parts(rounded, one)


PECULIARITIES: dict[str, Callable[[np.random.Generator, Snapshot], Snapshot]] = {
    "rounded": _rounded,
    "spread": _spread,
    "soft": _soft,
    "driven": _driven,
    "in one point": _in_one_point,
    "twice": _twice,
    "far": _far,
    "nearly": _nearly,
}


def with_parts(
    snapshot: Snapshot,
    one: Callable[[PlacedFreedom | PlacedSpring], PlacedFreedom | PlacedSpring],
    ending: Callable[[np.ndarray], np.ndarray] = lambda end: end,
) -> Snapshot:
    """The same with every joint and spring changed, and perhaps the ends of legs and branches."""

    def leg_with(leg: PlacedLeg) -> PlacedLeg:
        elements = tuple(
            PlacedBlock(e.name, tuple(leg_with(branch) for branch in e.branches))
            if isinstance(e, PlacedBlock)
            else changed(e)
            for e in leg.elements
        )
        return replace(leg, elements=elements, end=ending(leg.end))

    def changed(part: PlacedFreedom | PlacedSpring) -> PlacedFreedom | PlacedSpring:
        if not isinstance(part, CoupledFreedom):
            return one(part)
        moves = []
        for name, share, screw in part.moves:
            own: Any = one(PlacedFreedom(screw.axis, screw.point, screw.pitch, name, Passive()))
            moves.append((name, share, Screw(own.axis, own.point, own.pitch)))
        return replace(one(part), moves=tuple(moves))

    return replace(snapshot, legs=tuple(leg_with(leg) for leg in snapshot.legs))
