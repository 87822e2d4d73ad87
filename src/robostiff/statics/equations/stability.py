"""Stability: the energy of a loaded robot beside that of the unloaded one; where it is lost.

Assembly modes of rigid linkages meet in these, as in a parallelogram laid flat. On a smooth path of
configurations the closure ``G dx = 0`` of the whole robot, platform included, keeps its rank. With
U and V orthonormal bases of its rows and columns at one posture, the determinant of ``U^T G V`` at
the next has the same sign, unless a singular value has passed zero between: there another family of
configurations crosses the path.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robostiff.analysis.free_motion import free_motions_in_words
from robostiff.elastostatics import Status
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.statics.chains.elements import NOBODY
from robostiff.statics.chains.equilibrated import LOST
from robostiff.statics.chains.legs import LegEquations, Legs
from robostiff.statics.chains.numbers import ComponentBlock
from robostiff.statics.equations.newton import FoundEquilibrium
from robostiff.statics.equations.problem import EquilibriumProblem, Linearised

# Of the largest eigenvalue: below this there is no stiffness.
_NONE = 1e-10
# Of the largest entry of a scaled matrix: an eigenvalue below it resists nothing.
_FREE = 1e-9
# Deflection of springs, in unit motions of the platform, beyond which a motion is scaled down.
_FARTHER = 100.0
# Of the largest curvature: what rounding leaves of none.
_ROUNDING = 1e-8
# Condition of a root of an energy up to which it is positive definite beyond doubt.
_CLEARLY = 1e5
# Diagonal entry of a triangular factor, of the largest, above which closures are independent.
_INDEPENDENT = 1e-6
# Of the largest stiffness of a part: what rounding leaves of that of a body that hangs unloaded.
_LEFT = 1e-25
# Of the largest singular value of a closure: a direction that is missing all along.
_LOST = 1e-9
# Of load times mode: below this the load does no work on the mode, and equilibria branch.
_BRANCHES = 1e-4
# Difference of margins by which legs buckle together.
_TOGETHER = 1e-7


@frozen
class Margin:
    """How far the energy is from losing its minimum.

    `value` is the least ratio of the curvature of the energy under load to that of the elastic
    energy without load, over all motions that do not tear the robot apart: 1 without load, 0 at the
    critical load, negative beyond it. Where nothing elastic resists some motion, the sign alone has
    a meaning; 0 if nothing resists it under load, either.
    """

    value: float
    form: np.ndarray  # (k, k): that motion is its eigenvector of the least eigenvalue
    basis: np.ndarray  # (n, k): columns are the motions of which form has the coordinates
    leg: int | None = None  # that has it; None for the platform
    at: tuple[int, int] = (0, 0)  # of a leg: its block, and its row there

    @property
    def mode(self) -> np.ndarray:
        """The motion that has it (n,)."""
        if not len(self.form):
            return np.zeros(len(self.basis))
        return self.basis @ np.linalg.eigh(self.form)[1][:, 0]

    def among(self, motions: np.ndarray) -> Margin:
        """The same margin, where its coordinates are motions in the columns of a matrix."""
        return replace(self, basis=motions @ self.basis)


def margins(Q: np.ndarray, Q0: np.ndarray) -> list[Margin]:
    """Least ratios of pairs of quadratic forms (N, n, n), the second positive semidefinite.

    With ``Q0 = L L^T`` the ratios are the eigenvalues of ``L^-1 Q L^-T``, where the second forms of
    all pairs are clearly positive definite.
    """
    if Q.shape[-1] == 0:
        return [Margin(1.0, q, q) for q in Q]
    Q = 0.5 * (Q + np.swapaxes(Q, -1, -2))
    T, signs = of_unit_energy(Q0)
    if not np.all(signs > 0):
        return list(map(_semidefinite, Q, T, signs))
    form = np.swapaxes(T, -1, -2) @ Q @ T
    values = np.linalg.eigvalsh(form)[:, 0].tolist()
    return list(map(Margin, values, form, T))


def of_unit_energy(K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns T (N, k, k) with ``T^T K T`` diagonal, and that (N, k): 1, or 0 and -1.

    0 where nothing resists.
    """
    K = 0.5 * (K + np.swapaxes(K, -1, -2))
    try:
        L = np.linalg.cholesky(K)
        inverse = np.linalg.inv(L)
        if np.all(np.sum(L * L, axis=(1, 2)) * np.sum(inverse**2, axis=(1, 2)) < _CLEARLY**2):
            return np.swapaxes(inverse, -1, -2), np.ones(K.shape[:2])
    except np.linalg.LinAlgError:
        pass
    w, V = np.linalg.eigh(K)
    size = np.abs(w)
    signs = np.where(size > _NONE * size.max(axis=-1, initial=0.0, keepdims=True), np.sign(w), 0.0)
    return V / np.sqrt(np.where(signs == 0.0, 1.0, size))[:, None], signs


def _semidefinite(Q: np.ndarray, T: np.ndarray, signs: np.ndarray) -> Margin:
    """Of a pair of forms of which the second may not resist some motions, by `of_unit_energy`."""
    elastic, free = T[:, signs > 0], T[:, signs <= 0]
    # the largest curvature of both: motions of unit energy are short where it is large
    stiffest = np.max(1.0 / np.sum(elastic**2, axis=0), initial=0.0)
    largest = max(np.max(np.abs(Q)), stiffest)
    least = float(np.linalg.eigvalsh(Q)[0])
    if free.shape[1] and (not elastic.shape[1] or least < -_ROUNDING * largest):
        value = least / largest if largest > 0 else 0.0
        return Margin(value if abs(value) > _ROUNDING else 0.0, Q, np.eye(len(Q)))
    along = free.T @ Q @ free
    if free.shape[1] and np.linalg.eigvalsh(along)[0] < _ROUNDING * largest:
        return Margin(0.0, along, free)
    form = elastic.T @ Q @ elastic
    return Margin(float(np.linalg.eigvalsh(form)[0]), form, elastic)


def meets_stiffness(known: Linearised) -> bool:
    """Whether every motion of the platform does."""
    values = np.abs(np.linalg.eigvalsh(_curvature(known, _platform_motions(known))))
    return bool(values.min(initial=np.inf) > _FREE * values.max(initial=0.0))


def end_of_path(problem: EquilibriumProblem, last: FoundEquilibrium | None) -> Status:
    """No equilibrium, or too few digits of K where the last one was found, beside a singularity."""
    known = problem.at_rest if last is None else last.known
    scaled = known.K_total / np.outer(problem.scale, problem.scale)
    few = known.lacks_digits or (meets_stiffness(known) and np.linalg.cond(scaled) > 1.0 / LOST)
    return Status.ILL_CONDITIONED if few else Status.NO_EQUILIBRIUM


def platform_margin(known: Linearised) -> Margin:
    """Of the platform, legs in equilibrium; its mode is a twist (r,)."""
    motions, rest = _platform_motions(known), known.problem.at_rest
    (found,) = margins(*(_curvature(at, motions)[None] for at in (known, rest)))
    return found.among(motions)


@kept
def _platform_motions(known: Linearised) -> np.ndarray:
    """Motions of the platform that rigid parts allow (r, m), of unit size or smaller.

    Near a singular posture of a leg, a small motion of the platform can deflect springs far. Such a
    motion is scaled down: beside its large stiffness that of the others would count as zero.
    """
    problem, held = known.problem, known.held_platform
    free = np.eye(problem.size) if held is None else held.free
    motions, squares = free / problem.scale[:, None], np.zeros((free.shape[1],) * 2)
    for g, block in enumerate(problem.blocks):
        elastic = np.diagonal(elastic_curvature(problem.legs, g), axis1=1, axis2=2) > 0
        at = block.coordinates[elastic]
        given = problem.length * problem.units[at, None] * (known.by_twist[at] @ motions)
        squares += given.T @ given
    values, V = np.linalg.eigh(squares)
    if values.max(initial=0.0) <= _FARTHER**2:
        return motions
    return motions @ (V / np.maximum(np.sqrt(np.abs(values)) / _FARTHER, 1.0))


def _curvature(known: Linearised, motions: np.ndarray) -> np.ndarray:
    """Of the energy less the work of loads, by motions (r, m) of the platform, legs following.

    Of legs, not of K, which has lost its digits where these are nearly singular.
    """
    found = motions.T @ (known.K_total - known.K) @ motions
    followed = known.by_twist @ motions
    for block, A in zip(known.problem.blocks, known.equations.A, strict=True):
        x = followed[block.coordinates]
        found += np.sum(np.swapaxes(x, 1, 2) @ A[:, : block.free, : block.free] @ x, axis=0)
    return _without_rounding(0.5 * (found + found.T), known.problem.legs)


def _without_rounding(Q: np.ndarray, legs: Legs) -> np.ndarray:
    """Curvatures, 0 where rounding is all that is left."""
    return np.where(np.abs(Q) <= _LEFT * np.max(legs.stiffness, initial=0.0), 0.0, Q)


def leg_margins(known: Linearised) -> dict[int, Margin]:
    """Of each leg with the platform held, by its index; modes are coordinates and bodies."""
    found: dict[int, Margin] = {}
    problem = known.problem
    for g, (block, missing) in enumerate(zip(problem.blocks, problem.missing, strict=True)):
        if block.free <= block.closures - missing and not block.beams.size:
            continue  # the platform holds all coordinates
        of_block = margins_of(problem, known.equations, g)
        for row, (owner, one) in enumerate(zip(problem.legs.owners(block), of_block, strict=True)):
            # A margin of 0 is that of a joint that nothing holds, such as the spin of a rod.
            if one is not None and one.value != 0.0:
                # legs that are held together have one margin, under the first of them
                least = found.get(owner.leg)
                if least is None or one.value < least.value:
                    found[owner.leg] = replace(one, leg=owner.leg, at=(g, row))
    return dict(sorted(found.items()))


def named_margins(known: Linearised) -> dict[str, float]:
    """Of the platform, and of every leg, by name."""
    names, legs = known.problem.leg_names, leg_margins(known)
    return {"platform": platform_margin(known).value} | {names[k]: legs[k].value for k in legs}


def margins_of(problem: EquilibriumProblem, eq: LegEquations, g: int) -> list[Margin | None]:
    """Of the components of block g, inner modes of beams among their motions.

    None for one that the platform holds.
    """
    legs, block = problem.legs, problem.blocks[g]
    m, Q = block.free, with_modes(legs, eq, g)
    Q0 = np.tile(np.eye(Q.shape[1]), (len(Q), 1, 1))
    Q0[:, :m, :m] = unloaded_curvature(legs, g)
    found: list[Margin | None] = [None] * len(Q)
    inner = Q.shape[1] - m
    for alike, motions in held_motions(problem, eq, g):
        k = motions.shape[-1]
        if not k + inner:
            continue
        N = np.zeros((len(alike), m + inner, k + inner))
        N[:, :m, :k], N[:, m:, k:] = motions, np.eye(inner)
        across = np.swapaxes(N, -1, -2)
        pairs = _without_rounding(across @ Q[alike] @ N, legs), across @ Q0[alike] @ N
        for leg, basis, least in zip(alike, N, margins(*pairs), strict=True):
            found[leg] = least.among(basis)
    return found


def held_motions(
    problem: EquilibriumProblem, eq: LegEquations, g: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Components of block g, and independent motions (N, m, k) of each that leave the platform.

    Those of one rank side by side. They are orthonormal in coordinates of unit energy; such without
    stiffness move the ends of chains as far as the others do.
    """
    legs, block = problem.legs, problem.blocks[g]
    m, count = block.free, block.closures
    C = eq.A[g][:, m:, :m] * problem.units[block.at[0, m:]][:, None]
    # Without springs between bodies: what these add to a passive joint may be rounding.
    stiff = np.diagonal(elastic_curvature(legs, g), axis1=-2, axis2=-1)
    size = np.where(stiff > 0, 1.0 / np.sqrt(np.where(stiff > 0, stiff, 1.0)), 1.0)
    moved = np.sqrt(np.sum((C * size[:, None]) ** 2, axis=-2))
    elastic, passive = (stiff > 0) & (moved > 0), (stiff <= 0) & (moved > 0)
    most = np.max(np.where(elastic, moved, 0.0), axis=-1, initial=0.0, keepdims=True)
    typical = np.where(most > 0, most, 1.0)
    scale = np.where(passive, typical / np.where(passive, moved, 1.0), size)[..., None]
    C = C * np.swapaxes(scale, -1, -2)
    rows = np.linalg.norm(C, axis=2, keepdims=True)
    C = C / np.where(rows > 0, rows, 1.0)
    if count < m:
        V, R = np.linalg.qr(np.swapaxes(C, -1, -2), mode="complete")
        size = np.abs(np.diagonal(R, axis1=-2, axis2=-1))
        if np.all(size > _INDEPENDENT * size.max(axis=-1, initial=0.0, keepdims=True)):
            yield np.arange(len(C)), V[..., count:] * scale
            return
    _, values, Vt = np.linalg.svd(C)
    ranks = np.sum(values > _NONE * values[:, :1], axis=1)
    for rank in np.unique(ranks):
        alike = np.flatnonzero(ranks == rank)
        yield alike, np.swapaxes(Vt[alike, rank:], -1, -2) * scale[alike]


@frozen
class Regular:
    """The closure of a robot at a posture: bases of its rows (c, k) and columns (n, k)."""

    U: np.ndarray
    V: np.ndarray
    sign: float  # of the determinant of U^T G V, and the logarithm of its size
    log: float

    @staticmethod
    def of(known: Linearised) -> Regular:
        """At a posture that is not singular."""
        G = whole_closure(known)
        V, R = np.linalg.qr(G.T)
        size = np.abs(np.diagonal(R))
        if len(size) == len(G) and np.all(size > _INDEPENDENT * np.max(size, initial=0.0)):
            U = np.eye(len(G))
        else:
            U, S, Vt = np.linalg.svd(G, full_matrices=False)
            k = int(np.count_nonzero(_LOST * np.max(S, initial=0.0) < S))
            U, V = U[:, :k], Vt[:k].T
        return Regular(U, V, *np.linalg.slogdet(U.T @ G @ V))

    def ratio(self, known: Linearised) -> float:
        """Determinant of ``U^T G V`` at a posture near by: 1 here, 0 where it is singular."""
        sign, log = np.linalg.slogdet(self.U.T @ whole_closure(known) @ self.V)
        return float(sign * self.sign * np.exp(log - self.log))


def may_be_singular(problem: EquilibriumProblem) -> bool:
    """Whether some leg has rigid loops, or no more coordinates than its closure has rows.

    An open leg of more coordinates keeps its rank, but by coincidence.
    """
    chains = problem.legs.chains
    for block, lacking in zip(problem.blocks, problem.missing, strict=True):
        of_leg = [chains[c] for c in block.chains[0] if chains[c].owner != NOBODY]
        size = sum(e.size for chain in of_leg for e in chain.elements)
        if lacking or len(of_leg) > 1 or (of_leg and size <= problem.size):
            return True
    return False


def whole_closure(known: Linearised) -> np.ndarray:
    """G (c, n): of all legs by their coordinates and by the twist of the platform, as numbers."""
    problem, eq, units = known.problem, known.equations, known.problem.units
    G = np.zeros((len(units), len(units) + problem.size))
    for block, A in zip(problem.blocks, eq.A, strict=True):
        for at, M in zip(block.at, A, strict=True):
            G[at[:, None], at[: block.free]] = M[:, : block.free] / units[at[: block.free]]
    G[:, len(units) :] = problem.legs.numbers.by_twist * problem.length / problem.scale
    closures = np.delete(np.arange(len(units)), problem.free)
    kept = np.append(problem.free, np.arange(len(units), G.shape[1]))
    return units[closures, None] * G[np.ix_(closures, kept)]


def energies_of(legs: Legs, motion: np.ndarray, inner: np.ndarray) -> list[tuple[str, str, float]]:
    """Legs and parts, and what they store in a motion of all unknowns (T,) [J].

    `inner` (B, F) are amplitudes of inner modes of beams, see `with_modes`.
    """
    x = motion[legs.numbers.x]
    found = [
        (legs.chains[c].owner.name, beam.name, 0.5 * float(amplitudes @ amplitudes))
        for (c, _, beam), amplitudes in zip(legs.beams, inner, strict=True)
    ]
    for (c, k), at in legs.numbers.places.items():
        e = legs.chains[c].elements[k]
        energy = 0.5 * float(np.sum(e.stiffness * x[at] * x[at]))
        found.append((legs.chains[c].owner.name, e.name, energy))
    for coupling, a in zip(legs.couplings, legs.sum_rows, strict=True):
        leg, drive = legs.chains[coupling.place[0]].owner.name, coupling.drive
        found.append((leg, drive.name, 0.5 * float(drive.stiffness * (a @ motion) ** 2)))
    return found


def with_modes(legs: Legs, eq: LegEquations, g: int) -> np.ndarray:
    """Curvature by the m free unknowns of block g, and by amplitudes of inner modes of beams."""
    block, A = legs.numbers.blocks[g], eq.A[g]
    m, count, forms = block.free, block.beams.shape[1], legs.inner_modes.shape[1]
    if not count:
        return A[:, :m, :m]
    found = np.zeros((len(A), *[m + forms * count] * 2))
    found[:, :m, :m] = A[:, :m, :m]
    arrays = legs.arrays
    y = arrays.spring_coordinates(eq.state.x)[arrays.beams]
    whole, *others = arrays.bending.with_modes(y, eq.state.axial, arrays.along, arrays.axial)
    parts = whole - eq.terms.beams.curvature, *others  # A has those in balance
    for i, first in enumerate(block.beams[0]):
        more, mixed, inside = (array[block.beams[:, i]] for array in parts)
        beam, modes = legs.beams[first][2], m + forms * i + np.arange(forms)
        at = legs.numbers.beams[first, : beam.size] - block.at[0, 0]
        found[:, at[:, None], at] += more[:, : beam.size, : beam.size]
        found[:, modes[:, None], at] = mixed[:, :, : beam.size]
        found[:, at[:, None], modes] = np.swapaxes(mixed[:, :, : beam.size], -1, -2)
        found[:, modes[:, None], modes] = inside
    kept = m + np.flatnonzero(legs.inner_modes[block.beams[0]])
    kept = np.concatenate([np.arange(m), kept])
    return found[:, kept[:, None], kept]


def whole_motion(
    legs: Legs, block: ComponentBlock, i: int, mode: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A motion of component i of a block, as in `with_modes`, as `energies_of` takes them."""
    motion, inner = np.zeros(legs.numbers.total), np.zeros(legs.inner_modes.shape)
    motion[block.coordinates[i]] = mode[: block.free]
    amplitudes = np.zeros_like(inner[block.beams[i]])
    amplitudes[legs.inner_modes[block.beams[i]]] = mode[block.free :]
    inner[block.beams[i]] = amplitudes
    return motion, inner


@kept
def elastic_curvature(legs: Legs, g: int) -> np.ndarray:
    """Curvature of the elastic energy of parts and couplings, unloaded (N, m, m), of block g."""
    u = legs.numbers.blocks[g].coordinates
    h = legs.stiffness[u][..., None] * np.eye(u.shape[1])
    for coupling, a in zip(legs.couplings, legs.sum_rows, strict=True):
        h += float(coupling.drive.stiffness) * a[u][:, :, None] * a[u][:, None]
    return h


@kept
def unloaded_curvature(legs: Legs, g: int) -> np.ndarray:
    """The same with that of springs between bodies (N, m, m)."""
    if not legs.springs:
        return elastic_curvature(legs, g)
    K, coordinates = legs.pulls(legs.unloaded, 0.0).stiffness, legs.numbers.blocks[g].coordinates
    return elastic_curvature(legs, g) + np.array([K[np.ix_(u, u)] for u in coordinates])


@frozen
class CriticalPoint:
    """The first equilibrium along a growing load that is not stable, or a singular posture.

    Attributes
    ----------
    factor : float
        Of the load.
    words : str
        How the robot leaves it.
    leg : str or None
        The leg that buckles while the platform is held; None where the platform moves.
    twist : (r,) array
        Of the platform, per metre or radian; zero of a leg that buckles by itself, and of
        singular postures.
    is_limit : bool
        Whether the load cannot grow further; it can, on an unstable branch, where equilibria
        branch.
    found : FoundEquilibrium
    """

    factor: float
    words: str
    leg: str | None
    twist: np.ndarray
    is_limit: bool
    found: FoundEquilibrium


@kept
def least_margin(found: FoundEquilibrium) -> Margin:
    """The least margin, of the platform or of a leg."""
    every = platform_margin(found.known), *leg_margins(found.known).values()
    return min(every, key=lambda margin: margin.value)


def point_at(found: FoundEquilibrium, least: Margin | None = None) -> CriticalPoint:
    """What happens at a critical equilibrium, by its least margin."""
    problem, least = found.problem, least or least_margin(found)
    if least.leg is not None:
        # Of legs that buckle together, rounding must not choose the one that is named.
        margins = leg_margins(found.known)
        leg = min(key for key in margins if margins[key].value <= least.value + _TOGETHER)
        least = margins[leg]
        g, i = least.at
        parts = energies_of(
            problem.legs, *whole_motion(problem.legs, problem.blocks[g], i, least.mode)
        )
        name, part, _ = max(parts, key=lambda one: one[2])
        words = f"leg {name!r} buckles while the platform stays: most in {part!r}"
        return CriticalPoint(found.factor, words, name, np.zeros(problem.size), False, found)
    mode = least.mode
    size = np.linalg.norm(mode * problem.scale)
    twist = mode / (size if size > 0 else 1.0)
    motion = free_motions_in_words(twist[None], found.state.p, problem.length)[0]
    load = found.known.by_factor
    work = abs(float(load @ twist))
    # rigid parts may carry the load, and leave rounding of it
    whole = float(np.linalg.norm(np.append(load, found.loading.wrench) / np.tile(problem.scale, 2)))
    is_limit = work > _BRANCHES * whole
    how = "snaps through" if is_limit else "buckles"
    # the beam that bends most between its ends, if most bends so
    legs, known, bends = problem.legs, found.known, ""
    moved = known.by_twist[: legs.numbers.total] @ twist
    bent = np.zeros(legs.inner_modes.shape)
    for g, block in enumerate(problem.blocks):
        m, Q = block.free, with_modes(legs, known.equations, g)
        coordinates = moved[block.coordinates]
        inner = -np.linalg.pinv(Q[:, m:, m:]) @ Q[:, m:, :m] @ coordinates[..., None]
        for i, mode in enumerate(inner[..., 0]):
            bent += whole_motion(legs, block, i, np.append(coordinates[i], mode))[1]
    parts = energies_of(legs, moved, bent)
    beams = parts[: len(bent)]
    if sum(one[2] for one in beams) > 0.5 * sum(one[2] for one in parts):
        leg, part, _ = max(beams, key=lambda one: one[2])
        bends = f"; {part!r} of leg {leg!r} bends between its ends"
    words = f"the platform {how}: {motion}{bends}"
    return CriticalPoint(found.factor, words, None, motion.twist, is_limit, found)
