"""Dependent constraints, and passive freedoms that move no body of the network."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from robostiff.network.connection import Motion, RelativeMotion
from robostiff.network.equations import Equations
from robostiff.network.mobility import Mechanism, Mobility, independent_parts
from robostiff.network.null_space import null_spaces, pinning_coordinates

# A unit wrench with a smaller statically indeterminate part has none.
_SHARED = 1e-6


@dataclass(frozen=True)
class Redundancy:
    """Dependent constraints of a network with some nodes fixed.

    Attributes
    ----------
    dropped : dict
        For each connection by its number, which of its wrenches can be left out because the others
        say the same.
    on_platform : (n, k) array
        Wrenches on the fixed platform that rigid parts carry to the ground, scaled.
    doubtful : bool
    undetermined : frozenset of int
        Numbers of the connections that are statically indeterminate among rigid parts, so that
        equilibrium and elasticity do not determine their loads.
    """

    dropped: dict[int, list[int]]
    on_platform: np.ndarray
    doubtful: bool
    undetermined: frozenset[int]


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
        places = [(k, int(j)) for k in numbers for j in np.flatnonzero(_rigid(equations, k))]
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


def _rigid(equations: Equations, number: int) -> np.ndarray:
    return equations.connections[number].rigid


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
    return sorted({name for name, _, _ in connection.ends} - still)


def redundant_freedoms(
    equations: Equations, mobility: Mobility
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Which passive freedoms are redundant after those before them, the platform being fixed.

    A freedom does so when some mechanism moves it and none after it. Such mechanisms are those of
    bodies, and those inside a joint whose own freedoms depend on one another.

    Returns
    -------
    redundant : (q,) array of bool
    names : tuple of str
        ``element/freedom``.
    """
    connections = equations.connections
    names = tuple(name for c in connections for name in c.freedom_names)
    rates = [np.zeros((len(names), 0))]
    rates += [freedom_rates(equations, mechanism) for mechanism in mobility.mechanisms]
    start = 0
    for c in connections:
        if not c.freedom_names:
            continue
        own = null_spaces(c.freedoms, equations.tolerance).right
        rate = np.zeros((len(names), own.shape[1]))
        rate[start : start + len(own)] = own
        rates.append(rate)
        start += len(own)
    return _last_moved(np.hstack(rates), equations.tolerance.independence), names


def freedom_rates(equations: Equations, mechanism: Mechanism) -> np.ndarray:
    """How fast each passive freedom turns or slides in each motion of a mechanism (q, k)."""
    of_node = dict(zip(mechanism.nodes, mechanism.motions, strict=True))
    still = np.zeros_like(mechanism.motions[0])
    rates = [np.zeros((0, still.shape[-1]))]
    for c in equations.connections:
        if isinstance(c, RelativeMotion) and c.freedom_names:
            of_b = equations.transport(c.b, c.point) @ of_node.get(c.b, still)
            of_a = equations.transport(c.a, c.point) @ of_node.get(c.a, still)
            rates.append(np.linalg.pinv(c.freedoms) @ (of_b - of_a))
    return np.vstack(rates)


def _last_moved(rates: np.ndarray, independence: float) -> np.ndarray:
    """Rows, taken from the last, that are independent of those after them (q,)."""
    redundant = np.zeros(len(rates), dtype=bool)
    left = rates.copy()
    for i in range(len(rates) - 1, -1, -1):
        size = float(np.linalg.norm(left[i]))
        if size > np.sqrt(independence):
            redundant[i] = True
            direction = left[i] / size
            left = left - np.outer(left @ direction, direction)
    return redundant
