"""An ellipsoid of stiffness or compliance at the tool point."""

from __future__ import annotations

import numpy as np

from robostiff.errors import NoAnswerError
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.geometry.ellipsoid import PrincipalAxes, Quality, Stiffness, principal_axes
from robostiff.plot.geometry.surfaces import ellipsoid_mesh
from robostiff.plot.picture import Category, Face, Item, LineWeight, Mesh, Path, Scene
from robostiff.plot.posture import (
    Around,
    Surroundings,
    single_stiffness,
    surroundings,
)
from robostiff.plot.prefix import prefixed, short
from robostiff.plot.sketch import robot_scene

_IN_ROBOT = 0.22  # of the robot: the longest semi-axis
_OPEN = 1.6  # of the longest finite semi-axis: length shown of a free direction


def ellipsoid(
    result: Stiffness,
    quality: Quality = Quality.COMPLIANCE,
    *,
    within: Around | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw an ellipsoid of stiffness or compliance about the reference point.

    Its semi-axes are the principal values of one block of C or K: the surface is the displacement
    under a force of 1 N in every direction, or the force that a displacement of 1 m needs. Where
    the platform is free it is no ellipsoid: the compliance is a tube or a pair of plates without
    end, the stiffness is flat.

    Parameters
    ----------
    result : RobotStiffness or CableStiffness
        At a single pose.
    quality : Quality
    within : Robot, Snapshot or Network, optional
        Draws it at the reference point of this robot, at the pose of the result. An arm that was
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
        When there is no stiffness matrix, or the platform is free in all directions.

    Examples
    --------
    >>> import robostiff as rs
    >>> result = rs.stiffness(rs.load("hexapod"))
    >>> rs.plot.ellipsoid(result).get_zlabel()
    'z [nm/N]'
    """
    single_stiffness(result, "an ellipsoid")
    return drawn_by(backend, ellipsoid_picture(result, quality, surroundings(within, result)))


def ellipsoid_picture(
    result: Stiffness, quality: Quality, around: Surroundings | None = None
) -> Scene:
    """The picture of `ellipsoid`, as data."""
    axes = principal_axes(result, quality)
    bounded = axes.lengths[~axes.is_free]
    if not len(bounded) or bounded.max() == 0:
        raise NoAnswerError(
            f"no ellipsoid of {quality.value} of {result.name!r}: "
            "the platform is free in all directions"
        )
    times, unit = prefixed(float(bounded.max()), quality.unit)
    if around is None:
        centre, size, items, shown = np.zeros(3), times, [], unit
    else:
        centre = around.factor * result.reference_point
        size = around.factor * _IN_ROBOT * around.size / float(bounded.max())
        items, shown = list(around.items), around.unit
    items = [*items, *ellipsoid_items(axes, quality, centre, size, (times, unit))]
    is_flat = len(axes.lengths) < 3 and (around is None or around.is_flat)
    title, notes = f"{result.name}: {quality.value}", _notes(axes, quality)
    return robot_scene(title, items, shown, is_flat, notes=notes)


def ellipsoid_items(
    axes: PrincipalAxes,
    quality: Quality,
    centre: np.ndarray,
    size: float,
    shown: tuple[float, str],
) -> list[Item]:
    """Surface and semi-axes, `size` metres to a unit of the quality; `shown` as by `prefixed`."""
    times, unit = shown
    bounded = axes.lengths[~axes.is_free]
    without_end = np.isinf(axes.lengths)
    reach = np.where(without_end, _OPEN * bounded.max(), axes.lengths)
    half = np.zeros((3, 3))
    half[: len(reach)] = size * reach[:, None] * axes.directions
    open_axes = tuple(int(i) for i in np.flatnonzero(without_end))
    items: list[Item] = []
    if len(axes.lengths) == 2 and len(open_axes) < 2:
        items.append(Face(centre + _ellipse(half, open_axes), Category(0), 0.2, quality.value))
    elif len(axes.lengths) == 3:
        vertices, triangles = ellipsoid_mesh(half, open_axes)
        items.append(Mesh(centre + vertices, triangles, Category(0), 0.2, quality.value))
    for i, length in enumerate(axes.lengths):
        ends = centre + np.array([-half[i], half[i]])
        if np.isinf(length):
            label = "free: unlimited"
            ends = centre + 1.25 * np.array([-half[i], half[i]])
        elif length == 0:
            label = "free: no resistance"
        else:
            label = f"{short(times * length)} {unit}"
        dashed = bool(axes.is_free[i])
        items.append(Path(ends, Category(i + 1), LineWeight.LINE, dashed, label, label))
    return items


def _ellipse(half: np.ndarray, open_axes: tuple[int, ...]) -> np.ndarray:
    """Outline of an ellipse, or of a strip along an open axis."""
    if open_axes:
        (free,) = open_axes
        u, v = half[free], half[1 - free]
        return np.array([-u - v, u - v, u + v, -u + v])
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)[:, None]
    return np.cos(angle) * half[0] + np.sin(angle) * half[1]


def _notes(axes: PrincipalAxes, quality: Quality) -> tuple[str, ...]:
    notes = {
        Quality.COMPLIANCE: "displacement per force, free to turn",
        Quality.STIFFNESS: "force per displacement, rotations held",
        Quality.ROTATIONAL_COMPLIANCE: "rotation per moment, free to shift",
        Quality.ROTATIONAL_STIFFNESS: "moment per rotation, displacements held",
    }
    free = int(np.count_nonzero(axes.is_free))
    words = f"free in {free} direction{'s' if free > 1 else ''}"
    return (notes[quality], *((words,) if free else ()))
