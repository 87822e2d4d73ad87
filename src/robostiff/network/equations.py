"""The equations of a network in scaled coordinates, element by element."""

from __future__ import annotations

from dataclasses import dataclass
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
    """

    network: Network
    points: dict[str, np.ndarray]
    length: float
    stiffness: float
    tolerance: Tolerance

    @property
    def size(self) -> int:
        """Displacements of a node: 6, or 3 in the plane."""
        return self.network.space.size

    @cached_property
    def scale(self) -> np.ndarray:
        """Factors that turn a twist into lengths (n,)."""
        return scaling(np.array(self.length), self.network.space)

    @cached_property
    def connections(self) -> tuple[Motion, ...]:
        """Beams, springs, joints, then couplings."""
        # Compliance in units of 1 / stiffness.
        scale = self.scale * np.sqrt(self.stiffness)
        return _connections(self.network, self.points, scale, self.tolerance)

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
    of_elements = _length_of_elements(network, points, tolerance)
    if length <= tolerance.independence * of_elements:  # all in one point, relative to the springs
        length = of_elements or 1.0
    scale = scaling(np.array(length), network.space)
    soft = [
        np.trace(c.S) / max(1, np.count_nonzero(~c.rigid))
        for c in _connections(network, points, scale, tolerance)
        if not c.rigid.all()
    ]
    stiffness = 1.0 / float(np.exp(np.mean(np.log(soft)))) if soft else 1.0
    return Equations(network, points, length, stiffness, tolerance)


def _connections(
    network: Network, points: dict[str, np.ndarray], scale: np.ndarray, tolerance: Tolerance
) -> tuple[Motion, ...]:
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


def _length_of_elements(
    network: Network, points: dict[str, np.ndarray], tolerance: Tolerance
) -> float:
    """Largest length given by the springs [m]; 0 for none."""
    one = np.ones(network.space.size)
    connections = _connections(network, points, one, tolerance)
    lengths = [
        float(matrix_length(c.W @ c.S @ c.W.T, c.freedoms))
        for c in connections
        if isinstance(c, RelativeMotion) and np.any(c.S)
    ]
    return max(lengths, default=0.0)
