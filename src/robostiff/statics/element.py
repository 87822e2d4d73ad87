"""Elements of a chain in finite motion: how they move, and the energy that they store.

Each holds one element of several legs alike: a leading axis N counts the legs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.statics.finite_turn import turn_and_rates, turns


@dataclass(frozen=True)
class Placement:
    """A body that has moved: a point X of the unloaded posture is now at ``R X + t``."""

    R: np.ndarray
    t: np.ndarray

    def of(self, point: np.ndarray) -> np.ndarray:
        """Where points (N, 3) of the body are now [m]."""
        return np.einsum("nij,nj->ni", self.R, point) + self.t


@dataclass(frozen=True)
class Columns:
    """Velocities of the body behind an element, by each of its coordinates.

    Attributes
    ----------
    v : (N, 3, m) array
        Velocity of the point C.
    w : (N, 3, m) array
        Angular velocity.
    C : (N, 3) array
        Point of the body [m].
    rates, turning : (N, 3, 3, 3) and (N, 3, m) arrays, or None
        Derivative of w by rotation vectors, which are ``turning`` times the coordinates; None
        where w does not depend on the element's own coordinates.
    """

    v: np.ndarray
    w: np.ndarray
    C: np.ndarray
    rates: np.ndarray | None = None
    turning: np.ndarray | None = None


@dataclass(frozen=True)
class Energy:
    """Energy of an element (N,) [J], its gradient (N, m) and its curvature (N, m, m)."""

    value: np.ndarray
    gradient: np.ndarray
    curvature: np.ndarray


@dataclass(frozen=True)
class FiniteJoint:
    """A joint that moves by q along its screw; energy ``k q^2 / 2 - f q``.

    Attributes
    ----------
    names : tuple of str
    point, axis : (N, 3) arrays
        In the world, at the unloaded posture [m].
    turns : bool
        Whether it turns by q about its axis.
    slide : (N,) array
        How far it slides along its axis for each unit of q: the pitch where it turns, otherwise 1.
    stiffness : (N,) array
        k of its drive or lock, 0 where it is passive [N/m or N m/rad].
    preload : (N,) array
        f, with which its drive pushes along its coordinate at q = 0 [N or N m].
    """

    names: tuple[str, ...]
    point: np.ndarray
    axis: np.ndarray
    turns: bool
    slide: np.ndarray
    stiffness: np.ndarray
    preload: np.ndarray

    size = 1

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return ("joint", self.turns)

    @staticmethod
    def stacked(joints: Sequence[FiniteJoint]) -> FiniteJoint:
        """The same joint of several legs as one element."""
        return FiniteJoint(
            tuple(name for e in joints for name in e.names),
            np.concatenate([e.point for e in joints]),
            np.concatenate([e.axis for e in joints]),
            joints[0].turns,
            np.concatenate([e.slide for e in joints]),
            np.concatenate([e.stiffness for e in joints]),
            np.concatenate([e.preload for e in joints]),
        )

    def sizes(self, length: float) -> np.ndarray:
        """What a unit of its coordinate turns or shifts (N, 1), shifts by the robot's length."""
        return np.full((len(self.point), 1), 1.0 if self.turns else 1.0 / length)

    @property
    def unloaded_curvature(self) -> np.ndarray:
        """Curvature of its energy at the unloaded posture (N, 1, 1)."""
        return self.stiffness[:, None, None]

    def step(self, q: np.ndarray, before: Placement) -> tuple[Columns, Placement]:
        """Velocities of the body behind it, and where that is."""
        a = np.einsum("nij,nj->ni", before.R, self.axis)
        C = before.of(self.point)
        v = a * self.slide[:, None]
        if not self.turns:
            after = Placement(before.R, before.t + v * q)
            return Columns(v[..., None], np.zeros((len(a), 3, 1)), C), after
        Q = turns(self.axis, q[:, 0])
        R = before.R @ Q
        after = Placement(R, C + v * q - np.einsum("nij,nj->ni", R, self.point))
        return Columns(v[..., None], a[..., None], C), after

    def energy(self, q: np.ndarray, share: float) -> Energy:
        """Energy at coordinates (N, 1), with this share of the preload."""
        k, f = self.stiffness, share * self.preload
        value = 0.5 * k * q[:, 0] ** 2 - f * q[:, 0]
        return Energy(value, (k * q[:, 0] - f)[:, None], k[:, None, None])

    def by_share(self) -> np.ndarray:
        """Derivative of the gradient by the share of the preload (N, 1)."""
        return -self.preload[:, None]


@dataclass(frozen=True)
class BeamShape:
    """What axial load does to a beam between its ends.

    Attributes
    ----------
    axial : (N,) array
        EA/L [N/m].
    G : (N, 6, 6) array
        ``th^T G th`` is twice the shortening of the beam by bending [1/m, 1, m].
    """

    axial: np.ndarray
    G: np.ndarray


@dataclass(frozen=True)
class FiniteSpring:
    """An elastic part: its far end is displaced by d and turned by the rotation vector r.

    ``th = (d, r) = V y`` in its own axes; energy ``sum(k y^2) / 2`` with ``k`` 1, or 0 along
    freedoms, so that ``V V^T`` is its compliance; a beam has its bowing besides.

    Attributes
    ----------
    names : tuple of str
    point : (N, 3) array
        Its far end at the unloaded posture [m].
    rotation : (N, 3, 3) array
        Columns: its own axes.
    modes : (N, 6, m) array
        V.
    stiffness : (N, m) array
        k.
    bowing : BeamShape or None
    """

    names: tuple[str, ...]
    point: np.ndarray
    rotation: np.ndarray
    modes: np.ndarray
    stiffness: np.ndarray
    bowing: BeamShape | None = None

    @property
    def size(self) -> int:
        """Number of coordinates m."""
        return self.modes.shape[-1]

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return ("spring", self.size, self.bowing is None)

    @staticmethod
    def stacked(springs: Sequence[FiniteSpring]) -> FiniteSpring:
        """The same elastic part of several legs as one element."""
        shapes = [e.bowing for e in springs if e.bowing is not None]
        return FiniteSpring(
            tuple(name for e in springs for name in e.names),
            np.concatenate([e.point for e in springs]),
            np.concatenate([e.rotation for e in springs]),
            np.concatenate([e.modes for e in springs]),
            np.concatenate([e.stiffness for e in springs]),
            BeamShape(
                np.concatenate([shape.axial for shape in shapes]),
                np.concatenate([shape.G for shape in shapes]),
            )
            if shapes
            else None,
        )

    def sizes(self, length: float) -> np.ndarray:
        """What a unit of each coordinate turns or shifts (N, m), shifts by the robot's length."""
        V = np.abs(self.modes)
        return np.maximum(V[:, :3].max(1) / length, V[:, 3:].max(1))

    @property
    def unloaded_curvature(self) -> np.ndarray:
        """Curvature of its energy at the unloaded posture (N, m, m)."""
        return self.stiffness[:, :, None] * np.eye(self.size)

    def step(self, y: np.ndarray, before: Placement) -> tuple[Columns, Placement]:
        """Velocities of the body behind it, and where that is."""
        th = np.einsum("nij,nj->ni", self.modes, y)
        E, W, D = turn_and_rates(th[:, 3:])
        A = before.R @ self.rotation
        C = before.of(self.point) + np.einsum("nij,nj->ni", A, th[:, :3])
        turning = self.modes[:, 3:]
        rates = np.einsum("nij,njkb->nikb", A, D)
        R = A @ E @ np.swapaxes(self.rotation, -1, -2)
        after = Placement(R, C - np.einsum("nij,nj->ni", R, self.point))
        return Columns(A @ self.modes[:, :3], A @ W @ turning, C, rates, turning), after

    def energy(self, y: np.ndarray, share: float) -> Energy:
        """Energy at coordinates (N, m)."""
        ky = self.stiffness * y
        value = 0.5 * np.einsum("ni,ni->n", ky, y)
        if self.bowing is None:
            return Energy(value, ky, self.unloaded_curvature)
        k, G = self.bowing.axial, self.bowing.G
        V = self.modes
        th = np.einsum("nij,nj->ni", V, y)
        Gth = np.einsum("nij,nj->ni", G, th)
        u = th[:, 0]
        half = 0.5 * np.einsum("ni,ni->n", th, Gth)
        stretched = u + half
        direction = Gth.copy()
        direction[:, 0] += 1.0
        # k/2 ((u + half)^2 - u^2), without the difference of large numbers
        gradient = stretched[:, None] * Gth
        gradient[:, 0] += half
        outer = direction[:, :, None] * direction[:, None, :]
        outer[:, 0, 0] -= 1.0
        curvature = k[:, None, None] * (outer + stretched[:, None, None] * G)
        gradient = k[:, None] * gradient
        return Energy(
            value + 0.5 * k * half * (2 * u + half),
            ky + np.einsum("nij,ni->nj", V, gradient),
            self.unloaded_curvature + np.swapaxes(V, -1, -2) @ curvature @ V,
        )

    def by_share(self) -> np.ndarray:
        """Derivative of the gradient by the share of the preload (N, m): none."""
        return np.zeros(self.stiffness.shape)


Element = FiniteJoint | FiniteSpring
