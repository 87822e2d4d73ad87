"""A robot at a pose: its legs, their elastic energy, and its shape under a load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any, TypeVar

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness, Deflection, PartShare, cable_stiffness
from robostiff.errors import InputError
from robostiff.kinematics import Near, Pose
from robostiff.kinematics.pose import check_is_not_posed
from robostiff.linkage import Linkage
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.cable_robot import cable_scene
from robostiff.plot.geometry.displacement import RobotMotion, at_rest, motion_under, spatial
from robostiff.plot.geometry.legs import extent, joint_marks
from robostiff.plot.picture import PlainColour, Scene
from robostiff.plot.posture import snapshot_at
from robostiff.plot.prefix import short
from robostiff.plot.robot_parts import (
    Drawing,
    colours_of_parts,
    energy_scale,
    exaggerated,
    ghost,
    is_plane,
    joint_names,
    load_items,
    part_names,
    robot_items,
    robot_scene,
    round_factor,
    unit_of,
)
from robostiff.plot.structures import network_scene

_MISSED = 1e-4
_ROUNDING = 1e-9


class Colouring(Enum):
    """Meaning of the colours of the legs.

    ``LEGS``
        The share of each leg in the elastic energy.
    ``PARTS``
        The share of each link, strut or actuator.
    ``NAMES``
        A colour for each name of a part, in all legs.
    ``NONE``
        Nothing.
    """

    LEGS = "legs"
    PARTS = "parts"
    NAMES = "names"
    NONE = "none"


def robot(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Pose | Mapping[str, float] = None,
    *,
    near: Near = None,
    deflection: Deflection | CableResponse | None = None,
    colouring: Colouring = Colouring.LEGS,
    exaggeration: float | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw a robot at a pose, and its deformed shape under a load.

    Parameters
    ----------
    robot : Robot, Snapshot, Network, Linkage or CableRobot
    pose : RigidTransform, array, JointCoordinates, mapping of str to float, or None
        One pose, as for `robostiff.stiffness`; of a linkage the coordinates of joints by name.
    near : joint coordinates, optional
        Those that choose the posture, as for `robostiff.stiffness`.
    deflection : Deflection or CableResponse, optional
        Of the same robot at the same pose: draws the deformed shape, and colours the legs by their
        share of the elastic energy.
    colouring : Colouring
        Meaning of the colours, when there is a deflection. A serial arm is coloured part by part
        and its joints are named.
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
    picture = picture_of_robot(robot, pose, deflection, colouring, exaggeration, near)
    return drawn_by(backend, picture)


def picture_of_robot(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Any = None,
    bent: Deflection | CableResponse | None = None,
    colouring: Colouring = Colouring.LEGS,
    exaggeration: float | None = None,
    near: Near = None,
) -> Scene:
    """The picture of `robot`, as data."""
    check_exaggeration(exaggeration)
    if near is not None and not isinstance(robot, Robot):
        raise InputError(f"near of {robot.name!r}", got=near, expected="none: it has no postures")
    if isinstance(robot, CableRobot):
        if bent is not None:
            return cable_scene(_of_kind(robot, bent, CableResponse), exaggeration)
        return cable_scene(cable_stiffness(robot, pose))
    own = None if bent is None else _of_kind(robot, bent, Deflection)
    if isinstance(robot, Linkage):
        return network_scene(
            robot.network_at(pose), own, exaggeration, joints_in_words(robot, pose)
        )
    if isinstance(robot, Network):
        check_is_not_posed(robot, pose)
        return network_scene(robot, own, exaggeration)
    return robot_picture(snapshot_at(robot, pose, near), own, colouring, exaggeration)


def joints_in_words(linkage: Linkage, values: Mapping[str, Any] | None) -> tuple[str, ...]:
    """Coordinates that are given to joints, such as ``screw −50 mm``."""
    words, given = [], values or {}
    for joint in linkage.joints:
        if joint.name in given:
            pairs = zip(joint.freedoms, np.atleast_1d(given[joint.name]), strict=True)
            shown = (
                f"{short(np.degrees(q))}°" if screw.turns else f"{short(1e3 * q)} mm"
                for screw, q in pairs
            )
            words.append(f"{joint.name} {', '.join(shown)}")
    return tuple(words)


def picture_of_posed(
    posed: Snapshot | Network | CableStiffness,
    bent: Deflection | CableResponse | None = None,
    colouring: Colouring = Colouring.LEGS,
) -> Scene:
    """The picture of what has been placed at a pose."""
    if isinstance(posed, CableStiffness):
        return cable_scene(bent if isinstance(bent, CableResponse) else posed)
    return picture_of_robot(posed, None, bent, colouring)


_Bent = TypeVar("_Bent", Deflection, CableResponse)


def _of_kind(robot: Any, bent: Any, kind: type[_Bent]) -> _Bent:
    """A deflection of the kind that this robot has, and of this robot."""
    of = bent.before if isinstance(bent, CableResponse) else getattr(bent, "stiffness", None)
    if not isinstance(bent, kind) or of is None or of.name != robot.name:
        call = "rs.cable_response" if kind is CableResponse else "rs.deflection"
        raise InputError(
            f"deflection in a plot of {robot.name!r}",
            got=bent,
            expected=f"a result of {call} of this robot",
        )
    return bent


def robot_picture(
    snapshot: Snapshot,
    bent: Deflection | None = None,
    colouring: Colouring = Colouring.LEGS,
    exaggeration: float | None = None,
) -> Scene:
    """The picture of a robot of legs."""
    factor, unit = unit_of(extent(snapshot))
    is_arm = len(snapshot.legs) == 1
    if bent is None:
        drawing = Drawing(snapshot, at_rest(snapshot), 0.0, factor)
        named = is_arm or colouring is Colouring.NAMES
        colours = colours_of_parts(part_names(snapshot)) if named else {}
        items = robot_items(drawing, {}, PlainColour.INK, colours)
        items += joint_names(drawing) if named else []
        return robot_scene(snapshot.name, items, unit, is_plane(snapshot))
    motion, scale = displaced(snapshot, bent, exaggeration)
    if is_arm and colouring is Colouring.LEGS:
        colouring = Colouring.PARTS
    drawing = Drawing(snapshot, motion, scale, factor)
    shares = energy_colours(bent.parts, colouring)
    named = colouring is Colouring.NAMES
    colours = colours_of_parts(part_names(snapshot)) if named else {}
    plain = PlainColour.MUTED if shares or named else PlainColour.INK
    items = robot_items(drawing, shares, plain, colours)
    items += joint_names(drawing) if is_arm else []
    items = [*(ghost(drawing) if scale else []), *items]
    is_flat = stays_flat(snapshot, motion, spatial(bent.wrench, bent.stiffness.space.rows))
    items += load_items(drawing, bent, is_flat)
    values = energy_scale(shares.values())
    return robot_scene(snapshot.name, items, unit, is_flat, values, exaggerated(scale))


def displaced(
    snapshot: Snapshot, bent: Deflection, exaggeration: float | None
) -> tuple[RobotMotion, float]:
    """Motions of the bodies, and the factor of their displacements."""
    check_exaggeration(exaggeration)
    if bent.work_of_loads is not None:
        raise InputError(
            f"deflection in a plot of {snapshot.name!r}",
            got="one with forces or weights at bodies",
            expected="one under a wrench on the platform",
            hint="the shape is drawn of rs.deflection(robot, pose, wrench) without loads, gravity",
        )
    motion = motion_under(snapshot, bent)
    _check_fit(snapshot, bent, motion)
    return motion, chosen_exaggeration(snapshot, motion) if exaggeration is None else float(
        exaggeration
    )


def check_exaggeration(given: float | None) -> None:
    """Raise an InputError unless a factor of displacements is left out or finite."""
    if given is not None and not np.isfinite(given):
        raise InputError("exaggeration of a plot", got=given, expected="a finite number")


def energy_colours(
    parts: Sequence[PartShare], colouring: Colouring
) -> dict[tuple[str, str], float]:
    """Shares [%] of legs, or of their parts; the part of a whole leg has no name."""
    shares: dict[tuple[str, str], float] = {}
    if colouring in {Colouring.NONE, Colouring.NAMES}:
        return shares
    for part in parts:
        key = (part.leg, part.part if colouring is Colouring.PARTS else "")
        shares[key] = shares.get(key, 0.0) + 100 * part.share
    return shares


def chosen_exaggeration(snapshot: Snapshot, motion: RobotMotion) -> float:
    """With which displacements are drawn: see `round_factor`."""
    moved = [motion.platform.displacement(snapshot.reference_point)]
    for leg, own in zip(snapshot.legs, motion.legs, strict=True):
        moved.append(own.bodies[-1].displacement(leg.end))
        moved += [mark.point - mark.freedom.point for mark in joint_marks(leg, own, 1.0)]
    placed = snapshot.platform
    if placed is not None:
        for name, body in motion.nodes.items():
            moved.append(body.displacement(placed.in_world(placed.platform.point_of(name))))
    return round_factor(np.array(moved), extent(snapshot))


def _check_fit(snapshot: Snapshot, bent: Deflection, motion: RobotMotion) -> None:
    """Raise unless the deflection is that of this pose: otherwise the legs do not close."""
    length = float(bent.stiffness.about_reference.length)
    s = np.repeat([1.0, length], 3)
    size = np.linalg.norm(motion.platform.twist * s)
    ends = [motion.platform] * len(motion.legs)
    if snapshot.platform is not None:
        ends = [motion.nodes[name] for name in snapshot.platform.holds]
    o = bent.stiffness.origin
    gaps = [
        np.linalg.norm((leg.bodies[-1].twist - end.twist_about(o)) * s)
        for leg, end in zip(motion.legs, ends, strict=True)
    ]
    if max(gaps) > _MISSED * size:
        raise InputError(
            f"deflection in a plot of {snapshot.name!r}",
            got=f"that of {bent.stiffness.name!r} at another pose",
            expected="the deflection of this robot at this pose",
            hint="give both functions the same pose",
        )


def stays_flat(snapshot: Snapshot, motion: RobotMotion, F: np.ndarray) -> bool:
    """Whether a robot is plane, and neither a body nor a wrench (6,) on it leaves the x-y plane."""
    if not is_plane(snapshot) or np.any(np.abs(F[2:5]) > _ROUNDING):
        return False
    bodies = [motion.platform, *(body for leg in motion.legs for body in leg.bodies)]
    moved = np.array([body.displacement(point) for body in bodies for point in np.eye(3)[:2]])
    return bool(np.abs(moved[:, 2]).max() <= _ROUNDING * np.abs(moved).max(initial=0.0))
