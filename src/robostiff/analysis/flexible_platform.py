"""Legs on a flexible platform: its compliance about the point of the result."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.elastostatics import (
    CartesianStiffness,
    Form,
    Tolerance,
    WrenchBasis,
    couple_legs,
    scaling,
)
from robostiff.model import PlacedPlatform, Snapshot
from robostiff.network.condensation import PlatformFlexibility, platform_flexibility
from robostiff.spatial import Space, block_rotation, twist_transport


def legs_on_platform(
    placed: PlacedPlatform,
    legs: tuple[CartesianStiffness, ...],
    compliances: Sequence[np.ndarray],
    alone: np.ndarray | None,
    origin: np.ndarray,
    method: Form,
) -> tuple[CartesianStiffness, tuple[CartesianStiffness, ...], np.ndarray | None, list[str]]:
    """Stiffness of the tool, that of each leg, compliance without an inverse, and names.

    Legs are given by themselves about `origin`, with their compliances there, joints held; `alone`
    is the compliance of a single leg without passive joints. What each leg carries is as in
    `CoupledLegs`. The compliance is that of the tool, for a leg alone on a platform without motions
    of its own; names are those of motions of the platform itself, the last columns of
    ``whole.redundant``.

    The wrench basis form takes the compliance of each leg as it is, so that legs may be rigid; the
    others give a stiffness, which is inverted on the transmitted wrenches.
    """
    tolerance, space = legs[0].tolerance, legs[0].space
    nodes, flexibility = _flexibility(placed, space, tolerance)
    to_nodes = _to_nodes(placed, origin, space)
    s = scaling(legs[0].length, space)
    wrenches = [T @ (s[..., :, None] * leg.held) for T, leg in zip(to_nodes, legs, strict=True)]
    C, N = flexibility.compliance, flexibility.motions
    n = space.size
    where = [slice(n * nodes.index(name), n * nodes.index(name) + n) for name in placed.holds]
    p = [
        [np.swapaxes(F, -1, -2) @ C[a, b] @ G for b, G in zip(where, wrenches, strict=True)]
        for a, F in zip(where, wrenches, strict=True)
    ]
    size = np.linalg.norm(N * np.tile(s, len(nodes))[..., None], axis=-2, keepdims=True)
    N = N / np.where(size > 0, size, 1.0)
    work = [np.swapaxes(F, -1, -2) @ N[..., a, :] for a, F in zip(where, wrenches, strict=True)]
    own = [
        np.swapaxes(leg.held, -1, -2) @ (leg_C * s[..., :, None] * s[..., None, :]) @ leg.held
        if isinstance(method, WrenchBasis)
        else _met_by_stiffness(leg)
        for leg, leg_C in zip(legs, compliances, strict=True)
    ]
    coupled = couple_legs(legs, own, np.block(p), np.concatenate(work, axis=-2))
    compliance = None
    if alone is not None and N.shape[-1] == 0:
        T = to_nodes[0]
        compliance = alone + np.swapaxes(T, -1, -2) @ C @ T
    names = [f"platform/{name}" for name in flexibility.motion_names]
    return coupled.whole, coupled.legs, compliance, names


def platform_energies(
    snapshot: Snapshot,
    leg_wrenches: Sequence[np.ndarray],
    origin: np.ndarray,
    tolerance: Tolerance,
) -> list[tuple[str, str, float]]:
    """Elastic energy of each part of a flexible platform, at one pose: leg, part, energy [J].

    By what each leg carries (n,) about `origin`, world axes. A rigid platform has no such parts.
    """
    placed = snapshot.platform
    if placed is None:
        return []
    nodes, flexibility = _flexibility(placed, snapshot.space, tolerance)
    to_nodes = _to_nodes(placed, origin, snapshot.space)
    F = np.zeros((len(nodes), snapshot.space.size))
    for name, T, wrench in zip(placed.holds, to_nodes, leg_wrenches, strict=True):
        F[nodes.index(name)] += T @ wrench
    return [
        ("platform", name, 0.5 * float(F.ravel() @ E @ F.ravel()))
        for name, E in flexibility.part_compliances.items()
        if np.any(E)
    ]


def _flexibility(
    placed: PlacedPlatform, space: Space, tolerance: Tolerance
) -> tuple[list[str], PlatformFlexibility]:
    nodes = list(dict.fromkeys(placed.holds))
    return nodes, platform_flexibility(placed.platform, nodes, space, tolerance)


def _to_nodes(placed: PlacedPlatform, origin: np.ndarray, space: Space) -> list[np.ndarray]:
    """From a wrench about `origin` in world axes to that about each leg's node in platform axes."""
    rows = list(space.rows)
    R = np.swapaxes(block_rotation(placed.rotation), -1, -2)[..., rows, :][..., :, rows]
    matrices = []
    for name in placed.holds:
        v = (placed.in_world(placed.platform.point_of(name)) - origin)[..., : space.translations]
        matrices.append(R @ np.swapaxes(twist_transport(-v), -1, -2))
    return matrices


def _met_by_stiffness(leg: CartesianStiffness) -> np.ndarray:
    """Inverse of the stiffness between transmitted wrenches; the identity where there is none."""
    s = scaling(leg.length, leg.space)
    W = leg.held
    k = np.swapaxes(W, -1, -2) @ (leg.matrix / (s[..., :, None] * s[..., None, :])) @ W
    idle = ~np.any(W != 0, axis=-2) | ~leg.answered[..., None]
    k = np.where(idle[..., None] | idle[..., None, :], 0.0, k)
    return np.linalg.inv(k + idle[..., None] * np.eye(W.shape[-1]))
