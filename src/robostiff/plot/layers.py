"""A result as layers of lines, faces and words, for programs that show and hide them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress

import numpy as np

from robostiff.analysis import CableResponse, Deflection
from robostiff.elastostatics import Status
from robostiff.errors import NoAnswerError
from robostiff.frozen import frozen, replace
from robostiff.markup import prefixed, quantity, short
from robostiff.plot.displacement import motion_under
from robostiff.plot.outline import outline_of
from robostiff.plot.picture import Item, Paint, PlainColour
from robostiff.plot.posed_robot import moved_cables
from robostiff.plot.sketch import Sketch, colours_of_parts
from robostiff.plot.stiffness_pictures import ellipsoid_items, free_motion_items
from robostiff.plot.surfaces import Quality, principal_axes
from robostiff.spatial import Space

#: Layers of a result, and whether each is drawn unless others are chosen.
LAYERS = {
    "robot": True,
    "names of joints": False,
    "shape without load": True,
    "load": True,
    "ellipsoid of displacements": True,
    "ellipsoid of rotations": False,
    "free motions": True,
}
_QUALITIES = {
    "ellipsoid of displacements": Quality.COMPLIANCE,
    "ellipsoid of rotations": Quality.ROTATIONAL_COMPLIANCE,
}
_AXIS = 0.3  # of the robot: half the axis of a free motion
_IN_ROBOT = 0.22  # of the robot: the longest semi-axis where its scale is chosen
_LARGEST = 1.0  # of the robot: the longest semi-axis anywhere


@frozen
class Layers:
    """A machine under a load as it is drawn, layer by layer."""

    items: Mapping[str, Sequence[Item]]  #: of the layers that were chosen, in metres
    notes: tuple[str, ...]  #: what they show, a sentence each
    colours: Mapping[str, Paint]  #: of parts by their names; empty where colours mean nothing
    size: float  #: length of the machine [m]
    box: tuple[np.ndarray, np.ndarray]  #: corners (3,) of the machine without load [m]
    scales: Mapping[Quality, float]  #: of ellipsoids: metres of a semi-axis to a unit of a quantity
    exaggeration: float  #: factor of the displacements; 0 where there are none


def layers_of(
    answer: Deflection | CableResponse,
    chosen: Collection[str] = frozenset(name for name, drawn in LAYERS.items() if drawn),
    *,
    exaggeration: float | None = None,
    scales: Mapping[Quality, float] | None = None,
) -> Layers:
    """Draw a machine under a load, layer by layer.

    Parameters
    ----------
    answer : Deflection or CableResponse
        At a single pose. Without a load the machine is drawn at rest.
    chosen : collection of str
        Names of `LAYERS`.
    exaggeration : float, optional
        Factor of all displacements; by default a round one that makes them visible.
    scales : mapping of Quality to float, optional
        Those of an earlier picture, so that sizes of ellipsoids can be compared; by default the
        longest semi-axis is a fifth of the machine.

    Raises
    ------
    NoAnswerError
        When the pose is out of reach.
    """
    colours: Mapping[str, Paint] = {}
    if isinstance(answer, CableResponse):
        result, wrench = answer.before, answer.load
        sketch = Sketch(outline=outline_of(result))
        at = sketch.outline.point.point
    else:
        result, wrench = answer.stiffness, answer.wrench
        if Status.UNREACHABLE in result.status:
            advice = "; ".join(result.advice)
            raise NoAnswerError(f"no picture of {result.name!r}: {advice}")
        at, outline = result.reference_point, outline_of(result.placed())
        colours = colours_of_parts(outline.part_names)
        sketch = Sketch(
            outline=outline, colours=colours, of_joints=colours, plain=PlainColour.MUTED
        )
    points = np.array([anchor.point for anchor in sketch.outline.anchors])
    if answer.has_answer and np.any(wrench):
        if isinstance(answer, CableResponse):
            motions, outline = moved_cables(answer)
            sketch, at = replace(sketch, outline=outline, motions=motions), outline.point.point
        else:
            sketch = replace(sketch, motions=motion_under(answer.stiffness.placed(), answer))
        sketch = sketch.exaggerated(exaggeration)
    is_flat, F = result.space is Space.PLANAR, result.space.spatial(wrench)
    drawn = {
        "robot": sketch.parts,
        "names of joints": sketch.names,
        "load": lambda: sketch.load(at, F, is_flat),
        "free motions": lambda: free_motion_items(result, _AXIS * sketch.size),
    }
    if sketch.scale:
        drawn["shape without load"] = sketch.ghost
    items: dict[str, Sequence[Item]] = {name: drawn[name]() for name in drawn if name in chosen}
    notes = [f"displacements × {short(sketch.scale, 6)}"] if sketch.scale else []
    notes += [f"free: {motion}" for motion in result.free_motions]
    used_scales = dict(scales or {})
    for name in (key for key in _QUALITIES if key in chosen):
        quality, items[name] = _QUALITIES[name], []
        with suppress(NoAnswerError):
            axes = principal_axes(result, quality)
            longest = float(axes.lengths[~axes.is_free].max(initial=0.0))
            if longest == 0:
                continue
            scale = used_scales.setdefault(quality, _IN_ROBOT * sketch.size / longest)
            scale = min(scale, _LARGEST * sketch.size / longest)
            shown = prefixed(longest, quality.unit)
            point = result.reference_point
            items[name] = ellipsoid_items(axes, quality, point, scale, shown)
            free = int(np.count_nonzero(axes.is_free))
            rest = f"; {free} direction{'s' if free > 1 else ''} unlimited" if free else ""
            size = f"{quantity(longest, quality.unit)}, drawn {short(1e3 * scale * longest)} mm"
            notes.append(f"{quality.value}: longest axis {size} long{rest}")
    box = points.min(axis=0), points.max(axis=0)
    return Layers(items, tuple(notes), colours, sketch.size, box, used_scales, sketch.scale)
