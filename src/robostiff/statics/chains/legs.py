"""The legs of a robot as chains between bodies: their equilibrium and closure, and the tangent.

Chains that meet in a body, and those whose joints are coupled or that hold springs between bodies,
are one component: its unknowns do not follow from those of others while the platform is held.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.frozen import frozen, replace
from robostiff.record import is_zero, reciprocal
from robostiff.spatial.rotation import matrix_of_rotation, vector_of_rotation
from robostiff.statics.chains.elements import (
    NOBODY,
    Anchor,
    FiniteBodySpring,
    FiniteChain,
    FiniteCoupling,
    FiniteSpring,
    Owner,
    Pulls,
    Spot,
    group_of,
    pulls_of,
)
from robostiff.statics.chains.moving_chain import (
    ChainTerms,
    MovingChains,
    PlacedChains,
    cross,
    skews,
    sum_of_crosses,
)
from robostiff.statics.chains.numbers import (
    ComponentBlock,
    LegNumbers,
    LegsKind,
    numbers_of,
    sums_at,
)

# Of the way to a critical axial force, in one step.
_OF_THE_WAY = 0.9
# By which one element bends where a beam is some 0.5 % off: the only one of a beam, and one of many
# [rad]; and the same of moments that couple the turns across them, times what resists these turns.
_BENT, _TWISTED = (0.1, 0.2), (0.2, 0.3)


@frozen
class State:
    """Where a robot is: U coordinates, C chains, b bodies at the ends of these, and B beams.

    Bodies are those between chains, the platform of each robot, and last the base.
    """

    x: np.ndarray  # (U,): coordinates, chain by chain
    # (C, r): what the body at the end of each chain exerts on it, about that body's point [N, N m]
    W: np.ndarray
    # (b, 3, 3) and (b, 3): axes of the bodies, and where their points are [m]
    axes: np.ndarray
    points: np.ndarray
    multipliers: np.ndarray  # what rigid couplings push their sums with [N or N m]
    axial: np.ndarray  # (B,): axial forces of beams with bowing [N]

    @property
    def R(self) -> np.ndarray:
        """Axes of the platform (3, 3)."""
        return self.axes[-2]

    @property
    def p(self) -> np.ndarray:
        """Where the point of the platform is (3,) [m]."""
        return self.points[-2]


@frozen
class LegEquations:
    """Residual and tangent of all T unknowns of the legs, platform apart.

    Closures ``J dx - dt`` stand in the rows of wrenches, ``-J^T`` in their columns, else A is
    symmetric: unknown are steps of wrenches in axes that turn half as far as the body at the end,
    see `Legs.steps`.
    """

    A: tuple[np.ndarray, ...]  # (N, n, n), block by block
    r: np.ndarray  # (T,): residual
    r_share: np.ndarray  # (T,): derivative by the share of loads and preloads
    state: State
    half: np.ndarray  # (C, r): of wrenches, moments of which turn half of the gaps
    terms: ChainTerms
    pulls: Pulls | None


@frozen
class Legs:
    """All legs of a robot.

    Attributes
    ----------
    chains : tuple of FiniteChain
        Of one robot.
    points : (bodies, 3) array
        Of the bodies between chains, at the unloaded posture [m].
    platform_point : (3,) array
        Point of the platform about which wrenches are, at the unloaded posture [m]; (P, 3) of P
        robots side by side.
    rows : tuple of int
        Coordinates in which it moves: six in space, three in the plane.
    springs : tuple of FiniteBodySpring
        Between bodies.
    couplings : tuple of FiniteCoupling
        Of joints, of all robots.
    robots : int
        Number P of equal robots, one behind the other, each with a platform of its own. What chains
        have may be at P poses then.
    """

    chains: tuple[FiniteChain, ...]
    points: np.ndarray
    platform_point: np.ndarray
    rows: tuple[int, ...]
    springs: tuple[FiniteBodySpring, ...] = ()
    couplings: tuple[FiniteCoupling, ...] = ()
    robots: int = 1

    @cached_property
    def numbers(self) -> LegNumbers:
        """Where all unknowns are."""
        meeting: list[Sequence[tuple[int, int]]] = [(c.place, *c.terms) for c in self.couplings]
        meeting += [[spot for spot in spring.spots if spot is not None] for spring in self.springs]
        kinds, bodies = [chain.kind for chain in self.chains], len(self.points) // self.robots
        kind = LegsKind(
            tuple(own.behind(i * bodies) for i in range(self.robots) for own in kinds),
            len(self.points),
            self.rows,
            tuple(spot for *_, spot in self.anchors),
            tuple(tuple(c for c, _ in spots) for spots in meeting),
            tuple((coupling.place[0], coupling.drive.turns) for coupling in self.rigid),
        )
        return numbers_of(kind)

    @cached_property
    def arrays(self) -> MovingChains:
        """Their chains side by side."""
        anchors = [self.springs[i].points[side] for side, i, _ in self.anchors]
        both = self.unloaded.points[self.numbers.starts], self.end_points
        of_chains = self.numbers.of_chains
        return MovingChains(self.chains, of_chains, *both, self.rows, anchors, self.robots)

    def of_robots(self, count: int) -> Legs:
        """Legs at so many poses as those of as many equal robots, each at one of the poses."""
        C = len(self.chains)
        renumbered = [{c: i * C + c for c in range(C)} for i in range(count)]
        points = np.broadcast_to(self.points, (count, *self.points.shape[-2:]))
        return replace(
            self,
            points=points.reshape(-1, 3),
            platform_point=np.broadcast_to(self.platform_point, (count, 3)),
            couplings=tuple(c.renumbered(each) for each in renumbered for c in self.couplings),
            robots=count,
        )

    @cached_property
    def end_points(self) -> np.ndarray:
        """Points of the bodies at the ends of all chains, at the unloaded posture (C, 3) [m]."""
        return self.unloaded.points[self._ends]

    @cached_property
    def _ends(self) -> np.ndarray:
        """Bodies at the ends of all chains (C,), platforms behind those between chains."""
        ends = self.numbers.ends
        platforms = len(self.points) + np.arange(len(ends)) * self.robots // max(len(ends), 1)
        return np.where(ends < 0, platforms, ends)

    @cached_property
    def anchors(self) -> list[Anchor]:
        """The ends of springs between bodies that chains hold (A,)."""
        each = [(side, i, s.spots[side]) for side in (0, 1) for i, s in enumerate(self.springs)]
        return [(side, i, spot) for side, i, spot in each if spot is not None]

    def on_anchors(self, force: np.ndarray) -> np.ndarray:
        """Forces (A, 3) on the anchors, from those of springs (S, 3) on their first ends [N]."""
        return np.array([force[i] * (1 - 2 * side) for side, i, _ in self.anchors]).reshape(-1, 3)

    @cached_property
    def rigid(self) -> list[FiniteCoupling]:
        """Couplings whose sums stay 0."""
        return [coupling for coupling in self.couplings if coupling.is_rigid]

    @cached_property
    def beams(self) -> list[tuple[int, int, FiniteSpring]]:
        """Every beam with bowing, behind the numbers of its chain and of its element there."""
        return [
            (c, k, e)
            for c, chain in enumerate(self.chains)
            for k, e in enumerate(chain.elements)
            if isinstance(e, FiniteSpring) and e.bows
        ]

    @cached_property
    def inner_modes(self) -> np.ndarray:
        """Which forms of bending of each beam have an inner mode (B, F)."""
        return self.arrays.bending.b != 0

    @cached_property
    def unloaded(self) -> State:
        """The posture from which they are loaded."""
        at, base = self.numbers, np.zeros((1, 3), dtype=int)
        points = np.concatenate([self.points, self.platform_point.reshape(-1, 3), base])
        x, W, z, axial = (np.zeros(n.shape) for n in (at.x, at.W, at.multipliers, at.beams[:, 0]))
        return State(x, W, np.tile(np.eye(3), (len(points), 1, 1)), points, z, axial)

    def owners(self, block: ComponentBlock) -> list[Owner]:
        """The first leg of every component; `NOBODY` where springs hold the platform alone."""
        each = [[self.chains[c].owner for c in chains] for chains in block.chains]
        return [min((o for o in owners if o != NOBODY), default=NOBODY) for owners in each]

    def bodies(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Where all bodies of chains are, by their numbers there; see `MovingChains.moved`."""
        return self.arrays.moved(self._moving(state))

    def places_of(self, state: State, spots: Sequence[Spot]) -> tuple[np.ndarray, np.ndarray]:
        """The same of some bodies of each robot, (M, 3, 3) and (M, 3)."""
        bodies = self.numbers.bodies_at(spots, self.robots)
        R, t = self.bodies(state)
        return R[bodies], t[bodies]

    @cached_property
    def sum_rows(self) -> list[np.ndarray]:
        """Of every coupling: the factors of its sum, by unknown (T,)."""
        found = []
        for coupling in self.couplings:
            a = np.zeros(self.numbers.total, dtype=int).astype(coupling.factors.dtype)
            for place, factor in zip(coupling.terms, coupling.factors, strict=True):
                a[self.numbers.x[self.numbers.places[place]]] = factor
            found.append(a)
        return found

    def sums(self, state: State) -> list[Any]:
        """Of every coupling: its sum [m or rad]."""
        return [a[self.numbers.x] @ state.x for a in self.sum_rows]

    def equations(self, state: State, share: float) -> LegEquations:
        """Equilibrium and closure of all legs under a share of loads and preloads.

        Of numbers or of entries, whose gaps in turning are sines.
        """
        rows, at = list(self.rows), self.numbers
        pulls = self.pulls(state, share) if self.springs else None
        terms = self.terms(state, pulls, share)
        D = terms.R @ np.swapaxes(state.axes[self._ends], -1, -2)
        turn = sum_of_crosses(D) * -0.5 if D.dtype == object else vector_of_rotation(D)
        gap = np.concatenate([terms.P - state.points[self._ends], turn], axis=-1)[:, rows]
        J, tangent = terms.J[:, rows], terms.tangent
        parts = tangent, tangent[at.off_diagonal], J, -J, at.constants
        *ends, size = np.cumsum([0, *(block.at.size * block.at.shape[1] for block in at.blocks)])
        A = sums_at(at.entries, np.concatenate([part.ravel() for part in parts]), int(size))
        r = sums_at(at.columns, terms.gradient, at.total)
        r_share = sums_at(at.columns, terms.by_share, at.total)
        r[at.W] += gap
        half = cross(state.W @ self._turning.T, turn) @ self._turning * 0.5
        inner = at.inner_chains
        np.add.at(r, at.bodies[at.ends[inner]], (state.W + half)[inner])
        each = zip((block.at.shape for block in at.blocks), np.split(A, ends[1:]), strict=False)
        blocks = tuple(own.reshape(*shape, shape[1]) for shape, own in each)
        rigid = iter(range(len(self.rigid)))  # closures ``s = 0`` of rigid couplings, else energy
        for coupling, s in zip(self.couplings, self.sums(state), strict=True):
            x = np.concatenate([at.x[at.places[place]] for place in coupling.terms])
            factors, push = coupling.factors, coupling.drive.preload
            if coupling.is_rigid:
                i = next(rigid)
                row = at.multipliers[i]
                A[at.place(row, x)] += factors
                A[at.place(x, row)] -= factors
                r[row] += s
                r[x] -= factors * state.multipliers[i]
                continue
            A[at.place(x[:, None], x)] += coupling.drive.tangent(s) * np.outer(factors, factors)
            r[x] += (coupling.drive.force(s) - share * push) * factors
            r_share[x] -= push * factors
        if pulls is not None:
            K = pulls.stiffness
            for block, matrices in zip(at.blocks, blocks, strict=True):
                for matrix, u in zip(matrices, block.coordinates, strict=True):
                    matrix[: block.free, : block.free] += K[np.ix_(u, u)]
            r_share += pulls.by_share
        return LegEquations(blocks, r, r_share, state, half, terms, pulls)

    @cached_property
    def _turning(self) -> np.ndarray:
        """Of the coordinates of bodies those that turn (3, r)."""
        return np.eye(6, dtype=int)[3:, list(self.rows)]

    def steps(self, eq: LegEquations, step: np.ndarray, twist: np.ndarray) -> np.ndarray:
        """Steps (T + B, k) of unknowns and axial forces, from solutions (T, k), the first Newton's.

        Under twists (r, k) of the platform, in axes at rest.

        Where the body at the end of a chain turns by a vector θ, the moment m of its wrench turns
        by θ/2: of its rate ``m x θ / 2`` goes off. So the tangent of a chain is symmetric.
        """
        at, T = self.numbers, self._turning
        twists = np.tile(twist, (self.robots, 1, 1))
        turn = T @ np.concatenate([step[at.bodies], twists])[self._ends]
        found, m = step.copy(), eq.state.W @ T.T
        found[at.W] = found[at.W] - T.T @ (skews(m) @ turn) * 0.5
        found[at.W, 0] = found[at.W, 0] + eq.half
        beams = eq.terms.beams
        axial = (beams.rate[..., None] * found[at.beams]).sum(axis=1)
        axial[:, 0] = axial[:, 0] + beams.missing
        return np.concatenate([found, axial])

    def terms(self, state: State, pulls: Pulls | None, share: float) -> ChainTerms:
        """What the chains contribute, of numbers or of entries, with springs between bodies."""
        W = np.zeros((len(state.W), 6), dtype=int).astype(state.W.dtype)
        W[:, list(self.rows)] = state.W
        forces = None
        if pulls is not None:
            forces = 0 * self.arrays.load_force
            forces[self.numbers.of_chains.first_anchor :] = self.on_anchors(pulls.force)
        return self.arrays.terms(state.x, self._moving(state), W, state.axial, share, forces)

    def _moving(self, state: State) -> PlacedChains:
        """Where the chains are; kept with the state."""
        known: dict[MovingChains, PlacedChains] = vars(state).setdefault("_moving", {})
        if self.arrays not in known:
            starts = self.numbers.starts
            start = state.axes[starts], state.points[starts]
            known[self.arrays] = self.arrays.placed(state.x, *start)
        return known[self.arrays]

    def after_step(self, state: State, twist: np.ndarray, step: np.ndarray) -> State:
        """The state after a twist (r,) of the platform, and a step (T + B,) of all that follows.

        The latter of unknowns, and of axial forces of beams.
        """
        at, twists = self.numbers, np.zeros((len(state.points), 6))
        twists[:-1, list(self.rows)] = np.concatenate([step[at.bodies], twist[None]])
        return State(
            state.x + step[at.x],
            state.W + step[at.W],
            matrix_of_rotation(twists[:, 3:]) @ state.axes,
            state.points + twists[:, :3],
            state.multipliers + step[at.multipliers],
            state.axial + step[at.total :],
        )

    def short_of_buckling(self, before: State, after: State) -> State:
        """The state after a step, but axial forces cross no critical load of an inner mode.

        Of a beam in parts no mode of the whole beam, between its ends.
        """
        l = self.arrays.bending.l.max(axis=-1, initial=0.0) * self.parts_of_beams**2
        left = before.axial + 1 / np.maximum(l, np.finfo(float).tiny)
        least = np.where(left > 0, before.axial - _OF_THE_WAY * left, -np.inf)
        return replace(after, axial=np.maximum(after.axial, least))

    @cached_property
    def parts_of_beams(self) -> np.ndarray:
        """Of how many elements the beam is of which each is one (B,)."""
        beams = [(c, e.name) for c, _, e in self.beams]
        return np.array([beams.count(beam) for beam in beams], dtype=int)

    @cached_property
    def _bend_weights(self) -> np.ndarray:
        """Of the squares of turns of the ends of beams (B, 3), see `bends`."""
        V, k = (
            x[self.arrays.beams] for x in (self.arrays.modes[:, 3:], self.arrays.mode_stiffness)
        )
        c = (V * V * _inverse(k)[:, None]).sum(axis=-1)
        across = np.roll(c, 1, axis=-1) * np.roll(c, 2, axis=-1) * _inverse(c) ** 2
        alone = np.tile(self.parts_of_beams, len(c) // max(len(self.beams), 1))[:, None] == 1
        twisted, bent = (np.where(alone, *most) ** -2.0 for most in (_TWISTED, _BENT))
        return across * twisted + np.array([0, 1, 1]) * bent

    def bends(self, state: State) -> np.ndarray:
        """Squares (B,) of how far beams, or their elements, bend, by how far these may.

        Of numbers or of entries. Moments about two axes couple the turns about the third, so that a
        bar buckles across: turns about an axis count the more the softer it is about both others,
        torsion by that alone.
        """
        arrays = self.arrays
        y, s = arrays.spring_coordinates(state.x)[arrays.beams], arrays.bending.s[:, :1] * 1.5
        moved = (arrays.modes[arrays.beams] @ y[..., None])[..., 0]
        chord = np.concatenate([moved[:, 3:4], moved[:, 2:3] * s, moved[:, 1:2] * s], axis=-1)
        turns = (moved[:, 3:] * moved[:, 3:] + chord * chord) * 0.5
        return (turns * self._bend_weights).sum(axis=-1)

    def pulls(self, state: State, share: float) -> Pulls:
        """What springs between bodies do at a state under a share of loads."""
        at, moving = self.numbers, self._moving(state)
        bodies = at.bodies_at([spot for *_, spot in self.anchors])
        rates, points = self.arrays.twists(moving, bodies, None, at.columns, at.total)
        return pulls_of(self.springs, self.anchors, points, rates[:, :3], share)

    def energies(self, state: State) -> list[list[float]]:
        """Elastic energy of every element of every chain [J], preloads left out."""
        found = self.arrays.energies(state.x, state.axial)
        return [found[bodies[1:]].tolist() for bodies in self.numbers.of_chains.bodies]

    def spring_energies(self, pulls: Pulls, motion: np.ndarray) -> list[tuple[str, str, float]]:
        """Springs between bodies by two names, and what a motion (T,) of unknowns stores [J]."""
        moved = pulls.J @ motion
        energies = 0.5 * np.einsum("si,sij,sj->s", moved, pulls.D, moved)
        each = zip(self.springs, energies.tolist(), strict=True)
        return [(group_of(spring.is_cable), spring.name, energy) for spring, energy in each]

    def load_potential(self, state: State, share: float) -> float:
        """Potential of loads on its bodies and of preloads, 0 at the unloaded posture [J]."""
        pushed = zip(self.couplings, self.sums(state), strict=True)
        total = -sum(coupling.drive.preload * s for coupling, s in pushed)
        return share * (total + self.arrays.load_potential(state.x, self._moving(state)))

    def twists(self, state: State, spots: Sequence[Spot], points: np.ndarray) -> np.ndarray:
        """Of bodies of each robot about points (M, 3), by free unknowns of components (M, 6, m)."""
        at = self.numbers
        given = at.bodies_at(spots, self.robots), points, at.local[at.columns], at.widest
        return self.arrays.twists(self._moving(state), *given)[0]

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Of elastic parts and of drives, by unknown (T,), couplings left out."""
        at, arrays, found = self.numbers, self.arrays, np.zeros(self.numbers.total)
        found[at.x[at.of_chains.joint_x]] = arrays.stiffness
        found[at.x[at.of_chains.spring_x]] = arrays.mode_stiffness.ravel()[at.of_chains.full]
        return found

    def units(self, length: float) -> np.ndarray:
        """What makes unknowns numbers (T,), in robot lengths and radians.

        Of coordinates and bodies, what a unit turns or shifts; of wrenches, one over the unit of
        the gap that they close.
        """
        at, found, arrays = self.numbers, np.ones(self.numbers.total), self.arrays
        found[at.x[at.of_chains.joint_x]] = np.where(arrays.turning[:, 0] == 1, 1.0, 1.0 / length)
        V = np.abs(arrays.modes)
        sizes = np.maximum(V[:, :3].max(1, initial=0.0) / length, V[:, 3:].max(1, initial=0.0))
        found[at.x[at.of_chains.spring_x]] = sizes.ravel()[at.of_chains.full]
        body = [1.0 / length if row < 3 else 1.0 for row in self.rows]
        found[at.bodies], found[at.W] = body, body
        found[at.multipliers] = [1.0 if c.drive.turns else 1.0 / length for c in self.rigid]
        return found

    def without(self, gone: Sequence[int]) -> Legs:
        """The legs but for some chains that are a component each, alone."""
        rest = [c for c in range(len(self.chains)) if c not in set(gone)]
        number = {c: i for i, c in enumerate(rest)}
        return replace(
            self,
            chains=tuple(self.chains[c] for c in rest),
            springs=tuple(spring.renumbered(number) for spring in self.springs),
            couplings=tuple(coupling.renumbered(number) for coupling in self.couplings),
        )


def _inverse(x: np.ndarray) -> np.ndarray:
    """``1 / x`` of numbers or entries, 0 where they are 0."""
    if x.dtype == object:
        return np.asarray(np.frompyfunc(lambda v: 0 if is_zero(v) else reciprocal(v), 1, 1)(x))
    return np.divide(1.0, x, out=np.zeros(x.shape), where=x != 0)
