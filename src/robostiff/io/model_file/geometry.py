"""Vectors, directions, frames and rotations of a model file, numbers or formulas."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_parts import WrittenAxes, WrittenFrame, WrittenRotation
from robostiff.io.suggest import Words
from robostiff.io.units import Dimension
from robostiff.model.checks import rotation_matrix, unit_vector
from robostiff.spatial import Frame, is_formula
from robostiff.spatial.formula import exact_array, exact_arrays, length_of
from robostiff.spatial.rotation import matrix_of_rotation

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_THE_OTHER_TWO = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y")}
_WAYS = ("turn", "rotation_vector", "matrix", "axes")


def turned_axes(vector: np.ndarray, *, exact: bool) -> np.ndarray:
    """Columns (3, 3): the axes turned about a vector (3,) by its length [rad].

    In exact arithmetic after Rodrigues.

    Examples
    --------
    >>> import sympy as sp
    >>> turned_axes(np.array([0, 0, sp.pi / 2]), exact=True)
    array([[0, -1, 0],
           [1, 0, 0],
           [0, 0, 1]], dtype=object)
    """
    if not exact:
        return matrix_of_rotation(np.asarray(vector, dtype=float))
    import sympy as sp

    vector, unturned = exact_array(vector), exact_array(np.eye(3))
    turned = [i for i in range(3) if vector[i] != 0]
    if not turned:
        return unturned
    if len(turned) == 1:  # about an axis of the frame, either way: no absolute value
        angle, axis = vector[turned[0]], unturned[turned[0]]
    else:
        angle = length_of(vector)
        axis = vector / angle
    sine, cosine = sp.sin(angle), sp.cos(angle)
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=object)
    matrix: Any = cosine * unturned + sine * cross + (1 - cosine) * np.outer(axis, axis)
    return matrix


def point(place: Place, written: list | None) -> np.ndarray:
    """Three lengths (3,) [m]; zero when nothing is written."""
    return np.zeros(3) if written is None else vector(place, written, Dimension.LENGTH)


def vector(place: Place, written: list, dimension: Dimension) -> np.ndarray:
    """Numbers of one dimension."""
    return np.array([(place / i).number(value, dimension) for i, value in enumerate(written)])


def direction(place: Place, written: str | list) -> np.ndarray:
    """Unit vector (3,) of a direction: the name of an axis, or three numbers or lengths."""
    if isinstance(written, str):
        sign = -1.0 if written.startswith("-") else 1.0
        return sign * np.array(_AXES[written[-1]]) + 0.0
    numbers = vector(place, written, _dimension_of_direction(place, written))
    with place.complaints():
        return unit_vector("direction", numbers.tolist())


def transform(place: Place, written: WrittenFrame) -> Frame:
    """The frame, seen from the one in which it is written."""
    origin = point(place / "at", written.at)
    return Frame(axes_of(place, written), origin)


def axes_of(place: Place, written: WrittenRotation) -> np.ndarray:
    """Columns (3, 3): the axes turned by the rotation that is written, if any is."""
    turned = rotation(place, written)
    return np.eye(3) if turned is None else turned


def rotation(place: Place, written: WrittenRotation) -> np.ndarray | None:
    """The rotation that is written, its columns the turned axes (3, 3), if any is."""
    ways = [way for way in _WAYS if getattr(written, way) is not None]
    if len(ways) > 1:
        raise (place / ways[1]).error(
            "second rotation",
            got=Words(f"{ways[1]} beside {ways[0]}"),
            expected=f"one of {', '.join(_WAYS)}",
            key=True,
        )
    if written.turn is not None:
        return _turns(place / "turn", written.turn)
    if written.rotation_vector is not None:
        angles = vector(place / "rotation_vector", written.rotation_vector, Dimension.ANGLE)
        return turned_axes(angles, exact=place.is_exact)
    if written.matrix is not None:
        here = place / "matrix"
        rows = [vector(here / i, row, Dimension.NUMBER) for i, row in enumerate(written.matrix)]
        with here.complaints():
            return _of_kind(place, rotation_matrix("rotation", [row.tolist() for row in rows]))
    if written.axes is not None:
        return _of_kind(place, _axes(place / "axes", written.axes))
    return None


def _of_kind(place: Place, matrix: np.ndarray) -> np.ndarray:
    return exact_array(matrix) if place.is_exact else matrix


def _turns(place: Place, turns: list) -> np.ndarray:
    total = _of_kind(place, np.eye(3))
    for i, turn in enumerate(turns):
        about = [axis for axis in _AXES if getattr(turn, axis) is not None]
        if len(about) != 1:
            raise (place / i).error(
                "turn",
                got=Words(" and ".join(about) if about else "no axis"),
                expected="one axis, such as {z: 30 deg}",
                hint="write each turn as an entry of its own" if about else None,
            )
        angle = (place / i / about[0]).number(getattr(turn, about[0]), Dimension.ANGLE)
        total = total @ turned_axes(_along(about[0], angle), exact=place.is_exact)
    return total


def _along(axis: str, angle: Any) -> np.ndarray:
    return angle * np.array(_AXES[axis], dtype=int if is_formula(angle) else float)


def _axes(place: Place, written: WrittenAxes) -> np.ndarray:
    given = {
        axis: direction(place / axis, getattr(written, axis))
        for axis in _AXES
        if getattr(written, axis) is not None
    }
    if len(given) != 2:
        raise place.error(
            "axes of the frame",
            got=Words(f"{' and '.join(given) or 'none'} of the three"),
            expected="two of x, y, z; the third follows",
        )
    first, second = given.values()
    cosine = first @ second
    # Formulas have been checked at their nominal values.
    if not is_formula(cosine) and abs(cosine) > 1e-6:
        raise place.error(
            "axes of the frame",
            got=Words(f"{np.degrees(np.arccos(np.clip(cosine, -1, 1))):.6g} deg between them"),
            expected="two perpendicular directions",
        )
    (missing,) = (axis for axis in _AXES if axis not in given)
    before, after = _THE_OTHER_TWO[missing]
    one, two = exact_arrays(given[before], given[after])
    given[missing] = np.cross(one, two)
    columns = np.stack([given[axis] for axis in _AXES], axis=-1)
    return rotation_matrix("axes of the frame", columns)


def _dimension_of_direction(place: Place, written: list) -> Dimension:
    """Lengths when any of the three is one: the direction from one point to another."""
    lengths = ((place / i).is_length(value) for i, value in enumerate(written))
    return Dimension.LENGTH if any(lengths) else Dimension.NUMBER
