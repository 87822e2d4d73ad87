"""Stiffness of a platform by minimising the elastic energy, as an independent check."""

from __future__ import annotations

import numpy as np

from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.errors import NoAnswerError, TooFewDigitsError
from robostiff.network.elements import JointElement, SpringElement, beam_stiffness_12
from robostiff.network.equations import Equations, equations_of
from robostiff.network.network import Network
from robostiff.spatial import block_rotation
from robostiff.spatial.batch import Float

_ROUNDING = 1e-13
# Of the constraints: rounding moves what they determine by as many times its own size.
_NEARLY_DEPENDENT = 2e-7
_LOST = 1e-10  # of the energy
_BITS = np.finfo(float).nmant + 1


def energy_stiffness(network: Network, tolerance: Tolerance = DEFAULT_TOLERANCE) -> np.ndarray:
    """Stiffness about the reference point, the Hessian ``(E Z)^T E Z`` of the least energy.

    Unknowns are the displacements of all bodies and the coordinates of all joints and springs; the
    rows of E are what each spring stores, ``(E z)^T E z / 2``, and connections hold as constraints,
    eliminated by their null space. Z, the state of least energy for each unit displacement of the
    platform, enters squared: an error of it changes the energy in second order only. Dense, so for
    networks of some hundred bodies: it is a check of `condense`, with which it shares neither W nor
    S.

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
        When the platform is rigid in some direction.
    TooFewDigitsError
        When springs differ so much, or joints are so near a singular arrangement, that the minimum
        has fewer than nine digits.

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
    elements = (*network.springs, *network.joints)
    coordinates = [_coordinates(element, equations) for element in elements]
    size = n * len(bodies) + sum(len(k) for _, k in coordinates)
    G, E = np.zeros((n * len(coordinates), size)), [_beam_energy(equations, bodies, size)]
    column, first = n * len(bodies), dict[int, int]()
    for i, (element, (T, k)) in enumerate(zip(elements, coordinates, strict=True)):
        first[id(element)] = column
        rows, own = slice(n * i, n * (i + 1)), slice(column, column := column + len(k))
        for name, sign in ((element.a, -1.0), (element.b, 1.0)):
            if name in bodies:
                G[rows, bodies[name]] = sign * equations.transport(name, _point(element, equations))
        G[rows, own] = -T
        stored = np.zeros((len(k), size))
        stored[:, own] = np.diag(np.sqrt(k))
        E.append(stored[k > 0])
    for own in network.couplings:
        row = np.zeros(size)
        for joint, number, factor in own.terms:
            place = joint.place(number)
            if place is None:
                continue
            k = first[id(joint)] + place
            twist = joint.freedoms[number].twist(_point(joint, equations))
            rows = list(network.space.rows)
            row[k] = factor / np.linalg.norm(twist[rows] * equations.scale)
        if own.stiffness is None:
            G = np.vstack([G, row / np.linalg.norm(row)])
        else:
            E.append(row[None] * np.sqrt(own.stiffness / equations.stiffness))
    return _condense(np.vstack(E), G, bodies[network.platform], equations)


def _condense(E: np.ndarray, G: np.ndarray, platform: slice, equations: Equations) -> np.ndarray:
    """Least energy for unit displacements of the platform, subject to G z = 0."""
    from scipy.linalg import qr, solve_triangular

    n = equations.size
    others = np.delete(np.arange(E.shape[1]), np.arange(platform.start, platform.stop))
    Z = np.zeros((E.shape[1], n))
    Z[platform] = np.eye(n)
    Z[others], N = _solutions(G[:, others], -G[:, platform], equations.tolerance)
    # The motions that deflect some spring, without those of passive joints only.
    size = np.linalg.norm(E[:, others], axis=1, keepdims=True)
    values, Vt = np.linalg.svd(E[:, others] / np.where(size > 0, size, 1.0) @ N)[1:]
    N = N @ Vt[: np.count_nonzero(values > equations.tolerance.independence)].T
    before = np.linalg.norm(E @ Z)
    if N.shape[1]:
        A = E[:, others] @ N
        # Soft motions are lost in the rounding of stiff springs that they do not deflect: it leaves
        # them an error of eps largest / smallest, and the energy its square.
        largest = np.linalg.norm(E, axis=1).max()
        smallest = np.linalg.svd(A, compute_uv=False)[-1]
        if (np.finfo(float).eps * largest) ** 2 > _LOST * smallest**2:
            raise TooFewDigitsError(
                f"no stiffness by least energy: springs differ by {(largest / smallest) ** 2:.0e}, "
                "which leaves the energy fewer than nine digits"
            )
        # Least squares, each row to its own digits: Householder QR is that accurate where large
        # rows come first and columns are pivoted.
        order = np.argsort(-np.linalg.norm(A, axis=1), kind="stable")
        Q, R, columns = (np.asarray(p) for p in qr(A[order], mode="economic", pivoting=True))
        x = np.zeros((A.shape[1], n))
        x[columns] = solve_triangular(R, Q.T @ (E @ Z)[order])
        Z[others] -= N @ x
    if np.linalg.norm(E @ Z) <= _ROUNDING * before:
        return np.zeros((n, n))  # every motion of the platform is free
    to_reference = equations.transport(
        equations.network.platform, equations.network.reference_point
    )
    Z = Z @ np.linalg.inv(to_reference)
    stored = E @ Z
    return stored.T @ stored * np.outer(equations.scale, equations.scale) * equations.stiffness


def _solutions(
    G: np.ndarray, right: np.ndarray, tolerance: Tolerance
) -> tuple[np.ndarray, np.ndarray]:
    """One solution of G z = right, and a basis of null(G), by pivoted QR.

    Both are refined: where no motion is left to minimise over, their small entries are the answer.
    """
    from scipy.linalg import qr, solve_triangular

    Q, R, order = (np.asarray(part) for part in qr(G.T, pivoting=True))
    size = np.abs(np.diagonal(R))
    rank = int(np.count_nonzero(size > tolerance.independence * size.max(initial=0.0)))
    if rank and size[rank - 1] < _NEARLY_DEPENDENT * size[0]:
        raise TooFewDigitsError(
            f"no stiffness by least energy: joints within {size[rank - 1] / size[0]:.0e} of a "
            "singular arrangement leave it fewer than nine digits"
        )
    held, kept = Q[:, :rank], order[:rank]

    def moved(gaps: np.ndarray) -> np.ndarray:
        return held @ solve_triangular(R[:rank, :rank], gaps, trans=1)

    y = solve_triangular(R[:rank, :rank], right[kept], trans=1)
    gap = R[:rank, rank:].T @ y - right[order[rank:]]
    if np.abs(gap).max(initial=0.0) > tolerance.independence:
        raise NoAnswerError(f"no stiffness: {Status.RIGID_DIRECTION.advice[0]}")
    z, free = held @ y, Q[:, rank:]
    z = z + moved(residual(G[kept], z, right[kept]))
    return z, free + moved(residual(G[kept], free, np.zeros((rank, free.shape[1]))))


def _beam_energy(equations: Equations, bodies: dict[str, slice], size: int) -> np.ndarray:
    """Energy of beams, six rows each: L^-1 K_b with K = [[., .], [K_ba, K_bb]], K_bb = L L^T."""
    rows = list(equations.network.space.rows)
    both, n = rows + [row + 6 for row in rows], equations.size
    s = np.tile(equations.scale, 2)
    energies = [np.zeros((0, size))]
    for beam in equations.network.beams:
        R = np.kron(np.eye(2), block_rotation(beam.rotation))
        # Inverted in units in which lengths and angles are comparable.
        units = np.outer(*[np.repeat([1.0, beam.length], 3)] * 2)
        tip_stiffness = np.linalg.inv(beam.tip_compliance * units) * units
        K = R @ beam_stiffness_12(tip_stiffness, beam.length) @ R.T
        K = K[np.ix_(both, both)] / np.outer(s, s) / equations.stiffness
        stored = np.linalg.solve(np.linalg.cholesky(K[n:, n:]), K[n:])
        energies.append(np.zeros((n, size)))
        ends = ((beam.a, beam.start, stored[:, :n]), (beam.b, beam.end, stored[:, n:]))
        for name, point, own in ends:
            if name in bodies:
                energies[-1][:, bodies[name]] += own @ equations.transport(name, point)
    return np.vstack(energies)


def _point(element: SpringElement | JointElement, equations: Equations) -> np.ndarray:
    point = element.point
    return equations.points[element.a] if point is None else point


def _coordinates(
    element: SpringElement | JointElement, equations: Equations
) -> tuple[np.ndarray, np.ndarray]:
    """Scaled twists of a connection per unit of each coordinate (n, m), and stiffnesses (m,)."""
    rows, scale = list(equations.network.space.rows), equations.scale
    if isinstance(element, SpringElement):
        R = block_rotation(element.rotation)
        modes = (R @ element.elasticity.modes)[rows] * scale[:, None]
        size = np.linalg.norm(modes, axis=0)
        soft = size > 0
        J = (R @ element.elasticity.freedoms)[rows] * scale[:, None]
        J = J / np.linalg.norm(J, axis=0)
        k = np.concatenate([1 / size[soft] ** 2 / equations.stiffness, np.zeros(J.shape[1])])
        return np.hstack([modes[:, soft] / size[soft], J]), k
    moving, at = element.moving, _point(element, equations)
    T = np.zeros((len(rows), len(moving)))
    k = np.zeros(len(moving))
    for i, freedom in enumerate(moving):
        twist = freedom.twist(at)[rows] * scale
        size = np.linalg.norm(twist)
        T[:, i] = twist / size
        if not freedom.is_passive:
            k[i] = freedom.stiffness / size**2 / equations.stiffness
    return T, k


def residual(
    A: Float[np.ndarray, "m n"], x: Float[np.ndarray, "n k"], b: Float[np.ndarray, "m k"]
) -> Float[np.ndarray, "m k"]:
    """``b - A x``, of which rounding leaves a part of 1e-22 of the sizes of A and x.

    Leading bits of A and x are split off, so few that their products add up exactly. A step of
    refinement with this residual gives all entries of x to their own digits, the small ones too.
    """
    if x.size == 0 or A.size == 0:
        return b.copy()
    bits = (_BITS - int(np.ceil(np.log2(A.shape[1])))) // 2
    A_1, x_1 = _leading(A, bits, 1), _leading(x, bits, 0)
    return ((b - A_1 @ x_1) - A_1 @ (x - x_1)) - (A - A_1) @ x


def _leading(values: np.ndarray, bits: int, axis: int) -> np.ndarray:
    """Values rounded to so many bits of the largest along an axis."""
    _, exponent = np.frexp(np.max(np.abs(values), axis=axis, keepdims=True))
    shift = np.ldexp(1.0, exponent + (_BITS - bits))
    return (values + shift) - shift
