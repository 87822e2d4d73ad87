"""Legs in parallel: the sum of their stiffnesses, eq. (12), and legs on a flexible platform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robostiff.elastostatics.conditioning import (
    smallest_compliance,
    smallest_held_stiffness,
    smallest_singular_value,
)
from robostiff.elastostatics.conjugate_wrenches import ConjugateWrenches
from robostiff.elastostatics.result import CartesianStiffness
from robostiff.elastostatics.status import WITHOUT_STIFFNESS, Status
from robostiff.elastostatics.tolerance import Tolerance, scaling
from robostiff.errors import InputError
from robostiff.spatial import move_stiffness
from robostiff.spatial.batch import block_diagonal, empty_batch
from robostiff.spatial.shapes import Float


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
    held = _beside([leg.held for leg in legs])
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
    rigid = _beside([leg.rigid for leg in legs])
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


def _beside(stacks: Sequence[np.ndarray]) -> np.ndarray:
    """Columns of all legs beside one another, poses side by side in memory."""
    *batch, n, _ = stacks[0].shape
    beside = empty_batch(tuple(batch), (n, sum(stack.shape[-1] for stack in stacks)))
    start = 0
    for stack in stacks:
        stop = start + stack.shape[-1]
        beside[..., start:stop] = stack
        start = stop
    return beside


@dataclass(frozen=True)
class CoupledLegs:
    """Legs that hold the tool through a flexible platform.

    Attributes
    ----------
    whole : CartesianStiffness
        Of the tool.
    legs : tuple of CartesianStiffness
        What each leg carries of the load: its matrix times the twist of the tool is the wrench
        on this leg. These matrices add up to that of the whole; none is symmetric by itself. Their
        status is that of the whole, as a leg that is rigid by itself is compliant with the
        platform.
    """

    whole: CartesianStiffness
    legs: tuple[CartesianStiffness, ...]


def couple_legs(
    legs: Sequence[CartesianStiffness],
    leg_compliances: Sequence[Float[np.ndarray, "*batch m m"]],
    platform_compliance: Float[np.ndarray, "*batch w w"],
    platform_work: Float[np.ndarray, "*batch w k"],
) -> CoupledLegs:
    """Stiffness of legs on a flexible platform, ``K = H Z (Z^T (c + p) Z)^-1 Z^T H^T``.

    The legs transmit wrenches H = [W_1 W_2 ...] to the tool. Each meets the compliance c of its own
    leg and, with all others, the compliance p of the platform between the legs and the tool. Z
    combines them so that they do no work on motions that the platform itself leaves free. It is
    the wrench basis form with a C that couples the legs; where nothing bends, p = 0 and Z = I, it
    is the sum of the legs, eq. (12). In displacements it is the condensation of the platform,
    ``K_tt - K_tn (K_nn + diag K_i)^-1 K_nt``, which loses the more digits the stiffer the platform.

    Parameters
    ----------
    legs : sequence of CartesianStiffness
        About the same point, in the same axes, scaled by the same length.
    leg_compliances : sequence of (..., m_i, m_i) arrays
        Scaled compliance that the wrenches ``leg.held`` meet in their leg; whatever for zero
        columns.
    platform_compliance : (..., w, w) array
        p, scaled, for the wrenches of all legs beside one another.
    platform_work : (..., w, k) array
        Work of each on unit motions that the platform leaves free; k = 0 for none.

    Raises
    ------
    InputError
        When shapes do not fit.

    Examples
    --------
    A spring of compliance 1 on a platform of compliance 3:

    >>> from robostiff.elastostatics import solve_chain, WrenchBasis
    >>> passive = np.eye(6)[:, 1:]
    >>> leg = solve_chain(np.eye(6), passive, WrenchBasis(), np.array(1.0), Tolerance())
    >>> coupled = couple_legs([leg], [np.eye(1)], 3 * np.eye(1), np.zeros((1, 0)))
    >>> float(coupled.whole.K[0, 0]), int(coupled.whole.rank)
    (0.25, 1)
    """
    first = legs[0]
    H = np.concatenate([leg.held for leg in legs], axis=-1)
    count = H.shape[-1]
    if platform_compliance.shape[-2:] != (count, count) or platform_work.shape[-2] != count:
        raise InputError(
            "compliance of the platform",
            got=platform_compliance.shape,
            expected=f"one row and column for each of the {count} wrenches",
        )
    tolerance = first.tolerance
    M = platform_compliance + block_diagonal(leg_compliances)
    M = np.where(_idle(H)[..., None] | _idle(H)[..., None, :], 0.0, M)
    work = np.broadcast_to(platform_work, (*first.batch_shape, *platform_work.shape[-2:]))
    Z, lost, doubtful = _combinations(work, tolerance)
    HZ = H @ Z
    load, rigid, rigid_wrenches, few_digits = _inverted(M, Z, HZ, tolerance)
    s = scaling(first.length, first.space)
    scale = s[..., :, None] * s[..., None, :]
    status = np.bitwise_or.reduce([leg.status_codes for leg in legs])
    status = status & ~np.uint16(Status.FREE_MOTIONS | Status.RIGID_DIRECTION)
    status = (
        status
        | rigid * np.uint16(Status.RIGID_DIRECTION)
        | (doubtful | few_digits) * np.uint16(Status.ILL_CONDITIONED)
        | np.any(lost, axis=-1) * np.uint16(Status.REDUNDANT_JOINTS)
    )
    K = HZ @ load
    together = CartesianStiffness(
        matrix=0.5 * (K + np.swapaxes(K, -1, -2)) * scale,
        status_codes=np.asarray(status, dtype=np.uint16),
        rank=first.rank,
        held=HZ,
        redundant=np.concatenate([*(leg.redundant for leg in legs), lost], axis=-1),
        length=first.length,
        rigid=rigid_wrenches,
        tolerance=tolerance,
        reason="; ".join(dict.fromkeys(leg.reason for leg in legs if leg.reason)),
    )
    carried, start, shares = Z @ load, 0, []
    for leg in legs:
        stop = start + leg.held.shape[-1]
        own = leg.held @ carried[..., start:stop, :]
        shares.append(replace(leg, matrix=own * scale, status_codes=together.status_codes))
        start = stop
    return CoupledLegs(aggregate((together,)), tuple(shares))


def _inverted(
    M: np.ndarray, Z: np.ndarray, HZ: np.ndarray, tolerance: Tolerance
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What the transmitted wrenches carry (..., w, n) for unit twists.

    Besides where one is rigid (...), such wrenches (..., n, k), and where few digits hold (...).
    """
    count = M.shape[-1]
    identity = np.eye(count)
    A = np.swapaxes(Z, -1, -2) @ M @ Z
    # Wrenches that do not act on the tool matter, too: legs that pull at one another bend
    # the platform. Only where there is neither wrench nor compliance is nothing to solve for.
    idle = _idle(HZ) & (np.einsum("...ii->...i", A) == 0)
    mean = np.trace(A, axis1=-2, axis2=-1) / count
    A = np.where(idle[..., None] | idle[..., None, :], 0.0, A)
    A = A + idle[..., None] * identity * np.where(mean > 0, mean, 1.0)[..., None, None]
    every = np.broadcast_to(identity, A.shape)
    rigid = smallest_compliance(A, every) <= tolerance.rigidity
    diagonal = np.einsum("...ii->...i", A)
    size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    # In units of each wrench's own compliance, soft legs take no digits from stiff ones.
    unit = np.where(rigid[..., None, None], identity, A / (size[..., :, None] * size[..., None, :]))
    doubtful = ~rigid & (smallest_compliance(unit, every) <= tolerance.near_rigidity)
    to_tool = np.swapaxes(HZ, -1, -2) / size[..., None]
    load = np.linalg.solve(unit, to_tool) / size[..., None]
    wrenches = np.zeros((*HZ.shape[:-1], 0))
    if np.any(rigid):
        values, modes = np.linalg.eigh(A)
        limit = tolerance.rigidity * np.trace(A, axis1=-2, axis2=-1)
        stiff = (values <= limit[..., None]) & rigid[..., None]
        wrenches = HZ @ np.where(stiff[..., None, :], modes, 0.0)
    return load, rigid, wrenches, doubtful


def _combinations(
    work: np.ndarray, tolerance: Tolerance
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Combinations Z (..., w, w) of wrenches that do no work, zero columns among them.

    The second result marks the motions of the platform that no leg holds (..., k).
    """
    count, motions = work.shape[-2:]
    if motions == 0:
        Z = np.broadcast_to(np.eye(count), (*work.shape[:-2], count, count))
        return Z, np.zeros((*work.shape[:-2], 0), dtype=bool), np.zeros(work.shape[:-2], dtype=bool)
    U, values, _ = np.linalg.svd(work)
    held = np.count_nonzero(values > tolerance.independence, axis=-1)
    Z = np.where(np.arange(count) >= held[..., None, None], U, 0.0)
    doubtful = np.any(tolerance.leaves_in_doubt(values), axis=-1)
    # Motions that add nothing to what the legs hold of those before them.
    lost = np.zeros((*work.shape[:-2], motions), dtype=bool)
    before = np.zeros(held.shape, dtype=int)
    for k in range(motions):
        values = np.linalg.svd(work[..., : k + 1], compute_uv=False)
        now = np.count_nonzero(values > tolerance.independence, axis=-1)
        lost[..., k] = now == before
        before = now
    return Z, lost, doubtful


def _idle(H: np.ndarray) -> np.ndarray:
    """Columns that are no wrench (..., w)."""
    return ~np.any(H != 0, axis=-2)
