"""Checks that the parts of a model share; formulas are admitted wherever numbers are."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.elasticity.checks import positive_number
from robostiff.errors import InputError
from robostiff.model.stiffness_law import StiffnessLaw
from robostiff.spatial import Screw, as_floats, refuse_quantities
from robostiff.spatial.formula import (
    Entries,
    exact_array,
    formula_array,
    is_formula,
    is_possible,
    length_of,
    vanishes,
)
from robostiff.spatial.quantities import LARGEST
from robostiff.spatial.rotation import nearest_rotation

FARTHEST = 100.0
"""Lengths and places beyond that are probably meant in another unit [m]."""
FULL_TURN = 2 * np.pi * (1 + 1e-9)
"""Angles beyond that are probably meant in degrees [rad]."""
# Of a unit vector: by so much an axis may lean out of the plane of a planar robot.
_OUT_OF_PLANE = 1e-9
_AXES = np.eye(3)
_AXES.flags.writeable = False


def vector3(subject: str, value: Entries) -> np.ndarray:
    """Three finite numbers or formulas as an array."""
    if type(value) is np.ndarray and value.dtype == float and value.shape == (3,):
        x, y, z = value.tolist()
        if abs(x) + abs(y) + abs(z) <= LARGEST:  # as of most beams of a large network
            return value.copy()
    formulas = formula_array(value)
    if formulas is not None:
        if formulas.shape != (3,) or not all(map(is_possible, formulas)):
            raise InputError(subject, got=value, expected="three finite numbers [x, y, z]")
        return formulas
    if isinstance(value, np.ndarray) and value.dtype == object:
        value = value.tolist()  # plain numbers among the formulas of another vector
    return as_floats(subject, value, "three finite numbers [x, y, z]", shape=(3,))


def unit_vector(subject: str, value: Entries) -> np.ndarray:
    """A direction of unit length."""
    vector = vector3(subject, value)
    if vector.dtype == object:
        if not vanishes(vector):
            return vector / length_of(vector)
    elif largest := max(map(abs, vector.tolist())):
        vector = vector / largest  # the square of a huge component would overflow
        return vector / math.sqrt(vector @ vector)
    hint = "a zero vector points nowhere"
    raise InputError(subject, got=value, expected="a direction", hint=hint)


def axis_across(direction: np.ndarray) -> np.ndarray:
    """The frame axis (3,) that is most nearly across a direction.

    Among formulas it is the first one with a component of zero; without any, x.
    """
    if direction.dtype != object:
        return _AXES[np.argmin(np.abs(direction))]
    zeros = [i for i, entry in enumerate(direction) if entry == 0]
    if not zeros and not any(entry.free_symbols for entry in direction):
        zeros = [int(np.argmin(np.abs(direction.astype(float))))]
    return exact_array(np.eye(3)[zeros[0] if zeros else 0])


def are_parallel(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether two unit vectors are parallel; among formulas, whether that is certain."""
    across = np.cross(first, second)
    if across.dtype == object:
        return vanishes(across)
    return bool(np.linalg.norm(across) < 1e-6)


def rotation_matrix(subject: str, value: Entries) -> np.ndarray:
    """A rotation matrix, columns the turned axes; orthonormal and right-handed to six decimals.

    Formulas are kept as they are. Exact numbers are kept where they make a rotation.
    """
    formulas = formula_array(value)
    expected = "a 3 x 3 matrix of finite numbers"
    if formulas is not None:
        if formulas.shape != (3, 3) or not all(map(is_possible, formulas.flat)):
            raise InputError(subject, got=value, expected=expected)
        if any(entry.free_symbols for entry in formulas.flat):
            return formulas
        digits = formulas.astype(float)
        nearest = rotation_matrix(subject, digits)
        return formulas if np.abs(digits - nearest).max() < 1e-14 else exact_array(nearest)
    refuse_quantities(subject, value, expected)
    R = np.asarray(value, dtype=float)
    if R.shape != (3, 3) or not np.isfinite(R).all():
        raise InputError(subject, got=value, expected=expected)
    error = np.abs(R.T @ R - np.eye(3)).max()
    if error > 2e-6:
        raise InputError(
            subject,
            got=value,
            expected=f"orthonormal columns (R^T R differs from the identity by {error:.2g})",
            hint="the columns are the turned axes, of unit length and perpendicular; "
            "write six decimals or more",
        )
    if np.linalg.det(R) < 0:
        raise InputError(
            subject,
            got=value,
            expected="a right-handed frame (determinant +1, not -1)",
            hint="a mirror image is no rotation: flip the sign of one column",
        )
    # The nearest exact rotation: input written with few digits must not shear the robot.
    return nearest_rotation(R)


def finite_coordinates(subject: str, values: Sequence[Any], count: int) -> tuple[Any, ...]:
    """So many finite numbers, as floats; formulas stay."""
    wrong = InputError(subject, got=values, expected=f"{count} finite numbers")
    if len(values) != count:
        raise wrong
    refuse_quantities(subject, values, f"{count} finite numbers [m, rad]")
    for value in values:
        if not (is_possible(value) if is_formula(value) else np.isfinite(value)):
            raise wrong
    return tuple(value if is_formula(value) else float(value) for value in values)


def coordinate_array(values: Sequence[Any]) -> np.ndarray:
    """Coordinates as floats, or as objects when any of them is a formula."""
    formulas = formula_array(values) if any(map(is_formula, values)) else None
    return np.array(values, dtype=float) if formulas is None else formulas


def checked_stiffness(subject: str, value: Any) -> None:
    """Raise unless the stiffness is a positive finite number, a formula, or None for rigid."""
    if value is not None and not isinstance(value, StiffnessLaw):
        hint = "leave it out for a rigid one; make the joint passive for none"
        positive_number(subject, value, "N/m or N m/rad", hint)


def check_distinct(subject: str, names: Sequence[str]) -> None:
    """Raise where a name comes twice."""
    for name, count in Counter(names).items():
        if count > 1:
            raise InputError(subject, got=name, expected="each name once")


def check_in_plane(subject: str, freedom: Screw) -> None:
    """Raise unless a freedom in the world keeps a planar robot in the x-y plane."""
    leaving = [*freedom.axis[:2] * freedom.turns, *freedom.axis[2:] * freedom.slides]
    if np.linalg.norm(leaving) <= _OUT_OF_PLANE:
        return
    expected = "a joint that turns about z of the world or slides across it, not both"
    if not freedom.slides:
        expected = "an axis along z of the world"
    elif not freedom.turns:
        expected = "a direction in the x-y plane of the world"
    raise InputError(
        f"{'axis' if freedom.turns else 'direction'} of {subject}",
        got=[round(float(part), 6) + 0.0 for part in freedom.axis],
        expected=expected,
        hint="planar robots move in the x-y plane; leave planar: out for any other",
    )
