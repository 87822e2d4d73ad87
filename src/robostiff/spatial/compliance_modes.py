"""Modes of an elastic part: twists F whose products are its compliance, C = F F^T."""

from __future__ import annotations

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial.batch import Float

# Of a diagonal entry: a smaller remainder is rounding, and the direction is rigid.
_RIGID = 1e-14
# Up to here elimination in any order keeps the modes apart; below, the largest pivot comes first.
_REGULAR = 1e-6
_NEGATIVE = 1e-9


def compliance_modes(C: Float[np.ndarray, "*batch n n"]) -> Float[np.ndarray, "*batch n n"]:
    """Twists F in columns with ``F F^T = C``, zero columns where the part is rigid.

    A wrench w stores the energy ``|F^T w|^2 / 2``. Entries are compared with the diagonal of C, one
    direction at a time, so that units and very different sizes do not matter; rotations come
    first, as the bending of a beam takes its tip along.

    Parameters
    ----------
    C : (..., n, n) array
        Compliance about the part's own point, in its own axes [m/N, 1/N, rad/(N m)].

    Raises
    ------
    InputError
        When C is not positive semidefinite.

    Examples
    --------
    >>> compliance_modes(np.diag([4.0, 0.0, 1e-30]))
    array([[0.e+00, 0.e+00, 2.e+00],
           [0.e+00, 0.e+00, 0.e+00],
           [1.e-15, 0.e+00, 0.e+00]])
    """
    diagonal = np.einsum("...ii->...i", C)
    size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    A = (C / (size[..., :, None] * size[..., None, :]))[..., ::-1, ::-1]
    rigid = (diagonal == 0)[..., ::-1]
    if np.any(diagonal < 0) or np.any((A != 0) & (rigid[..., :, None] | rigid[..., None, :])):
        raise _indefinite(C)
    n, F, pivots = A.shape[-1], np.zeros(A.shape), np.zeros(1)
    try:
        F = np.linalg.cholesky(A + rigid[..., None] * np.eye(n)) * ~rigid[..., None, :]
        pivots = np.where(rigid, 1.0, np.einsum("...ii->...i", F))
    except np.linalg.LinAlgError:
        pass
    if np.min(pivots, initial=1.0) ** 2 <= _REGULAR:  # the largest pivot first
        F = np.zeros(A.shape)
        for k in range(n):
            diagonal = np.einsum("...ii->...i", A)
            first = np.argmax(diagonal, axis=-1)[..., None]
            pivot = np.take_along_axis(diagonal, first, axis=-1)
            column = np.take_along_axis(A, first[..., None], axis=-1)[..., 0]
            elastic = pivot > _RIGID
            F[..., k] = np.where(elastic, column / np.sqrt(np.where(elastic, pivot, 1.0)), 0.0)
            A = A - F[..., :, None, k] * F[..., None, :, k]
        if np.any(np.abs(A) > _NEGATIVE):  # what is left is rounding
            raise _indefinite(C)
    return size[..., :, None] * F[..., ::-1, :]


def _indefinite(C: np.ndarray) -> InputError:
    expected = "a positive semidefinite matrix: a spring does not push where it is pulled"
    return InputError("compliance of an elastic part", got=C, expected=expected)
