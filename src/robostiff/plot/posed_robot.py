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
from robostiff.plot.geometry.displacement import (
    RobotMotion,
    at_rest,
    motion_under,
    network_motion,
    spatial,
)
from robostiff.plot.picture import PlainColour, Scene
from robostiff.plot.posture import snapshot_at
from robostiff.plot.prefix import short
from robostiff.plot.robot_parts import RobotSketch, part_names
from robostiff.plot.sketch import colours_of_parts, exaggeration_note
from robostiff.plot.structures import (
    CableSketch,
    NetworkSketch,
    colours_of_network,
    energies_by_name,
)

_MISSED = 1e-4


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
    if near is not None and not isinstance(robot, Robot):
        raise InputError(f"near of {robot.name!r}", got=near, expected="none: it has no postures")
    if isinstance(robot, CableRobot):
        if bent is None:
            return CableSketch.at_pose(cable_stiffness(robot, pose)).scene(robot.name)
        return _loaded_cables(_of_kind(robot, bent, CableResponse), exaggeration)
    own = None if bent is None else _of_kind(robot, bent, Deflection)
    if isinstance(robot, Linkage):
        words = joints_in_words(robot, pose)
        return _network_picture(robot.network_at(pose), own, exaggeration, words)
    if isinstance(robot, Network):
        check_is_not_posed(robot, pose)
        return _network_picture(robot, own, exaggeration)
    return robot_picture(snapshot_at(robot, pose, near), own, colouring, exaggeration)


def _loaded_cables(found: CableResponse, exaggeration: float | None) -> Scene:
    _ = found.tensions  # raises with the reason where the load is not carried
    sketch = CableSketch.under_load(found).exaggerated(exaggeration)
    load = sketch.rest.point, spatial(found.load, sketch.space.rows)
    return sketch.scene(found.before.name, load, notes=exaggeration_note(sketch.scale))


def _network_picture(
    network: Network,
    bent: Deflection | None,
    exaggeration: float | None,
    notes: tuple[str, ...] = (),
) -> Scene:
    """A network, coloured part by part; under a load deformed and coloured by elastic energy."""
    if bent is None:
        sketch = NetworkSketch(network=network, colours=colours_of_network(network))
        return sketch.scene(network.name, is_named=True, notes=notes)
    sketch = NetworkSketch(
        network=network,
        colours=energies_by_name(bent.parts),
        plain=PlainColour.MUTED,
        motions=network_motion(network, bent),
    ).exaggerated(exaggeration)
    load = bent.stiffness.reference_point, spatial(bent.wrench, network.space.rows)
    notes = (*notes, *exaggeration_note(sketch.scale))
    return sketch.scene(network.name, load, is_named=True, notes=notes)


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
        if isinstance(bent, CableResponse):
            return _loaded_cables(bent, None)
        return CableSketch.at_pose(posed).scene(posed.name)
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
    is_arm, named = len(snapshot.legs) == 1, colouring is Colouring.NAMES
    if bent is None:
        named = is_arm or named
        colours = colours_of_parts(part_names(snapshot)) if named else {}
        sketch = RobotSketch(snapshot=snapshot, motion=at_rest(snapshot), colours=colours)
        return sketch.scene(snapshot.name, is_named=named)
    if is_arm and colouring is Colouring.LEGS:
        colouring = Colouring.PARTS
    shares = energy_colours(bent.parts, colouring)
    sketch = RobotSketch(
        snapshot=snapshot,
        motion=motion_of(snapshot, bent),
        shares=shares,
        colours=colours_of_parts(part_names(snapshot)) if named else {},
        plain=PlainColour.MUTED if shares or named else PlainColour.INK,
    ).exaggerated(exaggeration)
    load = bent.stiffness.reference_point, spatial(bent.wrench, bent.stiffness.space.rows)
    notes = exaggeration_note(sketch.scale)
    return sketch.scene(snapshot.name, load, is_named=is_arm, notes=notes)


def motion_of(snapshot: Snapshot, bent: Deflection) -> RobotMotion:
    """Motions of the bodies; InputError where they are not those of this pose and a wrench."""
    if bent.work_of_loads is not None:
        raise InputError(
            f"deflection in a plot of {snapshot.name!r}",
            got="one with forces or weights at bodies",
            expected="one under a wrench on the platform",
            hint="the shape is drawn of rs.deflection(robot, pose, wrench) without loads, gravity",
        )
    motion = motion_under(snapshot, bent)
    _check_fit(snapshot, bent, motion)
    return motion


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


def _check_fit(snapshot: Snapshot, bent: Deflection, motion: RobotMotion) -> None:
    """Raise unless the deflection is that of this pose: otherwise the legs do not close."""
    length = float(bent.stiffness.length)
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
