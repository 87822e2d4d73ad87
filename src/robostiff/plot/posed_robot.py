"""A machine at a pose, under a load, at rest under finite loads, and in its modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness, Deflection, PartShare
from robostiff.errors import InputError, Words
from robostiff.kinematics import Near, Pose
from robostiff.linkage import Linkage
from robostiff.markup import quantity, short
from robostiff.model import Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.displacement import PLATFORM, BodyMotion, Motions, finite_motions, motion_under
from robostiff.plot.outline import Outline, of_cables, outline_of
from robostiff.plot.picture import Category, Item, LineWeight, Path, PlainColour, Scene
from robostiff.plot.sketch import (
    Machine,
    Posed,
    Sketch,
    colours_of_parts,
    exaggeration_note,
    machine_at,
    unit_of,
)
from robostiff.plot.surfaces import perpendicular
from robostiff.spatial import Space
from robostiff.spatial.rotation import matrix_of_rotation
from robostiff.statics import BodyPlaces, Equilibrium, Modes

if TYPE_CHECKING:
    from robostiff.statics.equations.newton import FoundEquilibrium
    from robostiff.statics.equations.problem import EquilibriumProblem

_MISSED = 1e-4  # of the machine: an anchor that another pose has moved
_COILS, _WIDE = 7, 0.012  # of a spring, and how wide they are, of the robot


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
    posed = machine_at(robot, pose, near)
    is_cables = isinstance(posed, CableStiffness)
    of = getattr(deflection, "before" if is_cables else "stiffness", None)
    if deflection is not None and (of is None or of.name != robot.name):
        call = "rs.cable_response" if is_cables else "rs.deflection"
        subject = f"deflection in a plot of {robot.name!r}"
        expected = f"a result of {call} of this robot"
        raise InputError(subject, got=deflection, expected=expected)
    words = joints_in_words(robot, cast("Any", pose)) if isinstance(robot, Linkage) else ()
    return drawn_by(backend, picture_of_posed(posed, deflection, colouring, exaggeration, words))


def joints_in_words(linkage: Linkage, values: Mapping[str, Any] | None) -> tuple[str, ...]:
    """Coordinates that are given to joints, such as ``screw −50 mm``."""
    words, coordinates = [], values or {}
    for joint in linkage.joints:
        if joint.name in coordinates:
            pairs = zip(joint.freedoms, np.atleast_1d(coordinates[joint.name]), strict=True)
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
    load = point, Space.of_size(len(F)).spatial(F)
    notes = (*notes, *exaggeration_note(sketch.scale))
    return sketch.scene(posed.name, load, notes=notes)


def moved_cables(response: CableResponse) -> tuple[Motions, Outline]:
    """Motion of the platform under a load that is carried, and the cables that are taut there."""
    tensions = response.tensions  # raises with the reason where the load is not carried
    placed, moved = response.before.placed, cast("np.ndarray", response.displacement)
    d = response.before.space.spatial(moved)
    R = matrix_of_rotation(d[3:])
    p = placed.reference_point
    motions = {PLATFORM: BodyMotion(R - np.eye(3), d[:3] + p - R @ p)}
    ends = placed.exit_points, placed.attachments
    return motions, of_cables(response.before.cable_names, ends, p, response.before.space, tensions)


def motion_of(posed: Snapshot | Network, bent: Deflection) -> Motions:
    """Motions of the bodies; InputError where they are not those of this pose and a wrench."""
    subject = f"deflection in a plot of {posed.name!r}"
    if bent.work_of_loads is not None:
        got = Words("one with forces or weights at bodies")
        hint = "the shape is drawn of rs.deflection(robot, pose, wrench) without loads, gravity"
        raise InputError(subject, got=got, expected="one under a wrench on the platform", hint=hint)
    outline, of_bent = (outline_of(machine) for machine in (posed, bent.stiffness.placed()))
    points, others = (np.array([at.point for at in x.anchors]) for x in (outline, of_bent))
    if points.shape != others.shape or np.abs(points - others).max() > _MISSED * outline.size:
        raise InputError(
            subject,
            got=Words(f"that of {bent.stiffness.name!r} at another pose"),
            expected="the deflection of this robot at this pose",
            hint="give both functions the same pose",
        )
    return motion_under(posed, bent)


def loaded_sketch(
    outline: Outline, motions: Motions, parts: Sequence[PartShare], colouring: Colouring
) -> Sketch:
    """A machine with its bodies displaced, coloured by shares of elastic energy or by names.

    The part of a whole leg has no name; parts of a network are found by their whole names.
    """
    named, part_by_part = colouring is Colouring.NAMES, colouring is Colouring.PARTS
    part_by_part = part_by_part or outline.is_named
    shares: dict[tuple[str, str], float] = {}  # [%]
    for part in () if named or colouring is Colouring.NONE else parts:
        key = (part.leg, part.part if part_by_part else "")
        shares[key] = shares.get(key, 0.0) + 100 * part.share
        for name in (f"{part.leg}/{part.part}", part.part) if part_by_part else ():
            shares.setdefault(("", name), 100 * part.share)
    return Sketch(
        outline=outline,
        motions=motions,
        shares=shares,
        colours=colours_of_parts(outline.part_names) if named else {},
        plain=PlainColour.MUTED if shares or named else PlainColour.INK,
    )


def equilibrium(
    result: Equilibrium,
    *,
    colouring: Colouring = Colouring.LEGS,
    exaggeration: float | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw a robot where it comes to rest under finite loads, and without them in dashed lines.

    Parameters
    ----------
    result : Equilibrium
        What ``rs.equilibrium`` answers.
    colouring : Colouring
        Meaning of the colours: shares in the elastic energy.
    exaggeration : float, optional
        Factor of all displacements; 1 for the true shape. When left out, a round number from 1 on
        that draws the largest displacement as a tenth of the robot.
    backend : Matplotlib or Plotly

    Raises
    ------
    InputError
        When `result` is no equilibrium.
    NoAnswerError
        When there is none.

    Examples
    --------
    >>> import robostiff as rs
    >>> loaded = rs.equilibrium(rs.load("3-puu"), wrench=[500, 0, 0, 0, 0, 0])
    >>> rs.plot.equilibrium(loaded).get_title()
    '3-puu under load'
    """
    if not isinstance(result, Equilibrium) or result.batch_shape:
        expected = "a result of rs.equilibrium(robot, pose, wrench), one of a batch"
        raise InputError("equilibrium of a plot", got=result, expected=expected)
    _ = result.displacement  # raises with the reason when there is none
    posed, problem = result.posed, cast("FoundEquilibrium", result.found).problem
    tensions = np.array([spring.tension for spring in result.springs])
    sketch = _sketch(posed, problem, result.places, result.shares, colouring, tensions)
    sketch = sketch.exaggerated(exaggeration, is_finite=True)
    notes = exaggeration_note(sketch.scale)
    notes += () if result.stable else ("the robot does not stay there",)
    load = problem.point, result.space.spatial(result.wrench)
    more: list[Item] = []  # springs between bodies as coils, their ends displaced as the bodies are
    springs = posed.springs if isinstance(posed, Snapshot) else ()
    for unloaded, loaded in zip(springs, result.springs if springs else (), strict=True):
        pairs = zip(unloaded.points, loaded.points, strict=True)
        a, b = (p + sketch.scale * (now - p) for p, now in pairs)
        points, label = _coil(a, b, _WIDE * sketch.size), "" if more else "spring"
        paint, name = Category(2), loaded.name
        if sketch.shares:
            paint, name = sketch.paint(loaded.group, name)
        about = f"{name}, {quantity(loaded.tension, 'N', 4)}"
        more.append(Path(points, paint, LineWeight.LINE, label=label, about=about))
    scene = sketch.scene(f"{result.name} under load", load, notes=notes, more=more)
    return drawn_by(backend, scene)


def _sketch(
    posed: Any,
    problem: EquilibriumProblem,
    places: BodyPlaces,
    shares: Sequence[PartShare],
    colouring: Colouring,
    tensions: np.ndarray | None = None,
) -> Sketch:
    """A machine of any kind with its bodies at other places, coloured by elastic energy."""
    if isinstance(posed, CableRobot):
        springs = problem.legs.springs
        ends = np.array([spring.points for spring in springs])
        names, space = [spring.name for spring in springs], Space.of_size(len(problem.rows))
        outline = of_cables(names, (ends[:, 0], ends[:, 1]), problem.point, space, tensions)
    else:
        outline = outline_of(posed)
    return loaded_sketch(outline, finite_motions(posed, places), shares, colouring)


def mode(
    modes: Modes, number: int = 1, side: float = 1.0, *, backend: PlotBackend[Drawn] = PAPER
) -> Drawn:
    """Draw a robot in one of its modes, at one end of the vibration, and at rest in dashed lines.

    Parameters
    ----------
    modes : Modes
        What ``rs.modes`` answers.
    number : int
        Of the mode, 1 for the slowest.
    side : float
        -1 for the other end of the vibration.
    backend : Matplotlib or Plotly

    Raises
    ------
    InputError
        When there is no such mode.
    """
    if not isinstance(modes, Modes) or modes.batch_shape:
        raise InputError("modes of a plot", got=modes, expected="a result of rs.modes(robot)")
    _ = modes.frequencies  # raises with the reason when there are none
    whole = isinstance(number, int) and not isinstance(number, bool)
    if not (whole and 1 <= number <= len(modes)):
        raise InputError(
            "number of a mode", got=number, expected=f"1 to {len(modes)}, the slowest first"
        )
    vibration = modes[number - 1]
    rate = f"{short(vibration.frequency, 4)} Hz"
    rate = rate if vibration.growth == 0 else f"grows by {short(vibration.growth, 4)} /s"
    title = f"{modes.name}, mode {number}: {rate}"
    problem = cast("FoundEquilibrium", modes.equilibrium).problem
    sketch = _sketch(modes.posed, problem, vibration.motion, vibration.shares, Colouring.PARTS)
    sketch = sketch.exaggerated(side * sketch.exaggerated(None).scale)
    scene = sketch.scene(title, at_rest="at rest")
    # room for both ends of the vibration
    margin = 0.1 * unit_of(sketch.size)[0] * sketch.size
    low, high = scene.box
    return drawn_by(backend, replace(scene, frame=np.array([low - margin, high + margin])))


def _coil(a: np.ndarray, b: np.ndarray, wide: float) -> np.ndarray:
    """A zigzag (n, 3) between two points."""
    d = b - a
    length = float(np.linalg.norm(d))
    if length == 0:
        return np.array([a, b])
    across = wide * perpendicular(d)
    s = np.linspace(0.2, 0.8, 2 * _COILS + 1)
    side = np.array([0.0, *((-1.0) ** np.arange(2 * _COILS - 1)), 0.0])
    inner = a + s[:, None] * d + side[:, None] * across
    return np.array([a, *inner, b])
