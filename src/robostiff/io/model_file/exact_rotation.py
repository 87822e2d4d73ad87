"""Rotations whose entries are formulas, with the few methods of SciPy's that model files need."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.spatial.formula import exact_array, length_of


@dataclass(frozen=True, eq=False)
class ExactRotation:
    """A rotation in exact arithmetic.

    Attributes
    ----------
    matrix : (3, 3) array of objects
        Columns: the turned axes.

    Examples
    --------
    >>> import sympy as sp
    >>> quarter = ExactRotation.from_rotvec(np.array([0, 0, sp.pi / 2]))
    >>> (quarter * quarter).as_matrix()
    array([[-1, 0, 0],
           [0, -1, 0],
           [0, 0, 1]], dtype=object)
    """

    matrix: np.ndarray

    @classmethod
    def identity(cls) -> ExactRotation:
        """No turn."""
        return cls(exact_array(np.eye(3)))

    @classmethod
    def from_matrix(cls, matrix: np.ndarray) -> ExactRotation:
        """The rotation of a matrix that has been checked."""
        return cls(exact_array(matrix))

    @classmethod
    def from_rotvec(cls, vector: np.ndarray) -> ExactRotation:
        """The turn about a vector (3,) by its length [rad], after Rodrigues."""
        import sympy as sp

        vector = exact_array(vector)
        turned = [i for i in range(3) if vector[i] != 0]
        if not turned:
            return cls.identity()
        if len(turned) == 1:  # about an axis of the frame, either way: no absolute value
            angle = vector[turned[0]]
            axis = exact_array(np.eye(3)[turned[0]])
        else:
            angle = length_of(vector)
            axis = vector / angle
        sine, cosine = sp.sin(angle), sp.cos(angle)
        x, y, z = axis
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=object)
        matrix: Any = cosine * exact_array(np.eye(3)) + sine * cross
        return cls(matrix + (1 - cosine) * np.outer(axis, axis))

    def __mul__(self, other: ExactRotation) -> ExactRotation:
        """The other turn, then this one."""
        return ExactRotation(self.matrix @ other.matrix)

    def as_matrix(self) -> np.ndarray:
        """Columns: the turned axes (3, 3)."""
        return self.matrix
