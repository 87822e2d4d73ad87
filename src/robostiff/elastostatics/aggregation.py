"""Legs in parallel: the sum of their stiffnesses, eq. (12)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.elastostatics.conjugate_wrenches import ConjugateWrenches
from robostiff.elastostatics.result import CartesianStiffness
from robostiff.elastostatics.status import WITHOUT_STIFFNESS, Status
from robostiff.elastostatics.tolerance import (
    scaling,
    smallest_held_stiffness,
    smallest_singular_value,
)
from robostiff.errors import InputError
from robostiff.spatial import move_stiffness
from robostiff.spatial.batch import Float, poses_side_by_side


def aggregate_matrices(
    K_legs: Sequence[Float[np.ndarray, "*batch n n"]],
    v_leg_end_to_ref: Sequence[Float[np.ndarray, "*batch d"]],
) -> Float[np.ndarray, "*batch n n"]:
    """Stiffness of a parallel robot, sum of J_v^-T K_i J_v^-1, eq. (12) with (13) corrected.

    Parameters
    ----------
    K_legs : sequence of (..., n, n) arrays
        Stiffness of each leg about its own end, all in the same axes.
    v_leg_end_to_ref : sequence of (..., 3) arrays, or (..., 2) in the plane
        Vector from each leg end to the reference point [m].

    Returns
    -------
    (..., n, n) array
        About the reference point.

    Examples
    --------
    >>> pull = np.diag([0.0, 0.0, 100.0, 0.0, 0.0, 0.0])
    >>> left, right = np.array([1.0, 0, 0]), np.array([-1.0, 0, 0])
    >>> K = aggregate_matrices([pull, pull], [left, right])
    >>> float(K[2, 2]), float(K[4, 4])
    (200.0, 200.0)
    """
    if len(K_legs) != len(v_leg_end_to_ref):
        raise InputError(
            "vectors from leg ends", got=len(v_leg_end_to_ref), expected=f"{len(K_legs)}, one a leg"
        )
    moved = [move_stiffness(K, v) for K, v in zip(K_legs, v_leg_end_to_ref, strict=True)]
    return np.sum(moved, axis=0)


def aggregate(legs: Sequence[CartesianStiffness]) -> CartesianStiffness:
    """Stiffness of legs that act on one platform, all about the same point.

    Ranks are those of the stacked unit wrenches by which the legs hold the platform: geometry
    decides them, not the size of the stiffnesses.

    Parameters
    ----------
    legs : sequence of CartesianStiffness
        About the same point, in the same axes, scaled by the same length.

    Raises
    ------
    InputError
        When there is no leg, or the legs differ in space or batch.
    """
    if not legs:
        raise InputError("parallel robot", got="no leg", expected="at least one leg")
    first = legs[0]
    shapes = {leg.matrix.shape for leg in legs}
    if len(shapes) > 1:
        raise InputError(
            "legs of a parallel robot",
            got=f"matrices of shapes {sorted(shapes)}",
            expected="one space and one batch of poses",
        )
    n = first.space.size
    held, rigid = (
        poses_side_by_side(np.concatenate(own, axis=-1), 2)
        for own in ([leg.held for leg in legs], [leg.rigid for leg in legs])
    )
    margin = smallest_singular_value(held)
    tolerance = first.tolerance
    full = np.asarray(margin > tolerance.independence)
    rank = np.full(first.batch_shape, n)
    doubtful = np.array(full & (margin <= tolerance.near_independence))
    if not np.all(full):
        values = np.linalg.svd(held[~full], compute_uv=False)
        rank[~full] = np.count_nonzero(values > tolerance.independence, axis=-1)
        doubtful[~full] = np.any(tolerance.leaves_in_doubt(values), axis=-1)
    status = np.bitwise_or.reduce([leg.status_codes for leg in legs])
    status = status & ~np.uint16(Status.FREE_MOTIONS)
    status = status | (rank < n) * np.uint16(Status.FREE_MOTIONS)
    K = np.sum([leg.matrix for leg in legs], axis=0)
    if len(legs) > 1 and np.any(rigid):
        # Rigid wrenches of two legs that are almost one: how they differ is known to few digits.
        values = np.linalg.svd(rigid, compute_uv=False)
        doubtful = doubtful | np.any(tolerance.leaves_in_doubt(values), axis=-1)
    s = scaling(first.length, first.space)
    smallest = smallest_held_stiffness(K / (s[..., :, None] * s[..., None, :]), rank)
    answered = (status & int(WITHOUT_STIFFNESS)) == 0
    doubtful = doubtful | (answered & (smallest <= tolerance.near_rigidity))
    status = status | doubtful * np.uint16(Status.ILL_CONDITIONED)
    known = [leg.carried for leg in legs if leg.carried is not None]
    return CartesianStiffness(
        matrix=K,
        status_codes=np.asarray(status, dtype=np.uint16),
        rank=rank,
        held=held,
        redundant=np.concatenate([leg.redundant for leg in legs], axis=-1),
        length=first.length,
        rigid=rigid,
        tolerance=tolerance,
        reason="; ".join(dict.fromkeys(leg.reason for leg in legs if leg.reason)),
        carried=ConjugateWrenches.beside(known) if len(known) == len(legs) else None,
    )
