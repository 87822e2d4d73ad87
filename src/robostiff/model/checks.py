"""Checks that the parts of a model share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError


def vector3(subject: str, value: ArrayLike) -> np.ndarray:
    """Three finite numbers as an array.

    Examples
    --------
    >>> vector3("offset", [0, 0, 1])
    array([0., 0., 1.])
    """
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(subject, got=value, expected="three finite numbers [x, y, z]")
    return vector


def unit_vector(subject: str, value: ArrayLike) -> np.ndarray:
    """A direction of unit length.

    Examples
    --------
    >>> unit_vector("axis", [0, 3, 4])
    array([0. , 0.6, 0.8])
    """
    vector = vector3(subject, value)
    largest = np.max(np.abs(vector))
    if largest == 0:
        raise InputError(
            subject, got=value, expected="a direction", hint="a zero vector points nowhere"
        )
    vector = vector / largest  # the square of a huge component would overflow
    return vector / np.linalg.norm(vector)


def rotation_matrix(subject: str, value: ArrayLike) -> np.ndarray:
    """A rotation matrix, columns the turned axes; orthonormal and right-handed to 1e-6.

    Examples
    --------
    >>> rotation_matrix("rotation", np.eye(3)).trace()
    np.float64(3.0)
    """
    R = np.asarray(value, dtype=float)
    if R.shape != (3, 3) or not np.isfinite(R).all():
        raise InputError(subject, got=value, expected="a 3 x 3 matrix of finite numbers")
    error = np.abs(R.T @ R - np.eye(3)).max()
    if error > 1e-6:
        raise InputError(
            subject,
            got=value,
            expected=f"orthonormal columns (R^T R differs from the identity by {error:.2g})",
            hint="the columns are the turned axes, of unit length and perpendicular",
        )
    if np.linalg.det(R) < 0:
        raise InputError(
            subject,
            got=value,
            expected="a right-handed frame (determinant +1, not -1)",
            hint="a mirror image is no rotation: flip the sign of one column",
        )
    # The nearest exact rotation: input written with few digits must not shear the robot.
    U, _, Vt = np.linalg.svd(R)
    return U @ Vt


def is_formula(value: Any) -> bool:
    """Whether a value is a symbolic expression, of which SymPy knows the symbols."""
    return bool(getattr(value, "free_symbols", None))


def checked_stiffness(subject: str, value: Any) -> None:
    """Raise unless the stiffness is a positive finite number, a formula, or None for rigid."""
    if value is None or (is_formula(value) and value.is_positive is not False):
        return
    if is_formula(value) or not (np.isfinite(value) and value > 0):
        raise InputError(
            subject,
            got=value,
            expected="a positive finite number [N/m or N m/rad]",
            hint="leave it out for a rigid one; make the joint passive for none",
        )
