"""Vectors, directions, rotations and frames of a model file."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_parts import WrittenAxes, WrittenFrame, WrittenRotation
from robostiff.io.suggest import Words
from robostiff.io.units import Dimension
from robostiff.model.checks import rotation_matrix, unit_vector

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_THE_OTHER_TWO = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y")}
_WAYS = ("turn", "rotation_vector", "matrix", "axes")


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


def transform(place: Place, written: WrittenFrame) -> RigidTransform:
    """The frame, seen from the one in which it is written."""
    return RigidTransform.from_components(
        point(place / "at", written.at), rotation(place, written) or Rotation.identity()
    )


def rotation(place: Place, written: WrittenRotation) -> Rotation | None:
    """The rotation that is written, if any is."""
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
        return Rotation.from_rotvec(angles)
    if written.matrix is not None:
        here = place / "matrix"
        rows = [vector(here / i, row, Dimension.NUMBER) for i, row in enumerate(written.matrix)]
        with here.complaints():
            return Rotation.from_matrix(rotation_matrix("rotation", [row.tolist() for row in rows]))
    if written.axes is not None:
        return _from_axes(place / "axes", written.axes)
    return None


def _turns(place: Place, turns: list) -> Rotation:
    total = Rotation.identity()
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
        total = total * Rotation.from_rotvec(angle * np.array(_AXES[about[0]]))
    return total


def _from_axes(place: Place, written: WrittenAxes) -> Rotation:
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
    cosine = float(first @ second)
    if abs(cosine) > 1e-6:
        raise place.error(
            "axes of the frame",
            got=Words(f"{np.degrees(np.arccos(np.clip(cosine, -1, 1))):.6g} deg between them"),
            expected="two perpendicular directions",
        )
    (missing,) = (axis for axis in _AXES if axis not in given)
    before, after = _THE_OTHER_TWO[missing]
    given[missing] = np.cross(given[before], given[after])
    columns = np.stack([given[axis] for axis in _AXES], axis=-1)
    return Rotation.from_matrix(rotation_matrix("axes of the frame", columns))


def _dimension_of_direction(place: Place, written: list) -> Dimension:
    """Lengths when any of the three is one: the direction from one point to another."""
    lengths = ((place / i).is_length(value) for i, value in enumerate(written))
    return Dimension.LENGTH if any(lengths) else Dimension.NUMBER
