"""The saddle-point system of a network, (6) and (7) of all bodies at once, factorised."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from robostiff.elastostatics import Status
from robostiff.elastostatics.tolerance import last_moved
from robostiff.errors import NoAnswerError
from robostiff.frozen import frozen
from robostiff.kept import kept
from robostiff.kinematics.spanning_tree import independent_parts
from robostiff.network.equations import Equations, Motion
from robostiff.network.mobility import (
    Mechanism,
    Mobility,
    matrix_of_blocks,
    mobility,
    null_spaces,
    pinning_coordinates,
)
from robostiff.network.multifrontal import CholeskyFactors, dissection, lower_blocks
from robostiff.spatial.batch import block_diagonal

if TYPE_CHECKING:
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import SuperLU

# A unit wrench with a smaller statically indeterminate part has none.
_SHARED = 1e-6


@frozen
class Redundancy:
    """Dependent constraints of a network with some nodes fixed."""

    # for each connection by its number, which of its wrenches can be left out because the others
    # say the same
    dropped: dict[int, list[int]]
    # (n, k): wrenches on the fixed platform that rigid parts carry to the ground, scaled
    on_platform: np.ndarray
    doubtful: bool
    # numbers of the connections that are statically indeterminate among rigid parts, so that
    # equilibrium and elasticity do not determine their loads
    undetermined: frozenset[int]


@kept
def redundancy(equations: Equations, *, platform_fixed: bool) -> Redundancy:
    """Dependent constraints, with the platform free or fixed beside the fixed nodes.

    Constraints along a tree are independent; only rigid parts that close a loop, or lead from one
    fixed body to another, are looked at.
    """
    network, n, matrix = equations.network, equations.size, network_matrix(equations)
    still = {*network.fixed, *([network.platform] if platform_fixed else [])}
    dropped: dict[int, list[int]] = defaultdict(list)
    on_platform, doubtful, undetermined = [np.zeros((n, 0))], False, set()
    for nodes, connections in _loops(equations, still):
        places = [(k, int(j)) for k, c in connections.items() for j in np.flatnonzero(c.rigid)]
        rows = matrix.whole[[matrix.wrench_rows[k][j] for k, j in places]]
        unknowns = np.array([matrix.rows_of[name] for name in nodes], dtype=int).ravel()
        A, A_p = (rows[:, at].toarray() for at in (unknowns, matrix.rows_of[network.platform]))
        _, left, doubt = null_spaces(A, equations.tolerance)
        doubtful |= doubt
        on_platform.append(A_p.T @ left)
        for place in pinning_coordinates(left):
            number, wrench = places[place]
            dropped[number].append(wrench)
        shared = np.abs(left).max(axis=1, initial=0.0) > _SHARED
        undetermined |= {places[place][0] for place in np.flatnonzero(shared)}
    return Redundancy(dict(dropped), np.hstack(on_platform), doubtful, frozenset(undetermined))


def _loops(equations: Equations, still: set[str]) -> list[tuple[list[str], dict[int, Motion]]]:
    """Free bodies and connections with rigid wrenches, without branches that end in the air.

    Connections come by their numbers.
    """
    some = [np.flatnonzero(own.rigid.any(axis=1)) for own in equations.groups]
    edges = equations.some_connections(some)
    ends = {k: sorted({name for name, *_ in c.ends} - still) for k, c in edges.items()}
    at: dict[str, set[int]] = defaultdict(set)
    for k, own in ends.items():
        for name in own:
            at[name].add(k)
    leaves = [*at]
    while leaves:
        if len(numbers := at[leaves.pop()]) == 1:
            (k,) = numbers
            for end in ends.pop(k):
                at[end].discard(k)
                leaves.append(end)
    nodes, left = [name for name, numbers in at.items() if numbers], [*ends]
    parts = independent_parts(nodes, [*ends.values()])
    return [(own, {left[i]: edges[left[i]] for i in numbers}) for own, numbers in parts]


def redundant_freedoms(
    equations: Equations, mobility: Mobility
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Which passive freedoms (q,) are redundant after those before them, the platform held.

    They come with their names, ``element/freedom``. A freedom is redundant when some mechanism
    moves it and none after it. Such mechanisms are those of bodies, and those inside a joint whose
    own freedoms depend on one another.
    """
    some = [[i for i, own in enumerate(group.freedom_names) if own] for group in equations.groups]
    moving = [
        (c, null_spaces(c.freedoms, equations.tolerance)[0])
        for c in equations.some_connections(some).values()
    ]
    rates = [block_diagonal([own for _, own in moving])]
    for mechanism in mobility.mechanisms:
        of_node = dict(zip(mechanism.nodes, mechanism.motions, strict=True))
        rest = np.zeros_like(mechanism.motions[0])
        own = [np.zeros((0, rest.shape[-1]))]
        for c, _ in moving:
            of_a, of_b = (
                equations.transport(node, at) @ of_node.get(node, rest) for node, at, _ in c.ends
            )
            own.append(np.linalg.pinv(c.freedoms) @ (of_b - of_a))
        rates.append(np.vstack(own))
    names = tuple(name for c, _ in moving for name in c.freedom_names)
    return last_moved(np.hstack(rates), equations.tolerance), names


# Steps of iterative refinement by the factors of the whole system, and of the condensed one.
_REFINEMENTS, _STEPS_OF_CONDENSED = 2, 8
# A last step of refinement above this part of the answer means that few digits hold.
CONVERGED = 1e-8
# The condensed system must give more, or the whole one is factorised; below, steps end.
_ENOUGH, _ROUNDING = 1e-12, 1e-15
# Compliance of rigid directions in the condensed system, against the characteristic one.
_LITTLE = 1e-7
# Unknowns from which on a system is condensed.
_LARGE = 1000
# Of the size of a network: bodies that are nearer are in one place.
_NEAR = 1e-6


@frozen
class AlikeConnections:
    """Connections that resist as many motions at as many ends: rows ``A x = S f`` of a network."""

    rows: np.ndarray  # (N, m) of int: sizes f of their wrenches
    S: np.ndarray  # (N, m, m)
    nodes: np.ndarray  # (N, e) of int: nodes at their ends
    A: np.ndarray  # (N, m, e, n): of the displacements of these


@frozen
class NetworkMatrix:
    """``[[0, A^T], [A, -S]]`` of all bodies, the fixed ones and the platform among them."""

    size: int  # number of displacements and wrenches
    parts: tuple[AlikeConnections, ...]
    rows_of: dict[str, np.ndarray]  # the displacements of each node, which come first
    wrench_rows: tuple[np.ndarray, ...]  # sizes of the wrenches of each connection

    @property
    def displacements(self) -> int:
        """How many of the unknowns are displacements."""
        return sum(map(len, self.rows_of.values()))

    def deflections(self, own: AlikeConnections, x: np.ndarray) -> np.ndarray:
        """``A x`` of some connections (N, m, k) for columns (size, k)."""
        N, m, _, n = own.A.shape
        shifts = x[: self.displacements].reshape(-1, n, x.shape[1])
        return own.A.reshape(N, m, -1) @ shifts[own.nodes].reshape(N, -1, x.shape[1])

    def add_loads(self, b: np.ndarray, own: AlikeConnections, f: np.ndarray) -> None:
        """Add to right sides (size, k) ``A^T f`` of wrenches (N, m, k) of some connections."""
        N, m, _, n = own.A.shape
        on_nodes = b[: self.displacements].reshape(-1, n, b.shape[1])
        loads = np.swapaxes(own.A.reshape(N, m, -1), 1, 2) @ f
        np.add.at(on_nodes, own.nodes.ravel(), loads.reshape(-1, *on_nodes.shape[1:]))

    def times(self, x: np.ndarray) -> np.ndarray:
        """Product (size, k) with columns (size, k)."""
        product = np.zeros_like(x)
        for own in self.parts:
            f = x[own.rows]
            product[own.rows] = self.deflections(own, x) - own.S @ f
            self.add_loads(product, own, f)
        return product

    @cached_property
    def whole(self) -> csc_array:
        """The sparse matrix."""
        blocks = []
        for own in self.parts:
            n, A = own.A.shape[-1], own.A.reshape(*own.rows.shape, -1)
            columns = (n * own.nodes[:, :, None] + np.arange(n)).reshape(len(A), -1)
            blocks += [(-own.S, own.rows, own.rows), (A, own.rows, columns)]
            blocks.append((np.swapaxes(A, 1, 2), columns, own.rows))
        return matrix_of_blocks(blocks, (self.size, self.size))


@kept
def network_matrix(equations: Equations) -> NetworkMatrix:
    """The matrix of a network, whether its platform is free or not."""
    n, number_of = equations.size, {name: i for i, name in enumerate(equations.points)}
    sizes = np.empty(sum(len(own.numbers) for own in equations.groups), dtype=int)
    for own in equations.groups:
        sizes[own.numbers] = own.S.shape[-1]
    starts = n * len(number_of) + np.cumsum(sizes) - sizes
    points, parts = np.array([*equations.points.values()]), []
    # joints that leave all motions free are without rows
    for own in (group for group in equations.groups if group.S.shape[-1]):
        nodes = np.array([[number_of[name] for name in names] for names in own.nodes])
        A = (own.parts @ equations.between(points[nodes], own.at)).swapaxes(1, 2)
        rows = starts[own.numbers][:, None] + np.arange(own.S.shape[-1])
        parts.append(AlikeConnections(rows, own.S, nodes, np.ascontiguousarray(A)))
    rows_of = dict(zip(number_of, np.arange(n * len(number_of)).reshape(-1, n), strict=True))
    size = n * len(number_of) + int(sizes.sum())
    every, ends_at = np.arange(size), (starts + sizes).tolist()
    wrench_rows = tuple(every[a:b] for a, b in zip(starts.tolist(), ends_at, strict=True))
    return NetworkMatrix(size, tuple(parts), rows_of, wrench_rows)


@frozen
class CondensedSystem:
    """A saddle-point system without its wrenches, factorised, its platform free or fixed.

    Of ``[[0, A^T], [A, -S]]`` the stiffness ``A^T (S + D)^-1 A`` of the displacements is left,
    where D gives rigid directions a little compliance: positive definite, so that its factors take
    a tenth of the time. What it loses to rounding and to D, refinement by the whole system brings
    back.
    """

    matrix: NetworkMatrix
    stiffness: tuple[np.ndarray, ...]  # (N, m, m) of each part: (S + D)^-1, 0 of what is left out
    factors: CholeskyFactors
    pinned: np.ndarray  # of int: those that are held

    def step(self, b: np.ndarray, x: np.ndarray, *, platform_fixed: bool) -> np.ndarray:
        """What solutions (size, k) of the whole system lack for right sides (size, k).

        Up to rounding, and what D adds.
        """
        step, loads = np.zeros_like(x), b[: self.matrix.displacements].copy()
        parts = [*zip(self.matrix.parts, self.stiffness, strict=True)]
        gaps = [
            b[own.rows] - self.matrix.deflections(own, x) + own.S @ x[own.rows] for own, _ in parts
        ]
        for (own, k), gap in zip(parts, gaps, strict=True):
            self.matrix.add_loads(loads, own, k @ gap - x[own.rows])
        loads[self.pinned] = 0.0
        step[: len(loads)] = self.factors.solve(loads, last_is_fixed=platform_fixed)
        for (own, k), gap in zip(parts, gaps, strict=True):
            step[own.rows] = k @ (self.matrix.deflections(own, step) - gap)
        return step


@kept
def condensed_system(
    equations: Equations, pinned: tuple[int, ...], dropped: tuple[int, ...]
) -> CondensedSystem | None:
    """Condense, with displacements `pinned` and wrenches `dropped`, by their rows.

    None where rounding, or a motion without stiffness of all but the platform, makes it singular.
    """
    matrix, n = network_matrix(equations), equations.size
    network, names = equations.network, [*equations.points]
    is_left_out = np.zeros(matrix.size, dtype=bool)
    is_left_out[np.array([*pinned, *dropped], dtype=int)] = True
    still = {*network.fixed, network.platform}
    is_free = np.array([name not in still for name in names])
    bodies, platform = np.flatnonzero(is_free), names.index(network.platform)
    # Bodies are cut apart by their places; those in one place by the order that they come in.
    points = np.array([*equations.points.values()])
    places = (points - points.min(axis=0)) / (_NEAR * equations.length)
    places = np.column_stack([np.round(places), np.arange(len(points))]).astype(int)
    pairs = [pair for own in matrix.parts for pair in combinations(own.nodes.T, 2)]
    pairs = np.concatenate([np.zeros((0, 2), int), *(np.stack(pair, axis=1) for pair in pairs)])
    pairs = pairs[np.all(is_free[pairs], axis=1)]
    pieces = [*dissection(bodies, pairs, places), np.array([platform])]
    order = np.concatenate(pieces)
    number = np.full(len(names), -1)
    number[order] = np.arange(len(order))
    unknowns = (n * order[:, None] + np.arange(n)).ravel()
    stiffness: list[np.ndarray] = []
    try:
        for own in matrix.parts:
            out, identity = is_left_out[own.rows], np.eye(own.S.shape[-1])
            soft = own.S + _LITTLE * ~np.any(own.S, axis=1)[:, :, None] * identity
            either = out[:, :, None] | out[:, None, :]
            inverse = np.linalg.inv(np.where(either, identity, soft))
            stiffness.append(np.where(either, 0.0, inverse))
        held = is_left_out[: n * len(names)].reshape(-1, n)
        K = lower_blocks(number, _of_bodies(matrix.parts, stiffness, held))
        factors = CholeskyFactors.of(K, [*map(len, pieces)], unknowns)
    except np.linalg.LinAlgError:
        return None
    return CondensedSystem(matrix, tuple(stiffness), factors, np.array(pinned, dtype=int))


def _of_bodies(
    parts: Sequence[AlikeConnections], stiffness: Sequence[np.ndarray], pinned: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Bodies of connections and the stiffness of these, 1 of what is `pinned` (M, n)."""
    for own, k in zip(parts, stiffness, strict=True):
        N, m, e, n = own.A.shape
        A = (own.A * ~pinned[own.nodes][:, None]).reshape(N, m, -1)
        K = np.swapaxes(A, 1, 2) @ (k @ A)
        yield own.nodes, K.reshape(N, e, n, e, n).swapaxes(2, 3)
    nodes = np.flatnonzero(pinned.any(axis=1))
    yield nodes[:, None], (pinned[nodes][:, :, None] * np.eye(pinned.shape[1]))[:, None, None]


@frozen
class SaddlePointSystem:
    """``[[0, A^T], [A, -S]] [x; f] = [F; 0]`` of all bodies, and its solution.

    A holds the transmitted wrenches of beams, springs and joints, S their compliance (0 where
    rigid), x displacements and f the sizes of the wrenches; all scaled. With the wrenches as
    unknowns the rows of A are geometry alone, so that refinement reaches full accuracy; condensed
    to displacements alone, a long chain of beams would lose all digits.
    """

    equations: Equations
    platform_fixed: bool
    mobility: Mobility
    dependent: Redundancy
    # (m,) of int: rows and columns that are solved for: free, and independent of one another
    kept: np.ndarray
    condensed: CondensedSystem | None  # of a large system

    @property
    def matrix(self) -> NetworkMatrix:
        """The matrix, of a platform fixed or not."""
        return network_matrix(self.equations)

    @cached_property
    def regular(self) -> csc_array:
        """What is kept of the matrix (m, m)."""
        return self.matrix.whole[self.kept][:, self.kept].tocsc()

    @cached_property
    def lu(self) -> SuperLU:
        """Factors of what is kept of the matrix.

        Raises NoAnswerError when rounding makes it singular.
        """
        from scipy.sparse.linalg import splu

        try:
            return splu(self.regular)
        except RuntimeError:  # an exact zero for a pivot
            raise NoAnswerError(
                f"no stiffness of network {self.equations.network.name!r}: "
                f"{Status.ILL_CONDITIONED.advice[0]}"
            ) from None

    def solve(self, right: np.ndarray) -> tuple[np.ndarray, float]:
        """Displacements and wrenches (size, k) for right sides (size, k), 0 where not kept.

        Iterative refinement; the second answer is the size of its last step as a part of the whole.

        Raises NoAnswerError when rounding makes the system singular.
        """
        x, last = np.zeros(right.shape), np.inf
        if not self.kept.size:
            return x, 0.0
        if (condensed := self.condensed) is not None:
            fixed = self.platform_fixed
            x, last = _refine(
                lambda x: condensed.step(right, x, platform_fixed=fixed), x, _STEPS_OF_CONDENSED
            )
        if not last < _ENOUGH:
            b, kept = right[self.kept], np.zeros((len(self.kept), right.shape[1]))
            kept, last = _refine(lambda x: self.lu.solve(b - self.regular @ x), kept, _REFINEMENTS)
            x = np.zeros(right.shape)
            x[self.kept] = kept
        return x, last

    def forces(self, at: Sequence[tuple[str, np.ndarray, np.ndarray]]) -> np.ndarray:
        """Right sides (size, k) of wrenches (n, k) at nodes, each about a point (3,) [N, N m; m].

        One right side of wrenches (n,).
        """
        columns = at[0][1][0].size if at else 1
        right, equations = np.zeros((self.matrix.size, columns)), self.equations
        for node, F, point in at:
            scaled = F.reshape(equations.size, -1) / equations.scale[:, None] / equations.stiffness
            right[self.matrix.rows_of[node]] += equations.transport(node, point).T @ scaled
        return right

    def mechanism_driven_by(self, right: np.ndarray) -> Mechanism | None:
        """A mechanism on whose motion a right side (size,) does work, if there is one."""
        size = max(np.linalg.norm(right[rows]) for rows in self.matrix.rows_of.values())
        for mechanism in self.mobility.mechanisms:
            work = sum(
                motions.T @ right[self.matrix.rows_of[name]]
                for name, motions in zip(mechanism.nodes, mechanism.motions, strict=True)
            )
            if np.any(np.abs(work) > self.equations.tolerance.independence * size):
                return mechanism
        return None


def _refine(
    step: Callable[[np.ndarray], np.ndarray], x: np.ndarray, most: int
) -> tuple[np.ndarray, float]:
    """Solution by a step from nothing and some more, and the last one as a part of it.

    Steps shrink by one factor: where the next one would be rounding, it is left out.
    """
    x, last = x + step(x), 1.0
    for _ in range(most):
        change = step(x)
        x += change
        part = np.abs(change).max(initial=0.0) / np.abs(x).max(initial=np.finfo(float).tiny)
        before, last = last, float(part)
        if not last < before or (last < _ENOUGH and last * last < _ROUNDING * before):
            break
    return x, last


@kept
def saddle_point_system(equations: Equations, *, platform_fixed: bool) -> SaddlePointSystem:
    """Assemble and factorise, with the platform free or fixed beside the fixed nodes.

    Mechanisms are held at as many coordinates as they have, and dependent constraints left out:
    neither changes the stiffness of the platform. The remaining system is regular, but for parts
    that differ in softness by more than all digits.
    """
    matrix, network = network_matrix(equations), equations.network
    mobile = mobility(equations, platform_fixed=platform_fixed)
    dependent = redundancy(equations, platform_fixed=platform_fixed)
    still = {*network.fixed, *([network.platform] if platform_fixed else [])}
    pinned = []
    for mechanism in mobile.mechanisms:
        rows = np.concatenate([matrix.rows_of[name] for name in mechanism.nodes])
        pinned += rows[mechanism.pins].tolist()
    dropped = [
        int(matrix.wrench_rows[k][number])
        for k, numbers in dependent.dropped.items()
        for number in numbers
    ]
    fixed = np.concatenate([matrix.rows_of[name] for name in still])
    is_left = np.ones(matrix.size, dtype=bool)
    is_left[[*fixed, *pinned, *dropped]] = False
    left = np.flatnonzero(is_left)
    condensed = None
    if left.size > _LARGE:
        # Where nothing is pinned or dropped, one factorisation is for the platform free and fixed.
        condensed = condensed_system(equations, tuple(pinned), tuple(dropped))
        if condensed is not None and condensed.factors.last is None and not platform_fixed:
            condensed = None
    return SaddlePointSystem(equations, platform_fixed, mobile, dependent, left, condensed)
