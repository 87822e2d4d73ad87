"""Legs as chains between bodies: equilibrium and closure of a leg, and their tangent."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.spatial.rotation import matrix_of_rotation
from robostiff.statics.chains.body_springs import FiniteBodySpring, SpringArrays
from robostiff.statics.chains.chain import (
    NOBODY,
    BodyPlace,
    FiniteChain,
    FiniteCoupling,
    FiniteSpring,
    LegEquations,
    LegState,
    MovingBody,
    Owner,
    Share,
)
from robostiff.statics.chains.chain_family import ChainFamily, by_leg


@dataclass(frozen=True)
class LegGroup:
    """Legs that are built alike, computed together.

    Attributes
    ----------
    chains : tuple of FiniteChain
    points : tuple of (N, 3) arrays
        Of the bodies between its chains, at the unloaded posture [m].
    platform_point : (3,) array
        Point of the platform about which wrenches are, at the unloaded posture [m].
    rows : tuple of int
        Coordinates in which it moves: six in space, three in the plane.
    springs : tuple of FiniteBodySpring
        Between bodies; legs that have or share some are a group of their own, with N = 1.
    couplings : tuple of FiniteCoupling
        Of joints of a leg.
    """

    chains: tuple[FiniteChain, ...]
    points: tuple[np.ndarray, ...]
    platform_point: np.ndarray
    rows: tuple[int, ...]
    springs: tuple[FiniteBodySpring, ...] = ()
    couplings: tuple[FiniteCoupling, ...] = ()

    @staticmethod
    def stacked(legs: Sequence[LegGroup]) -> LegGroup:
        """Legs of one signature as one group."""
        first = legs[0]
        if len(legs) == 1:
            return first
        return replace(
            first,
            chains=tuple(
                FiniteChain.stacked([leg.chains[i] for leg in legs])
                for i in range(len(first.chains))
            ),
            points=tuple(
                np.concatenate([leg.points[b] for leg in legs]) for b in range(len(first.points))
            ),
            couplings=tuple(
                FiniteCoupling.stacked([leg.couplings[i] for leg in legs])
                for i in range(len(first.couplings))
            ),
        )

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        coupled = tuple(own.signature for own in self.couplings)
        return (len(self.points), coupled, *(chain.signature for chain in self.chains))

    @property
    def count(self) -> int:
        """Number of legs N."""
        return len(self.chains[0].owners)

    @cached_property
    def first(self) -> list[Owner]:
        """The first leg of every row; `NOBODY` where springs hold the platform alone."""
        rows = zip(*(chain.owners for chain in self.chains), strict=True)
        return [min((own for own in row if own != NOBODY), default=NOBODY) for row in rows]

    @cached_property
    def coordinates(self) -> tuple[slice, ...]:
        """Places of the coordinates of each chain among the unknowns."""
        return _slices(0, [chain.size for chain in self.chains])

    @cached_property
    def body_places(self) -> tuple[slice, ...]:
        """Places of the twists of its bodies."""
        return _slices(
            sum(chain.size for chain in self.chains), [len(self.rows)] * len(self.points)
        )

    @cached_property
    def wrench_places(self) -> tuple[slice, ...]:
        """Places of the wrenches of its chains."""
        return _slices(self.free_size, [len(self.rows)] * len(self.chains))

    @property
    def free_size(self) -> int:
        """Number of coordinates and of components of twists of bodies."""
        return sum(chain.size for chain in self.chains) + len(self.rows) * len(self.points)

    @property
    def size(self) -> int:
        """Number of unknowns: free ones, wrenches, and what rigid couplings push with."""
        rigid = sum(own.is_rigid for own in self.couplings)
        return self.free_size + len(self.rows) * len(self.chains) + rigid

    @cached_property
    def on_platform(self) -> tuple[int, ...]:
        """Chains that end on the platform."""
        return tuple(i for i, chain in enumerate(self.chains) if chain.end is None)

    def end_point(self, i: int) -> np.ndarray:
        """Point of the body at the end of chain i, at the unloaded posture (N, 3) [m]."""
        end = self.chains[i].end
        own = self.platform_point if end is None else self.points[end]
        return np.broadcast_to(own, (self.count, 3))

    def unloaded(self) -> LegState:
        """The posture from which it is loaded."""
        N, r = self.count, len(self.rows)
        R = np.broadcast_to(np.eye(3), (N, 3, 3))
        return LegState(
            tuple(np.zeros((N, chain.size)) for chain in self.chains),
            tuple(np.zeros((N, r)) for _ in self.chains),
            tuple(MovingBody(R, point) for point in self.points),
            np.zeros((N, sum(own.is_rigid for own in self.couplings))),
            np.zeros((N, len(self.beams))),
        )

    @cached_property
    def beams(self) -> list[tuple[int, int, FiniteSpring]]:
        """Every beam with bowing, behind the numbers of its chain and of its element there."""
        return [
            (c, k, e)
            for c, chain in enumerate(self.chains)
            for k, e in enumerate(chain.elements)
            if isinstance(e, FiniteSpring) and np.any(e.axial)
        ]

    @cached_property
    def family(self) -> ChainFamily:
        """Its chains side by side."""
        return ChainFamily.of((self,))

    def moved(self, state: LegState) -> list[list[BodyPlace]]:
        """Of every chain, where the bodies at its start and behind every element are."""
        family = self.family
        R, t = family.arrays.moved(family.coordinates([state]), *family.starting([state]))
        pairs = zip(family.rows, family.slots, strict=True)
        return [[BodyPlace(R[rows, k], t[rows, k]) for k in (0, *(own + 1))] for rows, own in pairs]

    @cached_property
    def sum_rows(self) -> list[np.ndarray]:
        """Of every coupling: the factors of its sum among the free unknowns (N, m)."""
        found = []
        for own in self.couplings:
            a = np.zeros((self.count, self.free_size))
            for (c, k), factor in zip(own.terms, own.factors.T, strict=True):
                a[:, self.coordinates[c].start + self.chains[c].places[k].start] = factor
            found.append(a)
        return found

    def sums(self, state: LegState) -> list[np.ndarray]:
        """Of every coupling: its sum (N,) [m or rad]."""
        x = np.concatenate([np.zeros((self.count, 0)), *state.x], axis=1)
        return [np.sum(a[:, : x.shape[1]] * x, axis=1) for a in self.sum_rows]

    def add_couplings(
        self,
        state: LegState,
        share: Share,
        A: np.ndarray,
        r: np.ndarray,
        r_factor: np.ndarray,
    ) -> None:
        """Add its couplings to the equations: closures ``s = 0`` of rigid ones, else energy.

        A, r and r_factor are those of `LegEquations`, changed in place.
        """
        m, at = self.free_size, self.size - state.held.shape[1]
        for own, a, s in zip(self.couplings, self.sum_rows, self.sums(state), strict=True):
            if own.is_rigid:
                A[:, at, :m] += a
                A[:, :m, at] -= a
                r[:, at] += s
                r[:, :m] -= a * state.held[:, [at - self.size]]
                at += 1
                continue
            f, k = (
                np.array([each(i, float(q)) for i, q in enumerate(s)])[:, None]
                for each in (own.drive.force, own.drive.tangent)
            )
            push = own.drive.preload[:, None]
            A[:, :m, :m] += (k * a)[:, :, None] * a[:, None]
            r[:, :m] += (f - share.value * push) * a
            r_factor[:, :m] -= share.rate * push * a

    @cached_property
    def spring_arrays(self) -> SpringArrays:
        """Its springs between bodies side by side."""
        return SpringArrays.of(self.springs)

    def anchored(self, state: LegState) -> list[tuple[np.ndarray, np.ndarray]]:
        """Where springs are held on every chain (A, 3) [m], and their velocities (A, 3, m)."""
        family, found = self.family, []
        for own in self.chains:
            points = np.zeros((len(own.anchors), 3), dtype=int).astype(family.arrays.kind)
            found.append((points, np.tile(points[..., None], self.free_size)))
        if not family.held:
            return found
        x = family.coordinates([state])
        points, rates = family.arrays.loaded(x, *family.starting([state]))
        for c, place, load in family.held:
            found[c][0][place] = points[c, load]
            to = self.moving_places(c)
            found[c][1][place][:, to] = rates[c, load][:, family.columns[c]]
        return found

    def energies(self, state: LegState) -> list[list[np.ndarray]]:
        """Elastic energy of every element of every chain (N,) [J], preloads left out."""
        x, axial = self.family.coordinates([state]), self.family.axial([state])
        found = self.family.arrays.energies(x, axial)
        pairs = zip(self.family.rows, self.family.slots, strict=True)
        return [list(found[rows][:, own].T) for rows, own in pairs]

    def energies_of(self, mode: np.ndarray, i: int) -> list[tuple[str, str, float]]:
        """Legs and parts of row i, and what they store in a motion of its coordinates [J].

        Behind these, the motion may have amplitudes of inner modes, see `with_modes`.
        """
        found = []
        inside = np.zeros(12 * len(self.beams))
        inside[self.family.places[0].modes[: len(mode) - self.free_size]] = mode[self.free_size :]
        for (c, _, beam), own in zip(self.beams, inside.reshape(-1, 12), strict=True):
            leg = self.chains[c].owners[i].name
            found.append((leg, beam.names[i], 0.5 * float(own @ own)))
        for chain, own in zip(self.chains, self.coordinates, strict=True):
            leg = chain.owners[i].name
            for element, place in zip(chain.elements, chain.places, strict=True):
                x = mode[own.start + place.start : own.start + place.stop]
                energy = 0.5 * float(np.sum(element.stiffness[i] * x * x))
                found.append((leg, element.names[i], energy))
        for own, a in zip(self.couplings, self.sum_rows, strict=True):
            leg = self.chains[own.place[0]].owners[i].name
            energy = 0.5 * float(own.drive.stiffness[i] * (a[i] @ mode[: self.free_size]) ** 2)
            found.append((leg, own.drive.names[i], energy))
        return found

    def with_modes(self, eq: LegEquations) -> np.ndarray:
        """Curvature by the m free unknowns, and by amplitudes of inner modes of beams behind."""
        m = self.free_size
        if not self.beams:
            return eq.A[:, :m, :m]
        family, known = self.family, self.family.places[0]
        found = np.zeros((self.count, *[m + 12 * len(self.beams)] * 2))
        found[:, :m, :m] = eq.A[:, :m, :m]
        arrays, x = family.arrays, family.coordinates([eq.state])
        own = arrays.spring_coordinates(x), family.axial([eq.state]), arrays.along, arrays.axial
        parts = arrays.bending.with_modes(*own)
        less, mixed, inside = (by_leg(own, self.count)[:, known.beams] for own in parts)
        for i, (_, _, beam) in enumerate(self.beams):
            size, first = beam.size, known.beam_columns[i, 0]
            at, modes = slice(first, first + size), slice(m + 12 * i, m + 12 * i + 12)
            found[:, at, at] += less[:, i, :size, :size]
            found[:, modes, at] = mixed[:, i, :, :size]
            found[:, at, modes] = np.swapaxes(mixed[:, i, :, :size], -1, -2)
            found[:, modes, modes] = inside[:, i]
        kept = np.concatenate([np.arange(m), m + known.modes])
        return found[:, kept[:, None], kept]

    def load_potential(self, state: LegState, share: float) -> float:
        """Potential of loads on its bodies and of preloads, 0 at the unloaded posture [J]."""
        total = -sum(
            float(np.sum(own.drive.preload * s))
            for own, s in zip(self.couplings, self.sums(state), strict=True)
        )
        x, start = self.family.coordinates([state]), self.family.starting([state])
        return share * (total + float(np.sum(self.family.arrays.load_potential(x, *start))))

    def twists(self, state: LegState, about: np.ndarray) -> list[np.ndarray]:
        """Of the body at the start of every chain, and of that behind each of its elements.

        Arrays (N, K + 1, 6, m) about a point (3,), by coordinates and bodies.
        """
        if not self.chains:
            return []
        family, found = self.family, []
        x = family.coordinates([state])
        by_all = family.arrays.twists(x, *family.starting([state]), about)
        parts = zip(family.rows, family.slots, family.columns, strict=True)
        for i, (own, slots, columns) in enumerate(parts):
            behind = np.append(0, slots + 1)
            moving = by_all[own][:, None] * family.arrays.moving(behind)[..., None]
            wide = np.zeros((self.count, len(behind), 6, self.free_size))
            wide[..., self.moving_places(i)] = np.swapaxes(moving[:, :, columns], -1, -2)
            found.append(wide)
        return found

    @cached_property
    def own_curvature(self) -> np.ndarray:
        """Curvature of the elastic energy of its parts, unloaded (N, m, m)."""
        h = np.zeros((self.count, self.free_size, self.free_size))
        for chain, own in zip(self.chains, self.coordinates, strict=True):
            for element, place in zip(chain.elements, chain.places, strict=True):
                here = np.arange(own.start + place.start, own.start + place.stop)
                h[:, here, here] = element.stiffness.reshape(self.count, -1)
        for own, a in zip(self.couplings, self.sum_rows, strict=True):
            h += (own.drive.stiffness[:, None] * a)[:, :, None] * a[:, None]
        return h

    @cached_property
    def unloaded_curvature(self) -> np.ndarray:
        """The same by coordinates and bodies, with that of springs between bodies (N, m, m)."""
        if not self.springs:
            return self.own_curvature
        return self.own_curvature + self.spring_arrays.at(self, self.unloaded(), 0.0).stiffness

    def sizes(self, length: float) -> np.ndarray:
        """What a unit of each coordinate turns or shifts (N, m), shifts by the robot's length."""
        of_chains = [e.sizes(length) for chain in self.chains for e in chain.elements]
        body = np.array([1.0 / length if row < 3 else 1.0 for row in self.rows])
        of_bodies = [np.broadcast_to(body, (self.count, len(body)))] * len(self.points)
        return np.concatenate([np.zeros((self.count, 0)), *of_chains, *of_bodies], axis=-1)

    def closure_sizes(self, length: float) -> np.ndarray:
        """What makes numbers of the gaps of its closures (c,), in robot lengths and radians."""
        of_chain = [1.0 / length if row < 3 else 1.0 for row in self.rows]
        rigid = [own.drive.turns for own in self.couplings if own.is_rigid]
        of_couplings = [1.0 if turns else 1.0 / length for turns in rigid]
        return np.array(of_chain * len(self.chains) + of_couplings)

    def stepped(self, state: LegState, step: np.ndarray) -> LegState:
        """The state after a step (N, n + b) of its unknowns, and of axial forces of its beams."""
        twists = np.zeros((len(self.points), self.count, 6))
        for twist, place in zip(twists, self.body_places, strict=True):
            twist[:, list(self.rows)] = step[:, place]
        turns = matrix_of_rotation(twists[..., 3:]) if self.points else ()
        bodies = [
            MovingBody(R @ body.R, body.p + twist[:, :3])
            for R, twist, body in zip(turns, twists, state.bodies, strict=True)
        ]
        return LegState(
            tuple(x + step[:, s] for x, s in zip(state.x, self.coordinates, strict=True)),
            tuple(W + step[:, s] for W, s in zip(state.W, self.wrench_places, strict=True)),
            tuple(bodies),
            state.held + step[:, self.size - state.held.shape[1] : self.size],
            state.axial + step[:, self.size :],
        )

    def moving_places(self, i: int) -> np.ndarray:
        """Places of the unknowns that move chain i: of the body at its start, then its own."""
        start, own = self.chains[i].start, self.coordinates[i]
        return _places(own) if start is None else _places(self.body_places[start], own)


def _places(*parts: slice) -> np.ndarray:
    return np.concatenate([np.arange(own.start, own.stop) for own in parts])


def _slices(start: int, sizes: Sequence[int]) -> tuple[slice, ...]:
    ends = np.cumsum([start, *sizes])
    return tuple(slice(int(a), int(b)) for a, b in itertools.pairwise(ends))
