"""Jacobian J_q of a placed leg at any point, its compliance, and loads of its springs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.model import (
    Actuated,
    PlacedBlock,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    StiffnessLaw,
)
from robostiff.spatial import block_rotation, twist_transport
from robostiff.spatial.batch import (
    Float,
    empty_batch,
    matrix_of_columns,
    poses_side_by_side,
    product,
    transpose,
)
from robostiff.spatial.screw import twists_of_screws


def freedom_twists(
    freedoms: Iterable[PlacedFreedom], at: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 6 q"]:
    """Columns (17) of several joints about the point `at`, world axes (..., 6, q)."""
    every = list(freedoms)
    if not every or any(type(one) is not PlacedFreedom for one in every):
        return _columns([one.twist(at) for one in every], at)
    shapes = {own.shape[:-1] for one in every for own in (one.axis, one.point)}
    batch = np.broadcast_shapes(at.shape[:-1], *shapes)
    e = matrix_of_columns([one.axis for one in every], batch, 3)
    r = at[..., None] - matrix_of_columns([one.point for one in every], batch, 3)
    return twists_of_screws(e, r, [one.pitch for one in every])


def passive_jacobian(
    leg: PlacedLeg, at: Float[np.ndarray, "*batch 3"]
) -> tuple[Float[np.ndarray, "*batch 6 q"], tuple[str, ...]]:
    """J_q of a leg about the point `at`, and the names of its columns.

    Parameters
    ----------
    leg : PlacedLeg
    at : (..., 3) array
        Point whose twist is given [m].

    Returns
    -------
    J_q : (..., 6, q) array
        World axes. Freedoms of a singular spring count as passive joints.
    names : tuple of str
    """
    elements = list(_plain(leg))
    if all(isinstance(e, PlacedFreedom) or not e.elasticity.freedoms.size for e in elements):
        joints = [e for e in elements if isinstance(e, PlacedFreedom) and e.is_passive]
        return freedom_twists(joints, at), tuple(e.name for e in joints)
    columns, names = [], []
    for element in elements:
        if isinstance(element, PlacedFreedom):
            if element.is_passive:
                columns.append(element.twist(at))
                names.append(element.name)
        else:
            J = product(twist_transport(at - element.point), block_rotation(element.rotation))
            for i, freedom in enumerate(element.elasticity.freedoms.T):
                columns.append(np.einsum("...ij,j->...i", J, freedom))
                names.append(f"{element.name}.free[{i}]")
    return _columns(columns, at), tuple(names)


def leg_compliance(
    leg: PlacedLeg, at: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 6 6"]:
    """Compliance of a leg with its passive joints held, C = J_theta K_theta^-1 J_theta^T.

    Each elastic part contributes its own compliance, turned to world axes and moved to the point;
    each elastic joint one column over its stiffness.

    Parameters
    ----------
    leg : PlacedLeg
    at : (..., 3) array
        Point whose twist is given [m].

    Returns
    -------
    (..., 6, 6) array
        World axes [m/N, 1/N, rad/(N m)].
    """
    # Integers: a zero that is a float would make formulas inexact.
    C = np.zeros((6, 6), dtype=int)
    elements = list(_plain(leg))
    drives = [e for e in elements if isinstance(e, PlacedFreedom) and e.stiffness is not None]
    for element in elements:
        if isinstance(element, PlacedSpring):
            C = C + spring_compliance(element, at)
    if drives:
        J = freedom_twists(drives, at)
        softer = J.copy()
        for i, drive in enumerate(drives):
            k = drive.stiffness
            softer[..., i] /= k[..., None] if isinstance(k, np.ndarray) else k
        C = C + product(J, transpose(softer))
    return np.broadcast_to(C, (*at.shape[:-1], 6, 6)) if C.ndim < at.ndim + 1 else C


def spring_compliance(
    spring: PlacedSpring, at: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 6 6"]:
    """Compliance that one elastic part gives to the point `at` (..., 6, 6), J C J^T in world axes.

    J = J_v diag(R, R) leads from its far end and its own axes to that point.
    """
    J = product(twist_transport(at - spring.point), block_rotation(spring.rotation))
    return product(product(J, spring.elasticity.compliance), transpose(J))


def _plain(leg: PlacedLeg) -> Iterator[PlacedFreedom | PlacedSpring]:
    for element in leg.elements:
        if isinstance(element, PlacedBlock):
            raise InputError(
                f"leg {leg.name!r}",
                got=Words(f"the parallel block {element.name!r}"),
                expected="joints and springs in series",
                hint="write stiffness(robot) or derive(robot), which support blocks",
            )
        yield element


def _columns(columns: list[np.ndarray], at: np.ndarray) -> np.ndarray:
    if not columns:
        return np.zeros((*at.shape[:-1], 6, 0))
    batch = np.broadcast_shapes(at.shape[:-1], *(c.shape[:-1] for c in columns))
    return matrix_of_columns(columns, batch, 6)


def spring_loads(
    leg: PlacedLeg,
    at: Float[np.ndarray, "*batch 3"],
    wrenches: Float[np.ndarray, "*batch 6 m"],
    length: Float[np.ndarray, "*batch"],
) -> tuple[Float[np.ndarray, "*batch p m"], Float[np.ndarray, "*batch p"]]:
    """Rows and sizes with the energy ``sum of (size row . f)^2 / 2`` under the wrenches W f.

    Each wrench is moved to the spring and turned to its axes before anything is summed, so that an
    axial force has all its digits in a beam that bends a million times more easily.

    Parameters
    ----------
    leg : PlacedLeg
        Without parallel blocks.
    at : (..., 3) array
        Point about which the wrenches are given [m].
    wrenches : (..., 6, m) array
        World axes.
    length : (...) array
        Characteristic length [m]: a unit twist turns by 1 / length.

    Returns
    -------
    rows : (..., p, m) array
        Part of each wrench along a unit twist of each spring; an elastic part has six of them.
    sizes : (..., p) array
        Root of the compliance along it.
    """
    rows, sizes = [np.zeros((0, wrenches.shape[-1]))], [np.zeros(0)]
    springs = [e for e in leg.elements if isinstance(e, PlacedSpring)]
    drives = [e for e in leg.elements if isinstance(e, PlacedFreedom) and e.stiffness is not None]
    few = math.prod(wrenches.shape[:-2]) <= FEW
    kinds: list[tuple[Any, list[Any]]] = [(_loads_of_springs, springs), (_loads_of_drives, drives)]
    for loads_of, elements in kinds:
        # At many poses one by one: together, they would fill more memory.
        groups = [elements] if few else [[one] for one in elements]
        for together in filter(None, groups):
            own, size = loads_of(together, at, wrenches, length)
            rows += list(own)
            sizes += list(np.broadcast_to(size, own.shape[:-1]) if few else size)
    batch = np.broadcast_shapes(wrenches.shape[:-2], *(own.shape[:-2] for own in rows))
    rows, sizes = (
        np.concatenate([np.broadcast_to(x, (*batch, *x.shape[axis:])) for x in own], axis=axis)
        for own, axis in ((rows, -2), (sizes, -1))
    )
    return poses_side_by_side(rows, 2), poses_side_by_side(sizes, 1)


def _loads_of_springs(
    springs: Sequence[PlacedSpring], at: np.ndarray, wrenches: np.ndarray, length: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    axes = wrenches.ndim - 2
    modes = beside([spring.elasticity.modes for spring in springs], axes, 2)
    modes = modes[..., np.any(modes != 0, axis=tuple(range(modes.ndim - 1)))]
    unit, size = _unit(modes, length)
    F, M = _moved(wrenches, beside([spring.point for spring in springs], axes, 1) - at)
    to_own = transpose(beside([spring.rotation for spring in springs], axes, 2))
    return _along(unit, product(to_own, F), product(to_own, M)), size


def _loads_of_drives(
    drives: Sequence[PlacedFreedom], at: np.ndarray, wrenches: np.ndarray, length: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    axes = wrenches.ndim - 2
    twists = beside([drive.twist(drive.point) for drive in drives], axes, 1)
    unit, size = _unit(twists[..., None], length)
    softness = [1.0 / np.sqrt(np.asarray(drive.stiffness, dtype=float)) for drive in drives]
    v = beside([drive.point for drive in drives], axes, 1) - at
    return _along(unit, *_moved(wrenches, v)), size * beside(softness, axes, 0)[..., None]


def _unit(twists: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Twists (..., 6, k) of unit size, turns weighed by the length, and their sizes (..., k)."""
    shift, turn = twists[..., :3, :], twists[..., 3:, :]
    size = np.sqrt(
        np.einsum("...ik,...ik->...k", shift, shift)
        + length[..., None] ** 2 * np.einsum("...ik,...ik->...k", turn, turn)
    )
    return twists / np.where(size > 0, size, 1.0)[..., None, :], size


def _along(unit: np.ndarray, F: np.ndarray, M: np.ndarray) -> np.ndarray:
    unit = transpose(unit)
    return product(unit[..., :3], F) + product(unit[..., 3:], M)


def _moved(wrenches: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Forces, and moments about a point that lies at v (..., 3, m)."""
    F, M = wrenches[..., :3, :], wrenches[..., 3:, :]
    x, y, z = (v[..., None, i] for i in range(3))
    moved = empty_batch(np.broadcast_shapes(M.shape[:-2], v.shape[:-1]), M.shape[-2:])
    moved[..., 0, :] = M[..., 0, :] - (y * F[..., 2, :] - z * F[..., 1, :])
    moved[..., 1, :] = M[..., 1, :] - (z * F[..., 0, :] - x * F[..., 2, :])
    moved[..., 2, :] = M[..., 2, :] - (x * F[..., 1, :] - y * F[..., 0, :])
    return F, moved


_Thing = TypeVar("_Thing")

#: Up to so many poses, what is alike is computed together: more fill arrays by themselves.
FEW = 32
# Of drives of several stiffnesses: the coordinate is the stiffness.
_GIVEN = Actuated(StiffnessLaw((1.0, 0.0)))


@frozen
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
            groups.append(own := [])
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
    # Of springs that differ, each has one stiffness at all poses.
    return one.role == other.role or all(isinstance(x.stiffness, float) for x in (one, other))


def _as_one(legs: Sequence[PlacedLeg], axes: int) -> PlacedLeg:
    first = legs[0]
    if len(legs) == 1:
        return first
    each = zip(*(leg.elements for leg in legs), strict=True)
    elements = tuple(_one_element(alike, axes) for alike in each)
    return PlacedLeg(first.name, elements, beside([leg.end for leg in legs], axes, 1))


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
