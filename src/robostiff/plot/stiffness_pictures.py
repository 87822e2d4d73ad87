"""Pictures of a stiffness: its ellipsoids at the tool point, free motions as screws, its matrix."""

from __future__ import annotations

from enum import Enum

import numpy as np

from robostiff.analysis import Stiffness
from robostiff.elastostatics import Status, scaling
from robostiff.errors import NoAnswerError
from robostiff.markup import prefixed, short
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.picture import (
    Arrow,
    Category,
    ColourScale,
    Face,
    Item,
    LineWeight,
    Marks,
    Matrix,
    Mesh,
    Path,
    PlainColour,
    Ramp,
    Shape,
)
from robostiff.plot.sketch import (
    Machine,
    robot_scene,
    single_stiffness,
    surroundings,
    turning_arrow,
    unit_of,
)
from robostiff.plot.surfaces import (
    AnyStiffness,
    PrincipalAxes,
    Quality,
    ellipsoid_mesh,
    length_of,
    principal_axes,
    screw_line,
)

_MEANINGS = {
    Quality.COMPLIANCE: "displacement per force, free to turn",
    Quality.STIFFNESS: "force per displacement, rotations held",
    Quality.ROTATIONAL_COMPLIANCE: "rotation per moment, free to shift",
    Quality.ROTATIONAL_STIFFNESS: "moment per rotation, displacements held",
}
_IN_ROBOT = 0.22  # of the robot: the longest semi-axis
_OPEN = 1.6  # of the longest finite semi-axis: length shown of a free direction


def ellipsoid(
    result: AnyStiffness,
    quality: Quality = Quality.COMPLIANCE,
    *,
    within: Machine | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw an ellipsoid of stiffness or compliance about the reference point.

    Its semi-axes are the principal values of one block of C or K: the surface is the displacement
    under a force of 1 N in every direction, or the force that a displacement of 1 m needs. Where
    the platform is free it is no ellipsoid: the compliance is a tube or a pair of plates without
    end, the stiffness is flat.

    Parameters
    ----------
    result : Stiffness or CableStiffness
        At a single pose.
    quality : Quality
    within : Robot, Snapshot, Network, Linkage or CableRobot, optional
        Draws it at the reference point of this robot, at the pose of the result.
    backend : Matplotlib or Plotly

    Raises
    ------
    InputError
        When the result is of several poses.
    NoAnswerError
        When there is no stiffness matrix, or the platform is free in all directions.
    """
    single_stiffness(result, "an ellipsoid")
    around, axes = surroundings(within, result), principal_axes(result, quality)
    bounded = axes.lengths[~axes.is_free]
    if not len(bounded) or bounded.max() == 0:
        raise NoAnswerError(
            f"no ellipsoid of {quality.value} of {result.name!r}: "
            "the platform is free in all directions"
        )
    shown = unit = prefixed(float(bounded.max()), quality.unit)
    centre, size, items = np.zeros(3), 1.0, []
    if around is not None:
        centre, size = result.reference_point, _IN_ROBOT * around.size / float(bounded.max())
        items, unit = around.backdrop(), unit_of(around.size)
    items += ellipsoid_items(axes, quality, centre, size, shown)
    is_flat = len(axes.lengths) < 3 and (around is None or around.outline.is_level)
    free = int(np.count_nonzero(axes.is_free))
    notes = (_MEANINGS[quality],)
    notes += (f"free in {free} direction{'s' if free > 1 else ''}",) if free else ()
    title = f"{result.name}: {quality.value}"
    return drawn_by(backend, robot_scene(title, items, unit, is_flat, notes=notes))


def ellipsoid_items(
    axes: PrincipalAxes, quality: Quality, centre: np.ndarray, size: float, shown: tuple[float, str]
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
        # an ellipse, or a strip along an open axis
        angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)[:, None]
        outline = np.cos(angle) * half[0] + np.sin(angle) * half[1]
        if open_axes:
            u, v = half[open_axes[0]], half[1 - open_axes[0]]
            outline = np.array([-u - v, u - v, u + v, -u + v])
        items.append(Face(centre + outline, Category(0), 0.2, quality.value))
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


_ALONG = 1e-9
_PART = 0.3  # of the robot: half an axis


def free_motions(
    result: AnyStiffness, *, within: Machine | None = None, backend: PlotBackend[Drawn] = PAPER
) -> Drawn:
    """Draw the free motions of a platform: rotation axes, helices, arrows.

    Parameters
    ----------
    result : Stiffness or CableStiffness
        At a single pose.
    within : Robot, Snapshot, Network, Linkage or CableRobot, optional
        Draws them in this robot, at the pose of the result.
    backend : Matplotlib or Plotly

    Raises
    ------
    InputError
        When the result is of several poses.
    NoAnswerError
        When the pose is out of reach.
    """
    single_stiffness(result, "free motions")
    if isinstance(result, Stiffness) and Status.UNREACHABLE in result.status:
        raise NoAnswerError(f"no free motions of {result.name!r}: {'; '.join(result.advice)}")
    around = surroundings(within, result)
    half = length_of(result) if around is None else _PART * around.size
    unit = unit_of(half if around is None else around.size)
    items = [] if around is None else around.backdrop()
    items += free_motion_items(result, half)
    point = result.reference_point
    items.append(Marks(point[None], PlainColour.INK, Shape.CROSS, "reference point"))
    free = len(result.free_motions)
    count = "no free motion" if not free else f"{free} free motion{'s' if free > 1 else ''}"
    # translations in the plane, rotations about z
    in_plane = (
        abs(screw.axis[2]) < _ALONG
        if screw.is_translation
        else screw.is_rotation and abs(screw.axis[2]) > 1 - _ALONG
        for screw in (motion.screw for motion in result.free_motions)
    )
    is_flat = around is not None and around.outline.is_level and all(in_plane)
    notes = (f"rank {int(result.rank)} of {result.space.size}",)
    scene = robot_scene(f"{result.name}: {count}", items, unit, is_flat, notes=notes)
    return drawn_by(backend, scene)


def free_motion_items(result: AnyStiffness, half: float) -> list[Item]:
    """Axes of `half` a length, helices and arrows [m]."""
    items: list[Item] = []
    for i, motion in enumerate(result.free_motions):
        paint, label = Category(i), str(motion)
        axis, way = screw_line(motion.screw, result.reference_point, half)
        if not len(way):
            items.append(Arrow(axis[0], axis[1], paint, label, both_ways=True))
            continue
        items.append(Path(axis, paint, LineWeight.THIN, dashed=True))
        items += turning_arrow(way, paint, label)
    return items


_ZERO = 1e-12  # of the largest entry, rotations multiplied by the length: rounding
_DECADES = 4  # below the largest entry, at which the shade fades out


class Kind(Enum):
    """The matrix to draw."""

    STIFFNESS = "stiffness"
    COMPLIANCE = "compliance"


class Shade(Enum):
    """Meaning of the colours of a matrix.

    ``SIZE``
        Signed logarithm of the entries with rotations given as lengths (times the characteristic
        length), which have one unit, over four decades.
    ``COUPLING``
        Each entry over the root of the two entries of the diagonal in its row and column: 1 on
        the diagonal, -1 to 1 elsewhere.
    """

    SIZE = "size"
    COUPLING = "coupling"


def matrix(
    result: AnyStiffness,
    kind: Kind = Kind.STIFFNESS,
    *,
    shade: Shade = Shade.SIZE,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw the stiffness or compliance matrix with its numbers, a unit for each block.

    Entries that are zero up to rounding have no colour.

    Parameters
    ----------
    result : Stiffness or CableStiffness
        At a single pose.
    kind : Kind
    shade : Shade
    backend : Matplotlib

    Raises
    ------
    InputError
        When the result is of several poses.
    NoAnswerError
        When there is no such matrix.

    Examples
    --------
    >>> import robostiff as rs
    >>> axes = rs.plot.matrix(rs.stiffness(rs.load("hexapod")))
    >>> [tick.get_text() for tick in axes.get_xticklabels()]
    ['dx', 'dy', 'dz', 'rx', 'ry', 'rz']
    """
    single_stiffness(result, "a matrix")
    space = result.space
    d, n = space.translations, space.size
    is_stiffness = kind is Kind.STIFFNESS
    A = result.K if is_stiffness else result.required_compliance()
    s = scaling(np.asarray(length_of(result)), space)
    scaled = A / np.outer(s, s) if is_stiffness else A * np.outer(s, s)
    is_zero = np.abs(scaled) <= _ZERO * np.abs(scaled).max()
    quarters = (
        (("N/m", "N/rad"), ("N m/m", "N m/rad"))
        if is_stiffness
        else (("m/N", "m/(N m)"), ("rad/N", "rad/(N m)"))
    )
    texts = [[""] * n for _ in range(n)]
    units = []
    for i, rows in enumerate((range(d), range(d, n))):
        for j, columns in enumerate((range(d), range(d, n))):
            block = np.ix_(rows, columns)
            values = np.where(is_zero[block], 0.0, A[block])
            times, unit = prefixed(float(np.abs(values).max()), quarters[i][j])
            units.append(unit)
            for (r, c), value in np.ndenumerate(values):
                texts[rows[r]][columns[c]] = short(times * value)
    shades, scale = _shades(scaled, is_zero, shade)
    named = (space.wrench_order, space.twist_order)
    rows, columns = named if is_stiffness else named[::-1]
    picture = Matrix(
        f"{result.name}: {kind.value}",
        rows,
        columns,
        tuple(tuple(row) for row in texts),
        shades,
        tuple(units),
        d,
        scale,
    )
    return drawn_by(backend, picture)


def _shades(
    scaled: np.ndarray, is_zero: np.ndarray, shade: Shade
) -> tuple[np.ndarray, ColourScale]:
    """Places (n, n) of entries on a scale of colours; not a number where they are zero."""
    if shade is Shade.COUPLING:
        size = np.sqrt(np.where(np.diag(is_zero), 1.0, np.diag(scaled)))
        label = "entry over root of the diagonal's"
        shades = scaled / np.outer(size, size)
        return np.where(is_zero, np.nan, shades), ColourScale(label, -1, 1, Ramp.SIGNED)
    part = np.abs(scaled) / np.abs(scaled).max()
    height = 1 + np.log10(np.where(is_zero, 1.0, part)) / _DECADES
    # Small is not zero: the last step of the shade is kept for it.
    shades = np.sign(scaled) * np.maximum(height, 0.05)
    ticks = tuple(
        (sign * (1 - k / _DECADES), f"{'−' if sign < 0 else ''}{name}")
        for sign in (-1, 1)
        for k, name in ((0, "1"), (2, "1/100"))
    )
    label = "relative size, rotations as lengths"
    scale = ColourScale(label, -1, 1, Ramp.SIGNED, tuple(sorted(ticks)))
    return np.where(is_zero, np.nan, shades), scale
