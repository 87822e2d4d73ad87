"""Compliance between any points of a network."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.errors import InputError, NoAnswerError
from robostiff.network.equations import equations_of
from robostiff.network.mobility import mobility
from robostiff.network.network import Network
from robostiff.network.redundancy import redundancy
from robostiff.network.saddle_point import CONVERGED, saddle_point_system
from robostiff.spatial import as_floats


def compliance_between(
    network: Network,
    points: Sequence[tuple[str, ArrayLike]],
    *,
    loads: ArrayLike | None = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> np.ndarray:
    """Compliance between points of a network: all their twists for wrenches at any of them.

    Where a point can move freely, there are no twists for all wrenches, but there is the work of
    those `loads` that do none on the free motions.

    Parameters
    ----------
    network : Network
    points : sequence of (str, (3,) array)
        N points in the world [m], each with the name of the node that carries it.
    loads : (n N, k) array, optional
        Loads in columns, each a wrench at every point [N, N m]; all unit wrenches when left out.
    tolerance : Tolerance

    Returns
    -------
    (n N, n N) or (k, k) array
        Block (i, j) is the twist of point i for a wrench at point j [m/N, 1/N, rad/(N m)], n = 6 or
        3 in the plane; with `loads`, entry (i, j) is the work of load i on the displacements under
        load j [J]. Symmetric (Maxwell and Betti), and zero where rigid.

    Raises
    ------
    InputError
        When a node is not there, or a point is no point.
    NoAnswerError
        When a load does work on a motion without stiffness, or rounding leaves few digits.

    Examples
    --------
    The middle and the tip of a rod of 1 m:

    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> a, b, c = (Node(name, np.array([x, 0, 0])) for name, x in zip("abc", (0, 0.5, 1.0)))
    >>> rods = [beam_between(*ends, material("steel"), circle(0.02)) for ends in ((a, b), (b, c))]
    >>> network = Network("rod", (a, b, c), ("a",), "c", c.point, beams=tuple(rods))
    >>> C = compliance_between(network, [("b", b.point), ("c", c.point)])
    >>> float(round(C[7, 7] / C[1, 1], 9)), float(round(C[1, 7] / C[1, 1], 9))
    (8.0, 2.5)
    """
    places = [_checked(network, node, point) for node, point in points]
    if not places:
        raise InputError("points", got=points, expected="at least one (node, [x, y, z])")
    equations = equations_of(network, tolerance)
    n = equations.size
    mobile = mobility(equations, platform_fixed=False)
    dependent = redundancy(equations, platform_fixed=False)
    transports = [equations.transport(node, point) for node, point in places]
    scale = np.tile(equations.scale, len(places))
    given = np.diag(scale) if loads is None else _checked_loads(loads, len(scale))
    F = given / scale[:, None]
    for mechanism in mobile.mechanisms:
        motion = np.zeros((len(scale), mechanism.motions.shape[-1]))
        for i, ((node, _), D) in enumerate(zip(places, transports, strict=True)):
            if node in mechanism.nodes:
                own = mechanism.motions[mechanism.nodes.index(node)]
                motion[n * i : n * (i + 1)] = D @ own
        work = np.abs(F.T @ motion).max(axis=1, initial=0.0)
        if np.any(work > tolerance.independence * np.linalg.norm(F, axis=0)):
            column = int(np.argmax(work))
            node, point = places[column // n if loads is None else 0]
            what = f"at {point.tolist()} of node {node!r}" if loads is None else f"of load {column}"
            raise NoAnswerError(f"no compliance {what}: {Status.FREE_MOTIONS.advice[0]}")
    system = saddle_point_system(equations, set(network.fixed), mobile, dependent)
    right = np.zeros((system.size, F.shape[1]))
    for i, ((node, _), D) in enumerate(zip(places, transports, strict=True)):
        right[system.rows_of[node]] += D.T @ F[n * i : n * (i + 1)]
    x, step = system.solve(right)
    if step > CONVERGED:
        raise NoAnswerError(f"no compliance: {Status.ILL_CONDITIONED.advice[0]}")
    C = right.T @ x / equations.stiffness
    C = 0.5 * (C + C.T)
    return C / np.outer(scale, scale) if loads is None else C


def _checked_loads(loads: ArrayLike, size: int) -> np.ndarray:
    F = as_floats("loads", loads, f"numbers ({size}, k), a load in each column [N, N m]")
    if F.ndim != 2 or F.shape[0] != size:
        raise InputError(
            "loads",
            got=F.shape,
            expected=f"a shape ({size}, k): a wrench at every point, a load in each column",
        )
    return F


def _checked(network: Network, node: str, point: ArrayLike) -> tuple[str, np.ndarray]:
    names = [known.name for known in network.nodes]
    if node not in names:
        raise InputError(
            "node of a point", got=node, expected=f"the name of a node: {', '.join(names[:12])}"
        )
    place = as_floats(f"point of node {node!r}", point, "three numbers x y z [m]", "m")
    if place.shape != (3,):
        raise InputError(f"point of node {node!r}", got=point, expected="three numbers x y z [m]")
    return node, place
