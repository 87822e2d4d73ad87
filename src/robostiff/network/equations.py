"""The equations of a network in scaled coordinates, element by element."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.elastostatics import Tolerance, matrix_length, scaling, transmitted_wrenches
from robostiff.elastostatics.plane import check_compliance_in_plane, check_joints_in_plane
from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics import freedom_twist
from robostiff.network.elements import BeamElement, CouplingElement, Element, SpringElement
from robostiff.network.network import Network
from robostiff.spatial import Space, block_rotation, compliance_modes, twist_transport

# Condition of a compliance scaled to a unit diagonal: beyond it directions are told apart first.
_DENSE = 1e3
_SYMMETRY = 1e-9  # part of its size by which a compliance may be negative


@dataclass(frozen=True)
class RelativeMotion:
    """A beam, spring or joint: it carries W f, and deflects by d with ``W^T d = S f``.

    d is the motion of node b against node a.
    """

    name: str
    a: str
    b: str
    point: np.ndarray  # (3,): reference point of the matrices [m]
    W: np.ndarray  # (n, m): orthonormal transmitted wrenches in scaled coordinates
    # (m, m): scaled compliance under these wrenches; rows and columns of rigid ones are exactly 0
    S: np.ndarray
    freedoms: np.ndarray  # (n, q): unit twists of the passive freedoms, scaled
    freedom_names: tuple[str, ...]  # ``connection/freedom``

    @property
    def ends(self) -> tuple[tuple[str, np.ndarray, np.ndarray], ...]:
        """Nodes, points, and the parts (m, n) of their displacements there in ``W^T d``."""
        return (self.a, self.point, -self.W.T), (self.b, self.point, self.W.T)

    @property
    def is_full(self) -> bool:
        """Whether it resists every relative motion."""
        return self.W.shape[1] == self.W.shape[0]

    @cached_property
    def rigid(self) -> np.ndarray:
        """Which of the transmitted wrenches are rigid (m,)."""
        return ~np.any(self.S, axis=0)


@dataclass(frozen=True)
class CoupledMotion:
    """A held sum of joint coordinates, as one row over the bodies of these joints."""

    name: str
    # nodes, points (3,), and the parts of their displacements there (1, n)
    ends: tuple[tuple[str, np.ndarray, np.ndarray], ...]
    S: np.ndarray  # (1, 1): scaled compliance against the sum, 0 where it is rigid
    freedoms: np.ndarray  # (n, 0)
    freedom_names: tuple[str, ...] = ()
    is_full: bool = False

    @property
    def rigid(self) -> np.ndarray:
        """Whether its one row is (1,)."""
        return ~np.any(self.S, axis=0)


Motion = RelativeMotion | CoupledMotion


def coupled_motion(
    own: CouplingElement, points: Mapping[str, np.ndarray], scale: np.ndarray, space: Space
) -> CoupledMotion:
    """The row of a coupling; `scale` turns twists into lengths.

    A joint turns by ``s . d``, where d is how its bodies move against each other, and s a row of
    the inverse of the twists of its freedoms.
    """
    rows, found = list(space.rows), []
    for joint, number, factor in own.terms:
        at = points[joint.a] if joint.point is None else joint.point
        place = joint.place(number)
        if place is None:
            continue
        twists = np.array([freedom_twist(f, at)[rows] * scale for f in joint.moving]).T
        row = factor * np.linalg.pinv(twists)[place][None, :]
        found += [(joint.a, at, -row), (joint.b, at, row)]
    size = float(np.sqrt(sum(np.sum(row**2) for _, _, row in found)))
    S = 0.0 if own.stiffness is None else 1.0 / (own.stiffness * size**2)
    ends = tuple((name, at, row / size) for name, at, row in found)
    return CoupledMotion(own.name, ends, np.array([[S]]), np.zeros((len(rows), 0)))


@dataclass(frozen=True)
class _ScaledElement:
    """What an element is to a network: compliance and freedoms, in axes in which to work."""

    element: Element
    at: np.ndarray  # (3,): reference point of the matrices [m]
    C: np.ndarray  # (n, n)
    J: np.ndarray  # (n, q)
    axes: np.ndarray  # (n, n)
    freedom_names: tuple[str, ...]

    @staticmethod
    def of(element: Element, of_node: np.ndarray, space: Space) -> _ScaledElement:
        """A beam about its end, a slide or a weld about the point of node a, `of_node` (3,) [m].

        Raises InputError when an element of a planar network leaves the plane.
        """
        names: list[str] = []
        C, J, rotation = np.zeros((6, 6)), np.zeros((6, 0)), np.eye(3)
        if isinstance(element, BeamElement):
            at, C, rotation = element.end, element.tip_compliance, element.rotation
        elif isinstance(element, SpringElement):
            at, rotation = element.point, element.rotation
            C, J = element.elasticity.compliance, element.elasticity.freedoms
            names = [f"{element.name}/freedom {i + 1}" for i in range(J.shape[1])]
        else:
            at = of_node if element.point is None else element.point
            for freedom in element.freedoms:
                twist = freedom_twist(freedom, at)
                if freedom.is_passive:
                    J = np.column_stack([J, twist])
                    names.append(f"{element.name}/{freedom.name}")
                elif freedom.stiffness is not None:
                    C = C + np.outer(twist, twist) / freedom.stiffness
        C, J, axes = _in_space(element.name, C, J, rotation, space)
        return _ScaledElement(element, at, C, J, axes, tuple(names))

    def modes(self, space: Space) -> np.ndarray:
        """Modes of the compliance (n, n), as the spring has them or as they follow from it."""
        if isinstance(self.element, SpringElement) and space is Space.SPATIAL:
            return self.element.elasticity.modes
        return compliance_modes(self.C)


def connections_of(
    elements: Sequence[Element],
    of_nodes: np.ndarray,
    scale: np.ndarray,
    space: Space,
    tolerance: Tolerance,
) -> list[RelativeMotion]:
    """Connections of elements; `scale` turns twists into lengths, `of_nodes` (N, 3) are points [m].

    Parts with as many freedoms are computed at once.

    Raises InputError when an element of a planar network leaves the plane, or a compliance is
    negative.
    """
    parts = [_ScaledElement.of(*each, space) for each in zip(elements, of_nodes, strict=True)]
    alike: dict[int, list[int]] = defaultdict(list)
    for k, part in enumerate(parts):
        alike[part.J.shape[1]].append(k)
    found: dict[int, RelativeMotion] = {}
    for numbers in alike.values():
        some = [parts[k] for k in numbers]
        found |= zip(numbers, _motions(some, scale, space, tolerance), strict=True)
    return [found[k] for k in range(len(parts))]


def _motions(
    parts: Sequence[_ScaledElement], scale: np.ndarray, space: Space, tolerance: Tolerance
) -> list[RelativeMotion]:
    """Connections of parts with as many freedoms."""
    J = np.array([part.J for part in parts]) * scale[:, None]
    J = J / np.linalg.norm(J, axis=1, keepdims=True)
    W, redundant = transmitted_wrenches(J, tolerance.independence)
    if len(parts) > 1 and redundant.any():  # they transmit different numbers of wrenches
        return [own for part in parts for own in _motions([part], scale, space, tolerance)]
    C = np.array([part.C for part in parts]) * np.outer(scale, scale)
    S = np.swapaxes(W, 1, 2) @ C @ W
    S = 0.5 * (S + np.swapaxes(S, 1, 2))
    below = np.min(np.linalg.eigvalsh(S), axis=-1, initial=0.0)
    for k in np.flatnonzero(below < -_SYMMETRY * np.trace(C, axis1=1, axis2=2))[:1]:
        raise InputError(
            f"compliance of {parts[k].element.name!r}",
            got=parts[k].C,
            expected="a positive semidefinite matrix",
        )
    diagonal = np.einsum("...ii->...i", S)
    unit = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    # Entries beside zeros of the diagonal are zeros, too.
    regular = S / (unit[:, :, None] * unit[:, None, :])
    plain = np.all(diagonal > 0, axis=-1)
    plain[plain] = np.linalg.cond(regular[plain]) < _DENSE
    found = []
    for k, part in enumerate(parts):
        own, of_own = W[k], S[k]
        if not np.any(part.C):
            of_own = np.zeros_like(of_own)
        elif not plain[k]:
            own, of_own = _by_size(part.modes(space) * scale[:, None], own, of_own, tolerance)
        ends = part.element.a, part.element.b, part.at
        axes = part.axes
        found.append(
            RelativeMotion(
                part.element.name, *ends, axes @ own, of_own, axes @ J[k], part.freedom_names
            )
        )
    return found


def _by_size(
    modes: np.ndarray, W: np.ndarray, S: np.ndarray, tolerance: Tolerance
) -> tuple[np.ndarray, np.ndarray]:
    """Wrenches by which the soft, the stiff and the rigid directions of a part are apart.

    Wrenches that load the spring are found by its unit modes: a stiff direction is not rigid.
    """
    modes = modes[:, np.any(modes != 0, axis=0)]
    felt = modes.T @ W
    values, Vt = np.linalg.svd(felt / np.linalg.norm(modes, axis=0)[:, None])[1:]
    rank = int(np.count_nonzero(values > tolerance.independence))
    unit = np.sqrt(np.where(np.diagonal(S) > 0, np.diagonal(S), 1.0))
    # Otherwise unchanged: a new basis would cost digits of stiff directions, unless these lie
    # across all axes.
    if rank == len(S) and np.linalg.cond(S / np.outer(unit, unit)) <= _DENSE:
        return W, S
    _, roots, by_size = np.linalg.svd(felt @ Vt[:rank].T, full_matrices=False)
    W = W @ np.vstack([by_size @ Vt[:rank], Vt[rank:]]).T
    return W, np.diag(np.append(roots**2, np.zeros(len(S) - rank)))


def check_fits(element: Element, space: Space) -> None:
    """Raise an InputError unless an element can be part of a network in this space."""
    connections_of([element], np.zeros((1, 3)), np.ones(space.size), space, Tolerance())


def _in_space(
    name: str, C: np.ndarray, J: np.ndarray, rotation: np.ndarray, space: Space
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compliance and freedoms of an element in axes in which to work, and these axes (n, n).

    In space they are the element's own: turned to the world, stiff directions would lose to soft
    ones as many digits as lie between them.
    """
    axes = block_rotation(rotation)
    if space is Space.SPATIAL:
        return C, J, axes
    C, J = axes @ C @ axes.T, axes @ J
    check_joints_in_plane(J, [name] * J.shape[1], "network")
    check_compliance_in_plane(C, f"part {name!r} of a planar network")
    rows = list(space.rows)
    return C[np.ix_(rows, rows)], J[rows], np.eye(len(rows))


# A point further from where a body is attached than this many lengths costs digits.
_FAR = 10.0


@dataclass(frozen=True)
class Equations:
    """A network made of scaled matrices.

    Displacements are lengths (rotations times `length`) about a point of each body in the middle
    of its attachments, stiffness in units of `stiffness`; so units of length and force do not
    matter.
    """

    network: Network
    points: dict[str, np.ndarray]  # (3,) of each node: its displacement is the unknown [m]
    length: float  # characteristic length [m]
    stiffness: float  # characteristic stiffness [N/m]
    tolerance: Tolerance
    # beams, springs, joints, then couplings; compliance in units of 1 / `stiffness`
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
        """Scaled displacement of a rigid body at `end` from that at `start` (..., n, n)."""
        v = (end - start)[..., : self.network.space.translations]
        return self.scale[:, None] * twist_transport(v) / self.scale


@kept
def equations_of(network: Network, tolerance: Tolerance) -> Equations:
    """Scaled equations of a network, kept with it.

    Raises InputError when the network has no connection, or one that leaves the plane of a planar
    network.
    """
    if not any(network.elements):
        raise InputError(
            f"network {network.name!r}", got="no element", expected="beams, springs or joints"
        )
    points = _points(network)
    length = network.characteristic_length
    connections = _connections(network, points, length or 1.0, tolerance)
    # The largest length that the springs have, as a part of the one that scales them.
    lengths, alike = [], defaultdict(list)
    for c in connections:
        if isinstance(c, RelativeMotion) and not c.rigid.all():
            alike[c.W.shape, c.freedoms.shape].append(c)
    for some in alike.values():
        W, S, freedoms = (np.array([getattr(c, x) for c in some]) for x in ("W", "S", "freedoms"))
        lengths.append(float(np.max(matrix_length(W @ S @ np.swapaxes(W, 1, 2), freedoms))))
    of_elements = max(lengths, default=0.0) * (length or 1.0)
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
    elements = tuple(network.elements)
    of_nodes = np.array([points[element.a] for element in elements]).reshape(-1, 3)
    between = connections_of(elements, of_nodes, scale, network.space, tolerance)
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
