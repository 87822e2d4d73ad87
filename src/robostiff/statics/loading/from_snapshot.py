"""A robot at a pose as chains between bodies, ready to be loaded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from robostiff.errors import InputError
from robostiff.model import (
    CoupledFreedom,
    Passive,
    PlacedBlock,
    PlacedFreedom,
    PlacedLeg,
    PlacedMass,
    PlacedSpring,
    Snapshot,
    StiffnessLaw,
)
from robostiff.statics.chains.beam_bowing import Beams, SpringElements, moves
from robostiff.statics.chains.body_springs import HeldSprings
from robostiff.statics.chains.carried_masses import CarriedMass
from robostiff.statics.chains.chain import (
    BodyLoad,
    Element,
    FiniteChain,
    FiniteCoupling,
    FiniteJoint,
    unknown_name,
)
from robostiff.statics.chains.legs import LegGroup
from robostiff.statics.loading.flexible_platform import on_flexible_platform
from robostiff.statics.loading.given_loads import DeadForce, load_vector

_NO_GRAVITY = np.zeros(3)


def legs_of(
    snapshot: Snapshot,
    platform_point: np.ndarray,
    beams: Beams,
    loads: Mapping[str, Sequence[DeadForce]],
    preload: Mapping[str, float],
    gravity: np.ndarray = _NO_GRAVITY,
) -> tuple[LegGroup, ...]:
    """The legs of a snapshot at one pose, those built alike in one group.

    Forces act on the body behind ``leg/part``; preloads [N or N m] are of the drive of a joint by
    that name. Gravity [m/s^2] makes weights of the masses of the legs. Wrenches are about a point
    of the platform (3,) [m].

    Raises
    ------
    InputError
        When a name is no part of the robot, or a preload is not of an elastic or passive joint.
    """
    springs, walks = SpringElements(snapshot.space, beams), walks_of(snapshot, beams)
    if np.any(gravity):
        for walk in walks:
            for own in walk.carried:
                walk.loads.setdefault(own.chain, []).extend(own.weights(gravity))
    named = {name: (k, part) for k, walk in enumerate(walks) for name, part in walk.named.items()}
    for name, forces in loads.items():
        k, part = _found(named, name, "loads")
        for force in forces:
            point = part.point if force.point is None else load_vector("point", name, force.point)
            body = BodyLoad(part.after, point[None], load_vector("force", name, force.force)[None])
            walks[k].loads.setdefault(part.chain, []).append(body)
    for name, value in preload.items():
        k, part = _found(named, name, "preload")
        own = walks[k].couplings
        if part.sum is not None and not own[part.sum].is_rigid:
            own[part.sum] = own[part.sum].pushed(value)
            continue
        if part.drive is None:
            raise InputError(
                f"preload of {name!r}",
                expected="the name of one joint that moves: passive, or with a stiffness",
                hint="a rigid drive holds whatever it must; springs are preloaded by a drive",
            )
        chain = walks[k].chains[part.chain]
        joint = chain[2][part.drive]
        if isinstance(joint, FiniteJoint):
            chain[2][part.drive] = replace(joint, preload=joint.preload + value)
    groups: dict[tuple[object, ...], list[LegGroup]] = {}
    held = HeldSprings.of(snapshot, {n: (k, part.chain) for n, (k, part) in named.items()})
    for k, (leg, walk) in enumerate(zip(snapshot.legs, walks, strict=True)):
        one = LegGroup(
            (k,),
            (leg.name,),
            tuple(
                FiniteChain(
                    start,
                    end,
                    tuple(elements),
                    tuple(walk.loads.get(c, ())),
                    tuple(
                        BodyLoad(named[name][1].after, np.array([point], float), np.zeros((1, 3)))
                        for spring in snapshot.springs
                        for name, point in zip(spring.bodies, spring.points, strict=True)
                        if held.places.get(name) == (k, c)
                    ),
                )
                for c, (start, end, elements) in enumerate(walk.chains)
            ),
            tuple(point[None] for point in walk.points),
            platform_point,
            snapshot.space.rows,
            couplings=tuple(walk.couplings),
        )
        is_held = held.group_of(k) >= 0
        groups.setdefault((k if is_held else None, one.signature), []).append(one)
    joined = held.joined([LegGroup.stacked(legs) for legs in groups.values()])
    if snapshot.platform is None:
        return joined
    return (on_flexible_platform(joined[0], snapshot.platform, springs),)


@dataclass(frozen=True)
class _Part:
    """What a name stands for: a place behind some elements of a chain, and its point (3,) [m].

    `drive` is the element that is its joint, `sum` the coupling that it is, of whose joint it
    follows.
    """

    chain: int
    after: int
    point: np.ndarray
    drive: int | None
    sum: int | None = None
    spring: PlacedSpring | None = None  # the elastic part that it is


@dataclass(frozen=True)
class _Behind:
    """A body behind some elements of a leg.

    Behind `after` elements of a chain, the last of them at a point [m]; or, without a chain, a body
    between chains, with None for the base, or for the platform at the end.
    """

    body: int | None
    chain: int | None = None
    after: int = 0
    point: np.ndarray = field(default_factory=lambda: np.zeros(3))
    is_end: bool = False


def masses_on_legs(
    snapshot: Snapshot, beams: Beams, given: Mapping[str, Sequence[PlacedMass]]
) -> list[CarriedMass]:
    """The masses of the legs, and given ones on bodies behind ``leg/part``.

    Raises
    ------
    InputError
        When a name is no part of the robot.
    """
    walks = walks_of(snapshot, beams)
    named = {name: (k, part) for k, walk in enumerate(walks) for name, part in walk.named.items()}
    found = [replace(own, leg=k) for k, walk in enumerate(walks) for own in walk.carried]
    for name, masses in given.items():
        k, part = _found(named, name, "masses")
        found += [CarriedMass(own, part.chain, part.after, leg=k) for own in masses]
    return found


def walks_of(snapshot: Snapshot, beams: Beams) -> list[LegWalk]:
    """The chains of each leg, loads left out."""
    springs = SpringElements(snapshot.space, beams)
    found = []
    for leg in snapshot.legs:
        walk = LegWalk(springs, f"{leg.name}/")
        walk.along(leg, None, None)
        walk.name_fixed()
        found.append(walk)
    return found


@dataclass
class LegWalk:
    """The chains of one leg, as they are found on the way from base to platform."""

    springs: SpringElements
    prefix: str
    chains: list[tuple[int | None, int | None, list[Element]]] = field(default_factory=list)
    points: list[np.ndarray] = field(default_factory=list)
    named: dict[str, _Part] = field(default_factory=dict)
    loads: dict[int, list[BodyLoad]] = field(default_factory=dict)
    weights: list[tuple[PlacedMass, _Behind]] = field(default_factory=list)
    # parts that do not move where no other does, between blocks and before or behind all of them
    fixed: list[tuple[PlacedFreedom | PlacedSpring, _Behind]] = field(default_factory=list)
    couplings: list[FiniteCoupling] = field(default_factory=list)
    blocks: list[tuple[PlacedBlock, _Behind]] = field(default_factory=list)

    def along(self, leg: PlacedLeg, start: int | None, end: int | None) -> None:
        """Chains from one body to another, through the blocks between them."""
        elements = [e.alone if isinstance(e, CoupledFreedom) else e for e in leg.elements]
        behind = [_Behind(start)]
        run: list[PlacedFreedom | PlacedSpring] = []
        for i, element in enumerate(elements):
            if not isinstance(element, PlacedBlock):
                run.append(element)
                continue
            moving = [e for e in run if moves(e)]
            if moving:
                body = self.body(moving[-1].point)
                behind += self.chain(run, start, body)
                start = body
            else:
                behind += self.fix(replace(leg, elements=tuple(run)), behind[-1])
            run = []
            goes_on = any(moves(later) for later in elements[i + 1 :])
            target = self.body(element.branches[0].end) if goes_on else end
            for branch in element.branches:
                self.along(branch, start, target)
            behind.append(_Behind(target, is_end=True))
            self.blocks.append((element, behind[-1]))
            if not goes_on:
                behind += self.fix(replace(leg, elements=tuple(elements[i + 1 :])), behind[-1])
                break
            start = target
        else:
            behind += self.chain(run, start, end)
        self.weights += [(mass, behind[mass.after]) for mass in leg.masses]
        for element in leg.elements:
            if isinstance(element, CoupledFreedom) and len(element.sum) > 1:
                self.couple(element)

    def fix(self, run: PlacedLeg, behind: _Behind) -> list[_Behind]:
        """Elements that do not move: the body behind each is the one before them."""
        self.fixed += [(part, behind) for part in run.parts]
        return [behind] * len(run.elements)

    def name_fixed(self) -> None:
        """Name the parts that do not move, and blocks, when all chains are there."""
        for element, behind in self.fixed:
            self.name(element, _Part(*self.place(behind), np.asarray(element.point, float), None))
        for block, behind in self.blocks:
            end = np.asarray(block.branches[0].end, float)
            self.named.setdefault(self.prefix + block.name, _Part(*self.place(behind), end, None))

    def name(self, element: PlacedFreedom | PlacedSpring, part: _Part) -> None:
        """A part by its name; a joint has its body behind the last freedom, its place at the first.

        Raises
        ------
        InputError
            When another part of the leg has the name.
        """
        if self.prefix + element.name in self.named:
            raise InputError(
                "parts of a snapshot under load",
                got=f"{self.prefix + element.name}, twice",
                expected="each name once in a leg: loads and masses are known by it",
            )
        self.named[self.prefix + element.name] = part
        whole = element.name.partition("[")[0]
        if whole != element.name:
            first = self.named.get(self.prefix + whole, part)  # the joint stands where it does
            self.named[self.prefix + whole] = replace(part, drive=None, point=first.point)

    def couple(self, own: CoupledFreedom) -> None:
        """Couple joints that have been met; one that a rigid drive holds does not move."""
        follows = self.named[self.prefix + own.joint]
        places, factors = [], []
        for name, factor in own.sum:
            part = self.named.get(self.prefix + name)
            if part is not None and part.drive is not None:
                places.append((part.chain, part.drive))
                factors.append(float(factor))
        self.named[self.prefix + own.name] = replace(follows, drive=None, sum=len(self.couplings))
        self.couplings.append(
            FiniteCoupling(
                finite_joint(own),
                own.stiffness is None,
                (follows.chain, follows.after - 1),
                tuple(places),
                np.array(factors)[None],
            )
        )

    @property
    def carried(self) -> list[CarriedMass]:
        """Its masses; those along an elastic part are carried by the bodies at its ends."""
        found = []
        for mass, behind in self.weights:
            chain, after = self.place(behind)
            along = self.chains[chain][2][:after] if mass.start is not None else ()
            parts = sum(element.names[0] == mass.name for element in along)
            known = self.named.get(self.prefix + mass.name)
            part = None if known is None else known.spring
            found.append(CarriedMass(mass, chain, after, parts, part, behind.point))
        return found

    def place(self, behind: _Behind) -> tuple[int, int]:
        """A chain, and how many of its elements lie before a body."""
        if behind.chain is not None:
            return behind.chain, behind.after
        if behind.body is None and not behind.is_end:
            return 0, 0  # the first chain begins at the base
        found = [c for c, (_, end, _) in enumerate(self.chains) if end == behind.body]
        return found[-1], len(self.chains[found[-1]][2])

    def body(self, point: np.ndarray) -> int:
        """A new body between chains, by a point of it."""
        self.points.append(point)
        return len(self.points) - 1

    def chain(
        self,
        run: Sequence[PlacedFreedom | PlacedSpring],
        start: int | None,
        end: int | None,
    ) -> list[_Behind]:
        """A chain of joints and springs from one body to another; the bodies behind each."""
        own: list[Element] = []
        behind: list[_Behind] = []
        for element in run:
            drive = spring = None
            if isinstance(element, PlacedSpring):
                spring = element
                own += self.springs.of(element)
            elif moves(element):
                drive = len(own)
                own.append(finite_joint(element))
            point = np.asarray(element.point, float)
            behind.append(_Behind(end, len(self.chains), len(own), point))
            self.name(element, _Part(len(self.chains), len(own), point, drive, spring=spring))
        self.chains.append((start, end, own))
        return behind


def finite_joint(freedom: PlacedFreedom) -> FiniteJoint:
    """A joint in finite motion."""
    k = 0.0 if freedom.stiffness is None else float(freedom.stiffness)
    varying = None if isinstance(freedom.role, Passive) else freedom.role.stiffness
    law = varying.from_rest(freedom.coordinate) if isinstance(varying, StiffnessLaw) else None
    inertia = getattr(freedom.role, "inertia", None)
    return FiniteJoint(
        (freedom.name,),
        np.array(freedom.point, dtype=float)[None],
        np.array(freedom.axis, dtype=float)[None],
        freedom.turns,
        np.array([freedom.advance(1.0)]),
        np.array([k]),
        np.zeros(1),
        (law,),
        np.array([0.0 if inertia is None else float(inertia)]),
    )


def _found(named: Mapping[str, tuple[int, _Part]], name: str, subject: str) -> tuple[int, _Part]:
    if name in named:
        return named[name]
    what = "leg/part" if subject == "preload" else "platform or leg/part"
    raise unknown_name(subject, name, named, what)
