"""What every joint and elastic part of a loaded robot carries, and where the bodies are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from robostiff.analysis import PartShare
from robostiff.spatial import cross, move_wrench, skew
from robostiff.statics.chains.body_springs import on_anchors
from robostiff.statics.chains.chain import (
    BodyLoad,
    BodyPlace,
    FiniteChain,
    FiniteJoint,
    LegState,
    Owner,
    wrench_at,
)
from robostiff.statics.chains.legs import LegGroup
from robostiff.statics.equations.problem import EquilibriumProblem, State

# Of loads and reactions: what they lack for equilibrium that is no rounding.
_BALANCED = 1e-6
# Of the length of a robot: rounding of where its parts are.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class LoadedPart:
    """A joint or an elastic part under load.

    Attributes
    ----------
    leg, part : str
    number, of : int
        Which of the elements into which a beam is cut, from 1; 1 of 1 elsewhere.
    wrench : (6,) array
        Force [N] and moment about `point` [N m] that the platform side exerts on the base side,
        world axes.
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


def loaded_parts(
    problem: EquilibriumProblem,
    state: State,
    share: float,
    places: State | None = None,
    pulls: Sequence[Sequence[np.ndarray]] = (),
) -> tuple[LoadedPart, ...]:
    """Every joint and elastic part, leg by leg from base to platform, under a share of the loads.

    Wrenches act where the robot is at `places`: for small loads the unloaded posture, else the
    state. Springs between bodies pull on the anchors of the chains of every group with `pulls` (A,
    3), where these are not those at the state.
    """
    found: list[tuple[Owner, LoadedPart]] = []
    placed = (state if places is None else places).legs
    for g, (group, own, where) in enumerate(zip(problem.groups, state.legs, placed, strict=True)):
        energies = group.energies(own)
        acting = _acting(group, own, state, share, pulls[g] if pulls else None)
        for c, (chain, motion) in enumerate(zip(group.chains, group.moved(where), strict=True)):
            W = np.zeros((group.count, 6))
            W[:, list(problem.rows)] = own.W[c]
            P = motion[-1].of(group.end_point(c))
            for k, (wrench, point) in enumerate(_carried(chain, motion, W, P, acting[c])):
                element, x = chain.elements[k], own.x[c][:, chain.places[k]]
                for i, owner in enumerate(chain.owners):
                    load, moved, unit = None, x[i], ""
                    if isinstance(element, FiniteJoint):
                        load = element.force(i, float(x[i, 0])) - share * float(element.preload[i])
                        unit = "N m" if element.turns else "N"
                    else:
                        moved = element.modes[i] @ x[i]
                    alike = [e.names[i] == element.names[i] for e in chain.elements]
                    part = LoadedPart(
                        leg=owner.name,
                        part=element.names[i],
                        number=1 + sum(alike[:k]),
                        of=sum(alike),
                        wrench=wrench[i],
                        point=point[i],
                        motion=moved,
                        load=load,
                        energy=float(energies[c][k][i]),
                        unit=unit,
                    )
                    found.append((owner, part))
                    found += [
                        (owner, replace(part, part=drive.names[i], number=1, of=1, **values))
                        for drive, values in _held(group, own, share, (c, k), i)
                    ]
    return tuple(part for _, part in sorted(found, key=lambda item: item[0]))


def _held(
    group: LegGroup, own: LegState, share: float, place: tuple[int, int], i: int
) -> Iterator[tuple[FiniteJoint, dict[str, Any]]]:
    """Couplings of row i whose joint at a place follows: motion, load and energy of their sums."""
    rigid = iter(range(own.held.shape[1]))
    for coupling, s in zip(group.couplings, group.sums(own), strict=True):
        drive, q = coupling.drive, float(s[i])
        load = -own.held[i, next(rigid)] if coupling.is_rigid else drive.force(i, q)
        if coupling.place == place:
            yield (
                drive,
                {
                    "motion": s[[i]],
                    "load": float(load - share * drive.preload[i]),
                    "energy": drive.energy(i, q),
                },
            )


def base_reactions(
    problem: EquilibriumProblem,
    state: State,
    share: float,
    places: State | None = None,
    pulls: Sequence[Sequence[np.ndarray]] = (),
) -> tuple[np.ndarray, ...]:
    """What every leg exerts on the base about the point of the platform (6,) [N, N m].

    Places and pulls as of `loaded_parts`.
    """
    where = state if places is None else places
    found = {leg: np.zeros(6) for leg in problem.legs}
    for g, (group, own) in enumerate(zip(problem.groups, state.legs, strict=True)):
        acting = _acting(group, own, state, share, pulls[g] if pulls else None)
        moved = group.moved(where.legs[g])
        for c, (chain, motion) in enumerate(zip(group.chains, moved, strict=True)):
            if chain.start is not None:
                continue
            f = np.zeros((group.count, 6))
            f[:, list(problem.rows)] = own.W[c]
            total = move_wrench(f, where.p - motion[-1].of(group.end_point(c)))
            for load in acting[c]:
                at = motion[load.after].of(load.point)
                total += wrench_at(where.p, at, load.force)
            for owner, own_total in zip(chain.owners, total, strict=True):
                found[owner.leg] += own_total
    return tuple(found.values())


def about_the_tool(
    problem: EquilibriumProblem, state: State, by_twist: Sequence[np.ndarray]
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """What the nodes of a flexible platform exert on each leg (r,), and its rate (r, r).

    About the point of the tool P, which moves along: with f at a node's point p, the moment has the
    rate ``dm + (dp - dP) x f + (p - P) x df`` by the twist of the tool. The unknowns of the groups
    move by `by_twist` (N, n, r).
    """
    rows, platform = list(problem.rows), max(problem.legs)
    moved = np.eye(6)[:, rows]  # twist of the tool
    W, K = np.zeros((platform, 6)), np.zeros((platform, 6, len(rows)))
    for group, legs, by in zip(problem.groups, state.legs, by_twist, strict=True):
        own_parts = [own for own in group.chains if own.owners[0].leg == platform]
        held = {None, *(body for own in own_parts for body in (own.start, own.end))}
        for c, chain in enumerate(group.chains):
            if chain.owners[0].leg == platform or chain.end not in held:
                continue
            for row, owner in enumerate(chain.owners):
                own, rate, node = np.zeros(6), np.zeros((6, len(rows))), moved
                own[rows], rate[rows] = legs.W[c][row], by[row, group.wrench_places[c]]
                arm = np.zeros(3)
                if chain.end is not None:
                    node = np.zeros((6, len(rows)))
                    node[rows] = by[row, group.body_places[chain.end]]
                    arm = legs.bodies[chain.end].p[row] - state.p
                rate[3:] += skew(arm) @ rate[:3] - skew(own[:3]) @ (node - moved)[:3]
                own[3:] += np.cross(arm, own[:3])
                W[owner.leg] += own
                K[owner.leg] += rate
    return list(W[:, rows]), list(K[:, rows])


def is_balanced(
    problem: EquilibriumProblem,
    state: State,
    wrench: np.ndarray,
    share: float,
    places: State | None = None,
    forces: Sequence[np.ndarray] = (),
) -> bool:
    """Whether what acts on a robot is what it exerts on the base, forces and moments.

    A wrench (r,) acts on the platform about its point, beside a share of all other loads. What
    moves the robot by rounding of its length is no load, and is not looked at. For small
    loads the robot is where it is at `places`, and springs between bodies of every group have
    `forces` (S, 3) on their first points.
    """
    where = state if places is None else places
    rows, about = list(problem.rows), where.p
    on_platform = np.zeros(6)
    on_platform[rows] = wrench
    applied = [on_platform, share * problem.dead.acting(where.R)[0]]
    if problem.steady is not None:
        on_platform[rows] += problem.steady.moment
        applied.append(problem.steady.weights.acting(where.R)[0])
    carried: list[np.ndarray] = []
    pulls: list[Sequence[np.ndarray]] = []
    for g, group in enumerate(problem.groups):
        moved = group.moved(where.legs[g]) if any(chain.loads for chain in group.chains) else []
        for chain, motion in zip(group.chains, moved, strict=False):
            for load in chain.loads:
                at = motion[load.after].of(load.point)
                applied += list(wrench_at(about, at, share * load.force))
        pulls.append([])
        if group.springs:
            now = group.spring_arrays.at(group, where.legs[g], share)
            force = forces[g] if len(forces) else now.force
            pulls[g] = on_anchors(group, force)
            for side, spring in zip(*np.nonzero(group.spring_arrays.on_base), strict=True):
                sign = 1.0 if side == 0 else -1.0
                carried.append(wrench_at(about, now.points[side, spring], sign * force[spring]))
    carried += base_reactions(problem, state, share, places, pulls)
    both = np.array([*applied, *(-own for own in carried)])[:, rows] / problem.scale
    stiffness = np.max(np.abs(problem.at_rest.K / np.outer(problem.scale, problem.scale)))
    if np.abs(both[: len(applied)]).sum() <= _ROUNDING * problem.length * stiffness:
        return True
    return bool(np.all(np.abs(both.sum(axis=0)) <= _BALANCED * np.abs(both).sum()))


def _acting(
    group: LegGroup,
    own: LegState,
    state: State,
    share: float,
    pulls: Sequence[np.ndarray] | None = None,
) -> list[list[BodyLoad]]:
    """Forces on the bodies of each chain, those of springs between bodies among them."""
    found = [
        [replace(load, force=share * load.force) for load in chain.loads] for chain in group.chains
    ]
    if group.springs:
        if pulls is None:
            pulls = on_anchors(group, group.spring_arrays.at(group, own, share).force)
        for forces, chain, pull in zip(found, group.chains, pulls, strict=True):
            forces += [
                replace(anchor, force=force[None])
                for anchor, force in zip(chain.anchors, pull, strict=True)
            ]
    return found


def shares_of(parts: Sequence[LoadedPart]) -> tuple[PartShare, ...]:
    """Energy of every elastic part, largest first."""
    return shares((p.leg, p.part, p.energy) for p in parts if p.load is None or p.energy > 0)


def shares(each: Iterable[tuple[str, str, float]]) -> tuple[PartShare, ...]:
    """Legs, parts and energies by share, largest first, the elements of a beam together."""
    energies: dict[tuple[str, str], float] = {}
    for leg, part, energy in each:
        energies[leg, part] = energies.get((leg, part), 0.0) + energy
    total = sum(energies.values())
    found = [
        PartShare(leg, part, energy, energy / total if total > 0 else 0.0)
        for (leg, part), energy in energies.items()
    ]
    return tuple(sorted(found, key=lambda share: -round(share.share, 9)))


def _carried(
    chain: FiniteChain,
    motion: Sequence[BodyPlace],
    W: np.ndarray,
    P: np.ndarray,
    acting: Sequence[BodyLoad],
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Wrench (N, 6) of every element about its own point, and that point (N, 3)."""
    for k, element in enumerate(chain.elements):
        behind = motion[k + 1]
        C = behind.of(element.point)
        if isinstance(element, FiniteJoint):
            C = motion[k].of(element.point)
        f = W[:, :3]
        m = W[:, 3:] + cross(P - C, f)
        for load in acting:
            if load.after > k:
                f = f + load.force
                m = m + cross(motion[load.after].of(load.point) - C, load.force)
        yield np.concatenate([f, m], axis=-1), C


@dataclass(frozen=True)
class BodyPlaces:
    """The bodies of a robot at a state.

    Attributes
    ----------
    behind : mapping of str to BodyPlace
        By ``leg/part``: the body behind that joint or elastic part. Rigid joints are not listed:
        the body behind them is that before.
    platform : BodyPlace
    nodes : mapping of str to BodyPlace
        Of a flexible platform, and the moving ones of a network.
    """

    behind: Mapping[str, BodyPlace]
    platform: BodyPlace
    nodes: Mapping[str, BodyPlace] = field(default_factory=dict)

    def since(self, other: BodyPlaces, times: float = 1.0) -> BodyPlaces:
        """How far all bodies have moved since another state, so many times, beside no motion."""
        return BodyPlaces(
            {name: _since(own, other.behind[name], times) for name, own in self.behind.items()},
            _since(self.platform, other.platform, times),
            {name: _since(own, other.nodes[name], times) for name, own in self.nodes.items()},
        )


def body_places(problem: EquilibriumProblem, state: State) -> BodyPlaces:
    """The bodies of a robot at a state, by the parts before them."""
    found, nodes = {}, {}
    platform = BodyPlace(state.R, state.p - state.R @ problem.point)
    every = [g.moved(own) for g, own in zip(problem.groups, state.legs, strict=True)]
    for group, of_chains in zip(problem.groups, every, strict=True):
        for chain, moved in zip(group.chains, of_chains, strict=True):
            for element, place in zip(chain.elements, moved[1:], strict=True):
                for row, owner in enumerate(chain.owners):
                    name = f"{owner.name}/{element.names[row]}"  # the last of a beam counts
                    found[name] = BodyPlace(place.R[row], place.t[row])
        for coupling in group.couplings:
            chain = group.chains[coupling.place[0]]
            joints = chain.elements[coupling.place[1]].names
            each = zip(chain.owners, coupling.drive.names, joints, strict=True)
            found |= {f"{own.name}/{drive}": found[f"{own.name}/{q}"] for own, drive, q in each}
    for node, spot in problem.nodes.items():
        nodes[node] = platform
        if spot is not None:
            place = every[spot.group][spot.chain][spot.after]
            nodes[node] = BodyPlace(place.R[spot.row], place.t[spot.row])
    return BodyPlaces(found, platform, nodes)


def _since(own: BodyPlace, other: BodyPlace, times: float) -> BodyPlace:
    return BodyPlace(np.eye(3) + times * (own.R - other.R), times * (own.t - other.t))
