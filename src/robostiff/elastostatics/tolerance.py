"""What is decided of matrices: ranks, how near they are to losing one, planes, and distances.

Matrices are scaled by a characteristic length.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.spatial import Space
from robostiff.spatial.batch import Float, empty_batch, product, transpose


@frozen
class Tolerance:
    """When a direction counts as lost.

    Joint and wrench directions are decided on unit vectors of the geometry alone, never on the size
    of stiffnesses: a soft spring is not a free motion.

    Attributes
    ----------
    independence : float
        A joint whose unit twist lies nearer than this to the span of those before is redundant;
        a platform direction held by unit wrenches with a singular value below this is free.
    near_independence : float
        Below this the pose is reported as ill-conditioned.
    rigidity : float
        A transmitted wrench whose compliance is below this part of the largest is rigid: float64
        cannot distinguish it from zero.
    near_rigidity : float
        Below this the answer is reported as ill-conditioned.
    rounding : float
        A direction nearer to lost than this is lost for certain; between it and `independence` the
        pose is reported as ill-conditioned.
    """

    independence: float = 1e-9
    near_independence: float = 1e-6
    rigidity: float = 1e-14
    near_rigidity: float = 1e-10
    rounding: float = 1e-11

    def __post_init__(self) -> None:
        pairs = (
            (self.rounding, self.independence),
            (self.independence, self.near_independence),
            (self.rigidity, self.near_rigidity),
        )
        for strict, near in pairs:
            if not 0 < strict <= near < 1:
                raise InputError("tolerance", got=(strict, near), expected="0 < strict <= near < 1")

    def leaves_in_doubt(self, values: np.ndarray) -> np.ndarray:
        """Where values or margins lie so near the cut that little would decide otherwise.

        Examples
        --------
        >>> Tolerance().leaves_in_doubt(np.array([1e-15, 1e-10, 1e-8, 1.0]))
        array([False,  True,  True, False])
        """
        return (values > self.rounding) & (values <= self.near_independence)


#: What functions decide by where no other is given.
DEFAULT_TOLERANCE = Tolerance()


def matrix_length(
    C: Float[np.ndarray, "*batch n n"], J_q: Float[np.ndarray, "*batch n q"]
) -> Float[np.ndarray, "*batch"]:
    """Characteristic length of a chain from its matrices alone, sqrt(tr C_tt / tr C_rr) [m].

    It scales with the unit of length, so that metres and millimetres decide alike. Without
    rotational compliance it follows from the lever arms of the joints; without them any length
    will do.

    Examples
    --------
    >>> C = np.diag([4.0, 4.0, 4.0, 1.0, 1.0, 1.0])
    >>> float(matrix_length(C, np.zeros((6, 0))))
    2.0
    """
    d = Space.of_size(C.shape[-1]).translations
    C_tt = np.trace(C[..., :d, :d], axis1=-2, axis2=-1)
    C_rr = np.trace(C[..., d:, d:], axis1=-2, axis2=-1)
    turns = np.sqrt(np.sum(J_q[..., d:, :] ** 2, axis=-2))
    levers = np.sqrt(np.sum(np.where(turns[..., None, :] > 0, J_q[..., :d, :], 0) ** 2, axis=-2))
    arm = np.max(levers / np.where(turns > 0, turns, 1), axis=-1, initial=0.0)
    arm = np.where(arm > 0, arm, 1.0)
    usable = (C_tt > 0) & (C_rr > 0)
    squared = np.where(usable, C_tt, 1) / np.where(usable, C_rr, 1)
    return np.where(usable, np.sqrt(squared), arm)


# Below this part of what the other block suggests a block is without stiffness.
_EMPTY = 1e-20
# Below this part it is the square of a lever arm of 1e-6, of which coordinates that are rounded a
# few times (1e-15) have fewer than nine digits.
_LEAST = 1e-12


def matrix_distance(
    K: np.ndarray, K_ref: np.ndarray, length: float, least: float = _LEAST
) -> float:
    """Largest entry of K - K_ref in units of its block, ``max |dK_ij| / s_ij``.

    For stiffness, or for compliance with 1 / `length`. s is the largest entry of the translation
    block, of the rotation block, and for the coupling blocks the root of their product; where a
    block of K_ref is empty, the other block, times or over the square of the robot's size [m]. A
    block that is smaller than `least` of what the other suggests is measured in that part. 0
    between two zero matrices.

    Examples
    --------
    >>> stiff = np.diag([1.0, 1, 1, 4, 4, 4])
    >>> round(matrix_distance(np.diag([1.0, 1, 1, 4, 4, 4.4]), stiff, length=1.0), 12)
    0.1
    """
    t = Space.of_size(len(K_ref)).translations
    translation, rotation = np.abs(K_ref[:t, :t]).max(), np.abs(K_ref[t:, t:]).max()
    if max(translation, rotation) == 0:
        return 0.0 if not np.any(K) else float("inf")
    if rotation <= _EMPTY * translation * length**2:
        rotation = translation * length**2
    if translation <= _EMPTY * rotation / length**2:
        translation = rotation / length**2
    rotation = max(rotation, least * translation * length**2)
    translation = max(translation, least * rotation / length**2)
    size = np.sqrt(np.where(np.arange(len(K_ref)) < t, translation, rotation))
    return float((np.abs(K - K_ref) / np.outer(size, size)).max())


def scaling(length: Float[np.ndarray, "*batch"], space: Space) -> Float[np.ndarray, "*batch n"]:
    """Factors that turn a twist into lengths, (1, 1, 1, L, L, L) or (1, 1, L).

    Examples
    --------
    >>> scaling(np.array(0.5), Space.PLANAR)
    array([1. , 1. , 0.5])
    """
    factors = empty_batch(length.shape, (space.size,))
    factors[..., : space.translations] = 1.0
    factors[..., space.translations :] = length[..., None]
    return factors


def last_moved(rates: np.ndarray, tolerance: Tolerance) -> np.ndarray:
    """Freedoms (q,) that some of k motions moves and none after them, from their rates (q, k)."""
    found = np.zeros(len(rates), dtype=bool)
    for i in range(len(rates) - 1, -1, -1):
        size = float(np.linalg.norm(rates[i]))
        if size > np.sqrt(tolerance.independence):
            found[i] = True
            along = rates[i] / size
            rates = rates - np.outer(rates @ along, along)
    return found


@frozen
class RankDecision:
    """Decision of a rank: the values kept and dropped, and the tolerance."""

    #: smallest_kept, largest_dropped: singular values of the stacked unit wrenches on both sides of
    #: the cut; None where there are none
    smallest_kept: float | None
    largest_dropped: float | None
    tolerance: float  #: the cut
    length: float  #: characteristic length [m] of the scaling

    def __str__(self) -> str:
        kept = "none" if self.smallest_kept is None else f"{self.smallest_kept:.2g}"
        dropped = "none" if self.largest_dropped is None else f"{self.largest_dropped:.2g}"
        return (
            f"smallest kept {kept}, largest dropped {dropped}, tolerance {self.tolerance:g}, "
            f"characteristic length {self.length:.4g} m"
        )


# A certificate this much above rounding needs no further look.
_CERTAIN = 1e-10


def smallest_compliance(
    C: Float[np.ndarray, "*batch n n"], W: Float[np.ndarray, "*batch n m"]
) -> Float[np.ndarray, "*batch"]:
    """Smallest eigenvalue of W^T C W over the trace of C: 0 where a transmitted wrench is rigid.

    Orthonormal wrenches W; zero columns are passed over, and 1 is given where nothing is
    transmitted. Where the ratio is certainly above 1e-10 a lower bound is given in place of the
    eigenvalue.
    """
    m = W.shape[-1]
    trace = np.trace(C, axis1=-2, axis2=-1)
    if m == 0:
        return np.ones(trace.shape)
    A = np.einsum("...im,...im->...m", W, W)[..., :, None] * np.eye(m)
    idle = np.eye(m) - np.where(A > 0, 1.0, 0.0) * np.eye(m)
    scale = np.where(trace > 0, trace, 1.0)[..., None, None]
    A = product(transpose(W), product(C, W)) / scale + idle
    bound = np.atleast_1d(_determinant_bound(A))
    doubtful = bound < _CERTAIN
    if np.any(doubtful):
        bound[doubtful] = np.linalg.eigvalsh(A.reshape(*bound.shape, m, m)[doubtful])[..., 0]
    ratio = bound.reshape(A.shape[:-2])
    return np.where(trace > 0, ratio, np.where(idle.any((-1, -2)), ratio, 0.0))


def smallest_singular_value(W: Float[np.ndarray, "*batch n m"]) -> Float[np.ndarray, "*batch"]:
    """Lower bound, sharp where it is small, of the smallest singular value of W (n x m, m >= n)."""
    n, m = W.shape[-2:]
    if m < n:
        return np.zeros(W.shape[:-2])
    bound = np.atleast_1d(_determinant_bound(product(W, transpose(W))))
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
    """
    n = K.shape[-1]
    diagonal = np.einsum("...ii->...i", K)
    # What is rounding on the diagonal must not be blown up to 1.
    least = np.max(diagonal, axis=-1, keepdims=True) * _CERTAIN
    size = np.sqrt(np.where(diagonal > least, diagonal, np.where(least > 0, least, 1.0)))
    unit = np.reshape(K / (size[..., :, None] * size[..., None, :]), (-1, n, n))
    ranks = np.ravel(rank)
    value = _determinant_bound(unit)
    doubtful = (value < _CERTAIN) | (ranks < n)
    if np.any(doubtful):
        eigenvalues = np.linalg.eigvalsh(unit[doubtful])
        place = np.minimum(n - ranks[doubtful], n - 1)[:, None]
        value[doubtful] = np.take_along_axis(eigenvalues, place, axis=-1)[:, 0]
        value[ranks == 0] = 1.0
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


# Rows of loads and motions in the x-y plane, and of those out of it.
_IN = list(Space.PLANAR.rows)
_OUT = [row for row in Space.SPATIAL.rows if row not in _IN]
_ROUNDING = 1e-9
_HINT = "leave out 'planar: true' to compute in space"


def check_joints_in_plane(J_q: np.ndarray, names: Sequence[str], of: str = "robot") -> None:
    """Raise unless every passive joint turns about z or slides across it."""
    out = np.linalg.norm(J_q[..., _OUT, :], axis=-2) > _ROUNDING * np.linalg.norm(J_q, axis=-2)
    if np.any(out):
        raise InputError(
            f"passive joint {names[int(np.argwhere(out)[0][-1])]!r} of a planar {of}",
            got=Words("an axis that leads out of the x-y plane"),
            expected="a rotation about z or a slide across z",
            hint=_HINT,
        )


def check_compliance_in_plane(C: np.ndarray, subject: str) -> None:
    """Raise unless loads in the plane deflect the part in the plane alone."""
    coupling, allowed = coupling_out_of_plane(C)
    if np.any(coupling > allowed):
        raise InputError(
            subject,
            got=Words("an elasticity that couples motions in the plane with motions out of it"),
            expected="principal axes along and across the plane",
            hint=_HINT,
        )


def coupling_out_of_plane(C: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sizes (..., 3, 3) of what a compliance (..., 6, 6) couples, and what rounding leaves of them.

    Rows are x, y and rz; columns are z, rx and ry.
    """
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", C), 0.0))
    allowed = _ROUNDING * size[..., _IN, None] * size[..., None, _OUT]
    return np.abs(C[..., _IN, :][..., _OUT]), allowed
