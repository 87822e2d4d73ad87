"""Mobility: motions when all elastic parts are rigid, from geometry alone; ranks beside (16)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

import numpy as np

from robostiff.elastostatics import Tolerance
from robostiff.frozen import frozen
from robostiff.kept import kept
from robostiff.kinematics.spanning_tree import connected_parts, independent_parts
from robostiff.network.equations import Equations

if TYPE_CHECKING:
    from scipy.sparse import csc_array

# Parts of 1 that a matrix of unit wrenches is shifted by: inverse iteration is blind to them.
_FIRM, _FAINT = 1e-8, 1e-14
_ITERATIONS = 3
_FIRST_BLOCK = 16


def null_spaces(G: np.ndarray, tolerance: Tolerance) -> tuple[np.ndarray, np.ndarray, bool]:
    """Null spaces of a matrix whose rows are unit wrenches on bodies.

    Orthonormal motions (columns, k) that no wrench resists, wrenches (rows, l) in equilibrium with
    themselves, and whether a singular value is neither clearly zero nor clearly not. Those below
    `Tolerance.independence` are zero.
    """
    U, values, Vt = np.linalg.svd(G)  # identities where there are no rows, or no columns
    rank = int(np.count_nonzero(values > tolerance.independence))
    doubtful = bool(np.any(tolerance.leaves_in_doubt(values)))
    return Vt[rank:].T, U[:, rank:], doubtful


def sparse_null_space(G: csc_array, tolerance: Tolerance) -> tuple[np.ndarray, bool]:
    """Orthonormal motions (columns, k) that no wrench resists, of a large sparse matrix.

    The second result is whether a singular value is neither clearly zero nor clearly not. Inverse
    iteration with a block of vectors on ``[[-a I, G], [G^T, d I]]``, whose factors are as sparse as
    those of a network. The block grows until its weakest vector is held for certain; the singular
    values of G on the block then decide like those of G itself.
    """
    from scipy.sparse import block_array, eye_array
    from scipy.sparse.linalg import splu

    rows, columns = cast("tuple[int, int]", G.shape)
    firm, faint = -_FIRM * eye_array(rows), _FAINT * eye_array(columns)
    lu = splu(block_array([[firm, G], [G.T, faint]], format="csc"))
    rng = np.random.default_rng(0)
    size = min(columns, _FIRST_BLOCK)
    while True:
        V = rng.normal(size=(columns, size))
        for _ in range(_ITERATIONS):
            right = np.vstack([np.zeros((rows, V.shape[1])), np.linalg.qr(V)[0]])
            V = lu.solve(right)[rows:]
        V = np.linalg.qr(V)[0]
        _, values, Wt = np.linalg.svd(G @ V, full_matrices=False)
        values = np.concatenate([values, np.zeros(size - len(values))])
        if size == columns or values[0] > tolerance.near_independence:
            break
        size = min(columns, 4 * size)
    lost = values <= tolerance.independence
    doubtful = bool(np.any(tolerance.leaves_in_doubt(values)))
    if len(Wt) < size:  # more motions than wrenches
        Wt = np.linalg.svd(G @ V)[2]
    return V @ Wt[lost].T, doubtful


def pinning_coordinates(basis: np.ndarray) -> np.ndarray:
    """Coordinates (k,) that are zero only for zero in a space (size, k): pivoted QR."""
    from scipy.linalg import qr

    k = basis.shape[1]
    if k == 0:
        return np.zeros(0, dtype=int)
    *_, pivots = qr(basis.T, mode="r", pivoting=True)
    return np.array(pivots[:k], dtype=int)


# Of the largest displacement of a mechanism: none.
_STILL = 1e-9
# Rows and columns up to which a dense decomposition is quicker.
_DENSE = 600


def matrix_of_blocks(
    blocks: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], shape: tuple[int, int]
) -> csc_array:
    """Sparse matrix of blocks (..., r, c) at rows (..., r) and columns (..., c); these add up."""
    from scipy.sparse import coo_array

    places = [shape[1] * rows[..., None] + columns[..., None, :] for _, rows, columns in blocks]
    place = np.concatenate([np.zeros(0, dtype=int), *map(np.ravel, places)])
    values = np.concatenate([np.zeros(0), *(block.ravel() for block, _, _ in blocks)])
    return coo_array((values, np.divmod(place, shape[1])), shape=shape).tocsc()


@frozen
class Mechanism:
    """Motions of some bodies without resistance."""

    nodes: tuple[str, ...]
    motions: np.ndarray  # (nodes, n, k): scaled displacements of each
    # (k,) of int: coordinates, counted through the nodes, that stop all of them when held
    pins: np.ndarray

    @property
    def moving(self) -> list[str]:
        """Names of the nodes that it moves."""
        size = np.abs(self.motions).max(axis=(1, 2), initial=0.0)
        return [n for n, s in zip(self.nodes, size, strict=True) if s > _STILL * size.max()]


@frozen
class Mobility:
    """Mechanisms of a network with some nodes fixed."""

    mechanisms: tuple[Mechanism, ...]
    # (n, m): unit wrenches by which the platform is held, scaled, about its point; columns of
    # the identity where elastic parts alone fix it to the ground; defined only if it was fixed
    held: np.ndarray
    doubtful: bool  # whether a rank is close to another


@kept
def mobility(equations: Equations, *, platform_fixed: bool) -> Mobility:
    """Mechanisms of a network, with its platform free or fixed beside the fixed nodes.

    Bodies joined by what resists every motion, as beams do, move as one; what can move between
    such clusters is the null space of the unit wrenches of the other connections.
    """
    network, n = equations.network, equations.size
    # Clusters of bodies without relative motion, by the first body of each
    pairs = [pair for own in equations.groups if own.S.shape[2] == n for pair in own.nodes]
    names = [node.name for node in network.nodes]
    label_of = connected_parts(names, [*pairs, network.fixed])
    members: dict[str, list[str]] = {}
    for name, label in label_of.items():
        members.setdefault(label, []).append(name)
    points = {
        label: np.mean([equations.points[name] for name in own], axis=0)
        for label, own in members.items()
    }
    ground, platform = label_of[network.fixed[0]], label_of[network.platform]
    points[platform] = equations.points[network.platform]
    still = {ground, platform} if platform_fixed else {ground}
    free = [label for label in members if label not in still]
    between = [
        [i for i, ends in enumerate(own.nodes) if len({label_of[name] for name in ends}) > 1]
        for own in equations.groups
    ]
    open_ = [*equations.some_connections(between).values()]
    mechanisms, held, doubtful = [], [], False
    for labels, numbers in independent_parts(
        free, [{label_of[name] for name, *_ in c.ends} - still for c in open_]
    ):
        connections = [open_[k] for k in numbers]
        # Wrenches of connections on free clusters, and on a fixed platform that comes last, as rows
        column = {label: np.arange(n * i, n * (i + 1)) for i, label in enumerate(labels)}
        column |= {label: n * len(labels) + np.arange(n) for label in still & {platform}}
        blocks, row = [], 0
        for c in connections:
            rows = np.arange(row, row := row + len(c.S))
            for node, point, part in c.ends:
                label = label_of[node]
                if label in column:
                    wrenches = part @ equations.between(points[label], point)
                    blocks.append((wrenches, rows, column[label]))
        G = matrix_of_blocks(blocks, (row, n * len(labels) + n))
        if max(row, n * len(labels)) <= _DENSE:
            G, G_p = np.split(G.toarray(), [n * len(labels)], axis=1)
            motions, wrenches, doubt = null_spaces(G, equations.tolerance)
            held.append(G_p.T @ wrenches)
        else:
            # What is free with the platform free is split into what moves it and what does not.
            motions, doubt = sparse_null_space(G, equations.tolerance)
            U, values, Vt = np.linalg.svd(motions[-n:])
            moved = int(np.count_nonzero(values > equations.tolerance.independence))
            motions = motions[:-n] @ Vt[moved:].T
            held.append(np.eye(n) - U[:, :moved] @ U[:, :moved].T)
        doubtful |= doubt
        if motions.shape[1]:
            nodes, stack = [], []  # the bodies of these clusters, and how they move
            for label in labels:
                for name in members[label]:
                    D = equations.between(points[label], equations.points[name])
                    nodes.append(name)
                    stack.append(D @ motions[column[label]])
            all_moved = np.array(stack)
            pins = pinning_coordinates(all_moved.reshape(-1, all_moved.shape[-1]))
            mechanisms.append(Mechanism(tuple(nodes), all_moved, pins))
    by_ground = platform == ground
    wrenches = np.eye(n) if by_ground else np.hstack([np.zeros((n, 0)), *held])
    return Mobility(tuple(mechanisms), wrenches, doubtful)


def held_coordinates(equations: Equations) -> set[tuple[str, int]]:
    """Node and row (0 to 5) of what does not move: the ground, what leaves the plane, mechanisms.

    Mechanisms carry nothing where they are held, each of their motions at one coordinate.
    """
    network, rows = equations.network, equations.network.space.rows
    held = {(name, row) for name in network.fixed for row in range(6)}
    held |= {(node.name, row) for node in network.nodes for row in range(6) if row not in rows}
    for mechanism in mobility(equations, platform_fixed=False).mechanisms:
        for pin in mechanism.pins:
            body, row = divmod(int(pin), len(rows))
            held.add((mechanism.nodes[body], rows[row]))
    return held
