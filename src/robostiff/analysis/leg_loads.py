"""How the legs of a robot share a load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.analysis.result import Stiffness
from robostiff.elastostatics import ConjugateWrenches, Status, scaling

_BALANCED = 1e-9  # part of a load that may do work on a free motion
# Of a load and the wrenches of all legs: what they lack for equilibrium that is no rounding.
_MISSED = 1e-6


@dataclass(frozen=True)
class LegLoads:
    """Loads of the legs of a robot, about the origin of its result, in world axes."""

    twist: np.ndarray  # (..., n): the least displacement, where free motions remain [m, rad]
    # (...) of uint16: UNBALANCED where the load does work on free motions, ILL_CONDITIONED where
    # the wrenches of the legs are not that of the load; nothing else holds there
    status_codes: np.ndarray
    # tuple of (..., n): on each leg, then each part of a flexible platform; none for a network
    wrenches: tuple[np.ndarray, ...]


def leg_loads(answer: Stiffness, wrench: np.ndarray) -> LegLoads:
    """Loads of the legs under a wrench (..., n) about the origin of a result, all within reach.

    They share it with the least energy, the primary result of linear statics: that needs a
    stiffness matrix neither of a leg nor of the robot, and holds where a direction is rigid.
    """
    whole = answer.details()
    every = whole.wrenches
    s = scaling(whole.length, whole.space)
    F = (wrench / s)[..., None]
    found = whole.shared
    sizes = found.shares @ F, found.rigid_shares @ F
    (among,) = ConjugateWrenches.carried([every], *sizes)
    if whole.shares is None:
        known = [leg.carried for leg in whole.legs if leg.carried is not None]
        wrenches = ConjugateWrenches.carried(known, *sizes)
    else:
        of_each = np.einsum("...bij,...j->...bi", whole.shares, wrench)
        wrenches = list(np.moveaxis(of_each / s[..., None, :], -2, 0)[..., None])
    of_legs = wrenches[: len(whole.legs)]
    return LegLoads(
        twist=(found.compliance @ F)[..., 0] / s,
        status_codes=_codes(F, of_legs, among, whole.rank),
        wrenches=tuple(own[..., 0] * s for own in wrenches),
    )


def _codes(
    F: np.ndarray, wrenches: Sequence[np.ndarray], among: np.ndarray, rank: np.ndarray
) -> np.ndarray:
    """Status (...) of a load (..., n, 1), what legs carry, and its part without free motions.

    Without free motions a part is missing by rounding alone: rigid wrenches of two legs that are
    almost one carry 1e8 of a load, and miss 1e-8 of it.
    """

    def size(own: np.ndarray) -> np.ndarray:
        return np.linalg.norm(own[..., 0], axis=-1)

    driven = (size(F - among) > _BALANCED * size(F)) & (rank < F.shape[-2])
    codes = np.where(driven, np.uint16(Status.UNBALANCED), np.uint16(0))
    if wrenches:
        whole = size(F) + np.sum([size(own) for own in wrenches], axis=0)
        lost = ~driven & ~(size(F - np.sum(wrenches, axis=0)) <= _MISSED * whole)
        codes = codes | np.where(lost, np.uint16(Status.ILL_CONDITIONED), np.uint16(0))
    return codes


def loads_known(answer: Stiffness) -> np.ndarray:
    """Where `leg_loads` has an answer (...)."""
    return (answer.rank >= 0) & (answer.details().wrenches.count >= answer.rank)
