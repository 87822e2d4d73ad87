"""Forward kinematics of a chain, eq. (5): where every joint and spring is, and the end frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity, beam_compliance
from robostiff.kinematics.turn import turn_about, turn_by_vector
from robostiff.model import (
    Chain,
    Joint,
    JointKind,
    Link,
    Motion,
    PlacedFreedom,
    PlacedSpring,
    Rigid,
    Role,
    Telescope,
    TelescopicBeam,
)
from robostiff.spatial import is_formula
from robostiff.spatial.batch import poses_side_by_side, product


@dataclass(frozen=True)
class PlacedChain:
    """A chain in the world, with its end frame.

    Attributes
    ----------
    elements : tuple of PlacedFreedom or PlacedSpring
    R : (..., 3, 3) array
        Axes of the end frame.
    p : (..., 3) array
        Origin of the end frame [m].
    """

    elements: tuple[PlacedFreedom | PlacedSpring, ...]
    R: np.ndarray
    p: np.ndarray

    @property
    def freedoms(self) -> list[PlacedFreedom]:
        """Its elementary joints, one a coordinate."""
        return [e for e in self.elements if isinstance(e, PlacedFreedom)]


def place_chain(
    chain: Chain,
    q: np.ndarray,
    R_base: np.ndarray,
    p_base: np.ndarray,
    theta: Sequence[np.ndarray] | None = None,
) -> PlacedChain:
    """Place the elements of a chain at coordinates q, and springs deflected by theta, eq. (5).

    Parameters
    ----------
    chain : Chain
    q : (..., chain.size) array
        Joint coordinates [m, rad]; one row where they or the chain have recorded entries.
    R_base, p_base : (3, 3) and (3,) arrays
        Frame in which the chain begins.
    theta : sequence of (..., 6) arrays, optional
        Deflection of each elastic link or telescope beam in its own axes [m, rad]; none when left
        out. (The deflection of an elastic joint adds to its coordinate.)

    Returns
    -------
    PlacedChain
    """
    walk = _Walk(R_base, p_base, q.shape[:-1], theta)
    start = 0
    for element in chain.elements:
        if isinstance(element, Rigid):
            walk.go(element.transform.p, element.transform.R)
        elif isinstance(element, Link):
            walk.go(element.to)
            walk.spring(element.name, element.axes, element.elasticity)
        elif isinstance(element, Joint):
            walk.joint(element, q[..., start : start + element.size])
            start += element.size
        else:
            walk.telescope(element, q[..., start])
            start += 1
    # without a joint that turns or slides, the frame is that of the base: alike at all poses
    R = np.broadcast_to(walk.R, (*walk.batch, 3, 3))
    return PlacedChain(tuple(walk.placed), R, np.broadcast_to(walk.p, (*walk.batch, 3)))


class _Walk:
    """The frame reached so far, on the way from base to platform."""

    def __init__(
        self,
        R: np.ndarray,
        p: np.ndarray,
        batch: tuple[int, ...],
        theta: Sequence[np.ndarray] | None,
    ) -> None:
        self.R, self.p, self.batch = R, p, batch
        self.theta = None if theta is None else list(theta)
        self.placed: list[PlacedFreedom | PlacedSpring] = []

    def go(self, to: np.ndarray, R: np.ndarray | None = None) -> None:
        if np.any(to):
            self.p = self.p + np.einsum("...ij,j->...i", self.R, to)
        if R is not None and not np.array_equal(R, np.eye(3)):
            self.R = product(self.R, R)

    def joint(self, joint: Joint, q: np.ndarray) -> None:
        if joint.kind is JointKind.SPHERICAL:
            for i, freedom in enumerate(joint.freedoms):
                self.freedom(f"{joint.name}[{i}]", freedom.motion, freedom.axis, joint.role)
            self.R = product(self.R, turn_by_vector(q))
            return
        for i, freedom in enumerate(joint.freedoms):
            name = joint.name if joint.size == 1 else f"{joint.name}[{i}]"
            e = self.freedom(name, freedom.motion, freedom.axis, joint.role)
            if freedom.motion is Motion.ROTATION:
                turn = turn_about(freedom.axis, q[..., i])
                self.R = product(self.R, turn)
            else:
                self.p = self.p + e * q[..., i, None]

    def telescope(self, telescope: Telescope, extension: np.ndarray) -> None:
        e = self.freedom(telescope.name, Motion.TRANSLATION, telescope.direction, telescope.role)
        if not telescope.beams:
            self.p = self.p + e * extension[..., None]
        for i, beam in enumerate(telescope.beams):
            length = np.asarray(beam.fixed + beam.share * extension)
            if self.theta is not None:  # the beams before have turned this one
                e = np.einsum("...ij,j->...i", self.R, telescope.direction)
            self.p = self.p + e * length[..., None]
            name = (
                f"{telescope.name}.beam{i + 1}"
                if len(telescope.beams) > 1
                else (f"{telescope.name}.beam")
            )
            self.spring(name, telescope.axes, telescopic_elasticity(beam, length))

    def freedom(self, name: str, motion: Motion, axis: np.ndarray, role: Role) -> np.ndarray:
        e = np.einsum("...ij,j->...i", self.R, axis)
        self.placed.append(PlacedFreedom(name, motion, self.p, e, role))
        return e

    def spring(self, name: str, axes: np.ndarray, elasticity: Elasticity) -> None:
        R_spring = product(self.R, axes)
        self.placed.append(PlacedSpring(name, self.p, R_spring, elasticity))
        if self.theta is not None:
            deflection = self.theta.pop(0)
            self.p = self.p + np.einsum("...ij,...j->...i", R_spring, deflection[..., :3])
            turn = turn_by_vector(np.einsum("...ij,...j->...i", R_spring, deflection[..., 3:]))
            self.R = product(turn, self.R)


def telescopic_elasticity(beam: TelescopicBeam, length: np.ndarray) -> Elasticity:
    """Elasticity of a beam of a telescope at lengths (...) [m], or at one recorded length."""
    usable: Any = length.item() if length.dtype == object else length
    if not is_formula(usable) or getattr(usable, "is_positive", None) is False:
        # Out of reach, a length may be negative: a status answers, but the others must go on.
        usable = np.maximum(np.asarray(usable, dtype=float), np.finfo(float).tiny ** 0.25)
    C = beam_compliance(usable, beam.material, beam.section, beam.theory)
    return Elasticity(poses_side_by_side(C, 2))
