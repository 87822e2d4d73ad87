"""The equations of a network in scaled coordinates, element by element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.elastostatics import Tolerance, matrix_length, scaling
from robostiff.errors import InputError
from robostiff.network.connection import Motion, RelativeMotion, connection_of, coupled_motion
from robostiff.network.network import Network
from robostiff.spatial import twist_transport

# A point further from where a body is attached than this many lengths costs digits.
_FAR = 10.0


@dataclass(frozen=True)
class Equations:
    """A network made of scaled matrices.

    Displacements are lengths (rotations times `length`) about a point of each body in the middle
    of its attachments, stiffness in units of `stiffness`; so units of length and force do not
    matter.

    Attributes
    ----------
    network : Network
    points : dict of (3,) arrays
        Point of each node whose displacement is the unknown [m].
    length : float
        Characteristic length [m].
    stiffness : float
        Characteristic stiffness [N/m].
    tolerance : Tolerance
    connections : tuple of RelativeMotion or CoupledMotion
        Beams, springs, joints, then couplings; compliance in units of 1 / `stiffness`.
    """

    network: Network
    points: dict[str, np.ndarray]
    length: float
    stiffness: float
    tolerance: Tolerance
    connections: tuple[Motion, ...]

    @property
    def size(self) -> int:
        """Displacements of a node: 6, or 3 in the plane."""
        return self.network.space.size

    @cached_property
    def scale(self) -> np.ndarray:
        """Factors that turn a twist into lengths (n,)."""
        return scaling(np.array(self.length), self.network.space)

    def transport(self, node: str, to: np.ndarray) -> np.ndarray:
        """Scaled displacement at a point of a body from that of the body (n, n)."""
        return self.between(self.points[node], to)

    def between(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Scaled displacement of a rigid body at `end` from that at `start` (n, n)."""
        v = (end - start)[: self.network.space.translations]
        return self.scale[:, None] * twist_transport(v) / self.scale


def equations_of(network: Network, tolerance: Tolerance) -> Equations:
    """Scaled equations of a network.

    Raises
    ------
    InputError
        When the network has no connection, or one that leaves the plane of a planar network.
    """
    if not any(network.elements):
        raise InputError(
            f"network {network.name!r}", got="no element", expected="beams, springs or joints"
        )
    points = _points(network)
    length = network.characteristic_length
    connections = _connections(network, points, length or 1.0, tolerance)
    of_elements = _length_of_elements(connections) * (length or 1.0)
    if length <= tolerance.independence * of_elements:  # all in one point, relative to the springs
        length = of_elements or 1.0
        connections = _connections(network, points, length, tolerance)
    soft = [
        np.trace(c.S) / max(1, np.count_nonzero(~c.rigid)) for c in connections if not c.rigid.all()
    ]
    stiffness = 1.0 / float(np.exp(np.mean(np.log(soft)))) if soft else 1.0
    scaled = tuple(replace(c, S=c.S * stiffness) for c in connections)
    return Equations(network, points, length, stiffness, tolerance, scaled)


def _connections(
    network: Network, points: dict[str, np.ndarray], length: float, tolerance: Tolerance
) -> tuple[Motion, ...]:
    scale = scaling(np.array(length), network.space)
    between = [
        connection_of(element, points[element.a], scale, network.space, tolerance)
        for element in network.elements
    ]
    held = [coupled_motion(own, points, scale, network.space) for own in network.couplings]
    return (*between, *held)


def _points(network: Network) -> dict[str, np.ndarray]:
    """The middle of the attachments of each body; for the platform the reference point, if near."""
    points = {}
    for node in network.nodes:
        attached = network.connection_points[node.name]
        points[node.name] = np.mean(attached, axis=0) if attached else node.point
    middle, reference = points[network.platform], network.reference_point
    distance = np.linalg.norm(reference - middle)
    if distance <= _FAR * network.characteristic_length:
        points[network.platform] = reference
    return points


def _length_of_elements(connections: Sequence[Motion]) -> float:
    """Largest length given by the springs, as a part of the one that scales them; 0 for none."""
    lengths = [
        float(matrix_length(c.W @ c.S @ c.W.T, c.freedoms))
        for c in connections
        if isinstance(c, RelativeMotion) and np.any(c.S)
    ]
    return max(lengths, default=0.0)
