"""Masses of a robot, and small vibrations about an equilibrium: motions that closures allow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.frozen import field, frozen
from robostiff.model import PlacedMass, PlacedSpring
from robostiff.spatial import cross, twist_transport
from robostiff.statics.chains.elements import FiniteJoint, Spot
from robostiff.statics.chains.legs import Legs, LegState
from robostiff.statics.equations.problem import EquilibriumProblem, Linearised, State
from robostiff.statics.equations.stability import (
    null_motions,
    unit_sizes,
    unloaded_curvature,
    whole_closure,
)

# Cosine, less than one by this: an elastic part whose own x axis is not along it.
_ASIDE = 1e-9
# Of the points from -1 to 1: the squares of cubics are integrated exactly.
_GAUSS = np.polynomial.legendre.leggauss(4)
# Of the largest singular value of the masses, whose roots are taken: none.
_MASSLESS = 1e-9
# Of the largest stiffness, or square of a frequency: nothing resists; and condition of a root of
# the stiffness up to which every motion meets more.
_LOOSE, _CLEARLY = 1e-10, 1e5
# Of a frequency: another is the same; and of what the platform moves: not at all.
_SAME, _SMALL = 1e-8, 1e-6


@frozen
class CarriedMass:
    """A mass, and what carries it.

    Attributes
    ----------
    mass : PlacedMass
    spot : Spot
        The body that carries it.
    parts : int
        Of the elements before it the last so many are the elastic part along which it is; 0 for
        a mass on a body.
    part : PlacedSpring or None
        That elastic part.
    end : (3,) array
        Where it ends at the unloaded posture [m].
    """

    mass: PlacedMass
    spot: Spot
    parts: int = 0
    part: PlacedSpring | None = None
    end: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @cached_property
    def is_along_part(self) -> bool:
        """Whether it moves with the sections of an elastic part, rather than with a body."""
        start = self.mass.start
        is_long = start is not None and bool(np.any(self.end - start))
        return self.part is not None and self.parts > 0 and is_long


@frozen
class CarriedMasses:
    """All masses of a robot, at the unloaded posture."""

    on_legs: tuple[CarriedMass, ...] = ()
    on_platform: tuple[PlacedMass, ...] = ()


def velocities(legs: Legs, state: LegState, masses: Sequence[CarriedMass]) -> np.ndarray:
    """Rows B (k, T) of velocities times roots of masses, by all unknowns of legs.

    ``B^T B`` is the mass matrix.
    """
    found = [np.zeros((0, legs.numbers.total))]
    points = [carried for carried in masses if not carried.is_along_part]
    if points:
        spots = [carried.spot for carried in points]
        at = legs.now(state, spots, np.array([carried.mass.centre for carried in points]))
        roots = np.sqrt(np.array([carried.mass.value for carried in points], dtype=float))
        moved = roots[:, None, None] * legs.twists(state, spots, at)[0][:, :3]
        found.append(moved.reshape(3 * len(points), -1))
    along = [carried for carried in masses if carried.is_along_part]
    if along:
        found.append(_velocities_of_parts(legs, state, along))
    return np.concatenate(found)


def _velocities_of_parts(legs: Legs, state: LegState, masses: Sequence[CarriedMass]) -> np.ndarray:
    """As `velocities`, of masses along elastic parts.

    An element of a part is straight between its ends where these are now, and its sections move as
    `motion_of_section` says.
    """
    n = np.array([carried.parts for carried in masses])
    of_mass = np.repeat(np.arange(len(masses)), n)  # of each element
    i = np.concatenate([np.arange(carried.parts) for carried in masses])
    near = [
        Spot(spot.chain, spot.after - carried.parts + k)
        for carried in masses
        for spot in (carried.spot,)
        for k in range(carried.parts)
    ]
    ends = [*near, *(spot._replace(after=spot.after + 1) for spot in near)]
    R, t = legs.places_of(state, ends)
    start = np.array([carried.mass.start for carried in masses])[of_mass]
    x = np.array([carried.end for carried in masses])[of_mass] - start
    y = np.array([carried.part.rotation[:, 1] for carried in masses if carried.part])[of_mass]
    n, count = n[of_mass], len(near)
    # ends of all elements, and their axes, as they are now
    steps = np.concatenate([i, i + 1]) / np.tile(n, 2)
    at = (R @ (np.tile(start, (2, 1)) + np.tile(x, (2, 1)) * steps[:, None])[..., None])[..., 0] + t
    chord = at[count:] - at[:count]
    axes = _axes(chord, ((R[:count] + R[count:]) @ y[..., None])[..., 0])
    shear, radii = (np.array(v)[of_mass] for v in zip(*map(_beam_numbers, masses), strict=True))
    spans, aside = (np.array(v)[of_mass] for v in zip(*map(_spread, masses), strict=True))
    aside = (np.swapaxes(_axes(x, y), -1, -2) @ aside[..., None])[..., 0]
    # sections, as parts s of their elements, and their masses; a mass at one point is all in one
    first, last = (spans * n[:, None] - i[:, None]).T
    is_point, low, high = first == last, np.maximum(first, 0.0), np.minimum(last, 1.0)
    s = low[:, None] + 0.5 * (1.0 + _GAUSS[0]) * (high - low)[:, None]
    share = np.maximum(high - low, 0.0) / np.where(is_point, 1.0, last - first)
    is_in = np.minimum((spans[:, 0] * n).astype(int), n - 1) == i
    s, share = np.where(is_point[:, None], first[:, None], s), np.where(is_point, is_in, share)
    weight = np.array([carried.mass.value for carried in masses], dtype=float)[of_mass] * share
    # their velocities by those of both ends, and these by the unknowns
    length = np.linalg.norm(chord, axis=-1)
    phi = shear / (x * x).sum(axis=-1)[:, None] * (n * n)[:, None]
    rows = motion_of_section(s, length[:, None], phi[:, None])
    roots = np.sqrt(0.5 * weight[:, None] * _GAUSS[1])
    rows = twist_transport(aside)[:, None] @ rows * roots[..., None, None]
    rows[..., 3:, :] *= radii[:, None, :, None]
    rows = np.linalg.qr(rows.reshape(count, -1, 12), mode="r")
    twists = legs.twists(state, ends, at)[0].reshape(2, count, 2, 3, -1)
    of_ends = np.swapaxes(axes, -1, -2)[None, :, None] @ twists
    both = np.moveaxis(of_ends, 0, 1).reshape(count, 12, -1)
    return (rows @ both).reshape(12 * count, -1)


def _beam_numbers(carried: CarriedMass) -> tuple[tuple[float, float], np.ndarray]:
    """``12 E I / (G A)`` in x-y and x-z [m^2], and radii of gyration (3,) of spread mass [m]."""
    part, x = cast("PlacedSpring", carried.part), carried.end - carried.mass.start
    beam = part.elasticity.as_beam
    if beam is None or part.rotation[:, 0] @ x < (1 - _ASIDE) * np.linalg.norm(x):
        return (0.0, 0.0), np.zeros(3)
    radii = np.sqrt(np.array([beam.EIy + beam.EIz, beam.EIy, beam.EIz]) / beam.EA)
    shear = 12 * beam.EIz * beam.shear_y, 12 * beam.EIy * beam.shear_z
    return shear, radii if carried.mass.span is not None else np.zeros(3)


def _spread(carried: CarriedMass) -> tuple[tuple[float, float], np.ndarray]:
    """Where along its part a mass begins and ends, and how far it is beside it (3,) [m]."""
    mass = carried.mass
    if mass.span is not None:
        return mass.span, np.zeros(3)
    x, aside = carried.end - mass.start, np.asarray(mass.centre, dtype=float) - mass.start
    s = float(np.clip(aside @ x / (x @ x), 0.0, 1.0))
    return (s, s), aside - s * x


def motion_of_section(s: ArrayLike, length: ArrayLike, phi: ArrayLike) -> np.ndarray:
    """Twist (6,) of a section of a beam by those of its ends (12,), as under loads at its ends.

    Stretch and torsion are linear. Bending in x-y has, with ``f = 12 E I_z / (G A_y L^2)``, the
    displacement ``((1 - 3 s^2 + 2 s^3 + f (1 - s)) v_1 + (3 s^2 - 2 s^3 + f s) v_2 + L (s - 2 s^2 +
    s^3 + f (s - s^2)/2) r_1 + L (s^3 - s^2 - f (s - s^2)/2) r_2) / (1 + f)``, and sections turn by
    its slope less the shear; in x-z alike, with turns the other way round. The mass matrix that
    follows is the consistent one, with 13/35, 11/210 and 9/70 where ``f`` is zero.

    Parameters
    ----------
    s : (...) array
        Part of the length before the section.
    length : (...) array
        Of the beam, along x [m].
    phi : (..., 2) array
        f in x-y and in x-z; 0 of a beam without shear.

    Returns
    -------
    (..., 6, 12) array
        Axes of the beam, each twist about its own end or the section [m, rad].

    Notes
    -----
    J. S. Przemieniecki, Theory of Matrix Structural Analysis, McGraw-Hill 1968, section 11.3.

    Examples
    --------
    >>> motion_of_section(0.5, 2.0, (0.0, 0.0))[1, [1, 5, 7, 11]]
    array([ 0.5 ,  0.25,  0.5 , -0.25])
    """
    s, length = np.asarray(s, dtype=float), np.asarray(length, dtype=float)
    found = np.zeros((*s.shape, 6, 12))
    for row in (0, 3):
        found[..., row, row], found[..., row, row + 6] = 1 - s, s
    bent = s - s**2
    for v, r, sign, f in zip(
        (1, 2), (5, 4), (1.0, -1.0), np.moveaxis(np.asarray(phi), -1, 0), strict=True
    ):
        columns, L = [v, r, v + 6, r + 6], sign * length
        of_shift = (
            1 - 3 * s**2 + 2 * s**3 + f * (1 - s),
            L * (bent * (1 - s) + f * bent / 2),
            3 * s**2 - 2 * s**3 + f * s,
            -L * (bent * s + f * bent / 2),
        )
        of_turn = (
            -6 * bent / L,
            1 - 4 * s + 3 * s**2 + f * (1 - s),
            6 * bent / L,
            3 * s**2 - 2 * s + f * s,
        )
        for row, factors in ((v, of_shift), (r, of_turn)):
            for column, entry in zip(columns, factors, strict=True):
                found[..., row, column] = entry / (1 + f)
    return found


def _axes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Columns (..., 3, 3): unit vectors along x, across it towards y, and across both."""
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    y = y - (x * y).sum(axis=-1, keepdims=True) * x
    aside = np.linalg.norm(y, axis=-1) < _ASIDE  # of a part whose own axes are not along it
    if np.any(aside):
        other = np.eye(3)[np.argmin(np.abs(x), axis=-1)]
        y = np.where(aside[..., None], other - (x * other).sum(axis=-1, keepdims=True) * x, y)
    y = y / np.linalg.norm(y, axis=-1, keepdims=True)
    return np.stack([x, y, cross(x, y)], axis=-1)


def vibrations(
    problem: EquilibriumProblem, masses: CarriedMasses, known: Linearised, state: State
) -> tuple[np.ndarray, Callable[[], np.ndarray]]:
    """Squares of angular frequencies (k,) [rad^2/s^2], slowest first, and what has motions (k, n).

    Small vibrations about a state where the equations are known, over the free coordinates of legs
    and the twist of the platform. The squares are negative where the robot leaves the equilibrium;
    motions have the kinetic energy 1/2 at unit velocity. Those without mass are at rest in the
    others' balance. Where every motion meets stiffness, frequencies are the inverse singular values
    of ``B`` over motions of unit energy: the slow ones keep their digits beside the fast ones.
    """
    legs, r = problem.legs, problem.size
    number = np.full(legs.numbers.total, -1)
    number[problem.free] = np.arange(len(problem.free))
    n = len(problem.free) + r
    stiff = np.zeros(n)
    for g, block in enumerate(problem.blocks):
        curvature = np.diagonal(unloaded_curvature(legs, g), axis1=-2, axis2=-1)
        stiff[number[block.coordinates]] = curvature
    # motions that keep the robot together, in robot lengths and radians
    C = whole_closure(known) * np.append(
        problem.units[problem.free], problem.scale / problem.length
    )
    size = unit_sizes(C, stiff)
    C = C * size
    rows = np.linalg.norm(C, axis=1)
    ((_, motions),) = null_motions((C / np.where(rows > 0, rows, 1.0)[:, None])[None])
    Z = motions[0] * size[:, None]
    # second variation of the energy, less the work of loads and wrenches
    KZ = np.zeros(Z.shape)
    KZ[n - r :] = (known.K_total - known.K) @ Z[n - r :]
    for block, A in zip(problem.blocks, known.equations.A, strict=True):
        at = number[block.coordinates]
        KZ[at] = A[:, : block.free, : block.free] @ Z[at]
    B, K = mass_rows(problem, masses, state) @ Z, Z.T @ KZ
    K = 0.5 * (K + K.T)
    try:
        L = np.linalg.cholesky(K)
        inverse = np.linalg.inv(L)
    except np.linalg.LinAlgError:
        return _without_stiffness(Z, K, B)
    if not np.linalg.norm(L) * np.linalg.norm(inverse) < _CLEARLY:
        return _without_stiffness(Z, K, B)
    B = B @ inverse.T
    values = np.linalg.svd(B, compute_uv=False)  # a third of the time of all
    values = values[values > _MASSLESS * np.max(values, initial=0.0)]
    return 1.0 / values**2, partial(_shapes, Z @ inverse.T, B, len(values), r)


def _shapes(Z: np.ndarray, B: np.ndarray, count: int, r: int) -> np.ndarray:
    """Motions ``Z v / s`` (count, n) of the largest singular values s of B.

    Of those of one frequency the first takes all of what the platform moves along the first of its
    r coordinates, which are the last of Z, and so on: rounding does not choose them.
    """
    _, values, Vt = np.linalg.svd(B, full_matrices=False)
    motions = (Z @ Vt[:count].T / values[:count]).T
    starts = np.flatnonzero(np.diff(values[:count]) < -_SAME * values[1:count]) + 1
    for own in np.split(np.arange(count), starts):
        moved = motions[own, -r:]
        sizes = np.linalg.norm(moved, axis=0)
        if len(own) > 1 and sizes.any():
            Q = np.linalg.qr(moved[:, sizes > _SMALL * sizes.max()], mode="complete")[0]
            motions[own] = Q.T @ motions[own]
    return motions


def _without_stiffness(
    Z: np.ndarray, K: np.ndarray, B: np.ndarray
) -> tuple[np.ndarray, Callable[[], np.ndarray]]:
    """Where some motion meets no stiffness, or a negative one."""
    least = _LOOSE * np.max(np.abs(np.linalg.eigvalsh(K)), initial=0.0)
    _, values, Vt = np.linalg.svd(B)
    k = int(np.sum(values > _MASSLESS * np.max(values, initial=0.0)))
    heavy, light = Vt[:k].T / values[:k], Vt[k:].T
    w, Q = np.linalg.eigh(light.T @ K @ light)
    stiff = np.abs(w) > least
    follow = light @ Q[:, stiff]
    moved = heavy - follow @ ((follow.T @ K @ heavy) / w[stiff][:, None])
    squares, modes = np.linalg.eigh(moved.T @ K @ moved)
    none = np.abs(squares) <= _LOOSE * np.max(np.abs(squares), initial=0.0)
    return np.where(none, 0.0, squares), partial(np.array, (Z @ moved @ modes).T)


def mass_rows(problem: EquilibriumProblem, masses: CarriedMasses, state: State) -> np.ndarray:
    """B (k, n) of all masses and drives by free coordinates and twist; ``B^T B`` is their matrix.

    Velocities of points times roots of masses.
    """
    r, legs, rows, free = problem.size, problem.legs, list(problem.rows), len(problem.free)
    pairs = [(coupling.drive, a) for coupling, a in zip(legs.couplings, legs.sum_rows, strict=True)]
    for (c, k), at in legs.places.items():
        element, unit = legs.chains[c].elements[k], np.zeros(legs.numbers.total)
        if isinstance(element, FiniteJoint) and element.inertia:
            unit[legs.numbers.x[at]] = 1.0
            pairs.append((element, unit))
    moving = [np.sqrt(drive.inertia) * a[problem.free] for drive, a in pairs if drive.inertia]
    each = [np.array(moving).reshape(-1, free)]
    if masses.on_legs:
        each.append(velocities(legs, state.legs, masses.on_legs)[:, problem.free])
    found = [np.pad(np.concatenate(each), [(0, 0), (0, r)])]
    for mass in masses.on_platform:
        b = state.R @ (mass.centre - problem.point)
        rate = twist_transport(b)[:3, rows]
        found.append(np.pad(np.sqrt(float(mass.value)) * rate, [(0, 0), (free, 0)]))
    return np.concatenate(found)
