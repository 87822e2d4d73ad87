"""A robot at a pose: its legs, their elastic energy, and its shape under a load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any, cast

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness, Deflection, PartShare
from robostiff.errors import InputError
from robostiff.kinematics import Near, Pose
from robostiff.linkage import Linkage
from robostiff.model import Snapshot
from robostiff.network import Network
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.geometry.displacement import (
    PLATFORM,
    FiniteMotion,
    Motions,
    motion_under,
    spatial,
)
from robostiff.plot.outline import Outline, of_cables, outline_of
from robostiff.plot.picture import PlainColour, Scene
from robostiff.plot.posture import Machine, Posed, placed
from robostiff.plot.prefix import short
from robostiff.plot.sketch import Sketch, colours_of_parts, exaggeration_note
from robostiff.spatial import Space
from robostiff.spatial.rotation import matrix_of_rotation

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
    robot: Machine,
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
    posed = placed(robot, pose, near)
    is_cables = isinstance(posed, CableStiffness)
    of = getattr(deflection, "before" if is_cables else "stiffness", None)
    if deflection is not None and (of is None or of.name != robot.name):
        call = "rs.cable_response" if is_cables else "rs.deflection"
        raise InputError(
            f"deflection in a plot of {robot.name!r}",
            got=deflection,
            expected=f"a result of {call} of this robot",
        )
    words = joints_in_words(robot, cast("Any", pose)) if isinstance(robot, Linkage) else ()
    return drawn_by(backend, picture_of_posed(posed, deflection, colouring, exaggeration, words))


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
    posed: Posed,
    bent: Deflection | CableResponse | None = None,
    colouring: Colouring = Colouring.LEGS,
    exaggeration: float | None = None,
    notes: tuple[str, ...] = (),
) -> Scene:
    """The picture of what has been placed at a pose."""
    outline, named = outline_of(posed), colouring is Colouring.NAMES
    if bent is None:
        named = outline.is_named or named
        colours = colours_of_parts(outline.part_names) if named else {}
        sketch = Sketch(outline=outline, colours=colours)
        return sketch.scene(posed.name, is_named=named, notes=notes)
    parts: Sequence[PartShare] = ()
    if isinstance(bent, CableResponse):
        motions, outline = moved_cables(bent)
        F, point = bent.load, outline.point.point
    else:
        motions, parts = motion_of(cast("Snapshot | Network", posed), bent), bent.parts
        F, point = bent.wrench, bent.stiffness.reference_point
    sketch = loaded_sketch(outline, motions, parts, colouring).exaggerated(exaggeration)
    load = point, spatial(F, Space.of_size(len(F)).rows)
    notes = (*notes, *exaggeration_note(sketch.scale))
    return sketch.scene(posed.name, load, notes=notes)


def moved_cables(found: CableResponse) -> tuple[Motions, Outline]:
    """Motion of the platform under a load that is carried, and the cables that are taut there."""
    tensions = found.tensions  # raises with the reason where the load is not carried
    placed, moved = found.before.placed, cast("np.ndarray", found.displacement)
    d = spatial(moved, found.before.space.rows)
    R = matrix_of_rotation(d[3:])
    p = placed.reference_point
    motions = {PLATFORM: FiniteMotion(np.zeros(6), np.zeros(3), R - np.eye(3), d[:3] + p - R @ p)}
    ends = placed.exit_points, placed.attachments
    return motions, of_cables(found.before.cable_names, ends, p, found.before.space, tensions)


def motion_of(posed: Snapshot | Network, bent: Deflection) -> Motions:
    """Motions of the bodies; InputError where they are not those of this pose and a wrench."""
    subject = f"deflection in a plot of {posed.name!r}"
    if bent.work_of_loads is not None:
        raise InputError(
            subject,
            got="one with forces or weights at bodies",
            expected="one under a wrench on the platform",
            hint="the shape is drawn of rs.deflection(robot, pose, wrench) without loads, gravity",
        )
    own, other = (outline_of(one) for one in (posed, bent.stiffness.placed()))
    points, others = (np.array([at.point for at in one.anchors]) for one in (own, other))
    if points.shape != others.shape or np.abs(points - others).max() > _MISSED * own.size:
        raise InputError(
            subject,
            got=f"that of {bent.stiffness.name!r} at another pose",
            expected="the deflection of this robot at this pose",
            hint="give both functions the same pose",
        )
    return motion_under(posed, bent)


def loaded_sketch(
    outline: Outline, motions: Motions, parts: Sequence[PartShare], colouring: Colouring
) -> Sketch:
    """A machine with its bodies displaced, coloured by elastic energy or by names."""
    named, shares = colouring is Colouring.NAMES, _energy_shares(parts, colouring, outline)
    return Sketch(
        outline=outline,
        motions=motions,
        shares=shares,
        colours=colours_of_parts(outline.part_names) if named else {},
        plain=PlainColour.MUTED if shares or named else PlainColour.INK,
    )


def _energy_shares(
    parts: Sequence[PartShare], colouring: Colouring, outline: Outline
) -> dict[tuple[str, str], float]:
    """Shares [%] of legs, or of their parts; the part of a whole leg has no name.

    Parts of a network have no leg, and are found by their whole names.
    """
    shares: dict[tuple[str, str], float] = {}
    if colouring in {Colouring.NONE, Colouring.NAMES}:
        return shares
    part_by_part = colouring is Colouring.PARTS or outline.is_named
    for part in parts:
        key = (part.leg, part.part if part_by_part else "")
        shares[key] = shares.get(key, 0.0) + 100 * part.share
        if part_by_part:
            for name in (f"{part.leg}/{part.part}", part.part):
                shares.setdefault(("", name), 100 * part.share)
    return shares
