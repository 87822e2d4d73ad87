"""How the legs of a robot share a load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import ConjugateWrenches, least_energy, scaling

_BALANCED = 1e-9  # part of a load that may do work on a free motion


@dataclass(frozen=True)
class LegLoads:
    """Loads of the legs of a robot, about the origin of its result, in world axes.

    Attributes
    ----------
    twist : (..., n) array
        The least displacement, where free motions remain [m, rad].
    balanced : (...) array of bool
        Where the load does no work on free motions; nothing else holds elsewhere.
    wrenches : tuple of (..., n) arrays
        On each leg; none for a network.
    """

    twist: np.ndarray
    balanced: np.ndarray
    wrenches: tuple[np.ndarray, ...]


def leg_loads(answer: RobotStiffness, wrench: np.ndarray) -> LegLoads | None:
    """Loads of the legs under a wrench about the origin of a result.

    They share it with the least energy, the primary result of linear statics: that needs a
    stiffness matrix neither of a leg nor of the robot, and holds where a direction is rigid.

    Parameters
    ----------
    answer : RobotStiffness
        At one pose or a batch, all within reach.
    wrench : (..., n) array
        [N, N m].

    Returns
    -------
    LegLoads or None
        None where the matrices alone are known, and cannot be solved at some pose.
    """
    if answer.serial_compliance is not None and not np.isnan(answer.serial_compliance).any():
        twist = np.einsum("...ij,...j->...i", answer.serial_compliance, wrench)
        F = np.broadcast_to(wrench, twist.shape)
        own = (F,) if answer.legs else ()
        return LegLoads(twist, np.ones(twist.shape[:-1], dtype=bool), own)
    whole = answer.about_reference
    known = [leg.carried for leg in answer.legs if leg.carried is not None]
    if whole.carried is None or len(known) < len(answer.legs):
        return _by_matrices(answer, wrench)
    s = scaling(whole.length, whole.space)
    F = wrench / s
    every = ConjugateWrenches.beside(known)
    found = least_energy(every.unit, every.compliance, every.rigid, whole.rank, whole.tolerance)
    elastic = np.einsum("...ij,...j->...i", found.shares, F)
    rigid = np.einsum("...ij,...j->...i", found.rigid_shares, F)
    wrenches, start, first = [], 0, 0
    for own in known:
        stop, last = start + own.unit.shape[-1], first + own.rigid.shape[-1]
        carried = np.einsum("...ij,...j->...i", own.unit, elastic[..., start:stop])
        carried = carried + np.einsum("...ij,...j->...i", own.rigid, rigid[..., first:last])
        wrenches.append(carried)
        start, first = stop, last
    missing = np.linalg.norm(F - np.sum(wrenches, axis=0), axis=-1)
    return LegLoads(
        twist=np.einsum("...ij,...j->...i", found.compliance, F) / s,
        balanced=_is_balanced(missing, F, whole.rank),
        wrenches=tuple(own * s for own in wrenches),
    )


def _is_balanced(missing: np.ndarray, F: np.ndarray, rank: np.ndarray) -> np.ndarray:
    """Where a load does no work on free motions; without any, what is missing is rounding.

    Rigid wrenches of two legs that are almost one carry 1e8 of a load, and miss 1e-8 of it.
    """
    return (missing <= _BALANCED * np.linalg.norm(F, axis=-1)) | (rank == F.shape[-1])


def loads_known(answer: RobotStiffness) -> np.ndarray:
    """Where `leg_loads` has an answer (...)."""
    if answer.about_reference.carried is not None:
        return answer.rank >= 0
    by_matrices = answer.about_reference.invertible
    if answer.serial_compliance is None:
        return by_matrices
    return by_matrices | answer.has_compliance


def _by_matrices(answer: RobotStiffness, wrench: np.ndarray) -> LegLoads | None:
    """From the stiffness matrices of the robot and of the legs."""
    if not np.all(answer.answered):
        return None
    whole = answer.about_reference
    s = scaling(whole.length, whole.space)
    F, K = wrench / s, whole.matrix / (s[..., :, None] * s[..., None, :])
    among = np.arange(K.shape[-1]) < whole.rank[..., None]
    U = np.linalg.svd(whole.held)[0] * among[..., None, :]
    # Of full rank nothing is projected: rounding of large entries would swamp the small ones.
    held = np.where(among[..., -1:, None], np.eye(K.shape[-1]), U @ np.swapaxes(U, -1, -2))
    load = np.einsum("...ij,...j->...i", held, F)
    size = np.trace(K, axis1=-2, axis2=-1)[..., None, None]
    # What is free is held by a spring of its own, which no load that is balanced feels.
    K_held = held @ K @ held + np.where(size > 0, size, 1.0) * (np.eye(K.shape[-1]) - held)
    try:
        t = np.linalg.solve(K_held, load[..., None])[..., 0] / s
    except np.linalg.LinAlgError:  # stiffnesses too far apart for their sum to hold both
        return None
    missing = np.linalg.norm(F - load, axis=-1)
    return LegLoads(
        twist=t,
        balanced=_is_balanced(missing, F, whole.rank),
        wrenches=tuple(np.einsum("...ij,...j->...i", leg.matrix, t) for leg in answer.legs),
    )
