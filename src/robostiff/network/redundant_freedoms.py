"""Passive freedoms that move nothing but themselves while the platform rests."""

from __future__ import annotations

import numpy as np

from robostiff.network.equations import Equations
from robostiff.network.mobility import Mechanism, Mobility
from robostiff.network.null_space import null_spaces


def redundant_freedoms(
    equations: Equations, mobility: Mobility
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Which passive freedoms add nothing to those before them, the platform being fixed.

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
        if c.freedom_names:
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
