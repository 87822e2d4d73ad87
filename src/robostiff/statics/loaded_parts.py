"""What every joint and elastic part of a loaded robot carries, and where the bodies are."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import product

import numpy as np

from robostiff.analysis.deflection_under_load import PartShare, by_share
from robostiff.frozen import field, frozen, replace
from robostiff.model import PlacedPlatform
from robostiff.spatial import cross, skew
from robostiff.spatial.rotation import vector_of_rotation
from robostiff.statics.chains.elements import (
    BodyPlace,
    FiniteJoint,
    FiniteSpring,
    Owner,
    group_of,
    wrench_at,
)
from robostiff.statics.chains.legs import State
from robostiff.statics.equations.problem import EquilibriumProblem

# Of loads and reactions: what they lack for equilibrium that is no rounding.
_BALANCED = 1e-6
# Of the length of a robot: rounding of where its parts are.
_ROUNDING = 1e-12


@frozen
class LoadedPart:
    """A joint or an elastic part under load.

    Attributes
    ----------
    leg, part : str
    number, of : int
        Which of the elements into which a beam is cut, from 1; 1 of 1 elsewhere.
    wrench : (6,) array
        Force [N] and moment about `point` [N m] that the platform side exerts on the base side, of
        a network the second body of the part on its first; world axes.
    point : (3,) array
        Where it has moved: a point of the joint, the far end of an elastic part [m].
    motion : (m,) array
        Coordinate of a joint from the unloaded posture [m or rad]; of an elastic part
        displacement and rotation vector of its far end, in its own axes [m, rad].
    load : float or None
        What the load does along the coordinate of a joint: ``k q`` less its preload [N or N m].
    energy : float
        Elastic [J].
    unit : str
        Of the load: N of a slide, N m of a turn.
    """

    leg: str
    part: str
    number: int
    of: int
    wrench: np.ndarray
    point: np.ndarray
    motion: np.ndarray
    load: float | None
    energy: float
    unit: str = ""


@frozen
class LoadedSpring:
    """A spring between two bodies under load.

    Attributes
    ----------
    name : str
    points : (2, 3) array
        Where its ends are [m].
    length : float
        [m].
    tension : float
        Negative where it pushes [N].
    energy : float
        Stored [J]: from its free length; of a constant force, from the unloaded posture.
    is_cable : bool
        Whether it only pulls.
    """

    name: str
    points: np.ndarray
    length: float
    tension: float
    energy: float
    is_cable: bool = False

    @property
    def group(self) -> str:
        """What stands for a leg where parts are named."""
        return group_of(self.is_cable)


@frozen
class CarriedLoads:
    """What a robot carries at a state, under a share of preloads and of forces on legs."""

    problem: EquilibriumProblem
    state: State
    share: float = 1.0
    small: bool = False  #: whether loads are small, and act where the robot is without them
    #: (S, 3): on the first points of springs between bodies, where these are not those at the state
    #: [N]
    forces: np.ndarray | None = None

    @property
    def _where(self) -> State:
        return self.problem.unloaded if self.small else self.state

    @cached_property
    def _bodies(self) -> tuple[np.ndarray, np.ndarray]:
        """Where all bodies are, see `Legs.bodies`."""
        return self.problem.legs.bodies(self._where)

    def _now(self, bodies: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Where points (n, 3) of bodies are, by the numbers of these [m]."""
        R, t = (x[bodies] for x in self._bodies)
        return (R @ points[..., None])[..., 0] + t

    @cached_property
    def _ends(self) -> np.ndarray:
        """Points at the ends of all chains (C, 3) [m]."""
        legs = self.problem.legs
        return self._now(legs.numbers.of_chains.last, legs.end_points)

    @cached_property
    def _acting(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces on the bodies of chains (L, 3) [N], and where they act [m].

        Those of springs between bodies are behind the others.
        """
        legs, at = self.problem.legs, self.problem.legs.numbers.of_chains
        forces = self.share * legs.arrays.load_force
        if legs.springs:
            forces[at.first_anchor :] = legs.on_anchors(self._pulls)
        return forces, self._now(at.load_bodies, legs.arrays.load_point)

    @property
    def _pulls(self) -> np.ndarray:
        """Of springs on their first points (S, 3) [N]."""
        if self.forces is not None:
            return self.forces
        return self.problem.legs.pulls(self.state, self.share).force

    def parts(self) -> tuple[LoadedPart, ...]:
        """Every joint and elastic part, leg by leg from base to platform."""
        found: list[tuple[Owner, LoadedPart]] = []
        legs, state = self.problem.legs, self.state
        energies, pushing = legs.energies(state), iter(state.multipliers)
        sums: defaultdict[tuple[int, int], list[tuple[str, np.ndarray, float, float]]]
        sums = defaultdict(list)
        at, (R, t) = legs.numbers.of_chains, self._bodies
        forces, points = self._acting
        for coupling, s in zip(legs.couplings, legs.sums(state), strict=True):
            drive = coupling.drive
            load = -next(pushing) if coupling.is_rigid else drive.force(s)
            load = float(load - self.share * drive.preload)
            sums[coupling.place].append((drive.name, np.array([s]), load, drive.energy(s)))
        for c, (chain, bodies) in enumerate(zip(legs.chains, at.bodies, strict=True)):
            W, P = np.zeros(6), self._ends[c]
            W[list(legs.rows)] = state.W[c]
            names = [e.name for e in chain.elements if not getattr(e, "goes_on", False)]
            number, first = Counter[str](), 0  # of the elements of a part
            for k, element in enumerate(chain.elements):
                if isinstance(element, FiniteSpring) and element.goes_on:
                    continue
                x = state.x[legs.numbers.places[c, k]]
                if isinstance(element, FiniteJoint):
                    body, moved, unit = bodies[k], x, "N m" if element.turns else "N"
                    load = element.force(float(x[0])) - self.share * float(element.preload)
                else:
                    body, moved, unit = bodies[k + 1], element.modes @ x, ""
                    if first < k:
                        start, back = bodies[first], R[bodies[first]].T
                        d = back @ (R[body] @ element.point + t[body] - t[start]) - element.point
                        turn = vector_of_rotation(back @ R[body])
                        moved = np.concatenate([d, turn]).reshape(2, 3) @ element.rotation
                    load = None
                C = R[body] @ element.point + t[body]
                f, m = W[:3], W[3:] + cross(P - C, W[:3])
                beyond = (at.chains[at.load_bodies] == c) & (at.load_bodies > bodies[k])
                if np.any(beyond):
                    f = f + forces[beyond].sum(axis=0)
                    m = m + cross(points[beyond] - C, forces[beyond]).sum(axis=0)
                if isinstance(element, FiniteJoint) and element.is_passed_back:
                    f, m = -f, -m
                number[element.name] += 1
                part = LoadedPart(
                    leg=chain.owner.name,
                    part=element.name,
                    number=number[element.name],
                    of=names.count(element.name),
                    wrench=np.concatenate([f, m]),
                    point=C,
                    motion=moved.ravel(),
                    load=load,
                    energy=sum(energies[c][first : k + 1]),
                    unit=unit,
                )
                first = k + 1
                found.append((chain.owner, part))
                for name, s, load, energy in sums[c, k]:
                    moved = {"motion": s, "load": load, "energy": energy}
                    found.append((chain.owner, replace(part, part=name, number=1, of=1, **moved)))
        return tuple(part for _, part in sorted(found, key=lambda item: item[0]))

    def reactions(self) -> tuple[np.ndarray, ...]:
        """What every leg exerts on the base about the point of the platform (6,) [N, N m]."""
        legs, about = self.problem.legs, self._where.p
        W, (forces, points) = np.zeros((len(legs.chains), 6)), self._acting
        W[:, list(legs.rows)] = self.state.W
        W[:, 3:] += cross(self._ends - about, W[:, :3])
        at = legs.numbers.of_chains
        np.add.at(W, at.chains[at.load_bodies], wrench_at(about, points, forces))
        found = {leg: np.zeros(6) for leg in self.problem.leg_names}
        for chain, wrench in zip(legs.chains, W, strict=True):
            if chain.start is None:
                found[chain.owner.leg] += wrench
        return tuple(found.values())

    def by_leg(
        self, by_twist: np.ndarray, platform: PlacedPlatform | None
    ) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
        """What the platform exerts on each leg (r,), and its rate (r, r).

        About its point P, which moves along. Of a flexible platform it is what its nodes exert, by
        the twist of the tool: with f at a node's point p, the moment has the rate ``dm + (dp - dP)
        x f + (p - P) x df``. The unknowns of the legs move by `by_twist` (T, r).
        """
        legs, rows, where = self.problem.legs, list(self.problem.rows), self._where
        moved, names = np.eye(6)[:, rows], self.problem.leg_names  # twist of the platform
        own = len(platform.holds) if platform else max(names, default=0) + 1  # behind the legs
        parts = [chain for chain in legs.chains if chain.owner.leg >= own]
        nodes = {None, *(body for part in parts for body in (part.start, part.end))}
        W = {leg: np.zeros(6) for leg in names if leg < own}
        K = {leg: np.zeros((6, len(rows))) for leg in W}
        for c, chain in enumerate(legs.chains):
            if chain.owner.leg not in W or chain.end not in nodes:
                continue
            wrench, rate, node = np.zeros(6), np.zeros((6, len(rows))), moved
            wrench[rows], rate[rows] = self.state.W[c], by_twist[legs.numbers.W[c]]
            arm = np.zeros(3)
            if chain.end is not None:
                node = np.zeros((6, len(rows)))
                node[rows] = by_twist[legs.numbers.bodies[chain.end]]
                arm = where.points[chain.end] - where.p
            rate[3:] += skew(arm) @ rate[:3] - skew(wrench[:3]) @ (node - moved)[:3]
            wrench[3:] += np.cross(arm, wrench[:3])
            W[chain.owner.leg] += wrench
            K[chain.owner.leg] += rate
        return tuple(w[rows] for w in W.values()), tuple(k[rows] for k in K.values())

    def are_balanced(self, wrench: np.ndarray) -> bool:
        """Whether what acts on the robot is what it exerts on the base, forces and moments.

        A wrench (r,) acts on the platform about its point beside all other loads. What moves the
        robot by rounding of its length is no load, and is not looked at.
        """
        problem, legs, where = self.problem, self.problem.legs, self._where
        rows, about, on_platform = list(problem.rows), where.p, np.zeros(6)
        on_platform[rows] = wrench
        applied = [on_platform, self.share * problem.dead.acting(where.R)[0]]
        if problem.steady is not None:
            on_platform[rows] += problem.moment
            applied.append(problem.steady.acting(where.R)[0])
        forces, points = (x[: legs.numbers.of_chains.first_anchor] for x in self._acting)
        applied += [*wrench_at(about, points, forces)]
        carried: list[np.ndarray] = []
        if legs.springs:
            points = legs.pulls(where, self.share).points
            for side, (i, spring) in product((0, 1), enumerate(legs.springs)):
                if spring.spots[side] is None:
                    force = self._pulls[i] * (1 - 2 * side)
                    carried.append(wrench_at(about, points[side, i], force))
        carried += self.reactions()
        both = np.array([*applied, *(-W for W in carried)])[:, rows] / problem.scale
        stiffness = np.max(np.abs(problem.at_rest.K / np.outer(problem.scale, problem.scale)))
        if np.abs(both[: len(applied)]).sum() <= _ROUNDING * problem.length * stiffness:
            return True
        return bool(np.all(np.abs(both.sum(axis=0)) <= _BALANCED * np.abs(both).sum()))

    def springs(self) -> tuple[LoadedSpring, ...]:
        """Every spring between bodies."""
        legs, found = self.problem.legs, []
        if not legs.springs:
            return ()
        now = legs.pulls(self.state, self.share)
        for i, spring in enumerate(legs.springs):
            length, tension = float(now.length[i]), float(now.tension[i])
            ends, energy = now.points[:, i], spring.energy(length, tension)
            found.append(LoadedSpring(spring.name, ends, length, tension, energy, spring.is_cable))
        return tuple(found)


def shares_of(
    parts: Sequence[LoadedPart], others: Iterable[tuple[str, str, float]] = ()
) -> tuple[PartShare, ...]:
    """Energy of every elastic part, and of others by two names each, largest first."""
    elastic = ((p.leg, p.part, p.energy) for p in parts if p.load is None or p.energy > 0)
    return shares((*elastic, *others))


def shares(each: Iterable[tuple[str, str, float]]) -> tuple[PartShare, ...]:
    """Legs, parts and energies by share, largest first, the elements of a beam together."""
    energies: dict[tuple[str, str], float] = {}
    for leg, part, energy in each:
        energies[leg, part] = energies.get((leg, part), 0.0) + energy
    return by_share((*names, energy) for names, energy in energies.items())


@frozen
class BodyPlaces:
    """The bodies of a robot at a state."""

    #: by ``leg/part``: the body behind that joint or elastic part. Rigid joints are not listed: the
    #: body behind them is that before.
    behind: Mapping[str, BodyPlace]
    platform: BodyPlace
    #: of a flexible platform, and the moving ones of a network
    nodes: Mapping[str, BodyPlace] = field(default_factory=dict)

    def since(self, other: BodyPlaces) -> BodyPlaces:
        """How far all bodies have moved since another state, beside no motion."""
        return BodyPlaces(
            {name: _since(place, other.behind[name]) for name, place in self.behind.items()},
            _since(self.platform, other.platform),
            {name: _since(place, other.nodes[name]) for name, place in self.nodes.items()},
        )


def body_places(problem: EquilibriumProblem, state: State) -> BodyPlaces:
    """The bodies of a robot at a state, by the parts before them."""
    found, nodes = {}, {}
    platform = BodyPlace(state.R, state.p - state.R @ problem.point)
    legs = problem.legs
    R, t = legs.bodies(state)
    places = [[BodyPlace(R[i], t[i]) for i in bodies] for bodies in legs.numbers.of_chains.bodies]
    for chain, moved in zip(legs.chains, places, strict=True):
        for element, place in zip(chain.elements, moved[1:], strict=True):
            found[f"{chain.owner.name}/{element.name}"] = place  # the last of a beam counts
    for coupling in legs.couplings:
        c, k = coupling.place
        leg, joint = legs.chains[c].owner.name, legs.chains[c].elements[k].name
        found[f"{leg}/{coupling.drive.name}"] = found[f"{leg}/{joint}"]
    for node, spot in problem.nodes.items():
        nodes[node] = platform if spot is None else places[spot.chain][spot.after]
    return BodyPlaces(found, platform, nodes)


def _since(place: BodyPlace, other: BodyPlace) -> BodyPlace:
    return BodyPlace(np.eye(3) + (place.R - other.R), place.t - other.t)
