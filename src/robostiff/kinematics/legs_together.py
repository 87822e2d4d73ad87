"""Placed legs that are alike as one: at a few poses they are computed together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.model import (
    Actuated,
    PlacedBlock,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    StiffnessLaw,
)

_Thing = TypeVar("_Thing")

#: Up to so many poses, what is alike is computed together: more fill arrays by themselves.
FEW = 32
# Of drives of several stiffnesses: the coordinate is the stiffness.
_GIVEN = Actuated(StiffnessLaw((1.0, 0.0)))


@dataclass(frozen=True)
class LegsTogether:
    """Legs that are alike."""

    places: tuple[int, ...]  # their numbers
    leg: PlacedLeg  # of several legs with arrays (legs, ..., 3), the masses left out

    def each(self, values: np.ndarray) -> np.ndarray:
        """Values that are alike for the legs, with the axes of its arrays."""
        if len(self.places) == 1:
            return values
        return np.broadcast_to(values, (len(self.places), *values.shape))


def in_order(together: Sequence[LegsTogether], found: Sequence[Any]) -> list[Any]:
    """What was found for each group, leg by leg."""
    by_leg = {}
    for own, values in zip(together, found, strict=True):
        several = len(own.places) > 1
        by_leg |= {i: values[k] if several else values for k, i in enumerate(own.places)}
    return [by_leg[i] for i in range(len(by_leg))]


def legs_together(legs: Sequence[PlacedLeg], batch: tuple[int, ...]) -> list[LegsTogether]:
    """Legs at poses of a batch, in groups of those that differ in their places alone."""
    if len(legs) == 1 or np.prod(batch, dtype=int) > FEW:
        return legs_alone(legs)
    groups = in_groups(legs, lambda one, other: _are_alike(one.elements, other.elements))
    return [LegsTogether(own, _as_one([legs[i] for i in own], len(batch))) for own in groups]


def in_groups(
    things: Sequence[_Thing], alike: Callable[[_Thing, _Thing], bool]
) -> list[tuple[int, ...]]:
    """Numbers of things that are alike, together."""
    groups: list[list[int]] = []
    for i, thing in enumerate(things):
        own = next((group for group in groups if alike(things[group[0]], thing)), None)
        if own is None:
            groups.append([i])
        else:
            own.append(i)
    return [tuple(group) for group in groups]


def legs_alone(legs: Sequence[PlacedLeg]) -> list[LegsTogether]:
    """Every leg for itself."""
    return [LegsTogether((i,), leg) for i, leg in enumerate(legs)]


def _are_alike(one: Sequence[Any], other: Sequence[Any]) -> bool:
    """Whether elements have equal names, kinds and sizes, one by one."""
    return len(one) == len(other) and all(map(_is_alike, one, other))


def _is_alike(one: Any, other: Any) -> bool:
    if type(one) is not type(other) or one.name != other.name:
        return False
    if isinstance(one, PlacedBlock):
        own, others = one.branches, other.branches
        return len(own) == len(others) and all(
            a.name == b.name and _are_alike(a.elements, b.elements)
            for a, b in zip(own, others, strict=True)
        )
    if isinstance(one, PlacedSpring):
        own, others = one.elasticity, other.elasticity
        return own is others or (
            np.array_equal(own.freedoms, others.freedoms)
            and own.compliance.shape == others.compliance.shape
            and (own.compliance.ndim > 2 or np.array_equal(own.compliance, others.compliance))
        )
    # Of coupled joints each has those that it moves.
    if type(one) is not PlacedFreedom or one.pitch != other.pitch:
        return False
    return one.role == other.role or (_is_spring(one) and _is_spring(other))


def _is_spring(freedom: PlacedFreedom) -> bool:
    """Whether it has one stiffness at all poses."""
    return isinstance(freedom.stiffness, float)


def _as_one(legs: Sequence[PlacedLeg], axes: int) -> PlacedLeg:
    first = legs[0]
    if len(legs) == 1:
        return first
    elements = zip(*(leg.elements for leg in legs), strict=True)
    return PlacedLeg(
        first.name,
        tuple(_one_element(alike, axes) for alike in elements),
        beside([leg.end for leg in legs], axes, 1),
    )


def _one_element(alike: Sequence[Any], axes: int) -> Any:
    first = alike[0]
    if isinstance(first, PlacedBlock):
        branches = zip(*(block.branches for block in alike), strict=True)
        return PlacedBlock(first.name, tuple(_as_one(own, axes) for own in branches))
    point = beside([e.point for e in alike], axes, 1)
    if isinstance(first, PlacedSpring):
        rotation, own = beside([e.rotation for e in alike], axes, 2), first.elasticity
        if own.compliance.ndim > 2:
            every = beside([e.elasticity.compliance for e in alike], axes, 2)
            own = Elasticity(every, own.freedoms)
        return PlacedSpring(first.name, point, rotation, own)
    role, x = first.role, first.coordinate
    if x is not None:
        x = beside([np.asarray(e.coordinate) for e in alike], axes, 0)
    elif any(e.role != role for e in alike):
        role, x = _GIVEN, beside([np.array(e.stiffness) for e in alike], axes, 0)
    axis = beside([e.axis for e in alike], axes, 1)
    return PlacedFreedom(axis, point, first.pitch, first.name, role, x)


def beside(arrays: Sequence[np.ndarray], axes: int, own: int) -> np.ndarray:
    """Arrays (..., *own) along a new first axis, with as many axes of poses between."""
    if len({a.shape for a in arrays}) > 1:
        arrays = list(np.broadcast_arrays(*arrays))
    stack = np.array(arrays) if len(arrays) > 1 else arrays[0][None]
    missing = axes + own + 1 - stack.ndim
    return stack.reshape(len(stack), *(1,) * missing, *stack.shape[1:]) if missing else stack
