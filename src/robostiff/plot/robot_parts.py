"""Robots of legs as lines, faces and marks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robostiff.model import Actuated, Passive, PlacedSpring, Role, Snapshot
from robostiff.plot.geometry.displacement import RobotMotion
from robostiff.plot.geometry.legs import (
    JointMark,
    MemberKind,
    bent_line,
    extent,
    foot,
    joint_marks,
    leg_members,
)
from robostiff.plot.geometry.surfaces import plate
from robostiff.plot.picture import (
    Face,
    Item,
    LineWeight,
    Marks,
    Paint,
    Path,
    PlainColour,
    Shape,
    Text,
)
from robostiff.plot.sketch import Sketch, dashed
from robostiff.spatial import Space

_ONE_PLACE = 0.08  # of the robot: names nearer than that would overlap


@dataclass(frozen=True, kw_only=True)
class RobotSketch(Sketch):
    """A robot of legs."""

    snapshot: Snapshot
    motion: RobotMotion
    # shares of the elastic energy [%], by leg and part, or by leg and an empty name
    shares: Mapping[tuple[str, str], float] = field(default_factory=dict)
    # of elastic parts and of joints without a share, by their names
    colours: Mapping[str, Paint] = field(default_factory=dict)
    of_joints: Mapping[str, Paint] = field(default_factory=dict)
    plain: PlainColour = PlainColour.INK  # of parts without either

    @property
    def size(self) -> float:
        """Length of the robot [m]."""
        return extent(self.snapshot)

    @property
    def is_level(self) -> bool:
        """Whether the robot is planar, or all of it lies in one plane z = constant."""
        snapshot = self.snapshot
        heights = [snapshot.reference_point[2]]
        for leg in snapshot.legs:
            heights += [leg.end[2], *(part.point[2] for part in leg.parts)]
        is_planar = snapshot.space is Space.PLANAR
        return is_planar or bool(np.ptp(heights) <= 1e-9 * self.size)

    @property
    def shifts(self) -> np.ndarray:
        """Displacements (n, 3) of platform, ends of legs, joints and nodes [m]."""
        snapshot, motion = self.snapshot, self.motion
        moved = [motion.platform.displacement(snapshot.reference_point)]
        for leg, own in zip(snapshot.legs, motion.legs, strict=True):
            moved.append(own.bodies[-1].displacement(leg.end))
            moved += [mark.point - mark.freedom.point for mark in joint_marks(leg, own, 1.0)]
        placed = snapshot.platform
        if placed is not None:
            for name, body in motion.nodes.items():
                moved.append(body.displacement(placed.in_world(placed.platform.point_of(name))))
        return np.array(moved)

    @property
    def values(self) -> Iterable[float]:
        """Shares of the elastic energy [%]."""
        return self.shares.values()

    def placed(self, point: np.ndarray) -> np.ndarray:
        """Where a point (3,) of the platform [m] is drawn."""
        return self.factor * (point + self.scale * self.motion.platform.displacement(point))

    def parts(self) -> list[Item]:
        """Base, platform, legs and joints; those with a share in the colour of its value.

        Those without one are in the colour of their name, where they have one.
        """
        unnamed = dict(self.colours)
        items = _plates(self) + _platform_parts(self, unnamed)
        marks: list[JointMark] = []
        for leg, motion in zip(self.snapshot.legs, self.motion.legs, strict=True):
            for member in leg_members(leg, motion, self.scale):
                share = self.shares.get((leg.name, member.part), self.shares.get((leg.name, "")))
                own = self.colours.get(member.part, self.plain)
                paint: Paint = own if share is None else share
                label = member.part if unnamed.pop(member.part, None) is not None else ""
                # a colour applies to a whole leg, or to a single part
                is_rigid = member.kind is MemberKind.RIGID
                weight = LineWeight.LINE if is_rigid else LineWeight.BOLD
                about = f"{leg.name}/{member.part}" if member.part else leg.name
                about += "" if share is None else f": {share:.1f} %"
                points = self.factor * member.points
                items.append(Path(points, paint, weight, label=label, about=about))
            marks += joint_marks(leg, motion, self.scale)
        items += _joints(marks, self)
        at = self.placed(self.snapshot.reference_point)[None]
        items.append(Marks(at, PlainColour.INK, Shape.CROSS, "reference point"))
        return items

    def ghost(self, label: str = "without load") -> list[Item]:
        """The undeformed legs, and the parts of a flexible platform, in dashed lines."""
        each = zip(self.snapshot.legs, self.motion.legs, strict=True)
        lines = [member.points for leg, motion in each for member in leg_members(leg, motion)]
        lines += [np.array(ends) for _, ends in _platform_lines(self.snapshot)]
        return dashed((self.factor * line for line in lines), label)

    def names(self) -> list[Item]:
        """Names beside the joints; of legs whose joints have the same names, those of the first."""
        places: list[tuple[np.ndarray, str]] = []
        known: list[list[str]] = []
        for leg, motion in zip(self.snapshot.legs, self.motion.legs, strict=True):
            marks = list(joint_marks(leg, motion, self.scale))
            own = [mark.freedom.name for mark in marks]
            places += [] if own in known else [(mark.point, mark.freedom.name) for mark in marks]
            known.append(own)
        return words_at([(self.factor * p, name) for p, name in places], self.factor * self.size)


def backdrop(d: RobotSketch) -> list[Item]:
    """A robot at rest in the background of something else: lines of one colour, no joints."""
    paths = [
        Path(d.factor * member.points, d.plain, LineWeight.LINE)
        for leg, motion in zip(d.snapshot.legs, d.motion.legs, strict=True)
        for member in leg_members(leg, motion)
    ]
    return [*_plates(d, d.plain), *_platform_parts(d, {}), *paths]


def part_names(snapshot: Snapshot) -> Iterator[str]:
    """Names of elastic parts, drives and slides of all legs, then of a flexible platform."""
    for leg in snapshot.legs:
        for part in leg.parts:
            is_seen = isinstance(part, PlacedSpring) or part.slides or not part.is_passive
            if is_seen:
                yield part.name
    for part, _ in _platform_lines(snapshot):
        if np.any(part.elasticity.compliance):
            yield part.name


def _plates(d: RobotSketch, paint: PlainColour = PlainColour.PLATE) -> list[Item]:
    ends = [leg.end for leg in d.snapshot.legs]
    point = d.snapshot.reference_point
    items: list[Item] = []
    base = plate(np.array([foot(leg) for leg in d.snapshot.legs]))
    if base is not None:
        items.append(Face(d.factor * base, PlainColour.FAINT, 0.35))
    moved = np.array([p + d.scale * d.motion.platform.displacement(p) for p in [*ends, point]])
    if d.snapshot.platform is not None:
        return items
    top = plate(moved[:-1])
    if top is not None:
        items.append(
            Face(d.factor * top, paint, 0.35, "platform" if paint is PlainColour.PLATE else "")
        )
    # A point of the platform that is away from the leg ends is tied to them.
    away = np.linalg.norm(moved[:-1] - moved[-1], axis=1)
    if top is None and away.max() > 1e-9:
        ties = [np.array([end, moved[-1]]) for end in moved[:-1]]
        items += [Path(d.factor * tie, PlainColour.MUTED, LineWeight.LINE) for tie in ties]
    elif top is not None:
        stem = np.array([moved[:-1].mean(axis=0), moved[-1]])
        items.append(Path(d.factor * stem, PlainColour.MUTED, LineWeight.THIN))
    return items


def _platform_parts(d: RobotSketch, colours: Mapping[str, Paint]) -> list[Item]:
    """The beams, springs and rigid members of a flexible platform."""
    items: list[Item] = []
    for part, (a, b) in _platform_lines(d.snapshot):
        share = d.shares.get(("platform", part.name), d.shares.get(("platform", "")))
        ends = np.array([a, b])
        if d.scale and np.any(a != b):
            ends = bent_line(a, b, d.motion.nodes[part.a], d.motion.nodes[part.b], d.scale)
        about = f"platform/{part.name}" + ("" if share is None else f": {share:.1f} %")
        paint: Paint = colours.get(part.name, d.plain) if share is None else share
        label = part.name if share is None and part.name in colours else ""
        items.append(Path(d.factor * ends, paint, LineWeight.BOLD, label=label, about=about))
    return items


def _platform_lines(snapshot: Snapshot) -> Iterator[tuple[Any, list[np.ndarray]]]:
    """Parts of a flexible platform, and their ends (3,) in the world [m]."""
    placed = snapshot.platform
    if placed is not None:
        for part in placed.platform.parts:
            names = (part.a, part.b)
            yield part, [placed.in_world(placed.platform.point_of(name)) for name in names]


_KINDS = (
    ("passive joint", Shape.RING),
    ("actuator", Shape.SQUARE),
    ("locked joint", Shape.DIAMOND),
)


def joint_kind(role: Role) -> tuple[str, Shape]:
    """Name in the legend, and mark, of a joint."""
    return _KINDS[0 if isinstance(role, Passive) else 1 if isinstance(role, Actuated) else 2]


def _joints(marks: list[JointMark], d: RobotSketch) -> list[Item]:
    items: list[Item] = []
    for label, shape in _KINDS:
        own = [mark for mark in marks if joint_kind(mark.freedom.role) == (label, shape)]
        by_paint: dict[Paint, list[JointMark]] = {}
        for mark in own:
            by_paint.setdefault(d.of_joints.get(mark.freedom.name, PlainColour.INK), []).append(
                mark
            )
        for paint, alike in by_paint.items():
            points = d.factor * np.array([mark.point for mark in alike])
            names = tuple(f"{mark.leg}/{mark.freedom.name}" for mark in alike)
            items.append(Marks(points, paint, shape, label, names))
        for mark in own:
            share = d.shares.get((mark.leg, mark.freedom.name))
            if share is not None:
                about = f"{mark.leg}/{mark.freedom.name}: {share:.1f} %"
                items.append(Marks(d.factor * mark.point[None], share, shape, about=(about,)))
    return items


_NUMBER = re.compile(r"\[\d+\]$")


def words_at(places: Sequence[tuple[np.ndarray, str]], size: float) -> list[Item]:
    """Names of joints beside their points (3,), those of one point in one line.

    A joint of several freedoms is named once, and joints of the branches of a block by the first.
    """
    found: list[tuple[np.ndarray, list[str]]] = []
    named: set[str] = set()
    for place, name in places:
        own = _NUMBER.sub("", name.rpartition("/")[2])
        if own in named:
            continue
        named.add(own)
        for point, names in found:
            if np.linalg.norm(point - place) <= _ONE_PLACE * size:
                names.append(own)
                break
        else:
            found.append((place, [own]))
    return [Text(point, ", ".join(dict.fromkeys(names)), PlainColour.INK) for point, names in found]
