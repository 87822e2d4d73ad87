"""How the stiffness of a robot changes with its load, to first order, on recorded entries.

Every leg meets the platform, so that motions of its end are twists t of the platform; joints and
elastic parts follow them by the response of the unloaded leg, x = X t. With
``B_ij = sum_ab (d_b J_a) X_ai X_bj``, the second derivative of the motion, the leg that deflects
by t and carries W = K t has the stiffness ``K + K_1``:

``K_1,ij = E_ij(t) - W . B_ij - sum_k t_k ((K B_jk)_i + (K B_ik)_j)``

with E the third derivative of the elastic energy, that of beams which bending shortens.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.analytic.legs.leg_response import BeamInLeg, LegResponse, times, zeros
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.errors import InputError
from robostiff.recorded import RecordedRobot
from robostiff.recorded.elimination import dot, most_size
from robostiff.recorded.leg import stiffness_entries

_SAME = 1e-9  # of K: what free motions may change of it


@dataclass(frozen=True)
class LoadedTerms:
    """Stiffness without load, and its rate by the components of a wrench."""

    K: np.ndarray  # (n, n)
    K_by: np.ndarray  # (n, n, m): derivative of K by each component of the wrench


def loaded_terms(
    placed: PlacedRobot,
    recorded: RecordedRobot,
    components: Sequence[int],
    is_beam: Callable[[np.ndarray], bool],
) -> LoadedTerms:
    """Record how K changes with a wrench on the platform at the reference point.

    `recorded`: its elimination; `components`: which components of the wrench there are, among
    the n of K; `is_beam`: whether a compliance (6, 6) is that of a beam which bending shortens.

    Raises
    ------
    InputError
        When a leg has parallel blocks, coupled joints, springs with freedoms, stiffnesses that
        depend on a coordinate, or more joints than it needs; or the wrench does work on a free
        motion of the platform.
    """
    n = recorded.space.size
    K = np.array(
        [[recorded.K[min(i, j), max(i, j)] for j in range(n)] for i in range(n)], dtype=object
    )
    factors = recorded.factors
    deflections = [factors.solved([int(i == c) for i in range(n)]) for c in components]
    free = _free_motions(recorded)
    along_free = [zeros(n, n) for _ in free]
    K_by = zeros(n, n, len(components))
    for own, leg in zip(placed.legs, recorded.legs, strict=True):
        upper = stiffness_entries([leg], n)
        K_leg = zeros(n, n)
        for (i, j), value in upper.items():
            K_leg[i, j] = K_leg[j, i] = value
        response = LegResponse.of(own.leg, placed, K_leg)
        B, shapes = response.second_derivative(), response.shapes(is_beam, placed.record.count)
        for i, t in enumerate(free):
            along_free[i] += _rate(K_leg, B, shapes, t, times(K_leg, t))
        for m, t in enumerate(deflections):
            alone = len(placed.legs) == 1
            W = [int(i == components[m]) for i in range(n)] if alone else times(K_leg, t)
            K_by[:, :, m] += _rate(K_leg, B, shapes, t, W)
    _check_free_motions(recorded, components, along_free, free)
    return LoadedTerms(K, K_by)


def _free_motions(recorded: RecordedRobot) -> list[list[Any]]:
    """Basis of the twists that K lets go free."""
    factors = recorded.factors
    found = []
    for own in sorted(set(range(factors.size)) - set(factors.pivots)):
        x: list[Any] = [int(i == own) for i in range(factors.size)]
        for column, pivot in reversed(list(zip(factors.columns, factors.pivots, strict=True))):
            rest = [0 if i == pivot else c for i, c in enumerate(column)]
            x[pivot] = 0 - dot(rest, x)
        found.append(x)
    return found


def _check_free_motions(
    recorded: RecordedRobot, components: Sequence[int], rates: Sequence[np.ndarray], free: Any
) -> None:
    """Raise where the load does work on a free motion, or K changes along one."""
    space, name = recorded.space, recorded.name
    sizes = [1.0 if row < 3 else recorded.length for row in space.rows]
    largest = max(most_size(x) / (sizes[i] * sizes[j]) for (i, j), x in recorded.K.items())
    for t, rate in zip(free, rates, strict=True):
        size = max(most_size(x) * s for x, s in zip(t, sizes, strict=True)) / recorded.length
        works = [i for i in components if most_size(t[i]) * sizes[i] > _SAME * size]
        changes = max(most_size(x) / (sizes[i] * sizes[j]) for (i, j), x in np.ndenumerate(rate))
        if works:
            got = f"{space.wrench_order[works[0]]}, which does work on a free motion"
            hint = "give the passive joint a stiffness, or leave that component of the wrench out"
        elif changes > _SAME * largest * size:
            got = "a free motion of the platform along which K changes"
            hint = "the posture follows from higher orders of the load: ask rs.equilibrium"
        else:
            continue
        raise InputError(
            f"stiffness of {name!r} to first order in the load",
            got=got,
            expected="a posture that the load decides",
            hint=hint,
        )


def _rate(
    K: np.ndarray, B: np.ndarray, shapes: Sequence[BeamInLeg], t: Sequence[Any], W: Sequence[Any]
) -> np.ndarray:
    """K_1 of a leg that deflects by t and carries W (n, n)."""
    n = len(K)
    found = zeros(n, n)
    by_load = zeros(n, n)
    for i in range(n):
        D = [dot(B[row, i], t) for row in range(n)]
        by_load[:, i] = [dot(K[row], D) for row in range(n)]
    for i in range(n):
        for j in range(n):
            found[i, j] = 0 - dot(W, B[:, i, j]) - by_load[i, j] - by_load[j, i]
    for shape in shapes:
        found = found + shape.curvature(t)
    return found
