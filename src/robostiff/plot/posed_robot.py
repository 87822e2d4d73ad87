"""A robot at a pose: its legs, who bends, and its shape under a load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from robostiff.analysis import Deflection
from robostiff.errors import InputError
from robostiff.kinematics import Pose
from robostiff.model import Actuated, Passive, Robot, Snapshot
from robostiff.plot.backend import PAPER, Backend, Drawn, drawn_by
from robostiff.plot.geometry.displacement import RobotMotion, at_rest, motion_under
from robostiff.plot.geometry.legs import (
    JointMark,
    MemberKind,
    extent,
    foot,
    joint_marks,
    leg_members,
)
from robostiff.plot.geometry.polygon import plate
from robostiff.plot.geometry.screw_line import screw_line
from robostiff.plot.picture import (
    Arrow,
    Category,
    ColourScale,
    Face,
    Item,
    Marks,
    Paint,
    Path,
    Scene,
    Shape,
    Tone,
    Weight,
)
from robostiff.plot.posture import snapshot_at
from robostiff.plot.prefix import prefixed, short
from robostiff.spatial import Screw, Space

_SEEN = 0.1  # of the robot: the largest displacement that an exaggeration of its own choice draws
_ARROW = 0.2
_MISSED = 1e-4


class Colouring(Enum):
    """What the colours of the legs tell.

    ``LEGS``
        The share of each leg in the elastic energy.
    ``PARTS``
        The share of each link, strut or actuator.
    ``NONE``
        Nothing.
    """

    LEGS = "legs"
    PARTS = "parts"
    NONE = "none"


@dataclass(frozen=True)
class _Drawing:
    """What all parts of a picture of a robot share."""

    snapshot: Snapshot
    motion: RobotMotion
    scale: float
    factor: float  # from metres to the unit of the axes


def robot(
    robot: Robot | Snapshot,
    pose: Pose = None,
    *,
    deflection: Deflection | None = None,
    colouring: Colouring = Colouring.LEGS,
    exaggeration: float | None = None,
    backend: Backend[Drawn] = PAPER,
) -> Drawn:
    """Draw a robot at a pose, and how it gives way under a load.

    Parameters
    ----------
    robot : Robot or Snapshot
    pose : RigidTransform, array, JointCoordinates or None
        One pose, as for `robostiff.stiffness`.
    deflection : Deflection, optional
        Of the same robot at the same pose: draws the deformed shape, and colours the legs by their
        share of the elastic energy.
    colouring : Colouring
        What the colours tell, when there is a deflection.
    exaggeration : float, optional
        Factor of all displacements; 0 leaves the robot as it is. When left out, a round number that
        draws the largest displacement as a tenth of the robot, or less.
    backend : Matplotlib or Plotly

    Returns
    -------
    Axes or Figure
        Of the backend.

    Raises
    ------
    InputError
        When the pose or the deflection does not fit the robot.
    NoAnswerError
        When the pose is out of reach, or there is no deflection.

    Examples
    --------
    >>> import robostiff as rs
    >>> hexapod = rs.load("hexapod")
    >>> bent = rs.deflection(hexapod, wrench=[500, 0, 0, 0, 0, 0])
    >>> rs.plot.robot(hexapod, deflection=bent).get_title()
    'hexapod'
    """
    picture = robot_picture(snapshot_at(robot, pose), deflection, colouring, exaggeration)
    return drawn_by(backend, picture)


def robot_picture(
    snapshot: Snapshot,
    bent: Deflection | None = None,
    colouring: Colouring = Colouring.LEGS,
    exaggeration: float | None = None,
) -> Scene:
    """The picture of `robot`, as data."""
    factor, unit = drawing_unit(snapshot)
    if bent is None:
        drawing = _Drawing(snapshot, at_rest(snapshot), 0.0, factor)
        items = robot_items(drawing, {}, Tone.INK)
        return _scene(snapshot, unit, items, None, ())
    motion = motion_under(snapshot, bent)
    _check_fit(snapshot, bent, motion)
    scale = _chosen(snapshot, motion) if exaggeration is None else float(exaggeration)
    drawing = _Drawing(snapshot, motion, scale, factor)
    shares = _shares(bent, colouring)
    items = robot_items(drawing, shares, Tone.INK if not shares else Tone.MUTED)
    if scale:
        items = [*_ghost(_Drawing(snapshot, motion, 0.0, factor)), *items]
    items += _load(drawing, bent, is_plane(snapshot))
    notes = (f"displacements × {short(scale, 6)}",) if scale not in {0.0, 1.0} else ()
    label = "share of elastic energy [%]"
    top = max(shares.values(), default=0.0)
    return _scene(snapshot, unit, items, ColourScale(label, 0, top) if shares else None, notes)


def drawing_unit(snapshot: Snapshot) -> tuple[float, str]:
    """From metres to the unit in which a robot is drawn: m, or mm for a robot below one metre."""
    return (1.0, "m") if extent(snapshot) >= 1 else (1e3, "mm")


def backdrop(snapshot: Snapshot, factor: float) -> list[Item]:
    """A robot in the background of something else."""
    drawing = _Drawing(snapshot, at_rest(snapshot), 0.0, factor)
    paths = [
        Path(factor * member.points, Tone.MUTED, Weight.LINE)
        for leg, motion in zip(snapshot.legs, drawing.motion.legs, strict=True)
        for member in leg_members(leg, motion)
    ]
    return [*_plates(drawing, Tone.MUTED), *paths]


def robot_items(
    drawing: _Drawing, shares: Mapping[tuple[str, str], float], plain: Tone
) -> list[Item]:
    """Base, platform, legs and joints; parts and legs with a share in the colour of its value."""
    d = drawing
    items = _plates(d)
    marks: list[JointMark] = []
    for leg, motion in zip(d.snapshot.legs, d.motion.legs, strict=True):
        for member in leg_members(leg, motion, d.scale):
            share = shares.get((leg.name, member.part), shares.get((leg.name, "")))
            paint: Paint = plain if share is None else share
            # a coloured leg is coloured all over, a coloured part alone
            weight = Weight.LINE if member.kind is MemberKind.RIGID else Weight.BOLD
            about = f"{leg.name}/{member.part}" if member.part else leg.name
            about += "" if share is None else f": {share:.1f} %"
            items.append(Path(d.factor * member.points, paint, weight, about=about))
        marks += joint_marks(leg, motion, d.scale)
    items += _joints(marks, d.factor)
    point = d.snapshot.reference_point
    moved = point + d.scale * d.motion.platform.displacement(point)
    items.append(Marks(d.factor * moved[None], Tone.INK, Shape.CROSS, "reference point"))
    return items


def _plates(d: _Drawing, paint: Tone = Tone.PLATE) -> list[Item]:
    ends = [leg.end for leg in d.snapshot.legs]
    point = d.snapshot.reference_point
    items: list[Item] = []
    base = plate(np.array([foot(leg) for leg in d.snapshot.legs]))
    if base is not None:
        items.append(Face(d.factor * base, Tone.FAINT, 0.35))
    moved = np.array([p + d.scale * d.motion.platform.displacement(p) for p in [*ends, point]])
    top = plate(moved[:-1])
    if top is not None:
        items.append(Face(d.factor * top, paint, 0.35, "platform" if paint is Tone.PLATE else ""))
    # A point of the platform that is away from the leg ends is tied to them.
    away = np.linalg.norm(moved[:-1] - moved[-1], axis=1)
    if top is None and away.max() > 1e-9:
        ties = [np.array([end, moved[-1]]) for end in moved[:-1]]
        items += [Path(d.factor * tie, Tone.MUTED, Weight.LINE) for tie in ties]
    elif top is not None:
        stem = np.array([moved[:-1].mean(axis=0), moved[-1]])
        items.append(Path(d.factor * stem, Tone.MUTED, Weight.THIN))
    return items


def _joints(marks: list[JointMark], factor: float) -> list[Item]:
    kinds = (
        ("passive joint", Shape.RING, lambda role: isinstance(role, Passive)),
        ("actuator", Shape.SQUARE, lambda role: isinstance(role, Actuated)),
        (
            "locked joint",
            Shape.DIAMOND,
            lambda role: not isinstance(role, Passive) and not isinstance(role, Actuated),
        ),
    )
    items: list[Item] = []
    for label, shape, belongs in kinds:
        own = [mark for mark in marks if belongs(mark.freedom.role)]
        if own:
            points = factor * np.array([mark.point for mark in own])
            names = tuple(mark.name for mark in own)
            items.append(Marks(points, Tone.INK, shape, label, names))
    return items


def _ghost(d: _Drawing) -> list[Item]:
    label, items = "without load", []
    for leg, motion in zip(d.snapshot.legs, d.motion.legs, strict=True):
        for member in leg_members(leg, motion):
            points = d.factor * member.points
            items.append(Path(points, Tone.MUTED, Weight.THIN, dashed=True, label=label))
            label = ""
    return items


def _load(d: _Drawing, bent: Deflection, is_flat: bool) -> list[Item]:
    """Arrows of the force, towards the point where it acts, and of the moment, away from it."""
    F = np.zeros(6)
    F[list(bent.stiffness.space.rows)] = bent.wrench
    point = bent.stiffness.reference_point
    point = d.factor * (point + d.scale * d.motion.platform.displacement(point))
    length = _ARROW * d.factor * extent(d.snapshot)
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
                items += turning_arrow(
                    Screw(vector / size, point, 0.0), length, Category(row), label
                )
            else:
                items.append(Arrow(point, point + arrow, Category(row), label))
    return items


def turning_arrow(screw: Screw, size: float, paint: Paint, label: str) -> list[Item]:
    """The way of a point around an axis, or a helix, with an arrow head."""
    point = np.zeros(3) if screw.point is None else screw.point
    way = screw_line(screw, point, size).way
    line = Path(way[:-4], paint, Weight.LINE, label=label, about=label)
    return [line, Arrow(way[-5], way[-1], paint)]


def _shares(bent: Deflection, colouring: Colouring) -> dict[tuple[str, str], float]:
    """Shares [%] of legs, or of their parts; the part of a whole leg has no name."""
    shares: dict[tuple[str, str], float] = {}
    if colouring is Colouring.NONE:
        return shares
    for part in bent.parts:
        key = (part.leg, part.part if colouring is Colouring.PARTS else "")
        shares[key] = shares.get(key, 0.0) + 100 * part.share
    return shares


def _chosen(snapshot: Snapshot, motion: RobotMotion) -> float:
    """A round factor 1, 2 or 5 times a power of ten."""
    points = [leg.end for leg in snapshot.legs] + [snapshot.reference_point]
    moved = [np.linalg.norm(motion.platform.displacement(point)) for point in points]
    for leg, own in zip(snapshot.legs, motion.legs, strict=True):
        for mark, body in zip(joint_marks(leg, own, 1.0), joint_marks(leg, own), strict=True):
            moved.append(np.linalg.norm(mark.point - body.point))
    largest = float(np.max(moved))
    if largest == 0:
        return 0.0
    wanted = _SEEN * extent(snapshot) / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1, 2, 5) if step * power <= wanted * (1 + 1e-9)))


def _check_fit(snapshot: Snapshot, bent: Deflection, motion: RobotMotion) -> None:
    """A deflection of another pose does not close the legs of this one."""
    length = float(bent.stiffness.about_reference.length)
    s = np.repeat([1.0, length], 3)
    size = np.linalg.norm(motion.platform.twist * s)
    gaps = [
        np.linalg.norm((leg.bodies[-1].twist - motion.platform.twist) * s) for leg in motion.legs
    ]
    if max(gaps) > _MISSED * size:
        raise InputError(
            f"deflection in a plot of {snapshot.name!r}",
            got=f"that of {bent.stiffness.name!r} at another pose",
            expected="the deflection of this robot at this pose",
            hint="give both functions the same pose",
        )


def _scene(
    snapshot: Snapshot,
    unit: str,
    items: list[Item],
    scale: ColourScale | None,
    notes: tuple[str, ...],
) -> Scene:
    x, y, z = (f"{axis} [{unit}]" for axis in "xyz")
    return Scene(snapshot.name, (x, y, z), tuple(items), scale, is_plane(snapshot), notes=notes)


def is_plane(snapshot: Snapshot) -> bool:
    """Whether a robot is planar, or all of it lies in one plane z = constant."""
    if snapshot.space is Space.PLANAR:
        return True
    heights = [snapshot.reference_point[2]]
    for leg in snapshot.legs:
        heights += [leg.end[2], *(part.point[2] for part in leg.parts)]
    return bool(np.ptp(heights) <= 1e-9 * extent(snapshot))
