"""Rotations, and frames: three axes and an origin, described in another frame."""

from __future__ import annotations

import sys
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.spatial.batch import empty_batch
from robostiff.spatial.formula import exact_arrays, formula_array, is_possible
from robostiff.spatial.quantities import as_floats

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform
    from typing_extensions import TypeIs

_TINY = 1e-300  # keeps the quotient at the angle zero
_ORTHOGONAL = 1e-12  # by which R R^T may differ from the identity before R is corrected


def matrix_of_rotation(r: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of rotation vectors r (..., 3) [rad].

    Through the quaternion (cos(a/2), sin(a/2) r/a), a = |r|.
    """
    x, y, z = r.ravel().tolist() if r.size == 3 else (r[..., i] for i in range(3))
    a = np.sqrt(x * x + y * y + z * z + _TINY)
    factor, c = np.sin(0.5 * a) / a, np.cos(0.5 * a)
    v = [x * factor, y * factor, z * factor]
    R = empty_batch(r.shape[:-1], (3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        R[..., i, i] = 1.0 - 2.0 * (v[j] * v[j] + v[k] * v[k])
        even, odd = v[i] * v[j], c * v[k]
        R[..., i, j], R[..., j, i] = 2.0 * (even - odd), 2.0 * (even + odd)
    return R


def vector_of_rotation(R: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3) [rad] of rotation matrices (..., 3, 3), angles up to pi.

    The quaternion comes from its greatest entry, so that no digits are lost near half a turn.
    """
    trace = R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2]
    squares = np.stack([R[..., 0, 0], R[..., 1, 1], R[..., 2, 2], trace], axis=-1)
    greatest = np.argmax(squares, axis=-1)
    # four times the quaternion (v, c), times the greatest of its entries
    q = empty_batch(trace.shape, (4,))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        q[..., i] = R[..., k, j] - R[..., j, k]
    q[..., 3] = 1.0 + trace
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        here = greatest == i
        if np.any(here):
            S = R[here]
            q[here, i] = 1.0 + S[:, i, i] - S[:, j, j] - S[:, k, k]
            q[here, j] = S[:, i, j] + S[:, j, i]
            q[here, k] = S[:, i, k] + S[:, k, i]
            q[here, 3] = S[:, k, j] - S[:, j, k]
    return vector_of_quaternion(q)


def vector_of_quaternion(q: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3) [rad] of quaternions (..., 4) of any size, scalar last."""
    v, c = q[..., :3], q[..., 3]
    size = np.sqrt(np.einsum("...i,...i->...", v, v))
    half = np.arctan2(size, np.abs(c))
    turning = size > 0
    small = 2.0 / (np.abs(c) + _TINY)  # where the square of the size is below the range of floats
    factor = np.where(turning, 2.0 * half / np.where(turning, size, 1.0), small)
    return v * np.where(c < 0, -factor, factor)[..., None]


def nearest_rotation(R: np.ndarray) -> np.ndarray:
    """The rotations next to matrices (..., 3, 3); these themselves where they are some to 1e-12."""
    off = np.abs(R @ np.swapaxes(R, -1, -2) - np.eye(3)).max(axis=(-2, -1)) > _ORTHOGONAL
    if not np.any(off):
        return R
    U, _, V = np.linalg.svd(R)
    return np.where(off[..., None, None], U @ V, R)


def is_rigid_transform(value: Any) -> TypeIs[RigidTransform]:
    """Whether a value is a rigid transform of SciPy, which none is before SciPy is imported."""
    module = sys.modules.get("scipy.spatial.transform")
    return isinstance(value, getattr(module, "RigidTransform", ()))  # SciPy 1.15 has none


def rigid_transform(T: np.ndarray) -> RigidTransform:
    """Matrices (..., 4, 4) as rigid transforms of SciPy.

    Raises
    ------
    InputError
        When SciPy is too old: it has batches of any shape from 1.17.
    """
    try:
        from scipy.spatial.transform import RigidTransform

        return RigidTransform.from_matrix(T)
    except (ImportError, ValueError):
        raise InputError(
            "rigid transforms of SciPy",
            got=Words(f"SciPy {import_module('scipy').__version__}"),
            expected="1.17 or newer",
            hint="write pip install 'scipy>=1.17', or take the pose as numbers",
        ) from None


@frozen
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
        if self.R.dtype != object and not (
            np.abs(self.R.T @ self.R - np.eye(3)).max() <= 1e-6 and np.linalg.det(self.R) > 0
        ):
            expected = "a right-handed frame: columns of unit length, perpendicular"
            hint = "write Frame.of(RigidTransform.from_components(p, rotation))"
            raise InputError("axes of the frame", got=self.R, expected=expected, hint=hint)

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
            expected = "a Frame or one RigidTransform"
            raise InputError("frame", got=value, expected=expected, hint="write Frame(R, p)")
        return cls(value.rotation.as_matrix(), value.translation)

    @classmethod
    def identity(cls) -> Frame:
        """The identity: origin zero, axes of the reference frame."""
        return cls(np.eye(3), np.zeros(3))

    def __matmul__(self, other: Frame) -> Frame:
        """`other`, given relative to this frame, relative to the reference of this frame."""
        R, p, R_other, p_other = exact_arrays(self.R, self.p, other.R, other.p)
        return Frame(R @ R_other, p + R @ p_other)

    @cached_property
    def inverse(self) -> Frame:
        """The reference frame relative to this frame."""
        R, p = exact_arrays(self.R, self.p)
        return Frame(R.T, -(R.T @ p))

    @cached_property
    def matrix(self) -> np.ndarray:
        """The frame as a matrix (4, 4), with the origin [m] in its last column.

        Raises
        ------
        InputError
            When the frame holds formulas.
        """
        if object in (self.R.dtype, self.p.dtype):
            subject = "matrix of a frame"
            hint = "give the symbols values first"
            raise InputError(subject, got=Words("formulas"), expected="numbers", hint=hint)
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.R, self.p
        return T

    @cached_property
    def rigid_transform(self) -> RigidTransform:
        """The frame as a rigid transform of SciPy.

        Raises
        ------
        InputError
            When the frame holds formulas, or SciPy has no rigid transforms yet.
        """
        return rigid_transform(self.matrix)


def _checked(
    subject: str, value: ArrayLike, shape: tuple[int, ...], unit: str | None = None
) -> np.ndarray:
    array = formula_array(value)
    if array is None:
        array = as_floats(subject, value, f"finite numbers of shape {shape}", unit)
    if array.shape != shape or (array.dtype == object and not all(map(is_possible, array.flat))):
        raise InputError(subject, got=value, expected=f"finite numbers of shape {shape}")
    return array
