"""A leg as the wrenches that it transmits and the energy that they store.

They solve (6) and (7) without the inverse of C: ``K = W (W^T C W)^-1 W^T`` of (8), of which (4) is
a case. Legs in parallel add up, (12).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from robostiff.elastostatics.conjugate_wrenches import ConjugateWrenches, conjugate_wrenches
from robostiff.elastostatics.result import CartesianStiffness
from robostiff.elastostatics.status import WITHOUT_STIFFNESS, PoseBatch, Status
from robostiff.elastostatics.tolerance import (
    Tolerance,
    scaling,
    smallest_held_stiffness,
    smallest_singular_value,
)
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.spatial import Space, compliance_modes, move_stiffness
from robostiff.spatial.batch import Bool, Float, poses_side_by_side

_ROUNDING = 4 * np.finfo(float).eps


def transmitted_wrenches(
    J_q: Float[np.ndarray, "*batch n q"], independence: float = 1e-9
) -> tuple[Float[np.ndarray, "*batch n m"], Bool[np.ndarray, "*batch q"]]:
    """Orthonormal wrenches W with W^T J_q = 0, and the joints that add no freedom.

    The dual of the recursion (15): all wrenches are transmitted to begin with, and each passive
    joint in turn removes the one that would drive it, by a Householder reflection of the columns of
    W: the rank of K drops by one a joint, eq. (16). A joint that no transmitted wrench drives is
    redundant and removes nothing.

    Parameters
    ----------
    J_q : (..., n, q) array
        Twists of the passive joints, scaled by a characteristic length.
    independence : float
        A joint is redundant when its unit twist lies nearer than this to the span of those before.

    Returns
    -------
    W : (..., n, m) array
        Orthonormal columns. Poses of a batch may transmit different numbers of wrenches; m is the
        largest, and zero columns fill the rest.
    redundant : (..., q) array of bool

    Examples
    --------
    A hinge about z transmits everything but the moment about z:

    >>> W, redundant = transmitted_wrenches(np.array([[0.0], [0.0], [1.0]]))
    >>> np.abs(W[2]).max(), redundant
    (np.float64(0.0), array([False]))
    """
    W, margins = wrenches_and_margins(J_q, independence)
    return W, margins <= independence


def unit_twists_and_wrenches(
    J_scaled: Float[np.ndarray, "*batch n q"],
    tolerance: Tolerance,
    present: Bool[np.ndarray, "*batch q"] | None = None,
) -> tuple[
    Float[np.ndarray, "*batch n q"], Float[np.ndarray, "*batch n m"], Float[np.ndarray, "*batch q"]
]:
    """Scaled twists of unit size, and the result of `wrenches_and_margins` for them.

    `present` marks the columns that exist: poses may differ in their number, and zero columns,
    whose margin is 1, fill up.
    """
    size = np.sqrt(np.einsum("...nq,...nq->...q", J_scaled, J_scaled))
    unit = J_scaled / np.where(size > 0, size, 1.0)[..., None, :]
    W, margins = wrenches_and_margins(unit, tolerance.independence)
    return unit, W, margins if present is None else np.where(present, margins, 1.0)


def wrenches_and_margins(
    J_q: Float[np.ndarray, "*batch n q"], independence: float
) -> tuple[Float[np.ndarray, "*batch n m"], Float[np.ndarray, "*batch q"]]:
    """Transmitted wrenches, and how far each unit twist lies from the span of those before it.

    As `transmitted_wrenches`, but with the distances (..., q) that decide redundancy; they are
    those of unit twists, so 1 is a joint that owes nothing to the others.
    """
    n, joints = J_q.shape[-2:]
    W = np.broadcast_to(np.eye(n), (*J_q.shape[:-2], n, n))
    margins = np.zeros((*J_q.shape[:-2], joints))
    for i in range(joints):
        column = J_q[..., i]
        drive = np.einsum("...nm,...n->...m", W, column)
        size = np.sqrt(np.einsum("...m,...m->...", drive, drive))
        whole = np.sqrt(np.einsum("...n,...n->...", column, column))
        margins[..., i] = size / np.where(whole > 0, whole, 1.0)
        lost = margins[..., i] <= independence
        if not np.any(lost):
            # Reflect the columns so that the first alone drives the joint, and drop it.
            first = drive[..., 0]
            leading = first + np.copysign(size, first)
            towards = np.einsum("...nm,...m->...n", W, drive)
            towards = towards + W[..., 0] * (leading - first)[..., None]
            towards = towards / (size * np.abs(leading))[..., None]
            W = W[..., 1:] - towards[..., :, None] * drive[..., None, 1:]
        elif not np.all(lost):  # poses that decide differently, each group by itself
            several, margins = np.zeros((*lost.shape, n, n)), np.zeros((*lost.shape, joints))
            for group in (lost, ~lost):
                W_group, margins[group] = wrenches_and_margins(J_q[group], independence)
                several[group, :, : W_group.shape[-1]] = W_group
            return several, margins
    # Unit vectors carry no smaller parts than these: an axis-aligned chain keeps its exact zeros.
    return np.where(np.abs(W) <= _ROUNDING, 0.0, W), margins


#: Loads of each spring under scaled wrenches W (..., n, m): rows (..., p, m) along unit twists, and
#: roots of the compliances along them (..., p).
SpringLoads = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@frozen
class LegWrenches(PoseBatch):
    """Wrenches that a leg transmits, in scaled coordinates."""

    #: (..., n, m): orthonormal basis of the transmitted wrenches; zero columns fill up
    W: Float[np.ndarray, "*batch n m"]
    #: (..., q): how far the unit twist of each passive joint lies from the span of those before it
    margins: Float[np.ndarray, "*batch q"]
    conjugate: ConjugateWrenches

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """Shape of the batch of poses."""
        return self.conjugate.batch_shape


def leg_wrenches(
    J_q: Float[np.ndarray, "*batch n q"],
    spring_loads: SpringLoads,
    length: np.ndarray,
    tolerance: Tolerance,
    present: np.ndarray | None = None,
) -> LegWrenches:
    """What a leg with passive joints transmits, and the energy that its springs store of it.

    Parameters
    ----------
    J_q : (..., n, q) array
        Twists of the passive joints about one point.
    spring_loads : SpringLoads
        Loads of the springs under wrenches about the same point.
    length : (...) array
        Characteristic length [m].
    tolerance : Tolerance
    present : (..., q) array of bool, optional
        Which columns of J_q are there; all when left out.
    """
    s = scaling(length, Space.of_size(J_q.shape[-2]))
    _, W, margins = unit_twists_and_wrenches(J_q * s[..., :, None], tolerance, present)
    return LegWrenches(W, margins, conjugate_wrenches(W, *spring_loads(W), tolerance))


def loads_of_compliance(C: Float[np.ndarray, "*batch n n"], length: np.ndarray) -> SpringLoads:
    """Loads along the modes of a compliance, of a chain of which it alone is known."""
    s = scaling(length, Space.of_size(C.shape[-1]))
    return loads_of_modes(np.swapaxes(compliance_modes(C) * s[..., :, None], -1, -2))


def loads_of_modes(modes: Float[np.ndarray, "*batch p n"]) -> SpringLoads:
    """Loads along modes by which a load F stores ``|modes F|^2 / 2``, in scaled coordinates."""
    sizes = np.sqrt(np.einsum("...pn,...pn->...p", modes, modes))
    unit = modes / np.where(sizes > 0, sizes, 1.0)[..., None]
    return lambda W: (unit @ W, sizes)


def solved_leg(leg: LegWrenches, length: np.ndarray, tolerance: Tolerance) -> CartesianStiffness:
    """Stiffness of a leg, ``K = W (W^T C W)^-1 W^T`` without summing C.

    Where a transmitted wrench meets no spring there is no matrix (`Status.RIGID_DIRECTION`); what
    the leg carries beside others, and their compliance together, follow all the same.
    """
    conjugate, s = leg.conjugate, scaling(length, Space.of_size(leg.W.shape[-2]))
    redundant = leg.margins <= tolerance.independence
    transmitted = np.count_nonzero(np.any(leg.W != 0, axis=-2), axis=-1)
    doubtful = conjugate.doubtful | np.any(tolerance.leaves_in_doubt(leg.margins), axis=-1)
    K = conjugate.stiffness
    status = (
        (transmitted < leg.W.shape[-2]) * int(Status.FREE_MOTIONS)
        | np.any(redundant, axis=-1) * int(Status.REDUNDANT_JOINTS)
        | np.any(conjugate.rigid != 0, axis=(-1, -2)) * int(Status.RIGID_DIRECTION)
        | doubtful * int(Status.ILL_CONDITIONED)
    )
    return CartesianStiffness(
        matrix=K * (s[..., :, None] * s[..., None, :]),
        status_codes=np.asarray(np.broadcast_to(status, K.shape[:-2]), dtype=np.uint16),
        rank=np.broadcast_to(transmitted, K.shape[:-2]),
        held=leg.W,
        redundant=redundant,
        length=length,
        rigid=conjugate.rigid,
        tolerance=tolerance,
        carried=conjugate,
    )


def wrenches_of_leg(leg: CartesianStiffness) -> LegWrenches:
    """The wrenches of a solved leg; those of any root of K, which share no energy, for K alone."""
    conjugate, s, W = leg.carried, scaling(leg.length, leg.space), leg.held
    if conjugate is None:
        k = np.swapaxes(W, -1, -2) @ (leg.matrix / (s[..., :, None] * s[..., None, :])) @ W
        k = np.where(leg.answered[..., None, None], k, np.eye(W.shape[-1]))  # of any size
        size = np.sqrt(np.maximum(np.einsum("...ii->...i", k), 0.0))
        size = np.where(size > 0, size, 1.0)
        k = k / (size[..., :, None] * size[..., None, :])
        try:
            root = np.linalg.cholesky(k)
        except np.linalg.LinAlgError:
            values, V = np.linalg.eigh(0.5 * (k + np.swapaxes(k, -1, -2)))
            root = V * np.sqrt(np.maximum(values, 0.0))[..., None, :]
        wrenches = W @ (size[..., :, None] * root)
        square = np.einsum("...nm,...nm->...m", wrenches, wrenches)
        some = np.where(square > 0, square, 1.0)
        conjugate = ConjugateWrenches(
            wrenches / np.sqrt(some)[..., None, :],
            np.where(square > 0, 1.0 / some, 0.0),
            np.zeros((*W.shape[:-1], 0)),
            np.zeros(leg.batch_shape, dtype=bool),
        )
    return LegWrenches(W, np.zeros((*leg.batch_shape, 0)), conjugate)


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
        subject = "vectors from leg ends"
        raise InputError(subject, got=len(v_leg_end_to_ref), expected=f"{len(K_legs)}, one a leg")
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
        raise InputError("parallel robot", got=Words("no leg"), expected="at least one leg")
    first = legs[0]
    shapes = {leg.matrix.shape for leg in legs}
    if len(shapes) > 1:
        raise InputError(
            "legs of a parallel robot",
            got=Words(f"matrices of shapes {sorted(shapes)}"),
            expected="one space and one batch of poses",
        )
    n = first.space.size
    wrenches = poses_side_by_side(np.concatenate([leg.held for leg in legs], axis=-1), 2)
    rigid = poses_side_by_side(np.concatenate([leg.rigid for leg in legs], axis=-1), 2)
    margin = smallest_singular_value(wrenches)
    tolerance = first.tolerance
    full = np.asarray(margin > tolerance.independence)
    rank = np.full(first.batch_shape, n)
    doubtful = np.array(full & (margin <= tolerance.near_independence))
    if not np.all(full):
        values = np.linalg.svd(wrenches[~full], compute_uv=False)
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
        held=wrenches,
        redundant=np.concatenate([leg.redundant for leg in legs], axis=-1),
        length=first.length,
        rigid=rigid,
        tolerance=tolerance,
        reason="; ".join(dict.fromkeys(leg.reason for leg in legs if leg.reason)),
        carried=ConjugateWrenches.beside(known) if len(known) == len(legs) else None,
    )
