"""Where the platform is, recorded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.kinematics.turn_of_entries import turn_by_vector_of_entries


@dataclass(frozen=True)
class FormulaPose:
    """A pose of the platform in the world.

    Attributes
    ----------
    R : (3, 3) array of entries and numbers
    p : (3,) array of entries and numbers
        [m].
    """

    R: np.ndarray
    p: np.ndarray

    @classmethod
    def of_coordinates(cls, coordinates: np.ndarray) -> FormulaPose:
        """The pose of x, y, z and a rotation vector (6,) [m, rad], entries or numbers.

        Examples
        --------
        >>> FormulaPose.of_coordinates(np.array([0.5, 0, 0, 0, 0, 0])).p.tolist()
        [0.5, 0.0, 0.0]
        """
        six = np.array(coordinates, dtype=object)
        return cls(turn_by_vector_of_entries(six[3:]), six[:3])
