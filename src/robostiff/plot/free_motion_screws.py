"""Free motions, drawn as screws."""

from __future__ import annotations

from robostiff.analysis import RobotStiffness
from robostiff.elastostatics import Status
from robostiff.errors import NoAnswerError
from robostiff.model import Robot, Snapshot
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.geometry.legs import extent
from robostiff.plot.geometry.screw_line import screw_line
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
from robostiff.plot.posture import single_stiffness, snapshot_at
from robostiff.plot.robot_parts import backdrop, drawing_unit, is_plane, turning_arrow

_ALONG = 1e-9
_PART = 0.3  # of the robot: half an axis


def free_motions(
    result: RobotStiffness,
    *,
    within: Robot | Snapshot | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw the free motions of a platform: rotation axes, helices, arrows.

    Parameters
    ----------
    result : RobotStiffness
        At a single pose.
    within : Robot or Snapshot, optional
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
    snapshot = None
    if within is not None:
        pose = None if isinstance(within, Snapshot) else result.pose
        snapshot = snapshot_at(within, pose)
    return drawn_by(backend, free_motions_picture(result, snapshot))


def free_motions_picture(result: RobotStiffness, snapshot: Snapshot | None = None) -> Scene:
    """The picture of `free_motions`, as data."""
    if Status.UNREACHABLE in result.status:
        raise NoAnswerError(f"no free motions of {result.name!r}: {'; '.join(result.advice)}")
    if snapshot is None:
        half = float(result.about_reference.length)
        factor, unit = (1.0, "m") if half >= 1 else (1e3, "mm")
        items: list[Item] = []
    else:
        half = _PART * extent(snapshot)
        factor, unit = drawing_unit(snapshot)
        items = backdrop(snapshot, factor)
    items += free_motion_items(result, half, factor)
    point = result.reference_point
    items.append(Marks(factor * point[None], PlainColour.INK, Shape.CROSS, "reference point"))
    x, y, z = (f"{axis} [{unit}]" for axis in "xyz")
    free = len(result.free_motions)
    count = "no free motion" if not free else f"{free} free motion{'s' if free > 1 else ''}"
    return Scene(
        f"{result.name}: {count}",
        (x, y, z),
        tuple(items),
        is_flat=snapshot is not None and is_plane(snapshot) and _is_in_plane(result),
        notes=(f"rank {int(result.rank)} of {result.space.size}",),
    )


def free_motion_items(result: RobotStiffness, half: float, factor: float) -> list[Item]:
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


def _is_in_plane(result: RobotStiffness) -> bool:
    """Whether all free motions are planar: translations in the plane, rotations about z."""
    return all(
        abs(motion.screw.axis[2]) < _ALONG
        if motion.screw.is_translation
        else motion.screw.is_rotation and abs(motion.screw.axis[2]) > 1 - _ALONG
        for motion in result.free_motions
    )
