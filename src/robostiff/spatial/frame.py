"""A frame: three axes and an origin, described in another frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError
from robostiff.spatial.formula import exact_arrays, formula_array, is_possible
from robostiff.spatial.quantities import as_floats
from robostiff.spatial.rotation import is_rigid_transform

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


@dataclass(frozen=True, eq=False)
class Frame:
    """Axes and origin of a frame, relative to another one.

    Attributes
    ----------
    R : (3, 3) array
        Columns: the axes. Floats, or objects where an entry is a formula.
    p : (3,) array
        The origin [m], likewise.

    Raises
    ------
    InputError
        Shapes that do not fit, entries that are not finite, or numbers that make no rotation.

    Examples
    --------
    >>> shift = Frame(np.eye(3), np.array([0.0, 0.0, 0.5]))
    >>> (shift @ shift).p
    array([0., 0., 1.])
    """

    R: np.ndarray
    p: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", _checked("axes of the frame", self.R, (3, 3)))
        object.__setattr__(self, "p", _checked("origin of the frame", self.p, (3,), "m"))
        if self.R.dtype != object and not _is_rotation(self.R):
            raise InputError(
                "axes of the frame",
                got=self.R,
                expected="a right-handed frame: columns of unit length, perpendicular",
                hint="write Frame.of(RigidTransform.from_components(p, rotation))",
            )

    @classmethod
    def of(cls, value: Frame | RigidTransform) -> Frame:
        """The frame itself, or that of a rigid transform.

        Raises
        ------
        InputError
            For anything else, a batch of transforms included.
        """
        if isinstance(value, Frame):
            return value
        if not is_rigid_transform(value) or value.shape != ():
            raise InputError(
                "frame",
                got=value,
                expected="a Frame or one RigidTransform",
                hint="write Frame(R, p)",
            )
        return cls(value.rotation.as_matrix(), value.translation)

    @classmethod
    def identity(cls) -> Frame:
        """The identity: origin zero, axes of the reference frame."""
        return cls(np.eye(3), np.zeros(3))

    def __matmul__(self, other: Frame) -> Frame:
        """`other`, given relative to this frame, relative to the reference of this frame."""
        R, p, R_other, p_other = exact_arrays(self.R, self.p, other.R, other.p)
        return Frame(R @ R_other, p + R @ p_other)

    @property
    def inverse(self) -> Frame:
        """The reference frame relative to this frame."""
        R, p = exact_arrays(self.R, self.p)
        return Frame(R.T, -(R.T @ p))

    @cached_property
    def rigid_transform(self) -> RigidTransform:
        """The frame as a rigid transform of SciPy.

        Raises
        ------
        InputError
            When the frame holds formulas.
        """
        if object in (self.R.dtype, self.p.dtype):
            raise InputError(
                "rigid transform of a frame",
                got="formulas",
                expected="numbers",
                hint="give the symbols values first",
            )
        from scipy.spatial.transform import RigidTransform

        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.R, self.p
        return RigidTransform.from_matrix(T)


def _checked(
    subject: str, value: ArrayLike, shape: tuple[int, ...], unit: str | None = None
) -> np.ndarray:
    array = formula_array(value)
    if array is None:
        array = as_floats(subject, value, f"finite numbers of shape {shape}", unit)
    if array.shape != shape or (array.dtype == object and not all(map(is_possible, array.flat))):
        raise InputError(subject, got=value, expected=f"finite numbers of shape {shape}")
    return array


def _is_rotation(R: np.ndarray) -> bool:
    return bool(np.abs(R.T @ R - np.eye(3)).max() <= 1e-6 and np.linalg.det(R) > 0)
