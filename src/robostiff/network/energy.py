"""Stiffness of a platform by minimising the elastic energy, with nothing else shared."""

from __future__ import annotations

import numpy as np
from scipy.linalg import qr, solve_triangular

from robostiff.elastostatics import Status, Tolerance
from robostiff.errors import NoAnswerError
from robostiff.kinematics import freedom_twist
from robostiff.network.beam_matrix import beam_stiffness_12
from robostiff.network.elements import BeamElement, JointElement, SpringElement
from robostiff.network.equations import Equations, equations_of
from robostiff.network.network import Network
from robostiff.spatial import block_rotation, rotate_stiffness

_DEFAULT_TOLERANCE = Tolerance()


def energy_stiffness(network: Network, tolerance: Tolerance = _DEFAULT_TOLERANCE) -> np.ndarray:
    """Stiffness about the reference point as the Hessian of the least elastic energy, ``Z^T H Z``.

    Unknowns are the displacements of all bodies and the coordinates of all joints and springs; H
    is their elastic energy, and what connects them holds as constraints, eliminated by their null
    space. Z, the state of least energy for each unit displacement of the platform, enters squared:
    an error of it changes the energy in second order only. Dense, so for networks of some hundred
    bodies: it is a check of `condense`, with which it shares neither W nor S.

    Parameters
    ----------
    network : Network
    tolerance : Tolerance

    Returns
    -------
    (n, n) array
        [N/m, N, N m], n = 6 or 3 in the plane.

    Raises
    ------
    NoAnswerError
        When rigid parts alone hold the platform in some direction.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02))
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> round(energy_stiffness(network)[0, 0].item())
    65973446
    """
    equations = equations_of(network, tolerance)
    n = equations.size
    bodies = {name: slice(n * i, n * (i + 1)) for i, name in enumerate(network.free_nodes)}
    coordinates = [
        _coordinates(element, equations) for element in (*network.springs, *network.joints)
    ]
    size = n * len(bodies) + sum(len(k) for _, k in coordinates)
    H, G = _beam_energy(equations, bodies, size), np.zeros((n * len(coordinates), size))
    column = n * len(bodies)
    for i, (element, (T, k)) in enumerate(
        zip((*network.springs, *network.joints), coordinates, strict=True)
    ):
        rows, own = slice(n * i, n * (i + 1)), slice(column, column := column + len(k))
        for name, sign in ((element.a, -1.0), (element.b, 1.0)):
            if name in bodies:
                G[rows, bodies[name]] = sign * equations.transport(name, _point(element, equations))
        G[rows, own] = -T
        H[own, own] = np.diag(k)
    return _condensed(H, G, bodies[network.platform], equations)


def _condensed(H: np.ndarray, G: np.ndarray, platform: slice, equations: Equations) -> np.ndarray:
    """Least energy for unit displacements of the platform, subject to G z = 0."""
    n = equations.size
    others = np.delete(np.arange(len(H)), np.arange(platform.start, platform.stop))
    Z = np.zeros((len(H), n))
    Z[platform] = np.eye(n)
    start, N = _solutions(G[:, others], -G[:, platform], equations.tolerance)
    Z[others] = start
    gradient = N.T @ (H @ Z)[others]
    if N.shape[1]:
        Z[others] -= N @ np.linalg.lstsq(N.T @ H[np.ix_(others, others)] @ N, gradient)[0]
    to_reference = equations.transport(
        equations.network.platform, equations.network.reference_point
    )
    Z = Z @ np.linalg.inv(to_reference)
    return Z.T @ H @ Z * np.outer(equations.scale, equations.scale) * equations.stiffness


def _solutions(
    G: np.ndarray, right: np.ndarray, tolerance: Tolerance
) -> tuple[np.ndarray, np.ndarray]:
    """One solution of G z = right, and a basis of null(G), by pivoted QR."""
    Q, R, order = (np.asarray(part) for part in qr(G.T, pivoting=True))
    size = np.abs(np.diagonal(R))
    rank = int(np.count_nonzero(size > tolerance.independence * size.max(initial=0.0)))
    y = solve_triangular(R[:rank, :rank], right[order[:rank]], trans=1)
    gap = R[:rank, rank:].T @ y - right[order[rank:]]
    if np.abs(gap).max(initial=0.0) > tolerance.independence:
        raise NoAnswerError(f"no stiffness: {Status.RIGID_DIRECTION.advice[0]}")
    return Q[:, :rank] @ y, Q[:, rank:]


def _beam_energy(equations: Equations, bodies: dict[str, slice], size: int) -> np.ndarray:
    H = np.zeros((size, size))
    rows = list(equations.network.space.rows)
    both = rows + [row + 6 for row in rows]
    s = np.tile(equations.scale, 2)
    for beam in equations.network.beams:
        R = np.kron(np.eye(2), block_rotation(beam.rotation))
        K = R @ beam_stiffness_12(_inverse(beam), beam.length) @ R.T
        K = K[np.ix_(both, both)] / np.outer(s, s) / equations.stiffness
        n = equations.size
        ends = ((beam.a, beam.start, K[:n]), (beam.b, beam.end, K[n:]))
        for name, point, _ in ends:
            for other, other_point, _ in ends:
                if name in bodies and other in bodies:
                    i, j = (n * (node == beam.b) for node in (name, other))
                    H[bodies[name], bodies[other]] += (
                        equations.transport(name, point).T
                        @ K[i : i + n, j : j + n]
                        @ equations.transport(other, other_point)
                    )
    return H


def _inverse(beam: BeamElement) -> np.ndarray:
    """Stiffness of the tip, inverted in units in which lengths and angles compare."""
    s = np.repeat([1.0, beam.length], 3)
    return np.linalg.inv(beam.tip_compliance * np.outer(s, s)) * np.outer(s, s)


def _point(element: SpringElement | JointElement, equations: Equations) -> np.ndarray:
    point = element.point
    return equations.points[element.a] if point is None else point


def _coordinates(
    element: SpringElement | JointElement, equations: Equations
) -> tuple[np.ndarray, np.ndarray]:
    """Scaled twists of a connection per unit of each coordinate (n, m), and stiffnesses (m,)."""
    rows, scale = list(equations.network.space.rows), equations.scale
    if isinstance(element, SpringElement):
        C = rotate_stiffness(element.elasticity.compliance, element.rotation)[np.ix_(rows, rows)]
        values, modes = np.linalg.eigh(C * np.outer(scale, scale) * equations.stiffness)
        soft = values > equations.tolerance.rigidity * values.sum()
        J = (block_rotation(element.rotation) @ element.elasticity.freedoms)[rows] * scale[:, None]
        J = J / np.linalg.norm(J, axis=0)
        k = np.concatenate([1.0 / values[soft], np.zeros(J.shape[1])])
        return np.hstack([modes[:, soft], J]), k
    moving = [f for f in element.freedoms if f.is_passive or f.stiffness is not None]
    at = _point(element, equations)
    T = np.zeros((len(rows), len(moving)))
    k = np.zeros(len(moving))
    for i, freedom in enumerate(moving):
        twist = freedom_twist(freedom, at)[rows] * scale
        size = np.linalg.norm(twist)
        T[:, i] = twist / size
        if not freedom.is_passive:
            k[i] = freedom.stiffness / size**2 / equations.stiffness
    return T, k
