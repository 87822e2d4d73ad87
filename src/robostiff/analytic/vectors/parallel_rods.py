"""Rods in parallel on one slide: a force through their middle, and couples that turn it.

Rods of one direction u and one compliance c_r end at r_m + r_j, where the r_j sum to zero. Their
stiffness is that of a rod at r_m which meets c_r / n, and a couple [0; r_j x u] for each of them;
couples do no work on the slide, so that only the force meets the compliance of its drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.springs.contributions import summed
from robostiff.analytic.springs.leg_springs import LegReader
from robostiff.analytic.springs.unit_wrenches import UnitWrench
from robostiff.analytic.vectors.vector_rods import Bar, Carrier, are_along, ends_of, in_the_platform
from robostiff.model import PlacedSpring
from robostiff.recorded.leg import at_samples as sampled


@dataclass(frozen=True, eq=False)
class ParallelRods:
    """The rods of a leg."""

    mean: UnitWrench  # the force through their middle
    compliance: Any  # that it meets
    # name and (3,): from the middle to the end of a rod, in the platform's axes; none of one rod
    arms: tuple[tuple[str, Any], ...]
    of_rod: Any  # compliance of a rod


def cluster_of(
    placed: PlacedRobot, number: int, rod: Bar, reader: LegReader
) -> ParallelRods | None:
    """The parallel rods of a leg on a slide; None where it is another leg."""
    own, count = placed.legs[number].leg, placed.record.count
    branches = own.blocks[0].branches if own.blocks else (own,)
    beside = own.blocks and any(isinstance(x, PlacedSpring) for x in own.elements)
    middle = ends_of(own)
    if rod.carrier is not Carrier.SLIDE or beside or middle is None:
        return None
    forces: list[UnitWrench] = []
    for branch in branches:
        basis = reader.search.basis(branch)
        found = () if basis is None else basis.wrenches
        if len(found) != 1 or found[0].point is None:
            return None
        if not are_along(sampled(found[0].direction, count), rod.unit):
            return None
        forces.append(found[0])
    mean, contributions = UnitWrench(forces[0].direction, middle[1]), reader.contributions.of
    if len(branches) == 1:
        return ParallelRods(mean, summed(contributions(own, mean, mean)), (), None)
    each = {summed(contributions(b, f, f)) for b, f in zip(branches, forces, strict=True)}
    if len(each) > 1:
        return None
    (of_rod,) = each
    # Each rod takes the same share of a force through their middle.
    met = summed(contributions(own.without_blocks, mean, mean)) + of_rod / len(branches)
    ends = [ends_of(branch) for branch in branches]
    arms = [in_the_platform(placed, end[1] - middle[1]) for end in ends if end is not None]
    labels = [f"{own.name}, {branch.name.split('/')[-1]}" for branch in branches]
    return ParallelRods(mean, met, tuple(zip(labels, arms, strict=True)), of_rod)


def rods_of(clusters: Sequence[ParallelRods]) -> tuple[tuple[int, str, Any], ...] | None:
    """All rods that are not alone, with the numbers of their legs; None where rods differ."""
    if len({x.of_rod for x in clusters if x.arms}) != 1:
        return None
    return tuple((i, *arm) for i, x in enumerate(clusters) for arm in x.arms)
