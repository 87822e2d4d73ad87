"""Loads of every spring of a leg under wrenches, each at its own point and in its own axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.kinematics.jacobians import freedom_twist
from robostiff.kinematics.legs_together import FEW, beside
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.spatial.batch import empty_batch, product, transposed
from robostiff.spatial.shapes import Float


def felt_by_springs(
    leg: PlacedLeg,
    at: Float[np.ndarray, "*batch 3"],
    wrenches: Float[np.ndarray, "*batch 6 m"],
    length: Float[np.ndarray, "*batch"],
) -> tuple[Float[np.ndarray, "*batch p m"], Float[np.ndarray, "*batch p"]]:
    """Rows and sizes with the energy ``sum of (size row . f)^2 / 2`` under the wrenches W f.

    Each wrench is moved to the spring and turned to its axes before anything is summed, so that an
    axial force is felt to all digits by a beam that bends a million times more easily.

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
    kinds: list[tuple[Any, list[Any]]] = [(_felt_by_springs, springs), (_felt_by_drives, drives)]
    for felt, elements in kinds:
        # At many poses one by one: together, they would fill more memory.
        groups = [elements] if few else [[one] for one in elements]
        for together in filter(None, groups):
            own, size = felt(together, at, wrenches, length)
            rows += list(own)
            sizes += list(np.broadcast_to(size, own.shape[:-1]) if few else size)
    batch = np.broadcast_shapes(wrenches.shape[:-2], *(own.shape[:-2] for own in rows))
    return _stacked(rows, batch, -2), _stacked(sizes, batch, -1)


def _felt_by_springs(
    springs: Sequence[PlacedSpring], at: np.ndarray, wrenches: np.ndarray, length: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    axes = wrenches.ndim - 2
    modes = beside([spring.elasticity.modes for spring in springs], axes, 2)
    modes = modes[..., np.any(modes != 0, axis=tuple(range(modes.ndim - 1)))]
    unit, size = _unit(modes, length)
    F, M = _moved(wrenches, beside([spring.point for spring in springs], axes, 1) - at)
    to_own = transposed(beside([spring.rotation for spring in springs], axes, 2))
    return _along(unit, product(to_own, F), product(to_own, M)), size


def _felt_by_drives(
    drives: Sequence[PlacedFreedom], at: np.ndarray, wrenches: np.ndarray, length: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    axes = wrenches.ndim - 2
    twists = beside([freedom_twist(drive, drive.point) for drive in drives], axes, 1)
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
    unit = transposed(unit)
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


def _stacked(parts: list[np.ndarray], batch: tuple[int, ...], axis: int) -> np.ndarray:
    """Parts beside one another along an axis from the end, poses side by side."""
    shape = list(parts[0].shape[axis:])
    shape[0] = sum(part.shape[axis] for part in parts)
    stack, start = empty_batch(batch, tuple(shape)), 0
    for part in parts:
        stop = start + part.shape[axis]
        if axis == -2:
            stack[..., start:stop, :] = part
        else:
            stack[..., start:stop] = part
        start = stop
    return stack
