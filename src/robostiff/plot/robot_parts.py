"""The parts of a robot as lines, faces and marks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.analysis import Deflection
from robostiff.model import Actuated, Passive, PlacedSpring, Role, Snapshot
from robostiff.plot.geometry.displacement import RobotMotion, at_rest, spatial
from robostiff.plot.geometry.ellipsoid import screw_line
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
    Arrow,
    Category,
    ColourScale,
    Face,
    Item,
    LineWeight,
    Marks,
    Paint,
    Path,
    PlainColour,
    Scene,
    Shape,
    Text,
)
from robostiff.plot.prefix import prefixed, short
from robostiff.spatial import Screw, Space

_ARROW = 0.2  # of the robot
_ROUNDING = 1e-12  # of the robot
_SEEN = 0.1  # of the robot: the largest displacement drawn with the default exaggeration
_ONE_PLACE = 0.08  # of the robot: names nearer than that would overlap


@dataclass(frozen=True)
class Drawing:
    """Common settings of the parts of a picture of a robot."""

    snapshot: Snapshot
    motion: RobotMotion
    scale: float
    factor: float  # from metres to the unit of the axes


def unit_of(size: float) -> tuple[float, str]:
    """From metres to the unit in which a robot is drawn: m, or mm for one below one metre."""
    return (1.0, "m") if size >= 1 else (1e3, "mm")


def round_factor(displacements: np.ndarray, size: float) -> float:
    """How far displacements (n, 3) are exaggerated: 1, 2 or 5 times a power of ten; 0 for none.

    The largest is then drawn as a tenth of the robot, or less.

    Examples
    --------
    >>> round_factor(np.array([[0.0, 3e-5, 4e-5]]), 1.2)
    2000.0
    """
    largest = float(np.linalg.norm(displacements, axis=-1).max(initial=0.0))
    if largest == 0:
        return 0.0
    wanted = _SEEN * size / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1, 2, 5) if step * power <= wanted * (1 + 1e-9)))


def finite_factor(factor: float) -> float:
    """How far displacements under finite loads are exaggerated, from what `round_factor` has.

    They are drawn at least as large as they are. Below a 1e-12 of the robot they are rounding of
    places, and not drawn.

    Examples
    --------
    >>> finite_factor(0.5), finite_factor(2000.0), finite_factor(2e15)
    (1.0, 2000.0, 0.0)
    """
    return max(factor, 1.0) if 0 < factor < _SEEN / _ROUNDING else 0.0


def exaggerated(scale: float) -> tuple[str, ...]:
    """A note about the factor of displacements, where they are drawn larger."""
    return (f"displacements × {short(scale, 6)}",) if scale not in {0.0, 1.0} else ()


def energy_scale(shares: Iterable[float]) -> ColourScale | None:
    """The scale of shares in the elastic energy [%]; None where there are none."""
    top = max(shares, default=0.0)
    return ColourScale("share of elastic energy [%]", 0, top) if top else None


def robot_scene(
    name: str,
    items: Sequence[Item],
    unit: str,
    is_flat: bool,
    scale: ColourScale | None = None,
    notes: tuple[str, ...] = (),
) -> Scene:
    """A scene of a robot, its axes in `unit`."""
    x, y, z = (f"{axis} [{unit}]" for axis in "xyz")
    return Scene(name, (x, y, z), tuple(items), scale, is_flat, notes=notes)


def backdrop(snapshot: Snapshot, factor: float) -> list[Item]:
    """A robot in the background of something else."""
    drawing = Drawing(snapshot, at_rest(snapshot), 0.0, factor)
    paths = [
        Path(factor * member.points, PlainColour.MUTED, LineWeight.LINE)
        for leg, motion in zip(snapshot.legs, drawing.motion.legs, strict=True)
        for member in leg_members(leg, motion)
    ]
    platform = _platform_parts(drawing, {}, PlainColour.MUTED, {})
    return [*_plates(drawing, PlainColour.MUTED), *platform, *paths]


def colours_of_parts(names: Iterable[str]) -> dict[str, Paint]:
    """A colour for each name of a part, the same for parts of one name in several legs."""
    return {name: Category(i) for i, name in enumerate(dict.fromkeys(names))}


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


def robot_items(
    drawing: Drawing,
    shares: Mapping[tuple[str, str], float],
    plain: PlainColour,
    colours: Mapping[str, Paint] | None = None,
    of_joints: Mapping[str, Paint] | None = None,
) -> list[Item]:
    """Base, platform, legs and joints; parts and legs with a share in the colour of its value.

    Those without one are in the colour of their name, where they have one.
    """
    d, unnamed = drawing, dict(colours or {})
    items = _plates(d) + _platform_parts(d, shares, plain, unnamed)
    marks: list[JointMark] = []
    for leg, motion in zip(d.snapshot.legs, d.motion.legs, strict=True):
        for member in leg_members(leg, motion, d.scale):
            share = shares.get((leg.name, member.part), shares.get((leg.name, "")))
            paint: Paint = (colours or {}).get(member.part, plain) if share is None else share
            label = member.part if unnamed.pop(member.part, None) is not None else ""
            # a colour applies to a whole leg, or to a single part
            weight = LineWeight.LINE if member.kind is MemberKind.RIGID else LineWeight.BOLD
            about = f"{leg.name}/{member.part}" if member.part else leg.name
            about += "" if share is None else f": {share:.1f} %"
            points = d.factor * member.points
            items.append(Path(points, paint, weight, label=label, about=about))
        marks += joint_marks(leg, motion, d.scale)
    items += _joints(marks, shares, d.factor, of_joints or {})
    point = d.snapshot.reference_point
    moved = point + d.scale * d.motion.platform.displacement(point)
    items.append(Marks(d.factor * moved[None], PlainColour.INK, Shape.CROSS, "reference point"))
    return items


def _plates(d: Drawing, paint: PlainColour = PlainColour.PLATE) -> list[Item]:
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


def _platform_parts(
    d: Drawing,
    shares: Mapping[tuple[str, str], float],
    plain: PlainColour,
    colours: Mapping[str, Paint],
) -> list[Item]:
    """The beams, springs and rigid members of a flexible platform."""
    items: list[Item] = []
    for part, (a, b) in _platform_lines(d.snapshot):
        share = shares.get(("platform", part.name), shares.get(("platform", "")))
        ends = np.array([a, b])
        if d.scale and np.any(a != b):
            ends = bent_line(a, b, d.motion.nodes[part.a], d.motion.nodes[part.b], d.scale)
        about = f"platform/{part.name}" + ("" if share is None else f": {share:.1f} %")
        paint: Paint = colours.get(part.name, plain) if share is None else share
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


def _joints(
    marks: list[JointMark],
    shares: Mapping[tuple[str, str], float],
    factor: float,
    colours: Mapping[str, Paint],
) -> list[Item]:
    items: list[Item] = []
    for label, shape in _KINDS:
        own = [mark for mark in marks if joint_kind(mark.freedom.role) == (label, shape)]
        by_paint: dict[Paint, list[JointMark]] = {}
        for mark in own:
            by_paint.setdefault(colours.get(mark.freedom.name, PlainColour.INK), []).append(mark)
        for paint, alike in by_paint.items():
            points = factor * np.array([mark.point for mark in alike])
            names = tuple(f"{mark.leg}/{mark.freedom.name}" for mark in alike)
            items.append(Marks(points, paint, shape, label, names))
        for mark in own:
            share = shares.get((mark.leg, mark.freedom.name))
            if share is not None:
                about = f"{mark.leg}/{mark.freedom.name}: {share:.1f} %"
                items.append(Marks(factor * mark.point[None], share, shape, about=(about,)))
    return items


def joint_names(d: Drawing) -> list[Item]:
    """Names beside the joints; of legs whose joints have the same names, those of the first."""
    places: list[tuple[np.ndarray, str]] = []
    known: list[list[str]] = []
    for leg, motion in zip(d.snapshot.legs, d.motion.legs, strict=True):
        marks = list(joint_marks(leg, motion, d.scale))
        own = [mark.freedom.name for mark in marks]
        places += [] if own in known else [(mark.point, mark.freedom.name) for mark in marks]
        known.append(own)
    return words_at([(d.factor * p, name) for p, name in places], d.factor * extent(d.snapshot))


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


def ghost(d: Drawing, label: str = "without load") -> list[Item]:
    """The undeformed legs, and the parts of a flexible platform, in dashed lines."""
    each = zip(d.snapshot.legs, d.motion.legs, strict=True)
    lines = [member.points for leg, motion in each for member in leg_members(leg, motion)]
    lines += [np.array(ends) for _, ends in _platform_lines(d.snapshot)]
    return dashed((d.factor * line for line in lines), label)


def dashed(lines: Iterable[np.ndarray], label: str) -> list[Item]:
    """Thin dashed lines, the first of which is named in the legend."""
    return [
        Path(line, PlainColour.MUTED, LineWeight.THIN, True, "" if i else label)
        for i, line in enumerate(lines)
    ]


def load_items(d: Drawing, bent: Deflection, is_flat: bool) -> list[Item]:
    """Arrows of the force, towards the point where it acts, and of the moment, away from it.

    Seen from above, a moment turns around the point.
    """
    F = spatial(bent.wrench, bent.stiffness.space.rows)
    return wrench_on_platform(d, F, bent.stiffness.reference_point, is_flat)


def wrench_on_platform(d: Drawing, F: np.ndarray, point: np.ndarray, is_flat: bool) -> list[Item]:
    """Arrows of a wrench (6,) at a point (3,) of the platform, where it is without load [m]."""
    moved = d.factor * (point + d.scale * d.motion.platform.displacement(point))
    return wrench_items(moved, d.factor * extent(d.snapshot), F, is_flat)


def wrench_items(point: np.ndarray, size: float, F: np.ndarray, is_flat: bool) -> list[Item]:
    """Arrows of a wrench (6,) at a point (3,) of a robot of some size, both as drawn."""
    length = _ARROW * size
    items: list[Item] = []
    for name, unit, row, vector in (
        ("force", "N", 1, F[:3]),
        ("moment", "N m", 4, F[3:]),
    ):
        size = float(np.linalg.norm(vector))
        if size > 0:
            times, shown = prefixed(size, unit)
            label = f"{name} {short(times * size)} {shown}"
            arrow = length * vector / size
            if name == "force":
                items.append(Arrow(point - arrow, point, Category(row), label))
            elif is_flat:
                screw = Screw(vector / size, point, 0.0)
                items += turning_arrow(
                    screw_line(screw, point, 0.6 * length).way, Category(row), label
                )
            else:
                items.append(Arrow(point, point + arrow, Category(row), label))
    return items


def turning_arrow(way: np.ndarray, paint: Paint, label: str) -> list[Item]:
    """The way (n, 3) of a point around an axis, with an arrow head."""
    line = Path(way[:-4], paint, LineWeight.LINE, label=label, about=label)
    return [line, Arrow(way[-5], way[-1], paint)]


def is_plane(snapshot: Snapshot) -> bool:
    """Whether a robot is planar, or all of it lies in one plane z = constant."""
    if snapshot.space is Space.PLANAR:
        return True
    heights = [snapshot.reference_point[2]]
    for leg in snapshot.legs:
        heights += [leg.end[2], *(part.point[2] for part in leg.parts)]
    return bool(np.ptp(heights) <= 1e-9 * extent(snapshot))
