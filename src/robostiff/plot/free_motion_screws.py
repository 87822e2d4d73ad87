"""Free motions, drawn as screws."""

from __future__ import annotations

from robostiff.analysis import RobotStiffness
from robostiff.elastostatics import Status
from robostiff.errors import NoAnswerError
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.geometry.ellipsoid import Stiffness, length_of, screw_line
from robostiff.plot.picture import (
    Arrow,
    Category,
    Item,
    LineWeight,
    Marks,
    Path,
    PlainColour,
    Scene,
    Shape,
)
from robostiff.plot.posture import (
    Around,
    Surroundings,
    single_stiffness,
    surroundings,
)
from robostiff.plot.sketch import robot_scene, turning_arrow, unit_of

_ALONG = 1e-9
_PART = 0.3  # of the robot: half an axis


def free_motions(
    result: Stiffness,
    *,
    within: Around | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw the free motions of a platform: rotation axes, helices, arrows.

    Parameters
    ----------
    result : RobotStiffness or CableStiffness
        At a single pose.
    within : Robot, Snapshot or Network, optional
        Draws them in this robot, at the pose of the result. An arm that was
        posed by its joints is given as a snapshot: ``find_posture(arm, pose).snapshot.one(0)``.
    backend : Matplotlib or Plotly

    Returns
    -------
    Axes or Figure
        Of the backend.

    Raises
    ------
    InputError
        When the result is of several poses.
    NoAnswerError
        When the pose is out of reach.

    Examples
    --------
    >>> import robostiff as rs
    >>> axes = rs.plot.free_motions(rs.stiffness(rs.load("gough-stewart-a")))
    >>> axes.get_legend().get_texts()[0].get_text()
    'rotation about x through (0, 0, 2) m'
    """
    single_stiffness(result, "free motions")
    return drawn_by(backend, free_motions_picture(result, surroundings(within, result)))


def free_motions_picture(result: Stiffness, around: Surroundings | None = None) -> Scene:
    """The picture of `free_motions`, as data."""
    if isinstance(result, RobotStiffness) and Status.UNREACHABLE in result.status:
        raise NoAnswerError(f"no free motions of {result.name!r}: {'; '.join(result.advice)}")
    half = length_of(result) if around is None else _PART * around.size
    factor, unit = unit_of(half) if around is None else (around.factor, around.unit)
    items = [] if around is None else list(around.items)
    items += free_motion_items(result, half, factor)
    point = result.reference_point
    items.append(Marks(factor * point[None], PlainColour.INK, Shape.CROSS, "reference point"))
    free = len(result.free_motions)
    count = "no free motion" if not free else f"{free} free motion{'s' if free > 1 else ''}"
    is_flat = around is not None and around.is_flat and _is_in_plane(result)
    notes = (f"rank {int(result.rank)} of {result.space.size}",)
    return robot_scene(f"{result.name}: {count}", items, unit, is_flat, notes=notes)


def free_motion_items(result: Stiffness, half: float, factor: float) -> list[Item]:
    """Axes of `half` a length [m], helices and arrows, in metres times `factor`."""
    items: list[Item] = []
    for i, motion in enumerate(result.free_motions):
        paint, label = Category(i), str(motion)
        lines = screw_line(motion.screw, result.reference_point, half)
        axis = factor * lines.axis
        if not len(lines.way):
            items.append(Arrow(axis[0], axis[1], paint, label, both_ways=True))
            continue
        items.append(Path(axis, paint, LineWeight.THIN, dashed=True))
        items += turning_arrow(factor * lines.way, paint, label)
    return items


def _is_in_plane(result: Stiffness) -> bool:
    """Whether all free motions are planar: translations in the plane, rotations about z."""
    return all(
        abs(motion.screw.axis[2]) < _ALONG
        if motion.screw.is_translation
        else motion.screw.is_rotation and abs(motion.screw.axis[2]) > 1 - _ALONG
        for motion in result.free_motions
    )
