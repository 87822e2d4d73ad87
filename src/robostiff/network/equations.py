"""The equations of a network in scaled coordinates, element by element."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from robostiff.elastostatics import Tolerance, matrix_length, scaling, transmitted_wrenches
from robostiff.elastostatics.tolerance import check_compliance_in_plane, check_joints_in_plane
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.network.elements import (
    BeamElement,
    CouplingElement,
    Element,
    SpringElement,
    find_properties,
)
from robostiff.network.network import Network
from robostiff.spatial import Space, block_rotation, compliance_modes, level_axes, twist_transport

# Condition of a compliance scaled to a unit diagonal: beyond it stiff directions are separated.
_DENSE = 1e3
_ALIKE = 1e-9  # of twists of a joint: nearer to others, one is among them
_SYMMETRY = 1e-9  # part of its size by which a compliance may be negative


class Motion(NamedTuple):
    """How some nodes move against one another at one of `Connections`."""

    name: str
    ends: tuple[tuple[str, np.ndarray, np.ndarray], ...]  # nodes, points (3,), and parts (m, n)
    S: np.ndarray  # (m, m)
    rigid: np.ndarray  # (m,)
    freedoms: np.ndarray  # (n, q)
    freedom_names: tuple[str, ...]


@frozen
class Connections:
    """Beams, springs and joints, or a coupling, of as many ends, motions and freedoms.

    Each resists the motions d of its nodes against one another with wrenches of sizes f, and
    ``d = S f``.
    """

    numbers: np.ndarray  # (N,): places among all of the network
    names: Sequence[str]
    nodes: Sequence[tuple[str, ...]]  # at e ends
    # (N, e, 3) or (N, 1, 3): points of these [m]; and (N, e, m, n): the parts of their
    # displacements there in d: -W^T and W^T of unit wrenches W that an element transmits
    at: np.ndarray
    parts: np.ndarray
    # (N, m, m): scaled compliance; rows and columns of rigid directions are exactly 0
    S: np.ndarray
    freedoms: np.ndarray  # (N, n, q): unit twists of the passive freedoms, scaled
    freedom_names: Sequence[tuple[str, ...]]  # ``connection/freedom``

    @cached_property
    def rigid(self) -> np.ndarray:
        """Which motions are impossible (N, m)."""
        return ~np.any(self.S, axis=1)

    def motion(self, i: int) -> Motion:
        """One of them."""
        at = np.broadcast_to(self.at[i], (len(self.nodes[i]), 3))
        ends = tuple(zip(self.nodes[i], at, self.parts[i], strict=True))
        rest = self.S[i], self.rigid[i], self.freedoms[i], self.freedom_names[i]
        return Motion(self.names[i], ends, *rest)


def coupled_motion(
    place: int,
    own: CouplingElement,
    points: Mapping[str, np.ndarray],
    scale: np.ndarray,
    space: Space,
) -> Connections:
    """The row of a coupling at its place in the network; `scale` turns twists into lengths.

    A joint turns by ``s . d``, where d is how its bodies move against each other, and s a row of
    the inverse of the twists of its freedoms. InputError where others of these move them alike.
    """
    rows, found = list(space.rows), []
    for joint, number, factor in own.terms:
        at = points[joint.a] if joint.point is None else joint.point
        moving = joint.place(number)
        if moving is None:
            continue
        twists = np.array([f.twist(at)[rows] * scale for f in joint.moving]).T
        row = np.linalg.pinv(twists, rcond=_ALIKE)[[moving]]
        if not np.allclose(row @ twists, np.eye(len(joint.moving))[moving], atol=_ALIKE):
            raise InputError(
                f"coupling {own.name!r}",
                got=Words(f"freedom {number + 1} of joint {joint.name!r}, which others repeat"),
                expected="a freedom that moves the bodies as no others of its joint do",
                hint="give it a joint of its own, with a node between the two joints",
            )
        found += [(joint.a, at, -factor * row), (joint.b, at, factor * row)]
    size = float(np.sqrt(sum(np.sum(row**2) for _, _, row in found)))
    S = 0.0 if own.stiffness is None else 1.0 / (own.stiffness * size**2)
    names, at, of_ends = zip(*found, strict=True)
    return Connections(
        np.array([place]),
        [own.name],
        [names],
        np.array([at]),
        np.array([of_ends]) / size,
        np.array([[[S]]]),
        np.zeros((1, len(rows), 0)),
        [()],
    )


_NO_FREEDOM, _RIGID, _WORLD = np.zeros((6, 0)), np.zeros((6, 6)), np.eye(3)


def _as_spring(
    element: Element, of_node: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, tuple[str, ...]]:
    """Reference point (3,), compliance (6, 6), freedoms (6, q), axes (3, 3), names of freedoms.

    A beam about its end, a slide or a weld about the point of node a, `of_node` (3,) [m].
    """
    if isinstance(element, BeamElement):
        return element.end, element.tip_compliance, _NO_FREEDOM, element.rotation, ()
    if isinstance(element, SpringElement):
        C, J = element.elasticity.compliance, element.elasticity.freedoms
        names = tuple(f"{element.name}/freedom {i + 1}" for i in range(J.shape[1]))
        return element.point, C, J, element.rotation, names
    at = of_node if element.point is None else element.point
    C, J, names = _RIGID, _NO_FREEDOM, ()
    for freedom in element.freedoms:
        twist = freedom.twist(at)
        if freedom.is_passive:
            J = np.column_stack([J, twist])
            names += (f"{element.name}/{freedom.name}",)
        elif freedom.stiffness is not None:
            C = C + np.outer(twist, twist) / freedom.stiffness
    return at, C, J, _WORLD, names


def groups_of(
    elements: Sequence[Element],
    of_nodes: np.ndarray,
    scale: np.ndarray,
    space: Space,
    tolerance: Tolerance,
    numbers: np.ndarray | None = None,
) -> Iterator[Connections]:
    """Elements, alike ones together.

    `scale` turns twists into lengths, `of_nodes` (N, 3) are points [m].

    Raises InputError when an element of a planar network leaves the plane, or a compliance is
    negative.
    """
    numbers = np.arange(len(elements)) if numbers is None else numbers
    find_properties(own for own in elements if isinstance(own, BeamElement))
    parts = [_as_spring(*each) for each in zip(elements, of_nodes, strict=True)]
    alike: dict[int, list[int]] = defaultdict(list)
    for k, (_, _, J, _, _) in enumerate(parts):
        alike[J.shape[1]].append(k)
    for own in alike.values():
        some = [elements[k] for k in own]
        *arrays, names = zip(*(parts[k] for k in own), strict=True)
        at, C, J, rotation = map(np.array, arrays)
        C, J, axes = _in_space(some, C, J, rotation, space)
        J = J * scale[:, None]
        J = J / np.linalg.norm(J, axis=1, keepdims=True)
        W, redundant = transmitted_wrenches(J, tolerance.independence)
        if len(own) > 1 and redundant.any():  # they transmit different numbers of wrenches
            for k in own:
                one = [elements[k]], of_nodes[[k]], scale, space, tolerance, numbers[[k]]
                yield from groups_of(*one)
            continue
        W, S = _springs(some, C, W, scale, space, tolerance)
        W_T = np.swapaxes(axes @ W, 1, 2)
        yield Connections(
            numbers[own],
            [element.name for element in some],
            [(element.a, element.b) for element in some],
            at[:, None],
            np.stack([-W_T, W_T], axis=1),
            S,
            axes @ J,
            names,
        )


def _springs(
    elements: Sequence[Element],
    C: np.ndarray,
    W: np.ndarray,
    scale: np.ndarray,
    space: Space,
    tolerance: Tolerance,
) -> tuple[np.ndarray, np.ndarray]:
    """Transmitted wrenches (N, n, m), and compliance (N, m, m) of elements under them."""
    C_scaled = C * np.outer(scale, scale)
    S = np.swapaxes(W, 1, 2) @ C_scaled @ W
    S = 0.5 * (S + np.swapaxes(S, 1, 2))
    below = np.min(np.linalg.eigvalsh(S), axis=-1, initial=0.0)
    for k in np.flatnonzero(below < -_SYMMETRY * np.trace(C_scaled, axis1=1, axis2=2))[:1]:
        subject = f"compliance of {elements[k].name!r}"
        raise InputError(subject, got=C[k], expected="a positive semidefinite matrix")
    diagonal = np.einsum("...ii->...i", S)
    unit = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    # Entries beside zeros of the diagonal are zeros, too.
    regular = S / (unit[:, :, None] * unit[:, None, :])
    # Of wrenches across all motions of a part rounding is left.
    least = tolerance.rigidity * np.trace(C_scaled, axis1=1, axis2=2)
    plain = np.all(diagonal > least[:, None], axis=-1)
    if W.shape[2]:
        plain[plain] = np.linalg.cond(regular[plain]) < _DENSE
    is_rigid = ~np.any(C, axis=(1, 2))
    S[is_rigid] = 0.0
    for k in np.flatnonzero(~plain & ~is_rigid).tolist():
        own = elements[k]
        if isinstance(own, SpringElement) and space is Space.SPATIAL:
            modes = own.elasticity.modes
        else:
            modes = compliance_modes(C[k])
        # Wrenches by which the soft, the stiff and the rigid directions of a part are apart. Those
        # that load the spring are found by its unit modes: a stiff direction is not rigid.
        modes = (modes * scale[:, None])[:, np.any(modes != 0, axis=0)]
        loads = modes.T @ W[k]
        values, Vt = np.linalg.svd(loads / np.linalg.norm(modes, axis=0)[:, None])[1:]
        rank = int(np.count_nonzero(values > tolerance.independence))
        unit = np.sqrt(np.where(np.diagonal(S[k]) > 0, np.diagonal(S[k]), 1.0))
        # Otherwise unchanged: a new basis would cost digits of stiff directions, unless these lie
        # across all axes.
        if rank == len(S[k]) and np.linalg.cond(S[k] / np.outer(unit, unit)) <= _DENSE:
            continue
        _, roots, by_size = np.linalg.svd(loads @ Vt[:rank].T, full_matrices=False)
        W[k] = W[k] @ np.vstack([by_size @ Vt[:rank], Vt[rank:]]).T
        S[k] = np.diag(np.append(roots**2, np.zeros(len(S[k]) - rank)))
    return W, S


def check_fits(element: Element, space: Space) -> None:
    """Raise an InputError unless an element stays in the plane of a planar network."""
    if space is Space.PLANAR:
        list(groups_of([element], np.zeros((1, 3)), np.ones(space.size), space, Tolerance()))


def _in_space(
    elements: Sequence[Element], C: np.ndarray, J: np.ndarray, rotation: np.ndarray, space: Space
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compliance and freedoms of elements in axes in which to work, and these axes (N, n, n).

    They are the element's own, in the plane those beside them: turned to the world, stiff
    directions would lose to soft ones as many digits as lie between them.
    """
    if space is Space.SPATIAL:
        return C, J, block_rotation(rotation)
    level, rows = level_axes(rotation), list(space.rows)
    turn = block_rotation(np.swapaxes(level, 1, 2) @ rotation)
    C, J = turn @ C @ np.swapaxes(turn, 1, 2), turn @ J
    for own, C_own, J_own in zip(elements, C, J, strict=True):
        check_joints_in_plane(J_own, [own.name] * J_own.shape[1], "network")
        check_compliance_in_plane(C_own, f"part {own.name!r} of a planar network")
    return C[:, rows][:, :, rows], J[:, rows], block_rotation(level)[:, rows][:, :, rows]


# A point further from where a body is attached than this many lengths costs digits.
_FAR = 10.0
# Of lengths of a network: longer is a spring that slides and turns by rounding alone.
_ENDLESS = 1e12


@frozen
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
    # beams, springs and joints, then couplings; compliance in units of 1 / `stiffness`
    groups: tuple[Connections, ...]

    @cached_property
    def connections(self) -> tuple[Motion, ...]:
        """Beams, springs and joints, then couplings, in the order of the network."""
        return tuple(self.some_connections([range(len(own.names)) for own in self.groups]).values())

    def some_connections(self, chosen: Sequence[Iterable[int]]) -> dict[int, Motion]:
        """Some of each group, by their numbers in the network."""
        places = [(own, i) for own, some in zip(self.groups, chosen, strict=True) for i in some]
        return dict(sorted((int(own.numbers[i]), own.motion(i)) for own, i in places))

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
        subject = f"network {network.name!r}"
        raise InputError(subject, got=Words("no element"), expected="beams, springs or joints")
    # The middle of the attachments of each body; for the platform the reference point, if near.
    numbers, attached = network.attachments
    count, total = np.zeros(len(network.nodes)), np.zeros((len(network.nodes), 3))
    np.add.at(count, numbers, 1.0)
    np.add.at(total, numbers, attached)
    middles = total / np.maximum(count, 1.0)[:, None]
    each = zip(network.nodes, middles, count.tolist(), strict=True)
    points = {node.name: middle if own else node.point for node, middle, own in each}
    length, reference = network.characteristic_length, network.reference_point
    if np.linalg.norm(reference - points[network.platform]) <= _FAR * length:
        points[network.platform] = reference
    groups = _scaled(network, points, length or 1.0, tolerance)
    # The largest length that the springs have, as a part of the one that scales them.
    of_elements = [(own, own.parts[:, 1]) for own in groups[: len(groups) - len(network.couplings)]]
    lengths = [
        matrix_length(np.swapaxes(W_T, 1, 2) @ own.S @ W_T, own.freedoms)[np.any(own.S, (1, 2))]
        for own, W_T in of_elements
    ]
    each = (x for own in lengths for x in own if x < _ENDLESS)
    longest = max(each, default=0.0) * (length or 1.0)
    if length <= tolerance.independence * longest:  # all in one point, relative to the springs
        length = longest or 1.0
        groups = _scaled(network, points, length, tolerance)
    soft = np.zeros(0)
    for own in groups:
        trace, count = np.trace(own.S, axis1=1, axis2=2), np.count_nonzero(~own.rigid, axis=1)
        soft = np.append(soft, trace[count > 0] / count[count > 0])
    stiffness = 1.0 / float(np.exp(np.mean(np.log(soft)))) if soft.size else 1.0
    return Equations(
        network,
        points,
        length,
        stiffness,
        tolerance,
        tuple(replace(own, S=own.S * stiffness) for own in groups),
    )


def _scaled(
    network: Network, points: Mapping[str, np.ndarray], length: float, tolerance: Tolerance
) -> list[Connections]:
    """Groups and couplings of a network, its twists turned into lengths by `length` [m]."""
    scale, elements = scaling(np.array(length), network.space), tuple(network.elements)
    of_nodes = np.array([points[element.a] for element in elements]).reshape(-1, 3)
    groups = [*groups_of(elements, of_nodes, scale, network.space, tolerance)]
    for number, own in enumerate(network.couplings, len(elements)):
        groups.append(coupled_motion(number, own, points, scale, network.space))
    return groups
