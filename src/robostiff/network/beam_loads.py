"""Loads between the ends of a beam, and what they do to it when its start is clamped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError
from robostiff.network.elements import BeamElement, section_compliance
from robostiff.spatial import as_float, as_floats

# Of an entry: a compliance that differs from that of a uniform beam by less is rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class DistributedForce:
    """A uniform force along a whole beam, on its axis.

    Attributes
    ----------
    per_length : (3,) array
        World axes [N/m].
    """

    per_length: ArrayLike


@dataclass(frozen=True)
class ForceOnBeam:
    """A force at a point of the axis of a beam.

    Attributes
    ----------
    force : (3,) array
        World axes [N].
    distance : float
        From the start of the beam [m].
    """

    force: ArrayLike
    distance: float


@dataclass(frozen=True)
class BeamLoad:
    """What the loads of a beam do when its start is clamped and its end free, in its axes."""

    at_start: np.ndarray  # (6,): their sum about the start [N, N m]
    tip_twist: np.ndarray  # (6,): of the end [m, rad]
    own_energy: float  # elastic energy [J]

    def energy(self, end: np.ndarray) -> float:
        """What the loads add to the energy ``f S f / 2`` of a wrench `end` on the end [J]."""
        return float(end @ self.tip_twist) + self.own_energy


def beam_load(beam: BeamElement, loads: Sequence[DistributedForce | ForceOnBeam]) -> BeamLoad:
    """All loads of a uniform beam together.

    At the distance u from the end a section carries the wrench w(u) of the loads beyond it. With
    the compliance c of the section for a unit of length, the end deflects by the integral of
    ``A(u)^T c w(u)``, where A(u) moves a wrench from the end to the section, and the energy is half
    the integral of ``w(u)^T c w(u)``. The wrenches are polynomials of u, of degree two at most.

    Raises InputError when a load is no vector, or is beyond the ends; when the beam is not uniform.

    Examples
    --------
    A cantilever under a uniform load sinks by q L^4 / (8 E I):

    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([2.0, 0, 0]))
    >>> steel, bar = material("steel"), circle(0.02)
    >>> beam = beam_between(wall, tip, steel, bar, y_axis=[0, 1, 0])
    >>> sunk = beam_load(beam, [DistributedForce([0, 0, -5.0])]).tip_twist[2]
    >>> round(float(sunk * 8 * steel.E * bar.Iy / (5.0 * 2.0**4)), 12)
    -1.0
    """
    c = _section_compliance(beam)
    L, e = beam.length, np.array([1.0, 0.0, 0.0])
    # w(u) of every piece of the beam as coefficients of 1, u, u^2; pieces end where forces are.
    at = sorted({0.0, L, *(_distance(beam, own) for own in loads if isinstance(own, ForceOnBeam))})
    tip, energy = np.zeros(6), 0.0
    for low, high in pairwise(at):
        w = np.zeros((3, 6))
        for own in loads:
            if isinstance(own, DistributedForce):
                q = _in_axes(beam, "force per length", own.per_length, "N/m")
                w[1, :3] += q
                w[2, 3:] += np.cross(e, q) / 2
            elif (u := _distance(beam, own)) <= low:
                P = _in_axes(beam, "force", own.force, "N")
                w[0, :3] += P
                w[0, 3:] -= u * np.cross(e, P)
                w[1, 3:] += np.cross(e, P)
        integral = [(high**k - low**k) / k for k in range(1, 7)]
        for i, part in enumerate(w):
            strain = c * part
            # A(u)^T strain: the displacement of the end, e u before it, gains rotation x e u.
            tip += strain * integral[i]
            tip[:3] += np.cross(strain[3:], e) * integral[i + 1]
            energy += 0.5 * sum(float(strain @ w[j]) * integral[i + j] for j in range(3))
    return BeamLoad(_at_start(beam, loads), tip, energy)


def _at_start(beam: BeamElement, loads: Sequence[DistributedForce | ForceOnBeam]) -> np.ndarray:
    """Sum of the loads about the start of the beam (6,), in its axes [N, N m]."""
    total, e = np.zeros(6), np.array([1.0, 0.0, 0.0])
    for own in loads:
        if isinstance(own, DistributedForce):
            arm = beam.length / 2
            force = beam.length * _in_axes(beam, "force per length", own.per_length, "N/m")
        else:
            arm = beam.length - _distance(beam, own)
            force = _in_axes(beam, "force", own.force, "N")
        total += np.concatenate([force, arm * np.cross(e, force)])
    return total


def _distance(beam: BeamElement, load: ForceOnBeam) -> float:
    """Of the point of a force from the end of the beam [m]."""
    subject = f"distance of a force on beam {beam.name!r}"
    expected = f"a number from 0 to {beam.length:g} [m], from its start"
    s = as_float(subject, load.distance, expected, "m")
    if not 0.0 <= s <= beam.length:
        raise InputError(subject, got=load.distance, expected=expected)
    return beam.length - s


def _in_axes(beam: BeamElement, what: str, value: ArrayLike, unit: str) -> np.ndarray:
    subject = f"{what} on beam {beam.name!r}"
    return beam.rotation.T @ as_floats(subject, value, f"three numbers [{unit}]", unit, (3,))


def _section_compliance(beam: BeamElement) -> np.ndarray:
    """That of a uniform beam, see `section_compliance`."""
    C, L = beam.tip_compliance, beam.length
    c = section_compliance(C, L)
    expected = np.diag(c * L)
    for row, turn, sign in ((1, 5, 1.0), (2, 4, -1.0)):
        expected[row, row] += c[turn] * L**3 / 3
        expected[row, turn] = expected[turn, row] = sign * c[turn] * L**2 / 2
    size = np.sqrt(np.outer(np.diagonal(C), np.diagonal(C)))
    if np.any(np.abs(C - expected) > _ROUNDING * size):
        raise InputError(
            f"beam {beam.name!r} with a load between its ends",
            got="a compliance that is not that of a uniform beam",
            expected="one section along the beam, its axes principal",
            hint="divide the beam into pieces, and load their ends",
        )
    return c
