"""Distance of a matrix from a loss of rank: a cheap bound, and the exact value where needed."""

from __future__ import annotations

import numpy as np

from robostiff.spatial.batch import product, transposed
from robostiff.spatial.shapes import Float

# A certificate this much above rounding needs no further look.
_CERTAIN = 1e-10


def smallest_compliance(
    C: Float[np.ndarray, "*batch n n"], W: Float[np.ndarray, "*batch n m"]
) -> Float[np.ndarray, "*batch"]:
    """Smallest eigenvalue of W^T C W over the trace of C: 0 where a transmitted wrench is rigid.

    Orthonormal wrenches W; zero columns are passed over, and 1 is given where nothing is
    transmitted. Where the ratio is certainly above 1e-10 a lower bound is given in place of the
    eigenvalue.

    Examples
    --------
    >>> C = np.diag([1.0, 1.0, 0.0])
    >>> smallest_compliance(C, np.eye(3)), smallest_compliance(C, np.eye(3)[:, :1])
    (array(0.), array(0.5))
    """
    m = W.shape[-1]
    trace = np.trace(C, axis1=-2, axis2=-1)
    if m == 0:
        return np.ones(trace.shape)
    A = np.einsum("...im,...im->...m", W, W)[..., :, None] * np.eye(m)
    idle = np.eye(m) - np.where(A > 0, 1.0, 0.0) * np.eye(m)
    held = np.where(trace > 0, trace, 1.0)[..., None, None]
    A = product(transposed(W), product(C, W)) / held + idle
    bound = np.atleast_1d(_determinant_bound(A))
    doubtful = bound < _CERTAIN
    if np.any(doubtful):
        bound[doubtful] = np.linalg.eigvalsh(A.reshape(*bound.shape, m, m)[doubtful])[..., 0]
    ratio = bound.reshape(A.shape[:-2])
    return np.where(trace > 0, ratio, np.where(idle.any((-1, -2)), ratio, 0.0))


def smallest_singular_value(W: Float[np.ndarray, "*batch n m"]) -> Float[np.ndarray, "*batch"]:
    """Lower bound, sharp where it is small, of the smallest singular value of W (n x m, m >= n).

    Examples
    --------
    >>> float(smallest_singular_value(np.array([[1.0, 0.0, 1.0], [0.0, 1e-8, 0.0]])))
    1e-08
    """
    n, m = W.shape[-2:]
    if m < n:
        return np.zeros(W.shape[:-2])
    bound = np.atleast_1d(_determinant_bound(product(W, transposed(W))))
    value = np.sqrt(np.maximum(bound, 0.0))
    doubtful = bound < _CERTAIN
    if np.any(doubtful):
        stack = W.reshape(*bound.shape, n, m) if W.ndim == 2 else W
        value[doubtful] = np.linalg.svd(stack[doubtful], compute_uv=False)[..., -1]
    return value.reshape(W.shape[:-2])


def smallest_held_stiffness(
    K: Float[np.ndarray, "*batch n n"], rank: np.ndarray
) -> Float[np.ndarray, "*batch"]:
    """Smallest stiffness that is not zero by rank, K scaled to a unit diagonal (...).

    K is positive semidefinite, scaled by a characteristic length. The result limits the digits of
    compliance and deflection. Where it is certainly above 1e-10 a lower bound is given in its
    place; 1 where nothing is held.

    Examples
    --------
    >>> float(smallest_held_stiffness(np.diag([1.0, 1e-6, 0.0]), np.array(2)))
    1.0
    """
    n = K.shape[-1]
    diagonal = np.einsum("...ii->...i", K)
    # What is rounding on the diagonal must not be blown up to 1.
    least = np.max(diagonal, axis=-1, keepdims=True) * _CERTAIN
    size = np.sqrt(np.where(diagonal > least, diagonal, np.where(least > 0, least, 1.0)))
    unit = np.reshape(K / (size[..., :, None] * size[..., None, :]), (-1, n, n))
    held = np.ravel(rank)
    value = _determinant_bound(unit)
    doubtful = (value < _CERTAIN) | (held < n)
    if np.any(doubtful):
        eigenvalues = np.linalg.eigvalsh(unit[doubtful])
        place = np.minimum(n - held[doubtful], n - 1)[:, None]
        value[doubtful] = np.take_along_axis(eigenvalues, place, axis=-1)[:, 0]
        value[held == 0] = 1.0
    return value.reshape(K.shape[:-2])


def _determinant_bound(A: np.ndarray) -> np.ndarray:
    """Smallest eigenvalue of a semidefinite A is at least det A / (tr A / (n - 1))^(n - 1).

    The other n - 1 eigenvalues have at most that product (arithmetic against geometric mean).
    """
    n = A.shape[-1]
    if n == 1:
        return A[..., 0, 0].copy()
    others = (np.trace(A, axis1=-2, axis2=-1) / (n - 1)) ** (n - 1)
    return np.linalg.det(A) / np.where(others > 0, others, 1.0)
