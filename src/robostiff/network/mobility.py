"""What can move when all that is elastic counts as rigid: geometry alone decides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from robostiff.network.connection import Connection
from robostiff.network.equations import Equations
from robostiff.network.null_space import null_spaces, pinning_coordinates


@dataclass(frozen=True)
class Mechanism:
    """Motions of some bodies that nothing resists.

    Attributes
    ----------
    nodes : tuple of str
    motions : (nodes, n, k) array
        Scaled displacements of each.
    pins : (k,) array of int
        Coordinates, counted through the nodes, that stop all of them when held.
    """

    nodes: tuple[str, ...]
    motions: np.ndarray
    pins: np.ndarray


@dataclass(frozen=True)
class Mobility:
    """Mechanisms of a network with some nodes fixed.

    Attributes
    ----------
    mechanisms : tuple of Mechanism
    held : (n, m) array
        Unit wrenches by which the platform is held, scaled, about its point; the identity's columns
        where it is fixed to the ground by elastic parts alone. Of no meaning unless it was fixed.
    doubtful : bool
        Whether a rank is close to another.
    """

    mechanisms: tuple[Mechanism, ...]
    held: np.ndarray
    doubtful: bool


@dataclass(frozen=True)
class _Clusters:
    """Bodies between which nothing can move."""

    label_of: dict[str, int]
    members: dict[int, list[str]]
    points: dict[int, np.ndarray]


def mobility(equations: Equations, *, platform_fixed: bool) -> Mobility:
    """Mechanisms of a network, with its platform free or fixed beside the fixed nodes.

    Bodies joined by what resists every motion, as beams do, move as one; what can move between
    such clusters is the null space of the unit wrenches of the other connections.
    """
    network, n = equations.network, equations.size
    clusters = _clusters(equations)
    ground = clusters.label_of[network.fixed[0]]
    platform = clusters.label_of[network.platform]
    still = {ground, platform} if platform_fixed else {ground}
    free = [label for label in clusters.members if label not in still]
    open_ = [c for c in equations.connections if len(_ends(c, clusters)) == 2]
    mechanisms, held, doubtful = [], [], False
    for labels, connections in _parts(free, open_, clusters):
        column = {label: i for i, label in enumerate(labels)}
        G = np.zeros((sum(c.W.shape[1] for c in connections), n * len(labels)))
        G_p = np.zeros((len(G), n))
        row = 0
        for c in connections:
            rows = slice(row, row := row + c.W.shape[1])
            for node, sign in ((c.a, -1), (c.b, 1)):
                label = clusters.label_of[node]
                if label in still and label != platform:
                    continue
                wrenches = sign * c.W.T @ equations.between(clusters.points[label], c.point)
                if label in column:
                    G[rows, n * column[label] : n * (column[label] + 1)] += wrenches
                else:
                    G_p[rows] += wrenches
        spaces = null_spaces(G, equations.tolerance)
        doubtful |= spaces.doubtful
        held.append(G_p.T @ spaces.left)
        if spaces.right.shape[1]:
            mechanisms.append(_mechanism(equations, clusters, labels, spaces.right))
    by_ground = platform == ground
    wrenches = np.eye(n) if by_ground else np.hstack([np.zeros((n, 0)), *held])
    return Mobility(tuple(mechanisms), wrenches, doubtful)


def _ends(connection: Connection, clusters: _Clusters) -> set[int]:
    return {clusters.label_of[connection.a], clusters.label_of[connection.b]}


def _clusters(equations: Equations) -> _Clusters:
    network = equations.network
    index = {node.name: i for i, node in enumerate(network.nodes)}
    pairs = [(c.a, c.b) for c in equations.connections if c.is_full]
    pairs += [(network.fixed[0], name) for name in network.fixed[1:]]
    labels = _labels([(index[a], index[b]) for a, b in pairs], len(index))
    label_of = {name: int(labels[i]) for name, i in index.items()}
    members: dict[int, list[str]] = {}
    for name, label in label_of.items():
        members.setdefault(label, []).append(name)
    points = {
        label: np.mean([equations.points[name] for name in names], axis=0)
        for label, names in members.items()
    }
    points[label_of[network.platform]] = equations.points[network.platform]
    return _Clusters(label_of, members, points)


def _parts(
    free: list[int], connections: list[Connection], clusters: _Clusters
) -> list[tuple[list[int], list[Connection]]]:
    """Clusters that move together or not at all, and their connections.

    Connections without a free cluster come each on its own.
    """
    index = {label: i for i, label in enumerate(free)}
    pairs = []
    for c in connections:
        ends = [index[label] for label in _ends(c, clusters) if label in index]
        if len(ends) == 2:
            pairs.append((ends[0], ends[1]))
    labels = _labels(pairs, len(free))
    parts: list[tuple[list[int], list[Connection]]] = [
        ([], []) for _ in range(max(labels, default=-1) + 1)
    ]
    for label, i in index.items():
        parts[labels[i]][0].append(label)
    for c in connections:
        ends = [index[label] for label in _ends(c, clusters) if label in index]
        if ends:
            parts[labels[ends[0]]][1].append(c)
        else:
            parts.append(([], [c]))
    return parts


def _labels(pairs: list[tuple[int, int]], size: int) -> np.ndarray:
    rows, columns = np.array(pairs, dtype=int).reshape(-1, 2).T
    graph = coo_array((np.ones(len(pairs)), (rows, columns)), shape=(size, size))
    return connected_components(graph, directed=False)[1]


def _mechanism(
    equations: Equations, clusters: _Clusters, labels: list[int], motions: np.ndarray
) -> Mechanism:
    """Motions of clusters as motions of their bodies."""
    n = equations.size
    nodes, displacements = [], []
    for i, label in enumerate(labels):
        of_cluster = motions[n * i : n * (i + 1)]
        for name in clusters.members[label]:
            D = equations.between(clusters.points[label], equations.points[name])
            nodes.append(name)
            displacements.append(D @ of_cluster)
    stack = np.array(displacements)
    return Mechanism(tuple(nodes), stack, pinning_coordinates(stack.reshape(-1, stack.shape[-1])))
