"""What is read of a robot, and in which axes loads are given."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Any

import numpy as np


class Reading(Enum):
    """What is read: of a marker ``POINT``, its three coordinates in axes of the instrument.

    ``POSE``: these, and the rotation vector from axes of the marker to those of the instrument.
    ``DISPLACEMENT``: the three coordinates of its motion from the posture under another load.
    ``ALONG``: this motion along a direction, as a dial gauge reads it.
    ``DISTANCE``: from a fixed point, as a ball bar or a wire reads it.
    ``TORQUE``: with which a drive pushes in the direction of its coordinate, from motor current.
    ``JOINT``: the coordinate of a joint behind its gear, counted as the commanded one is.
    """

    POINT = "point"
    POSE = "pose"
    DISPLACEMENT = "displacement"
    ALONG = "along"
    DISTANCE = "distance"
    TORQUE = "torque"
    JOINT = "joint"

    @property
    def size(self) -> int:
        """Numbers of a reading."""
        return {Reading.POINT: 3, Reading.DISPLACEMENT: 3, Reading.POSE: 6}.get(self, 1)

    @property
    def of_drive(self) -> bool:
        """Whether it is read at a drive, and not of a marker."""
        return self in (Reading.TORQUE, Reading.JOINT)


#: Readings of whole places, and those that begin in another state.
PLACES, MOTIONS = (Reading.POINT, Reading.POSE), (Reading.DISPLACEMENT, Reading.ALONG)


class LoadAxes(Enum):
    """Axes of a load: of the world, of the commanded platform, or of the instrument."""

    WORLD = "world"
    PLATFORM = "platform"
    INSTRUMENT = "instrument"


def act_at_hooks(hooks: np.ndarray, bodies: Sequence[str]) -> np.ndarray:
    """Which forces (N,) act at hooks (N, 3) or on named bodies, not at the reference point."""
    return np.isfinite(hooks).all(axis=1) | np.array([bool(body) for body in bodies])


def coordinates_of(pose: Any) -> np.ndarray:
    """Numbers (N, n) of joints or poses."""
    return np.asarray(getattr(pose, "values", pose))
