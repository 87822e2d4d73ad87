"""Masses of a robot, and small vibrations about an equilibrium: motions that closures allow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.frozen import field, frozen
from robostiff.kept import kept
from robostiff.model import PlacedMass, PlacedSpring
from robostiff.one_thread import in_one_thread
from robostiff.spatial import cross, twist_transport
from robostiff.statics.chains.elements import Spot
from robostiff.statics.chains.legs import Legs, State
from robostiff.statics.chains.numbers import ComponentBlock, side_by_side
from robostiff.statics.equations.problem import EquilibriumProblem, Linearised
from robostiff.statics.equations.stability import elastic_curvature, held_motions, of_unit_energy

# Cosine, less than one by this: an elastic part whose own x axis is not along it.
_ASIDE = 1e-9
_NOWHERE = np.zeros(3)
# Of the points from -1 to 1: the squares of cubics are integrated exactly.
_GAUSS = np.polynomial.legendre.leggauss(4)
# Of the largest singular value of the masses, whose roots are taken: none.
_MASSLESS = 1e-9
# Of the largest stiffness, or square of a frequency: nothing resists.
_LOOSE = 1e-10
# Of the length of the robot: the arm of a mass in the joint that turns it.
_ROUNDING = 1e-14
# Of the largest root of a stiffness of the platform: it has none beside those of rigid parts.
_RIGID = 1e-12
# Of a frequency: another is the same; and of what the platform moves: not at all.
_SAME, _SMALL = 1e-8, 1e-6


@frozen
class CarriedMass:
    """A mass, and what carries it."""

    mass: PlacedMass
    spot: Spot  #: the body that carries it
    #: where the elements of the elastic part along which it is begin and end, as parts of its
    #: length; the last of them is before that body. Empty for a mass on a body.
    cuts: tuple[float, ...] = ()
    part: PlacedSpring | None = None  #: that elastic part
    #: (3,): where it ends at the unloaded posture [m]
    end: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @cached_property
    def parts(self) -> int:
        """Number of these elements."""
        return max(len(self.cuts) - 1, 0)

    @cached_property
    def is_along_part(self) -> bool:
        """Whether it moves with the sections of an elastic part, rather than with a body."""
        start = self.mass.start
        is_long = start is not None and bool(np.any(self.end - start))
        return self.part is not None and self.parts > 0 and is_long


@frozen(eq=False)
class CarriedMasses:
    """All masses of a robot, at the unloaded posture."""

    on_legs: tuple[CarriedMass, ...] = ()
    on_platform: tuple[PlacedMass, ...] = ()


def _rows_of_parts(legs: Legs, state: State, masses: Sequence[CarriedMass]) -> np.ndarray:
    """Twelve rows (E, 12, m) of each of the E elements of elastic parts along which masses are.

    An element of a part is straight between its ends where these are now, and its sections move as
    `motion_of_section` says.
    """
    P, counts = legs.robots, [carried.parts for carried in masses]
    of_mass = np.repeat(np.arange(P * len(masses)), np.tile(counts, P))  # of each element
    each = [(c, k) for c, n in zip(masses, counts, strict=True) for k in range(n)]
    begin, end = np.tile([c.cuts[k : k + 2] for c, k in each], (P, 1)).T
    bodies = ((c.spot.chain, c.spot.after - c.parts + k) for c, k in each)
    ends = [Spot(chain, after + i) for chain, after in bodies for i in (0, 1)]
    R, t = legs.places_of(state, ends)
    R, t = R.reshape(-1, 2, 3, 3), t.reshape(-1, 2, 3)
    parts = [cast("PlacedSpring", carried.part) for carried in masses]
    starts = side_by_side(P, [carried.mass.start for carried in masses], 3)
    along = side_by_side(P, [carried.end for carried in masses], 3) - starts
    axes = side_by_side(P, [part.rotation for part in parts], 3, 3)
    y = axes[of_mass, :, 1]
    start, x = starts[of_mass], along[of_mass]
    # ends of all elements, and their axes, as they are now
    steps = np.stack([begin, end], axis=-1)[..., None]
    at = (R @ (start[:, None] + x[:, None] * steps)[..., None])[..., 0] + t
    chord = at[:, 1] - at[:, 0]
    now = _axes(chord, (R.sum(axis=1) @ y[..., None])[..., 0])
    # of beams along their own x: ``12 E I / (G A)`` in x-y and x-z [m^2], and, of spread mass,
    # squares of radii of gyration [m^2]
    is_beam = (axes[..., 0] * along).sum(axis=-1) >= (1 - _ASIDE) * np.linalg.norm(along, axis=-1)
    numbers = side_by_side(P, [x for carried in masses for x in _beam_numbers(carried)], 5)
    numbers[~is_beam[of_mass]] = 0.0
    spans, aside = zip(*map(_spread, masses), strict=True)
    spans, aside = side_by_side(P, spans, 2)[of_mass], side_by_side(P, aside, 3)[of_mass]
    aside = (np.swapaxes(_axes(x, y), -1, -2) @ aside[..., None])[..., 0]
    # sections, as parts s of their elements, and their masses; a mass at one point is all in one
    first, last = ((spans - begin[:, None]) / (end - begin)[:, None]).T
    is_point, low, high = first == last, np.maximum(first, 0.0), np.minimum(last, 1.0)
    s = low[:, None] + 0.5 * (1.0 + _GAUSS[0]) * (high - low)[:, None]
    share = np.maximum(high - low, 0.0) / np.where(is_point, 1.0, last - first)
    is_in = (spans[:, 0] >= begin) & ((spans[:, 0] < end) | (end == 1.0))
    s, share = np.where(is_point[:, None], first[:, None], s), np.where(is_point, is_in, share)
    weight = side_by_side(P, [carried.mass.value for carried in masses])[of_mass] * share
    # their velocities by those of both ends, and these by the unknowns
    phi = numbers[:, :2] / ((x * x).sum(axis=-1) * (end - begin) ** 2)[:, None]
    rows = motion_of_section(s, np.linalg.norm(chord, axis=-1)[:, None], phi[:, None])
    roots = np.sqrt(0.5 * weight[:, None] * _GAUSS[1])
    rows = twist_transport(aside)[:, None] @ rows * roots[..., None, None]
    rows[..., 3:, :] *= np.sqrt(numbers[:, None, 2:, None])
    rows = np.asarray(np.linalg.qr(rows.reshape(len(rows), -1, 12), mode="r"))
    twists = legs.twists(state, ends, at.reshape(-1, 3)).reshape(len(rows), 12, -1)
    return (rows.reshape(-1, 48, 3) @ np.swapaxes(now, -1, -2)).reshape(-1, 12, 12) @ twists


def _beam_numbers(carried: CarriedMass) -> list[np.ndarray]:
    """Those of each element (..., 5)."""
    beams, spread = cast("PlacedSpring", carried.part).elasticity.beams, carried.mass.span
    found = [np.zeros(5)] * (not beams)
    for b in beams:
        of_mass = ((I / b.EA) * (spread is not None) for I in (b.EIy + b.EIz, b.EIy, b.EIz))
        found.append(np.array([12 * b.EIz * b.shear_y, 12 * b.EIy * b.shear_z, *of_mass]).T)
    return [found[k * len(found) // carried.parts] for k in range(carried.parts)]


def _spread(carried: CarriedMass) -> tuple[Any, np.ndarray]:
    """Where along its part a mass begins and ends (..., 2), and how far beside it (..., 3) [m]."""
    mass = carried.mass
    if mass.span is not None:
        return mass.span, _NOWHERE
    x, aside = carried.end - mass.start, np.asarray(mass.centre, dtype=float) - mass.start
    s = np.clip((aside * x).sum(axis=-1) / (x * x).sum(axis=-1), 0.0, 1.0)[..., None]
    return np.repeat(s, 2, axis=-1), aside - s * x


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


#: Squares of angular frequencies (k,) [rad^2/s^2], slowest first, and what has motions (k, n).
Vibrations = tuple[np.ndarray, Callable[[], np.ndarray]]


def vibrations(
    problem: EquilibriumProblem, masses: CarriedMasses, known: Linearised, state: State
) -> list[Vibrations]:
    """Small vibrations of each robot about a state where the equations are known.

    Over the free coordinates of legs and the twist of the platform. The squares are negative where
    the robot leaves the equilibrium; motions have the kinetic energy 1/2 at unit velocity. Those
    without mass are at rest in the others' balance. Empty where robots side by side differ in the
    motions that leave their platforms.

    A motion is one of the platform that the legs follow in balance, and those of each component of
    the legs while the platform stays: these share no elastic energy, and are of unit energy. Where
    every one meets stiffness, frequencies are the inverse singular values of ``B`` over them: the
    slow ones keep their digits beside the fast ones.
    """
    free, r, robots = _motions_of_platform(known), problem.size, problem.legs.robots
    find = _rows_at_rest if state is problem.unloaded else partial(mass_rows, state=state)
    of_legs, chains, of_twist = find(problem, masses)
    K = np.swapaxes(free, -1, -2) @ (known.K_total - known.K) @ free
    f, start, on_platform = free.shape[-1], 0, [of_twist @ free]
    # of components of one kind: their coordinates, and of each robot (P, N, ...) their motions,
    # those with the platform, signs of energies, and rows of masses
    parts = list[tuple[np.ndarray, ...]]()
    for g, (block, A) in enumerate(zip(problem.blocks, known.equations.A, strict=True)):
        N, m = block.coordinates.shape
        rows = _by_component(block, of_legs[:, :m], chains)
        # without masses they follow
        none = [(np.arange(N), np.zeros((N, m, 0)))]
        alone = held_motions(problem, known.equations, g) if rows.shape[1] else none
        for alike, motions in alone:
            n = len(alike) // robots
            of_each = np.add.outer(np.arange(robots) * (N // robots), alike[:n])
            if not np.array_equal(of_each.ravel(), alike):
                return []
            A_x, by_twist = A[alike, :m, :m], known.by_twist[block.coordinates[alike]]
            E, signs = of_unit_energy(np.swapaxes(motions, -1, -2) @ A_x @ motions)
            E = motions @ E
            follow = (by_twist.reshape(robots, -1, m, r) @ free[:, None]).reshape(len(alike), m, f)
            follow -= E @ (signs[..., None] * (np.swapaxes(E, -1, -2) @ (A_x @ follow)))
            K += (np.swapaxes(follow, -1, -2) @ A_x @ follow).reshape(robots, n, f, f).sum(axis=1)
            # as many rows as it has motions, and those that are left over for the platform
            k, both = E.shape[-1], rows[alike] @ np.concatenate([E, follow], axis=-1)
            if both.shape[1] > k:
                both = np.asarray(np.linalg.qr(both, mode="r"))
            on_platform.append(both[:, k:, k:].reshape(robots, n * len(both[0, k:]), f))
            each = (x.reshape(robots, n, *x.shape[1:]) for x in (E, follow, signs, both[:, :k]))
            parts.append((start + np.add.outer(alike[:n] * m, np.arange(m)), *each))
        start += block.coordinates.size // robots
    P, signs = of_unit_energy(K)
    last = np.asarray(np.linalg.qr(np.concatenate(on_platform, axis=1) @ P, mode="r"))
    signs = np.concatenate([*(part[3].reshape(robots, -1) for part in parts), signs], axis=1)
    n, found = signs.shape[1] - f, list[Vibrations]()

    def assembled(i: int) -> tuple[np.ndarray, np.ndarray]:
        B, Z, k = np.zeros((n + last.shape[1], n + f)), np.zeros((start + r, n + f)), 0
        B[n:, n:], Z[start:, n:] = last[i], free[i] @ P[i]
        for at, E, follow, _, own in parts:
            for x, e, by_platform, rows in zip(at, E[i], follow[i], own[i], strict=True):
                m, to = k + len(rows), k + e.shape[1]
                B[k:m, k:to], B[k:m, n:] = rows[:, : to - k], rows[:, to - k :] @ P[i]
                Z[x, k:to], Z[x, n:], k = e, by_platform @ P[i], to
        return B, Z

    for i, own in enumerate(signs):
        B, Z = assembled(i)
        if not np.all(own > 0):
            found.append(_without_stiffness(Z, own, B, r))
            continue
        values = _massive(B)  # most of the time where legs have masses
        found.append((1.0 / values**2, partial(_shapes, partial(assembled, i), len(values), r)))
    return found


def _massive(B: np.ndarray) -> np.ndarray:
    """Singular values of the motions that have mass, largest first."""
    values = np.linalg.svd(B, compute_uv=False)
    return values[values > _MASSLESS * np.max(values, initial=0.0)]


def _by_component(block: ComponentBlock, rows: np.ndarray, chains: np.ndarray) -> np.ndarray:
    """Rows of chains (k, m) by the N components of a block (N, k, m), zero where one has fewer."""
    component = np.full(1 + max(np.max(chains, initial=0), np.max(block.chains)), -1)
    component[block.chains] = np.arange(len(block.at))[:, None]
    own = np.argsort(component[chains], kind="stable")[np.sum(component[chains] < 0) :]
    number = component[chains[own]]
    counts = np.bincount(number, minlength=len(block.at))
    place = np.arange(len(own)) - np.repeat(np.cumsum(counts) - counts, counts)
    found = np.zeros((len(counts), np.max(counts, initial=0), rows.shape[1]))
    found[number, place] = rows[own]
    return found


def _motions_of_platform(known: Linearised) -> np.ndarray:
    """Twists (P, r, f) that rigid parts leave, each about as stiff as the others."""
    problem, held, robots = known.problem, known.held_platform, known.problem.legs.robots
    free = (np.eye(problem.size) if held is None else held.free) / problem.scale[:, None]
    f = free.shape[1]
    roots = [np.zeros((robots, f, f))]
    for g, block in enumerate(problem.blocks):
        stiff = np.diagonal(elastic_curvature(problem.legs, g), axis1=-2, axis2=-1)
        own = np.sqrt(stiff)[..., None] * (known.by_twist[block.coordinates] @ free)
        roots.append(own.reshape(robots, len(own) // robots * own.shape[1], f))
    _, sizes, Vt = np.linalg.svd(np.concatenate(roots, axis=1), full_matrices=False)
    most = np.max(sizes, axis=-1, initial=0.0, keepdims=True)
    most = np.where(most > 0, most, 1.0)
    return free @ np.swapaxes(Vt, -1, -2) / np.where(sizes > _RIGID * most, sizes, most)[:, None]


@in_one_thread
def _shapes(
    assembled: Callable[[], tuple[np.ndarray, np.ndarray]], count: int, r: int
) -> np.ndarray:
    """Motions ``Z v / s`` (count, n) of the largest singular values s of B.

    Of those of one frequency the first takes all of what the platform moves along the first of its
    r coordinates, which are the last of Z, and so on: rounding does not choose them.
    """
    B, Z = assembled()
    _, values, Vt = np.linalg.svd(B, full_matrices=False)
    found = (Z @ Vt[:count].T / values[:count]).T
    starts = np.flatnonzero(np.diff(values[:count]) < -_SAME * values[1:count]) + 1
    for own in np.split(np.arange(count), starts):
        moved = found[own, -r:]
        sizes = np.linalg.norm(moved, axis=0)
        if len(own) > 1 and sizes.any():
            Q = np.linalg.qr(moved[:, sizes > _SMALL * sizes.max()], mode="complete")[0]
            found[own] = Q.T @ found[own]
    return found


def _without_stiffness(Z: np.ndarray, signs: np.ndarray, B: np.ndarray, r: int) -> Vibrations:
    """Where some motion of unit energy meets no stiffness, or a negative one.

    Free motions with mass have the frequency zero, and the others leave these at rest. What is left
    without a negative stiffness keeps the digits of its slow motions.
    """
    size, free = np.linalg.norm(Z, axis=0), signs == 0
    U, s, Vt = np.linalg.svd((B / size)[:, free], full_matrices=False)
    k = int(np.sum(s > _MASSLESS * np.linalg.norm(B / size)))
    drifts = (Z / size)[:, free] @ (Vt[:k].T / s[:k])
    along = U[:, :k].T @ B[:, ~free]
    B, Z, signs = B[:, ~free] - U[:, :k] @ along, Z[:, ~free] - drifts @ along, signs[~free]
    if np.all(signs > 0):
        values = _massive(B)
        own = partial(_shapes, lambda: (B, Z), len(values), r)
        return np.append(np.zeros(k), 1.0 / values**2), lambda: np.concatenate([drifts.T, own()])
    _, values, Vt = np.linalg.svd(B)
    m = int(np.sum(values > _MASSLESS * np.max(values, initial=0.0)))
    heavy, light = Vt[:m].T / values[:m], Vt[m:].T
    w, Q = np.linalg.eigh((light.T * signs) @ light)
    stiff = np.abs(w) > _LOOSE
    follow = light @ Q[:, stiff]
    moved = heavy - follow @ (((follow.T * signs) @ heavy) / w[stiff][:, None])
    squares, modes = np.linalg.eigh((moved.T * signs) @ moved)
    none = np.abs(squares) <= _LOOSE * np.max(np.abs(squares), initial=0.0)
    squares = np.append(np.zeros(k), np.where(none, 0.0, squares))
    motions = np.concatenate([drifts.T, (Z @ moved @ modes).T])
    order = np.argsort(squares, kind="stable")
    return squares[order], partial(np.array, motions[order])


def mass_rows(
    problem: EquilibriumProblem, masses: CarriedMasses, state: State
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Velocities of points times roots of masses; their squares are twice the kinetic energy.

    Rows (k, m) by the free unknowns of one component of the legs, and a chain (k,) of that; rows
    (P, p, r) by the twist of each platform. Of all masses and drives, at a state.
    """
    legs, of_chains, at = problem.legs, list[tuple[Any, np.ndarray]](), problem.legs.numbers
    first = np.arange(legs.robots)[:, None] * len(legs.chains)  # chain of each robot
    points = [carried for carried in masses.on_legs if not carried.is_along_part]
    if points:
        spots = [carried.spot for carried in points]
        R, t = legs.places_of(state, spots)
        centres = side_by_side(legs.robots, [carried.mass.centre for carried in points], 3)
        centres = np.einsum("nij,nj->ni", R, centres) + t
        roots = np.sqrt(side_by_side(legs.robots, [carried.mass.value for carried in points]))
        moved = legs.twists(state, spots, centres)[:, :3]
        units = np.ones((len(at.coordinates), at.widest))
        units[at.of_chains.of_chain, at.local[at.columns]] = problem.units[at.columns]
        chains = (first + [spot.chain for spot in spots]).ravel()
        moved[np.abs(moved) < _ROUNDING * problem.length * units[chains, None]] = 0.0
        moved *= roots[:, None, None]
        of_chains.append((np.repeat(chains, 3), moved.reshape(-1, at.widest)))
    along = [carried for carried in masses.on_legs if carried.is_along_part]
    if along:
        of_parts = np.repeat([carried.spot.chain for carried in along], [c.parts for c in along])
        rows = _rows_of_parts(legs, state, along)
        of_chains.append((np.repeat(first + of_parts, 12), rows.reshape(-1, at.widest)))
    inertia, k = legs.arrays.inertia, np.flatnonzero(legs.arrays.inertia)
    rows = np.zeros((len(k), at.widest))
    rows[np.arange(len(k)), at.local[at.x[at.of_chains.joint_x[k]]]] = np.sqrt(inertia[k])
    of_chains.append((at.of_chains.chains[at.of_chains.joint_bodies[k]], rows))
    for coupling, factors in zip(legs.couplings, legs.sum_rows, strict=True):
        if coupling.drive.inertia:
            moved = np.zeros((1, at.widest))
            (k,) = np.nonzero(factors)
            moved[0, at.local[k]] = factors[k] * np.sqrt(float(coupling.drive.inertia))
            of_chains.append((coupling.place[:1], moved))
    values = side_by_side(legs.robots, [mass.value for mass in masses.on_platform])
    centres = side_by_side(legs.robots, [mass.centre for mass in masses.on_platform], 3)
    arms = centres.reshape(legs.robots, -1, 3) - problem.point.reshape(-1, 1, 3)
    arms = arms @ np.swapaxes(state.axes[-legs.robots - 1 : -1], -1, -2)
    of_twist = twist_transport(arms)[..., :3, list(problem.rows)]
    of_twist *= np.sqrt(values).reshape(*arms.shape[:2], 1, 1)
    return (
        np.concatenate([np.zeros((0, at.widest)), *(rows for _, rows in of_chains)]),
        np.concatenate([np.zeros(0, dtype=int), *(c for c, _ in of_chains)]),
        of_twist.reshape(legs.robots, -1, problem.size),
    )


_rows_at_rest = kept(lambda problem, masses: mass_rows(problem, masses, problem.unloaded))
