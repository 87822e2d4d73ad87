"""A robot at a pose: its legs, their elastic energy, and its shape under a load."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import numpy as np

from robostiff.analysis import Deflection, PartShare, cable_stiffness
from robostiff.errors import InputError
from robostiff.kinematics import Pose
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.geometry.displacement import RobotMotion, at_rest, motion_under
from robostiff.plot.geometry.legs import extent, joint_marks
from robostiff.plot.picture import ColourScale, Item, PlainColour, Scene
from robostiff.plot.posture import snapshot_at
from robostiff.plot.prefix import short
from robostiff.plot.robot_parts import (
    Drawing,
    colours_of_parts,
    drawing_unit,
    ghost,
    is_plane,
    joint_names,
    load_items,
    part_names,
    robot_items,
)
from robostiff.plot.structures import cable_scene, network_scene
from robostiff.spatial import Space

_SEEN = 0.1  # of the robot: the largest displacement drawn with the default exaggeration
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
    robot: Robot | Snapshot | Network | CableRobot,
    pose: Pose = None,
    *,
    deflection: Deflection | None = None,
    colouring: Colouring = Colouring.LEGS,
    exaggeration: float | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw a robot at a pose, and its deformed shape under a load.

    Parameters
    ----------
    robot : Robot, Snapshot, Network or CableRobot
        Networks and cable robots are drawn without load.
    pose : RigidTransform, array, JointCoordinates or None
        One pose, as for `robostiff.stiffness`.
    deflection : Deflection, optional
        Of the same robot at the same pose: draws the deformed shape, and colours the legs by their
        share of the elastic energy.
    colouring : Colouring
        Meaning of the colours, when there is a deflection. A serial arm is coloured part by part
        and its joints are named.
    exaggeration : float, optional
        Factor of all displacements; 0 leaves the robot as it is. When left out, a round number that
        draws the largest displacement as a tenth of the robot, or less. A robot with a flexible
        platform is drawn as it is.
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
    if isinstance(robot, Network | CableRobot):
        return drawn_by(backend, _structure(robot, pose, deflection))
    picture = robot_picture(snapshot_at(robot, pose), deflection, colouring, exaggeration)
    return drawn_by(backend, picture)


def _structure(robot: Network | CableRobot, pose: Pose, bent: Deflection | None) -> Scene:
    """A network or a cable robot, as it is."""
    if bent is not None:
        raise InputError(
            f"deflection in a plot of {robot.name!r}",
            got=bent,
            expected="none: networks and cable robots are drawn without load",
        )
    if isinstance(robot, CableRobot):
        return cable_scene(cable_stiffness(robot, pose))
    if pose is not None:
        raise InputError(
            f"pose of network {robot.name!r}", got=pose, expected="none: it has its own"
        )
    return network_scene(robot)


def robot_picture(
    snapshot: Snapshot,
    bent: Deflection | None = None,
    colouring: Colouring = Colouring.LEGS,
    exaggeration: float | None = None,
) -> Scene:
    """The picture of `robot`, as data."""
    factor, unit = drawing_unit(snapshot)
    is_arm = len(snapshot.legs) == 1
    if bent is None:
        drawing = Drawing(snapshot, at_rest(snapshot), 0.0, factor)
        named = is_arm or colouring is Colouring.NAMES
        colours = colours_of_parts(part_names(snapshot)) if named else {}
        items = robot_items(drawing, {}, PlainColour.INK, colours)
        items += joint_names(drawing) if is_arm else []
        return robot_scene(snapshot, unit, items, is_plane(snapshot))
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
    if scale:
        items = [*ghost(Drawing(snapshot, motion, 0.0, factor)), *items]
    is_flat = is_plane(snapshot) and _stays_in_plane(bent, motion)
    items += load_items(drawing, bent, is_flat)
    notes = (f"displacements × {short(scale, 6)}",) if scale not in {0.0, 1.0} else ()
    if snapshot.platform is not None:
        notes = ("flexible platform: shape without load",)
    label = "share of elastic energy [%]"
    top = max(shares.values(), default=0.0)
    values = ColourScale(label, 0, top) if shares else None
    return robot_scene(snapshot, unit, items, is_flat, values, notes)


def displaced(
    snapshot: Snapshot, bent: Deflection, exaggeration: float | None
) -> tuple[RobotMotion, float]:
    """Motions of the bodies, and the factor of their displacements."""
    check_exaggeration(exaggeration)
    if snapshot.platform is not None:
        if exaggeration:
            raise InputError(
                f"exaggeration in a plot of {snapshot.name!r}",
                got=exaggeration,
                expected="0: the deformed shape of a flexible platform is not drawn",
            )
        _ = bent.twist  # raises with the reason when there is no deflection
        return at_rest(snapshot), 0.0
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
    """With which displacements are drawn: a round factor 1, 2 or 5 times a power of ten."""
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
    """Raise unless the deflection is that of this pose: otherwise the legs do not close."""
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


def _stays_in_plane(bent: Deflection, motion: RobotMotion) -> bool:
    """Whether neither the load nor the platform leaves the x-y plane."""
    if bent.stiffness.space is Space.PLANAR:
        return True
    out = [2, 3, 4]
    length = float(bent.stiffness.about_reference.length)
    moved = motion.platform.twist * np.repeat([1.0, length], 3)
    size = float(np.linalg.norm(moved))
    return not np.any(bent.wrench[out]) and bool(np.abs(moved[out]).max() <= _ROUNDING * size)


def robot_scene(
    snapshot: Snapshot,
    unit: str,
    items: list[Item],
    is_flat: bool,
    scale: ColourScale | None = None,
    notes: tuple[str, ...] = (),
) -> Scene:
    """A scene of a robot, its axes in `unit`."""
    x, y, z = (f"{axis} [{unit}]" for axis in "xyz")
    return Scene(snapshot.name, (x, y, z), tuple(items), scale, is_flat, notes=notes)
