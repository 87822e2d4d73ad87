"""The saddle-point system of a network, (6) and (7) of all bodies at once, factorised."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.elastostatics import Status
from robostiff.elastostatics.tolerance import last_moved
from robostiff.errors import NoAnswerError
from robostiff.kept import kept
from robostiff.kinematics.spanning_tree import independent_parts
from robostiff.network.equations import Equations, Motion
from robostiff.network.mobility import (
    BlockEntries,
    Mechanism,
    Mobility,
    mobility,
    null_spaces,
    pinning_coordinates,
)
from robostiff.spatial.batch import block_diagonal

if TYPE_CHECKING:
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import SuperLU

# A unit wrench with a smaller statically indeterminate part has none.
_SHARED = 1e-6


@dataclass(frozen=True)
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
    network, n = equations.network, equations.size
    still = {*network.fixed, *([network.platform] if platform_fixed else [])}
    dropped: dict[int, list[int]] = defaultdict(list)
    on_platform, doubtful, undetermined = [np.zeros((n, 0))], False, set()
    for nodes, numbers in _loops(equations, still):
        column = {name: i for i, name in enumerate(nodes)}
        places = [
            (k, int(j)) for k in numbers for j in np.flatnonzero(equations.connections[k].rigid)
        ]
        A, A_p = np.zeros((len(places), n * len(nodes))), np.zeros((len(places), n))
        row = 0
        for k in numbers:
            c = equations.connections[k]
            rows = slice(row, row := row + int(np.count_nonzero(c.rigid)))
            for name, point, part in c.ends:
                wrenches = part[c.rigid] @ equations.transport(name, point)
                if name in column:
                    A[rows, n * column[name] : n * (column[name] + 1)] += wrenches
                elif name == network.platform:
                    A_p[rows] += wrenches
        spaces = null_spaces(A, equations.tolerance)
        doubtful |= spaces.doubtful
        on_platform.append(A_p.T @ spaces.left)
        for place in pinning_coordinates(spaces.left):
            number, wrench = places[place]
            dropped[number].append(wrench)
        shared = np.abs(spaces.left).max(axis=1, initial=0.0) > _SHARED
        undetermined |= {places[place][0] for place in np.flatnonzero(shared)}
    return Redundancy(dict(dropped), np.hstack(on_platform), doubtful, frozenset(undetermined))


def _loops(equations: Equations, still: set[str]) -> list[tuple[list[str], list[int]]]:
    """Free bodies and connections with rigid wrenches, without branches that end in the air."""
    edges = {k: c for k, c in enumerate(equations.connections) if c.rigid.any()}
    at: dict[str, set[int]] = defaultdict(set)
    for k, c in edges.items():
        for name in _free_ends(c, still):
            at[name].add(k)
    leaves = [name for name, numbers in at.items() if len(numbers) == 1]
    while leaves:
        name = leaves.pop()
        if len(at[name]) != 1:
            continue
        (k,) = at[name]
        for end in _free_ends(edges.pop(k), still):
            at[end].discard(k)
            if len(at[end]) == 1:
                leaves.append(end)
    nodes, left = [name for name, numbers in at.items() if numbers], list(edges)
    parts = independent_parts(nodes, [_free_ends(edges[k], still) for k in left])
    return [(own, [left[i] for i in numbers]) for own, numbers in parts]


def _free_ends(connection: Motion, still: set[str]) -> list[str]:
    return sorted({*connection.nodes} - still)


def redundant_freedoms(
    equations: Equations, mobility: Mobility
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Which passive freedoms (q,) are redundant after those before them, the platform held.

    They come with their names, ``element/freedom``. A freedom is redundant when some mechanism
    moves it and none after it. Such mechanisms are those of bodies, and those inside a joint whose
    own freedoms depend on one another.
    """
    moving = [
        (c, null_spaces(c.freedoms, equations.tolerance).right)
        for c in equations.connections
        if c.freedom_names
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
_LARGE = 3000


_SYMMETRIC: dict[str, Any] = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}


@dataclass(frozen=True)
class CondensedSystem:
    """A saddle-point system without its wrenches, factorised.

    Of ``[[0, A^T], [A, -S]]`` the stiffness ``A^T (S + D)^-1 A`` of the displacements is left,
    where D gives rigid directions a little compliance: sparse and positive definite, so that its
    factors take a tenth of the time. What it loses to rounding and to D, refinement by the whole
    system brings back.
    """

    others: np.ndarray  # (m,) of int: displacements, in the order of elimination
    wrenches: np.ndarray  # (k,) of int: sizes of wrenches, which follow
    A: csc_array  # (k, m)
    stiffness: csc_array  # (k, k): S^-1
    lu: SuperLU

    @staticmethod
    def of(
        regular: csc_array, parts: Sequence[tuple[np.ndarray, np.ndarray]], bodies: np.ndarray
    ) -> CondensedSystem | None:
        """Condense; `parts` are places (N, k) and compliances (N, k, k) of connections alike.

        Displacements come first in the system, (m,) numbers of the `bodies` that they move.

        None where rounding makes the rest singular.
        """
        from scipy.sparse import csc_array, eye_array
        from scipy.sparse.linalg import splu

        blocks = BlockEntries()
        try:
            for places, S in parts:
                rigid = ~np.any(S, axis=1)
                soft = S + _LITTLE * rigid[:, :, None] * np.eye(S.shape[-1])
                blocks.add_many(np.linalg.inv(soft), places, places)
            size = len(regular.indptr) - 1
            wrenches = np.concatenate([places.ravel() for places, _ in parts])
            stiffness = blocks.matrix((size, size))[wrenches][:, wrenches]
            A = regular[wrenches][:, : len(bodies)].tocsc()
            # Body after body by minimum degree: that of single displacements, which zeros in their
            # blocks mislead, fills in twice as much.
            m, count = len(bodies), int(bodies.max()) + 1
            loads = csc_array((np.ones(A.nnz), A.indices, A.indptr), shape=(len(wrenches), m))
            loads = loads @ csc_array((np.ones(m), (np.arange(m), bodies)), shape=(m, count))
            graph = csc_array(loads.T @ loads + m * eye_array(count))
            order = splu(graph, permc_spec="MMD_AT_PLUS_A", **_SYMMETRIC).perm_c
            others = np.argsort(order[bodies], kind="stable")
            A = A[:, others]
            lu = splu(csc_array(A.T @ stiffness @ A), permc_spec="NATURAL", **_SYMMETRIC)
        except (RuntimeError, np.linalg.LinAlgError):
            return None
        return CondensedSystem(others, wrenches, A, stiffness, lu)

    def solve(self, b: np.ndarray) -> np.ndarray:
        """Solution (size, k) of the whole system for right sides (size, k), up to rounding."""
        solution = np.empty(b.shape)
        gaps = b[self.wrenches]
        x = self.lu.solve(b[self.others] + self.A.T @ (self.stiffness @ gaps))
        solution[self.others] = x
        solution[self.wrenches] = self.stiffness @ (self.A @ x - gaps)
        return solution


@dataclass(frozen=True)
class SaddlePointSystem:
    """``[[0, A^T], [A, -S]] [x; f] = [F; 0]`` of all bodies, and its solution.

    A holds the transmitted wrenches of beams, springs and joints, S their compliance (0 where
    rigid), x displacements and f the sizes of the wrenches; all scaled. With the wrenches as
    unknowns the rows of A are geometry alone, so that refinement reaches full accuracy; condensed
    to displacements alone, a long chain of beams would lose all digits.
    """

    name: str  # of the network
    size: int  # number of displacements and wrenches, those that are not kept among them
    matrix: csc_array  # (size, size): of all bodies, the fixed ones and the platform among them
    # (m,) of int: rows and columns that are solved for: free, and independent of one another
    kept: np.ndarray
    rows_of: dict[str, np.ndarray]  # the displacements of each node
    wrench_rows: tuple[np.ndarray, ...]  # sizes of the wrenches of each connection
    regular: csc_array  # (m, m): what is kept of the matrix
    condensed: CondensedSystem | None  # of a large system

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
                f"no stiffness of network {self.name!r}: {Status.ILL_CONDITIONED.advice[0]}"
            ) from None

    def solve(self, right: np.ndarray) -> tuple[np.ndarray, float]:
        """Displacements and wrenches (size, k) for right sides (size, k), 0 where not kept.

        Iterative refinement; the second answer is the size of its last step as a part of the whole.

        Raises NoAnswerError when rounding makes the system singular.
        """
        solution = np.zeros(right.shape)
        if not self.kept.size:
            return solution, 0.0
        b = right[self.kept]
        part, last = np.zeros(b.shape), np.inf
        if self.condensed is not None:
            part, last = self._refined(self.condensed, b, _STEPS_OF_CONDENSED)
        if not last < _ENOUGH:
            part, last = self._refined(self.lu, b, _REFINEMENTS)
        solution[self.kept] = part
        return solution, last

    def _refined(
        self, factors: SuperLU | CondensedSystem, b: np.ndarray, most: int
    ) -> tuple[np.ndarray, float]:
        part, last = factors.solve(b), np.inf
        for _ in range(most):
            step = factors.solve(b - self.regular @ part)
            part = part + step
            whole = np.abs(part).max(initial=np.finfo(float).tiny)
            before, last = last, float(np.abs(step).max(initial=0.0) / whole)
            if last < _ROUNDING or not last < before:
                break
        return part, last

    def forces(
        self, equations: Equations, at: Iterable[tuple[str, np.ndarray, np.ndarray]]
    ) -> np.ndarray:
        """Right side (size, 1) of wrenches (n,) at nodes, each about a point (3,) [N, N m; m]."""
        right = np.zeros((self.size, 1))
        for node, F, point in at:
            D = equations.transport(node, point)
            scaled = F / equations.scale / equations.stiffness
            right[self.rows_of[node], 0] += D.T @ scaled
        return right

    def twist(
        self, equations: Equations, x: np.ndarray, node: str, point: np.ndarray
    ) -> np.ndarray:
        """Twist (n,) of a node about a point (3,) in a solution x (size,) [m, rad]."""
        return equations.transport(node, point) @ x[self.rows_of[node]] / equations.scale


@kept
def saddle_point_system(equations: Equations, *, platform_fixed: bool) -> SaddlePointSystem:
    """Assemble and factorise, with the platform free or fixed beside the fixed nodes.

    Mechanisms are held at as many coordinates as they have, and dependent constraints left out:
    neither changes the stiffness of the platform. The remaining system is regular, but for parts
    that differ in softness by more than all digits.
    """
    matrix, rows_of, wrench_rows = _assembled(equations)
    network, size = equations.network, len(matrix.indptr) - 1
    still = {*network.fixed, *([network.platform] if platform_fixed else [])}
    lost = [rows_of[name] for name in still]
    for mechanism in mobility(equations, platform_fixed=platform_fixed).mechanisms:
        rows = np.concatenate([rows_of[name] for name in mechanism.nodes])
        lost.append(rows[mechanism.pins])
    dropped = redundancy(equations, platform_fixed=platform_fixed).dropped
    lost += [wrench_rows[k][numbers] for k, numbers in dropped.items()]
    left = np.setdiff1d(np.arange(size), np.concatenate(lost))
    regular = matrix[left][:, left].tocsc()
    condensed = None
    if left.size > _LARGE:
        place = np.full(size, -1)
        place[left] = np.arange(left.size)
        parts = []
        for numbers, S, _ in equations.springs:
            rows = place[np.array([wrench_rows[k] for k in numbers.tolist()])]
            whole = np.all(rows >= 0, axis=1)
            parts.append((rows[whole], S[whole]))
            for k in np.flatnonzero(~whole):
                some = np.flatnonzero(rows[k] >= 0)
                parts.append((rows[[k]][:, some], S[[k]][:, some][:, :, some]))
        condensed = CondensedSystem.of(
            regular, parts, left[left < equations.size * len(network.nodes)] // equations.size
        )
    return SaddlePointSystem(
        network.name, size, matrix, left, rows_of, wrench_rows, regular, condensed
    )


def system_of(
    equations: Equations, *, platform_fixed: bool = False
) -> tuple[SaddlePointSystem, Mobility, Redundancy]:
    """The system of a network with what decided it: see `saddle_point_system`."""
    mobile = mobility(equations, platform_fixed=platform_fixed)
    dependent = redundancy(equations, platform_fixed=platform_fixed)
    return saddle_point_system(equations, platform_fixed=platform_fixed), mobile, dependent


def driven_mechanism(
    equations: Equations, mobile: Mobility, system: SaddlePointSystem, right: np.ndarray
) -> Mechanism | None:
    """A mechanism on whose motion a right side (size, 1) does work, if there is one."""
    size = max(np.linalg.norm(right[rows]) for rows in system.rows_of.values())
    for mechanism in mobile.mechanisms:
        work = sum(
            motions.T @ right[system.rows_of[name], 0]
            for name, motions in zip(mechanism.nodes, mechanism.motions, strict=True)
        )
        if np.any(np.abs(work) > equations.tolerance.independence * size):
            return mechanism
    return None


@kept
def _assembled(
    equations: Equations,
) -> tuple[csc_array, dict[str, np.ndarray], tuple[np.ndarray, ...]]:
    """The matrix, and its rows of each node and connection, whether the platform is free or not."""
    n, number_of = equations.size, {name: i for i, name in enumerate(equations.points)}
    springs, blocks = [*equations.springs], BlockEntries()
    sizes = np.empty(sum(len(numbers) for numbers, _, _ in springs), dtype=int)
    for numbers, S, _ in springs:
        sizes[numbers] = S.shape[-1]
    starts = n * len(number_of) + np.cumsum(sizes) - sizes
    size, points = n * len(number_of) + int(sizes.sum()), np.array([*equations.points.values()])
    for numbers, S, ends in springs:
        rows = starts[numbers][:, None] + np.arange(S.shape[-1])
        blocks.add_many(-S, rows, rows)
        for names, at, parts in ends:
            nodes = np.array([number_of[name] for name in names])
            A = parts @ equations.between(points[nodes], at)
            columns = n * nodes[:, None] + np.arange(n)
            blocks.add_many(A, rows, columns)
            blocks.add_many(np.swapaxes(A, 1, 2), columns, rows)
    rows_of = dict(zip(number_of, np.arange(n * len(number_of)).reshape(-1, n), strict=True))
    every, ends_at = np.arange(size), (starts + sizes).tolist()
    wrench_rows = tuple(every[a:b] for a, b in zip(starts.tolist(), ends_at, strict=True))
    return blocks.matrix((size, size)), rows_of, wrench_rows
