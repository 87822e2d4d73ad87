"""Legs as chains between bodies: equilibrium and closure of a leg, and their tangent."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.statics.chain import FiniteChain, Moved, moved, velocities
from robostiff.statics.element import Columns, Placement
from robostiff.statics.finite_turn import turns


@dataclass(frozen=True)
class MovingBody:
    """A rigid body of each leg: its axes (N, 3, 3), and where its own point is (N, 3) [m]."""

    R: np.ndarray
    p: np.ndarray

    def placement(self, own_point: np.ndarray) -> Placement:
        """As a motion from the unloaded posture, where its point was at `own_point`."""
        return Placement(self.R, self.p - np.einsum("nij,nj->ni", self.R, own_point))


@dataclass(frozen=True)
class LegState:
    """Coordinates of the legs of a group.

    Attributes
    ----------
    x : tuple of (N, n) arrays
        Of each chain.
    W : tuple of (N, r) arrays
        What the body at the end of each chain exerts on it, about that body's point [N, N m].
    bodies : tuple of MovingBody
        Between the chains of a leg.
    """

    x: tuple[np.ndarray, ...]
    W: tuple[np.ndarray, ...]
    bodies: tuple[MovingBody, ...]


@dataclass(frozen=True)
class LegEquations:
    """Residual and tangent of the legs of a group, platform apart.

    Attributes
    ----------
    A : (N, n, n) array
        Tangent by coordinates, bodies and wrenches.
    r : (N, n) array
        Residual.
    A_t : (N, n, r) array
        Derivative by the twist of the platform.
    r_factor : (N, n) array
        Derivative by the factor of the loads.
    carried : (N, r) array
        What the platform exerts on the leg about its point [N, N m].
    """

    A: np.ndarray
    r: np.ndarray
    A_t: np.ndarray
    r_factor: np.ndarray
    carried: np.ndarray


@dataclass(frozen=True)
class Share:
    """How much of preloads and of loads on legs acts, and how that grows with the factor."""

    value: float
    rate: float


@dataclass(frozen=True)
class LegGroup:
    """Legs that are built alike, computed together.

    Attributes
    ----------
    indices : tuple of int
        Which legs of the robot.
    names : tuple of str
    chains : tuple of FiniteChain
    points : tuple of (N, 3) arrays
        Of the bodies between its chains, at the unloaded posture [m].
    platform_point : (3,) array
        Point of the platform about which wrenches are, at the unloaded posture [m].
    rows : tuple of int
        Coordinates in which it moves: six in space, three in the plane.
    """

    indices: tuple[int, ...]
    names: tuple[str, ...]
    chains: tuple[FiniteChain, ...]
    points: tuple[np.ndarray, ...]
    platform_point: np.ndarray
    rows: tuple[int, ...]

    @staticmethod
    def stacked(legs: Sequence[LegGroup]) -> LegGroup:
        """Legs of one signature as one group."""
        first = legs[0]
        chains = []
        for i, chain in enumerate(first.chains):
            alike = [leg.chains[i] for leg in legs]
            elements = tuple(
                type(e).stacked([own.elements[k] for own in alike])  # type: ignore[arg-type]
                for k, e in enumerate(chain.elements)
            )
            loads = tuple(
                replace(
                    load,
                    point=np.concatenate([own.loads[k].point for own in alike]),
                    force=np.concatenate([own.loads[k].force for own in alike]),
                )
                for k, load in enumerate(chain.loads)
            )
            chains.append(replace(chain, elements=elements, loads=loads))
        return replace(
            first,
            indices=tuple(i for leg in legs for i in leg.indices),
            names=tuple(name for leg in legs for name in leg.names),
            chains=tuple(chains),
            points=tuple(
                np.concatenate([leg.points[b] for leg in legs]) for b in range(len(first.points))
            ),
        )

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return (len(self.points), *(chain.signature for chain in self.chains))

    @property
    def count(self) -> int:
        """Number of legs N."""
        return len(self.indices)

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
        """Number of unknowns."""
        return self.free_size + len(self.rows) * len(self.chains)

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
        )

    def moved(self, state: LegState) -> tuple[Moved, ...]:
        """Every chain in its finite motion."""
        N = self.count
        base = Placement(np.broadcast_to(np.eye(3), (N, 3, 3)), np.zeros((N, 3)))
        found = []
        for chain, x in zip(self.chains, state.x, strict=True):
            if chain.start is None:
                found.append(moved(chain, x, base, None))
                continue
            body = state.bodies[chain.start]
            start = body.placement(self.points[chain.start])
            found.append(moved(chain, x, start, self._body_columns(body)))
        return tuple(found)

    def _body_columns(self, body: MovingBody) -> Columns:
        unit = np.broadcast_to(np.eye(6)[:, list(self.rows)], (self.count, 6, len(self.rows)))
        return Columns(unit[:, :3], unit[:, 3:], body.p)

    def equations(
        self, state: LegState, R: np.ndarray, p: np.ndarray, share: Share
    ) -> LegEquations:
        """Equilibrium and closure, with the platform at (R, p).

        Parameters
        ----------
        state : LegState
        R, p : (3, 3) and (3,) arrays
            Axes and point of the platform [m].
        share : Share
        """
        N, n, rows = self.count, self.size, list(self.rows)
        A, residual = np.zeros((N, n, n)), np.zeros((N, n))
        A_t, r_factor = np.zeros((N, n, len(rows))), np.zeros((N, n))
        identity = np.eye(len(rows))
        carried = np.zeros((N, len(rows)))
        platform = MovingBody(np.broadcast_to(R, (N, 3, 3)), np.broadcast_to(p, (N, 3)))
        for i, (chain, motion) in enumerate(zip(self.chains, self.moved(state), strict=True)):
            own, wrench = self.coordinates[i], self.wrench_places[i]
            places = self._places(i)
            W = state.W[i]
            full = np.zeros((N, 6))
            full[:, rows] = W
            end = platform if chain.end is None else state.bodies[chain.end]
            P = motion.end.of(self.end_point(i))
            if places.size:
                known = velocities(motion.columns, P)
                J = known.J[:, rows]
                A[:, places[:, None], places] -= known.of_wrench(full[:, :3], full[:, 3:])
                A[:, places, wrench] -= np.swapaxes(J, -1, -2)
                A[:, wrench, places] += J
                residual[:, places] -= np.einsum("nia,ni->na", J, W)
            gap = np.concatenate([P - end.p, turn_between(end.R, motion.end.R)], axis=-1)
            residual[:, wrench] += gap[:, rows]
            if chain.end is None:
                A_t[:, wrench] -= identity
                carried += W
            else:
                to = self.body_places[chain.end]
                A[:, wrench, to] -= identity
                A[:, to, wrench] += identity
                residual[:, to] += W
            for element, place in zip(chain.elements, chain.places, strict=True):
                here = slice(own.start + place.start, own.start + place.stop)
                stored = element.energy(state.x[i][:, place], share.value)
                A[:, here, here] += stored.curvature
                residual[:, here] += stored.gradient
                r_factor[:, here] += share.rate * element.by_share()
            for load in chain.loads:
                bodies = load.after + (chain.start is not None)
                felt = places[: self._felt(chain, load.after)]
                if not felt.size:
                    continue
                c = motion.placements[load.after].of(load.point)
                known = velocities(motion.columns[:bodies], c)
                pull = np.einsum("nia,ni->na", known.v, load.force)
                f = share.value * load.force
                A[:, felt[:, None], felt] -= known.of_wrench(f, np.zeros((N, 3)))
                residual[:, felt] -= share.value * pull
                r_factor[:, felt] -= share.rate * pull
        return LegEquations(A, residual, A_t, r_factor, carried)

    def energies(self, state: LegState) -> list[list[np.ndarray]]:
        """Elastic energy of every element of every chain (N,) [J], preloads left out."""
        return [
            [
                element.energy(x[:, place], 0.0).value
                for element, place in zip(chain.elements, chain.places, strict=True)
            ]
            for chain, x in zip(self.chains, state.x, strict=True)
        ]

    def largest_part(self, mode: np.ndarray, i: int) -> str:
        """Name of the part of leg i that stores most energy in a motion of its coordinates."""
        found: list[tuple[float, str]] = []
        for chain, own in zip(self.chains, self.coordinates, strict=True):
            for element, place in zip(chain.elements, chain.places, strict=True):
                x = mode[own.start + place.start : own.start + place.stop]
                energy = float(x @ element.unloaded_curvature[i] @ x)
                found.append((energy, element.names[i]))
        return max(found)[1]

    def load_potential(self, state: LegState, share: float) -> float:
        """Potential of loads on its bodies and of preloads, 0 at the unloaded posture [J]."""
        total = 0.0
        for chain, motion, x in zip(self.chains, self.moved(state), state.x, strict=True):
            for load in chain.loads:
                shift = motion.placements[load.after].of(load.point) - load.point
                total -= share * float(np.sum(load.force * shift))
            for element, place in zip(chain.elements, chain.places, strict=True):
                total += share * float(np.sum(element.by_share() * x[:, place]))
        return total

    @cached_property
    def unloaded_curvature(self) -> np.ndarray:
        """Curvature of the elastic energy by coordinates and bodies, unloaded (N, m, m)."""
        h = np.zeros((self.count, self.free_size, self.free_size))
        for chain, own in zip(self.chains, self.coordinates, strict=True):
            for element, place in zip(chain.elements, chain.places, strict=True):
                here = slice(own.start + place.start, own.start + place.stop)
                h[:, here, here] = element.unloaded_curvature
        return h

    def sizes(self, length: float) -> np.ndarray:
        """What a unit of each coordinate turns or shifts (N, m), shifts by the robot's length."""
        of_chains = [e.sizes(length) for chain in self.chains for e in chain.elements]
        body = np.array([1.0 / length if row < 3 else 1.0 for row in self.rows])
        of_bodies = [np.broadcast_to(body, (self.count, len(body)))] * len(self.points)
        return np.concatenate([np.zeros((self.count, 0)), *of_chains, *of_bodies], axis=-1)

    def stepped(self, state: LegState, step: np.ndarray) -> LegState:
        """The state after a step (N, n) of its unknowns."""
        bodies = []
        for body, place in zip(state.bodies, self.body_places, strict=True):
            twist = np.zeros((self.count, 6))
            twist[:, list(self.rows)] = step[:, place]
            bodies.append(MovingBody(turned_by(twist[:, 3:]) @ body.R, body.p + twist[:, :3]))
        return LegState(
            tuple(x + step[:, s] for x, s in zip(state.x, self.coordinates, strict=True)),
            tuple(W + step[:, s] for W, s in zip(state.W, self.wrench_places, strict=True)),
            tuple(bodies),
        )

    def _places(self, i: int) -> np.ndarray:
        """Places of the unknowns that move chain i: of the body at its start, then its own."""
        chain, own = self.chains[i], self.coordinates[i]
        body = [] if chain.start is None else [self.body_places[chain.start]]
        return np.concatenate([np.arange(s.start, s.stop) for s in (*body, own)]).astype(int)

    def _felt(self, chain: FiniteChain, after: int) -> int:
        """How many of the places of a chain move the body behind some of its elements."""
        body = 0 if chain.start is None else len(self.rows)
        return body + (chain.places[after - 1].stop if after else 0)


def _slices(start: int, sizes: Sequence[int]) -> tuple[slice, ...]:
    ends = np.cumsum([start, *sizes])
    return tuple(slice(int(a), int(b)) for a, b in itertools.pairwise(ends))


def turn_between(R_from: np.ndarray, R_to: np.ndarray) -> np.ndarray:
    """Rotation vector (N, 3) in world axes that turns one set of axes into the other."""
    R = R_to @ np.swapaxes(R_from, -1, -2)
    v = 0.5 * np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=-1
    )
    s = np.sqrt(np.einsum("ni,ni->n", v, v))
    angle = np.arctan2(s, 0.5 * (np.einsum("nii->n", R) - 1.0))
    return v * np.where(s > 1e-9, angle / np.where(s > 1e-9, s, 1.0), 1.0)[:, None]


def turned_by(r: np.ndarray) -> np.ndarray:
    """Rotation matrices (N, 3, 3) of rotation vectors (N, 3)."""
    angle = np.sqrt(np.einsum("ni,ni->n", r, r))
    axis = r / np.where(angle > 0, angle, 1.0)[:, None]
    return turns(axis, angle)
