"""How the legs of a robot share a load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.analysis.result import Stiffness
from robostiff.elastostatics import ConjugateWrenches, least_energy, scaling

_BALANCED = 1e-9  # part of a load that may do work on a free motion


@dataclass(frozen=True)
class LegLoads:
    """Loads of the legs of a robot, about the origin of its result, in world axes."""

    twist: np.ndarray  # (..., n): the least displacement, where free motions remain [m, rad]
    # (...) of bool: where the load does no work on free motions; nothing else holds elsewhere
    balanced: np.ndarray
    wrenches: tuple[np.ndarray, ...]  # tuple of (..., n): on each leg; none for a network


def leg_loads(answer: Stiffness, wrench: np.ndarray) -> LegLoads | None:
    """Loads of the legs under a wrench (..., n) about the origin of a result, all within reach.

    They share it with the least energy, the primary result of linear statics: that needs a
    stiffness matrix neither of a leg nor of the robot, and holds where a direction is rigid. None
    where the matrices alone are known, and cannot be solved at some pose.
    """
    details = answer.details()
    C, whole = details.serial_compliance, details.whole
    if C is not None and not np.isnan(C).any():
        twist = np.einsum("...ij,...j->...i", C, wrench)
        F = np.broadcast_to(wrench, twist.shape)
        own = (F,) if details.legs else ()
        return LegLoads(twist, np.ones(twist.shape[:-1], dtype=bool), own)
    known = [leg.carried for leg in details.legs if leg.carried is not None]
    if whole.carried is None or len(known) < len(details.legs):
        return _by_matrices(answer, wrench)
    s = scaling(whole.length, whole.space)
    F = (wrench / s)[..., None]
    every = ConjugateWrenches.beside(known)
    found = least_energy(every.unit, every.compliance, every.rigid, whole.rank, whole.tolerance)
    wrenches = ConjugateWrenches.carried(known, found.shares @ F, found.rigid_shares @ F)
    return LegLoads(
        twist=(found.compliance @ F)[..., 0] / s,
        balanced=_is_balanced(F - np.sum(wrenches, axis=0), F, whole.rank),
        wrenches=tuple(own[..., 0] * s for own in wrenches),
    )


def _is_balanced(missing: np.ndarray, F: np.ndarray, rank: np.ndarray) -> np.ndarray:
    """Where a load (..., n, 1) does no work on free motions; without any, it misses rounding.

    Rigid wrenches of two legs that are almost one carry 1e8 of a load, and miss 1e-8 of it.
    """
    missed, size = (np.linalg.norm(own[..., 0], axis=-1) for own in (missing, F))
    return (missed <= _BALANCED * size) | (rank == F.shape[-2])


def loads_known(answer: Stiffness) -> np.ndarray:
    """Where `leg_loads` has an answer (...)."""
    details = answer.details()
    if details.whole.carried is not None:
        return answer.rank >= 0
    by_matrices = details.whole.invertible
    if details.serial_compliance is None:
        return by_matrices
    return by_matrices | answer.has_compliance


def _by_matrices(answer: Stiffness, wrench: np.ndarray) -> LegLoads | None:
    """From the stiffness matrices of the robot and of the legs."""
    if not np.all(answer.answered):
        return None
    whole, legs = answer.details().whole, answer.details().legs
    s = scaling(whole.length, whole.space)
    F, K = (wrench / s)[..., None], whole.matrix / (s[..., :, None] * s[..., None, :])
    among = np.arange(K.shape[-1]) < whole.rank[..., None]
    U = np.linalg.svd(whole.held)[0] * among[..., None, :]
    # Of full rank nothing is projected: rounding of large entries would swamp the small ones.
    held = np.where(among[..., -1:, None], np.eye(K.shape[-1]), U @ np.swapaxes(U, -1, -2))
    load = held @ F
    size = np.trace(K, axis1=-2, axis2=-1)[..., None, None]
    # What is free is held by a spring of its own, which no load that is balanced feels.
    K_held = held @ K @ held + np.where(size > 0, size, 1.0) * (np.eye(K.shape[-1]) - held)
    try:
        t = np.linalg.solve(K_held, load)[..., 0] / s
    except np.linalg.LinAlgError:  # stiffnesses too far apart for their sum to hold both
        return None
    return LegLoads(
        twist=t,
        balanced=_is_balanced(F - load, F, whole.rank),
        wrenches=tuple(np.einsum("...ij,...j->...i", leg.matrix, t) for leg in legs),
    )
