"""Decisions of ranks, on matrices scaled by a characteristic length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial import Space
from robostiff.spatial.batch import empty_batch
from robostiff.spatial.shapes import Float


@dataclass(frozen=True)
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
    return np.where(usable, np.sqrt(C_tt / np.where(usable, C_rr, 1)), arm)


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
    """Freedoms (q,) that some of k motions moves and none after them, from their rates (q, k).

    Examples
    --------
    >>> last_moved(np.array([[1.0], [2.0], [0.0]]), Tolerance())
    array([False,  True, False])
    """
    found = np.zeros(len(rates), dtype=bool)
    for i in range(len(rates) - 1, -1, -1):
        size = float(np.linalg.norm(rates[i]))
        if size > np.sqrt(tolerance.independence):
            found[i] = True
            along = rates[i] / size
            rates = rates - np.outer(rates @ along, along)
    return found


@dataclass(frozen=True)
class RankDecision:
    """Decision of a rank: the values kept and dropped, and the tolerance.

    Attributes
    ----------
    smallest_kept, largest_dropped : float or None
        Singular values of the stacked unit wrenches on both sides of the cut; None where there are
        none.
    tolerance : float
        The cut.
    length : float
        Characteristic length [m] of the scaling.
    """

    smallest_kept: float | None
    largest_dropped: float | None
    tolerance: float
    length: float

    def __str__(self) -> str:
        kept = "none" if self.smallest_kept is None else f"{self.smallest_kept:.2g}"
        dropped = "none" if self.largest_dropped is None else f"{self.largest_dropped:.2g}"
        return (
            f"smallest kept {kept}, largest dropped {dropped}, tolerance {self.tolerance:g}, "
            f"characteristic length {self.length:.4g} m"
        )
