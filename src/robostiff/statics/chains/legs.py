"""The legs of a robot as chains between bodies: their equilibrium and closure, and the tangent.

Chains that meet in a body, and those whose joints are coupled or that hold springs between bodies,
are one component: its unknowns do not follow from those of others while the platform is held.
"""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.kinematics.spanning_tree import connected_parts
from robostiff.spatial.rotation import matrix_of_rotation, vector_of_rotation
from robostiff.statics.chains.body_springs import FiniteBodySpring, Pulls, SpringArrays
from robostiff.statics.chains.elements import (
    NOBODY,
    BodyPlace,
    FiniteChain,
    FiniteCoupling,
    FiniteSpring,
    Owner,
    Share,
)
from robostiff.statics.chains.moving_chain import ChainTerms, MovingChains
from robostiff.statics.chains.numbers import Component, ComponentBlock, Numbers


@dataclass(frozen=True)
class LegState:
    """Where the legs of a robot are: U coordinates, C chains, bodies between them, and B beams."""

    x: np.ndarray  # (U,): coordinates, chain by chain
    # (C, r): what the body at the end of each chain exerts on it, about that body's point [N, N m]
    W: np.ndarray
    # (bodies, 3, 3) and (bodies, 3): between chains: their axes, and where their points are [m]
    R: np.ndarray
    p: np.ndarray
    held: np.ndarray  # what rigid couplings push their sums with [N or N m]
    axial: np.ndarray  # (B,): axial forces of beams with bowing [N]


@dataclass(frozen=True)
class LegEquations:
    """Residual and tangent of all T unknowns of the legs, platform apart."""

    A: tuple[np.ndarray, ...]  # (N, n, n), block by block
    r: np.ndarray  # (T,): residual
    A_t: np.ndarray  # (T, r): derivative by the twist of the platform
    r_factor: np.ndarray  # (T,): derivative by the factor of the loads
    state: LegState
    # (B,), (B, 6) and (B, 6): what axial forces of beams lack, how they follow the coordinates of
    # the beams, and places of these among the unknowns
    missing: np.ndarray
    rate: np.ndarray
    beam_places: np.ndarray

    def completed(self, found: np.ndarray) -> np.ndarray:
        """Steps (T, k) of the unknowns, those of axial forces behind; the first are Newton's."""
        axial = (self.rate[..., None] * found[self.beam_places]).sum(axis=1)
        axial[:, 0] += self.missing
        return np.concatenate([found, axial])


@dataclass(frozen=True)
class Legs:
    """All legs of a robot.

    Attributes
    ----------
    chains : tuple of FiniteChain
    points : (bodies, 3) array
        Of the bodies between chains, at the unloaded posture [m].
    platform_point : (3,) array
        Point of the platform about which wrenches are, at the unloaded posture [m].
    rows : tuple of int
        Coordinates in which it moves: six in space, three in the plane.
    springs : tuple of FiniteBodySpring
        Between bodies.
    couplings : tuple of FiniteCoupling
        Of joints.
    """

    chains: tuple[FiniteChain, ...]
    points: np.ndarray
    platform_point: np.ndarray
    rows: tuple[int, ...]
    springs: tuple[FiniteBodySpring, ...] = ()
    couplings: tuple[FiniteCoupling, ...] = ()

    @cached_property
    def arrays(self) -> MovingChains:
        """Their chains side by side."""
        anchors = self.spring_arrays.anchors
        return MovingChains(self.chains, self.points, self.end_points, self.rows, anchors)

    @cached_property
    def spring_arrays(self) -> SpringArrays:
        """Springs between bodies side by side."""
        return SpringArrays.of(self.springs)

    @cached_property
    def end_points(self) -> np.ndarray:
        """Points of the bodies at the ends of all chains, at the unloaded posture (C, 3) [m]."""
        return np.concatenate([self.points.reshape(-1, 3), self.platform_point[None]])[self.ends]

    @cached_property
    def coordinates(self) -> list[slice]:
        """Those of each chain among all."""
        ends = itertools.accumulate((chain.size for chain in self.chains), initial=0)
        return list(itertools.starmap(slice, itertools.pairwise(ends)))

    @cached_property
    def places(self) -> dict[tuple[int, int], slice]:
        """Coordinates of all elements, by chain and place there, among all."""
        return {
            (c, k): slice(own.start + at.start, own.start + at.stop)
            for c, (chain, own) in enumerate(zip(self.chains, self.coordinates, strict=True))
            for k, at in enumerate(chain.places)
        }

    @cached_property
    def rigid(self) -> list[FiniteCoupling]:
        """Couplings whose sums stay 0."""
        return [own for own in self.couplings if own.is_rigid]

    @cached_property
    def components(self) -> list[Component]:
        """Its components."""
        meeting: list[list[Hashable]] = [
            [c, *((b,) for b in (own.start, own.end) if b is not None)]
            for c, own in enumerate(self.chains)
        ]
        for coupling in self.couplings:
            meeting.append([c for c, _ in (coupling.place, *coupling.terms)])
        for spring in self.springs:
            meeting.append([own.chain for own in spring.spots if own is not None])
        nodes = [*range(len(self.chains)), *((b,) for b in range(len(self.points)))]
        first = connected_parts(nodes, [own for own in meeting if own])
        found: dict[Hashable, Component] = {}
        for c in range(len(self.chains)):
            found.setdefault(first[c], Component([], [], [])).chains.append(c)
        for b in range(len(self.points)):
            found[first[b,]].bodies.append(b)
        for i, own in enumerate(self.rigid):
            found[first[own.place[0]]].rigid.append(i)
        return list(found.values())

    @cached_property
    def numbers(self) -> Numbers:
        """Where all unknowns are."""
        return Numbers.of(self)

    @cached_property
    def on_platform(self) -> np.ndarray:
        """Chains that end on the platform."""
        return np.flatnonzero(self.ends < 0)

    @cached_property
    def ends(self) -> np.ndarray:
        """Bodies at the ends of all chains (C,), -1 for the platform."""
        return np.array([-1 if c.end is None else c.end for c in self.chains], dtype=int)

    @cached_property
    def inner_chains(self) -> np.ndarray:
        """Chains that end on bodies between chains."""
        return np.flatnonzero(self.ends >= 0)

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
        """Which inner modes each beam has (B, 12)."""
        return self.arrays.bending.b.reshape(-1, 12) != 0

    @cached_property
    def unloaded(self) -> LegState:
        """The posture from which they are loaded."""
        bodies = np.tile(np.eye(3), (len(self.points), 1, 1)), self.points
        W = np.zeros((len(self.chains), len(self.rows)))
        sizes = len(self.arrays.coordinates), len(self.rigid), len(self.beams)
        x, held, axial = map(np.zeros, sizes)
        return LegState(x, W, *bodies, held, axial)

    def owners(self, block: ComponentBlock) -> list[Owner]:
        """The first leg of every component; `NOBODY` where springs hold the platform alone."""
        each = [[self.chains[c].owner for c in own] for own in block.chains]
        return [min((o for o in own if o != NOBODY), default=NOBODY) for own in each]

    def moved(self, state: LegState) -> list[list[BodyPlace]]:
        """Of every chain, where the bodies at its start and behind every element are."""
        R, t = self.arrays.moved(state.x, *self._starting(state))
        return [[BodyPlace(R[i], t[i]) for i in own] for own in self.arrays.bodies]

    @cached_property
    def sum_rows(self) -> list[np.ndarray]:
        """Of every coupling: the factors of its sum, by unknown (T,)."""
        found = []
        for own in self.couplings:
            a = np.zeros(self.numbers.total)
            for place, factor in zip(own.terms, own.factors, strict=True):
                a[self.numbers.x[self.places[place]]] = factor
            found.append(a)
        return found

    def sums(self, state: LegState) -> list[float]:
        """Of every coupling: its sum [m or rad]."""
        return [float(a[self.numbers.x] @ state.x) for a in self.sum_rows]

    def equations(
        self, state: LegState, R: np.ndarray, p: np.ndarray, share: Share
    ) -> LegEquations:
        """Equilibrium and closure of all legs; axes and point [m] of the platform are R, p."""
        rows, at = list(self.rows), self.numbers
        pulls = self.spring_arrays.at(self, state, share.value) if self.springs else None
        terms = self.terms(state, pulls, share.value)
        R_end, p_end = self._placed(self.ends, state, R, p)
        turn = vector_of_rotation(terms.R @ np.swapaxes(R_end, -1, -2))
        gap = np.concatenate([terms.P - p_end, turn], axis=-1)[:, rows]
        J, (a, b) = terms.J[:, rows], self.arrays.pairs
        A = at.summed(
            at.entries,
            terms.tangent + terms.bracket,
            (terms.tangent - terms.bracket)[a != b],
            J,
            -J,
            at.constants,
        )
        r = np.bincount(at.columns, terms.gradient, at.total)
        r_factor = np.bincount(at.columns, terms.by_share * share.rate, at.total)
        r[at.W] += gap
        np.add.at(r, at.bodies[self.ends[self.inner_chains]], state.W[self.inner_chains])
        blocks = at.as_blocks(A)
        if self.couplings:
            self._add_couplings(state, share, A, r, r_factor)
        if pulls is not None:
            K = pulls.stiffness
            for block, own in zip(at.blocks, blocks, strict=True):
                for each, u in zip(own, block.coordinates, strict=True):
                    each[: block.free, : block.free] += K[np.ix_(u, u)]
            r_factor += share.rate * pulls.by_share
        missing, rate = terms.beams.missing, terms.beams.rate
        return LegEquations(blocks, r, at.by_twist, r_factor, state, missing, rate, at.beams)

    def terms(self, state: LegState, pulls: Pulls | None, share: float) -> ChainTerms:
        """What the chains contribute, of numbers or of entries, with springs between bodies."""
        W = np.zeros((len(self.chains), 6), dtype=int).astype(state.W.dtype)
        W[:, list(self.rows)] = state.W
        forces = None
        if pulls is not None:
            forces = 0 * self.arrays.load_force
            forces[self.arrays.first_anchor :] = self.spring_arrays.on_anchors(pulls.force)
        start = self._starting(state)
        return self.arrays.terms(state.x, *start, W, state.axial, share, forces)

    @cached_property
    def starts(self) -> np.ndarray:
        """Bodies at the starts of all chains (C,), -1 for the base."""
        return np.array([-1 if c.start is None else c.start for c in self.chains], dtype=int)

    def _starting(self, state: LegState) -> tuple[np.ndarray, np.ndarray]:
        """Axes and points of the bodies at the starts of the chains [m]."""
        base = np.eye(3, dtype=int), np.zeros(3, dtype=int)
        return self._placed(self.starts, state, *base)

    def _placed(
        self, which: np.ndarray, state: LegState, R: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Axes and points of some bodies [m]; those of body -1 are R and p."""
        all_R = np.concatenate([state.R.reshape(-1, 3, 3), R[None]])
        return all_R[which], np.concatenate([state.p.reshape(-1, 3), p[None]])[which]

    def _add_couplings(
        self, state: LegState, share: Share, A: np.ndarray, r: np.ndarray, r_factor: np.ndarray
    ) -> None:
        """Add couplings to the equations: closures ``s = 0`` of rigid ones, else energy.

        A is flat, see `Numbers`; it, r and r_factor are changed in place.
        """
        at, rigid = self.numbers, iter(range(len(self.rigid)))
        for own, a, s in zip(self.couplings, self.sum_rows, self.sums(state), strict=True):
            x = np.flatnonzero(a)
            factors, push = a[x], float(own.drive.preload)
            if own.is_rigid:
                i = next(rigid)
                row = at.held[i]
                A[at.place(row, x)] += factors
                A[at.place(x, row)] -= factors
                r[row] += s
                r[x] -= factors * state.held[i]
                continue
            A[at.place(x[:, None], x)] += own.drive.tangent(s) * np.outer(factors, factors)
            r[x] += (own.drive.force(s) - share.value * push) * factors
            r_factor[x] -= share.rate * push * factors

    def stepped(self, state: LegState, step: np.ndarray) -> LegState:
        """The state after a step (T + B,) of its unknowns, and of axial forces of its beams."""
        at, twists = self.numbers, np.zeros((len(self.points), 6))
        twists[:, list(self.rows)] = step[at.bodies]
        return LegState(
            state.x + step[at.x],
            state.W + step[at.W],
            matrix_of_rotation(twists[:, 3:]) @ state.R,
            state.p + twists[:, :3],
            state.held + step[at.held],
            state.axial + step[at.total :],
        )

    def anchored(self, state: LegState) -> tuple[np.ndarray, np.ndarray]:
        """Where anchors of springs are (A, 3) [m], and their velocities by unknown (A, 3, T)."""
        points, rates = self.arrays.anchored(state.x, *self._starting(state))
        found = np.zeros((*rates.shape[:2], self.numbers.total), dtype=int).astype(rates.dtype)
        for i, column in enumerate(self.numbers.columns):
            found[:, :, column] = found[:, :, column] + rates[:, :, i]
        return points, found

    def energies(self, state: LegState) -> list[list[float]]:
        """Elastic energy of every element of every chain [J], preloads left out."""
        found = self.arrays.energies(state.x, state.axial)
        return [found[own[1:]].tolist() for own in self.arrays.bodies]

    def energies_of(self, motion: np.ndarray, inner: np.ndarray) -> list[tuple[str, str, float]]:
        """Legs and parts, and what they store in a motion of all unknowns (T,) [J].

        `inner` (B, 12) are amplitudes of inner modes of beams, see `with_modes`.
        """
        x = motion[self.numbers.x]
        found = [
            (self.chains[c].owner.name, beam.name, 0.5 * float(own @ own))
            for (c, _, beam), own in zip(self.beams, inner, strict=True)
        ]
        for (c, k), at in self.places.items():
            e = self.chains[c].elements[k]
            energy = 0.5 * float(np.sum(e.stiffness * x[at] * x[at]))
            found.append((self.chains[c].owner.name, e.name, energy))
        for coupling, a in zip(self.couplings, self.sum_rows, strict=True):
            leg, drive = self.chains[coupling.place[0]].owner.name, coupling.drive
            found.append((leg, drive.name, 0.5 * float(drive.stiffness * (a @ motion) ** 2)))
        return found

    def with_modes(self, block: ComponentBlock, A: np.ndarray, state: LegState) -> np.ndarray:
        """Curvature by the m free unknowns, and by amplitudes of inner modes of beams behind."""
        m, count = block.free, block.beams.shape[1]
        if not count:
            return A[:, :m, :m]
        found = np.zeros((len(A), *[m + 12 * count] * 2))
        found[:, :m, :m] = A[:, :m, :m]
        arrays = self.arrays
        y = arrays.spring_coordinates(state.x)[arrays.beams]
        parts = arrays.bending.with_modes(y, state.axial, arrays.along, arrays.axial)
        for i, first in enumerate(block.beams[0]):
            less, mixed, inside = (own[block.beams[:, i]] for own in parts)
            beam, modes = self.beams[first][2], slice(m + 12 * i, m + 12 * i + 12)
            at = self.numbers.beams[first, : beam.size] - block.at[0, 0]
            found[:, at[:, None], at] += less[:, : beam.size, : beam.size]
            found[:, modes, at] = mixed[:, :, : beam.size]
            found[:, at, modes] = np.swapaxes(mixed[:, :, : beam.size], -1, -2)
            found[:, modes, modes] = inside
        kept = m + np.flatnonzero(self.inner_modes[block.beams[0]])
        kept = np.concatenate([np.arange(m), kept])
        return found[:, kept[:, None], kept]

    def whole_motion(
        self, block: ComponentBlock, i: int, mode: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """A motion of component i of a block, as in `with_modes`, as `energies_of` takes them."""
        motion, inner = np.zeros(self.numbers.total), np.zeros(self.inner_modes.shape)
        motion[block.coordinates[i]] = mode[: block.free]
        own = np.zeros((block.beams.shape[1], 12))
        own[self.inner_modes[block.beams[i]]] = mode[block.free :]
        inner[block.beams[i]] = own
        return motion, inner

    def load_potential(self, state: LegState, share: float) -> float:
        """Potential of loads on its bodies and of preloads, 0 at the unloaded posture [J]."""
        pushed = zip(self.couplings, self.sums(state), strict=True)
        total = -sum(float(own.drive.preload) * s for own, s in pushed)
        return share * (total + self.arrays.load_potential(state.x, *self._starting(state)))

    def twists(self, state: LegState, about: np.ndarray, c: int) -> np.ndarray:
        """Of the body at the start of a chain, and of that behind each of its elements.

        (K + 1, 6, T) about a point (3,), by all unknowns.
        """
        arrays = self.arrays
        own, bodies = arrays.columns[c], arrays.bodies[c]
        by_columns = arrays.twists(state.x, *self._starting(state), about)[own]
        found = np.zeros((len(bodies), 6, self.numbers.total))
        moving = arrays.body[own] <= bodies[:, None]
        found[:, :, self.numbers.columns[own]] = np.swapaxes(by_columns * moving[..., None], 1, 2)
        return found

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Of elastic parts and of drives, by unknown (T,), couplings left out."""
        found, stiff = np.zeros(self.numbers.total), np.zeros(len(self.arrays.coordinates))
        arrays = self.arrays
        stiff[arrays.joint_x] = arrays.stiffness
        stiff[arrays.spring_x] = arrays.mode_stiffness.ravel()[arrays.full]
        found[self.numbers.x] = stiff
        return found

    def own_curvature(self, block: ComponentBlock) -> np.ndarray:
        """Curvature of the elastic energy of parts and couplings, unloaded (N, m, m)."""
        u = block.coordinates
        h = self.stiffness[u][..., None] * np.eye(block.free)
        for own, a in zip(self.couplings, self.sum_rows, strict=True):
            h += float(own.drive.stiffness) * a[u][:, :, None] * a[u][:, None]
        return h

    def unloaded_curvature(self, block: ComponentBlock) -> np.ndarray:
        """The same with that of springs between bodies (N, m, m)."""
        if not self.springs:
            return self.own_curvature(block)
        K = self.spring_arrays.at(self, self.unloaded, 0.0).stiffness
        return self.own_curvature(block) + np.array([K[np.ix_(u, u)] for u in block.coordinates])

    def units(self, length: float) -> np.ndarray:
        """What makes unknowns numbers (T,), in robot lengths and radians.

        Of coordinates and bodies, what a unit turns or shifts; of wrenches, one over the unit of
        the gap that they close.
        """
        at, found = self.numbers, np.ones(self.numbers.total)
        sizes = [s for chain in self.chains for e in chain.elements for s in e.sizes(length)]
        found[at.x] = sizes
        body = [1.0 / length if row < 3 else 1.0 for row in self.rows]
        found[at.bodies], found[at.W] = body, body
        found[at.held] = [1.0 if own.drive.turns else 1.0 / length for own in self.rigid]
        return found

    def without(self, gone: Sequence[int]) -> Legs:
        """The legs but for some chains that are a component each, alone."""
        left = [c for c in range(len(self.chains)) if c not in set(gone)]
        number = {c: i for i, c in enumerate(left)}
        return replace(
            self,
            chains=tuple(self.chains[c] for c in left),
            springs=tuple(own.renumbered(number) for own in self.springs),
            couplings=tuple(own.renumbered(number) for own in self.couplings),
        )
