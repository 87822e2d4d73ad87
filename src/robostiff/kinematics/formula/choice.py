"""Which of the two ways of aiming two axes matters to the stiffness of a leg."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.kinematics.closure.skeleton import Cluster
from robostiff.kinematics.formula.half_turn import half_turn_matters, has_springs
from robostiff.kinematics.formula.tidy import ROUNDING
from robostiff.model import Actuated, Chain, Passive


@dataclass(frozen=True)
class Choice:
    """Whether the way of aiming must be recorded; where not, either way gives the same stiffness.

    A second axis b across the rod and across its fixed neighbour has two ways, b and -b, which
    differ by a half turn of the rod about itself. A rod of straight prismatic beams is the same
    after it.

    Attributes
    ----------
    first, second : bool
        Of the joint at the near and the far end of the rod.
    spin : bool
        Whether the turn about itself matters of a rod between two spherical joints.
    """

    first: bool
    second: bool
    spin: bool


def choice_of(chain: Chain, A: Cluster, B: Cluster, along: np.ndarray, spin: int | None) -> Choice:
    """What must be chosen to place a rod.

    Parameters
    ----------
    chain : Chain
        Of floats; places of coordinates are those of its main path. Where it has parallel blocks
        everything is chosen: a half turn moves their other branches.
    A, B : Cluster
        Joints at the ends of the rod.
    along : (3,) array
        Unit vector from A to B at zero coordinates.
    spin : int or None
        Place of a turn about the rod itself.
    """
    turned_by_far = spin is not None or A.is_ball
    if chain.has_blocks:
        return Choice(_has_two_ways(A), turned_by_far and _has_two_ways(B), spin=True)
    far = (A.places[-1] if spin is None else spin) + 1, B.places[0]
    near = A.places[-1] + 1, B.places[0] if spin is None else spin
    second = (
        turned_by_far
        and _has_two_ways(B)
        and (
            not _across(B.axes[0], along, B.axes[1])
            or half_turn_matters(chain, far, A.point, along)
            or _is_told(chain, B)
        )
    )
    first = _has_two_ways(A) and (
        not _across(A.axes[1], along, A.axes[0])
        or not (turned_by_far or B.is_ball or _across(B.axes[0], along))
        or half_turn_matters(chain, near, A.point, along)
        or _is_told(chain, A)
        or second  # its ways are told apart by the turn that the first joint gives the rod
    )
    return Choice(first, second, spin=not _are_passive(chain, A, B))


def _has_two_ways(cluster: Cluster) -> bool:
    return not cluster.is_ball and len(cluster.axes) == 2


def _across(b: np.ndarray, *others: np.ndarray) -> bool:
    return all(abs(float(b @ other)) <= ROUNDING for other in others)


def _are_passive(chain: Chain, *clusters: Cluster) -> bool:
    roles = chain.roles
    return all(isinstance(roles[place], Passive) for c in clusters for place in c.places)


def _is_told(chain: Chain, cluster: Cluster) -> bool:
    """Whether the angles themselves matter, or something elastic between the two axes."""
    if cluster.places[1] != cluster.places[0] + 1:
        return True
    roles = (chain.roles[place] for place in cluster.places)
    limited = any(isinstance(role, Actuated) and role.limits is not None for role in roles)
    return limited or has_springs(chain, cluster.places[1])
