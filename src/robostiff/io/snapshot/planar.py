"""A planar robot stays in the x-y plane: its joints fit, and its parts do not bend out of it."""

from __future__ import annotations

import numpy as np

from robostiff.io.snapshot.place import Place
from robostiff.kinematics import spring_compliance
from robostiff.model import Motion, PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot
from robostiff.spatial import Space

_IN_PLANE = list(Space.PLANAR.rows)
_OUT_OF_PLANE = [row for row in Space.SPATIAL.rows if row not in _IN_PLANE]

# Part of its size by which an axis may lean, or a part may bend, out of the plane: rounding, not
# a slip.
_TOLERANCE = 1e-9

_SPATIAL = "without planar: true the robot is spatial"


def check_planar(snapshot: Snapshot, legs: Place) -> None:
    """Raise a FileError unless all legs fit the plane; `legs` is where they are written.

    Raises
    ------
    FileError
        When a joint does not turn about z or slide across z, or a load in the plane bends a leg out
        of it.
    """
    for i, leg in enumerate(snapshot.legs):
        _check_leg(leg, snapshot.reference_point, legs.at(i, "chain"))


def _check_leg(leg: PlacedLeg, reference_point: np.ndarray, chain: Place) -> None:
    """Check a leg, or a branch of a block in it."""
    for i, element in enumerate(leg.elements):
        if isinstance(element, PlacedFreedom):
            _check_axis(element, chain.at(i, "axis"))
        elif isinstance(element, PlacedBlock):
            for j, branch in enumerate(element.branches):
                _check_leg(branch, reference_point, chain.at(i, "branches", j, "chain"))
    _check_bending(leg, reference_point, chain)


def _check_axis(freedom: PlacedFreedom, place: Place) -> None:
    turns = freedom.motion is Motion.ROTATION
    wrong = freedom.axis[:2] if turns else freedom.axis[2:]
    if np.abs(wrong).max() > _TOLERANCE:
        raise place.error(
            "axis of a joint of a planar robot",
            got=place.value,
            expected="an axis along z" if turns else "an axis in the x-y plane",
            hint=_SPATIAL,
        )


def _check_bending(leg: PlacedLeg, reference_point: np.ndarray, chain: Place) -> None:
    """Refuse a leg that bends out of the plane, at the element that does so most."""
    parts = [
        spring_compliance(element, reference_point)
        if isinstance(element, PlacedSpring)
        else np.zeros((6, 6))
        for element in leg.elements
    ]
    C = np.sum([np.zeros((6, 6)), *parts], axis=0)
    size = np.sqrt(np.diagonal(C))
    allowed = _TOLERANCE * np.outer(size[_IN_PLANE], size[_OUT_OF_PLANE])
    in_and_out = np.ix_(_IN_PLANE, _OUT_OF_PLANE)
    if np.any(np.abs(C[in_and_out]) > allowed):
        excess = [np.max(np.abs(part[in_and_out]) - allowed) for part in parts]
        raise chain.at(int(np.argmax(excess))).error(
            "part of a planar robot that a load in the plane bends out of it",
            expected="parts at the height of the reference point, a principal axis along z",
            hint=_SPATIAL,
        )
