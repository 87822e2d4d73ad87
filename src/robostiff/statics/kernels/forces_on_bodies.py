"""What acts on bodies on recorded entries: springs between them, weights, and dead forces."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.kinematics import Pose
from robostiff.model import (
    Chain,
    Element,
    Joint,
    Leg,
    Link,
    Mass,
    ParallelBlock,
    PlacedBlock,
    PlacedBodySpring,
    PlacedElement,
    PlacedLeg,
    PlacedMass,
    PlacedSpring,
    Rigid,
    Telescope,
    TelescopicBeam,
)
from robostiff.model.body_spring import BASE, PLATFORM, BodySpring
from robostiff.record import is_zero, reciprocal, square_root, usual_size
from robostiff.recorded.robot import RobotOnEntries
from robostiff.spatial import cross, is_formula
from robostiff.statics.chains.beam_bowing import Beams, Bowing
from robostiff.statics.chains.chain import BodyLoad
from robostiff.statics.equilibrium import equilibrium
from robostiff.statics.kernels.elimination import SymmetricElimination
from robostiff.statics.kernels.motion import Body, identity
from robostiff.statics.loading.from_snapshot import DeadForce, LegWalk
from robostiff.statics.loading.given_loads import Gravity, Loads, given_forces
from robostiff.statics.result import Equilibria

# Names a rigid part without extent, which shows where the frame of a body is that holds a spring.
_ANCHOR = "\0anchor"
_NOWHERE, _STILL = np.zeros(3), np.zeros(3, dtype=int).astype(object)
# Of their constant force: what is rounding.
_NONE = 1e-12

Frames = Mapping[str, tuple[np.ndarray, np.ndarray]]
# Names a rigid part without extent, which shows where the frame of the next one is.
_FRAME = "\0frame"
_BOWING = Bowing()


def marked(leg: Leg, mark: str, wanted: Callable[[str, Element], bool]) -> Leg:
    """A leg with a rigid part without extent in the frames of the elements that are wanted.

    Their names begin with `mark` and go on with those of the elements, which are asked for by
    ``leg/part``.
    """
    return replace(leg, chain=_marked(leg.chain, f"{leg.name}/", mark, wanted))


def _marked(chain: Chain, prefix: str, mark: str, wanted: Callable[[str, Element], bool]) -> Chain:
    elements: list[Element] = []
    for element in chain.elements:
        pair: list[Element] = [element]
        if isinstance(element, ParallelBlock):
            inner = f"{prefix}{element.name}/"
            branches = (
                replace(one, chain=_marked(one.chain, f"{inner}{one.name}/", mark, wanted))
                for one in element.branches
            )
            pair = [replace(element, branches=tuple(branches))]
        if wanted(prefix + element.name, element):
            own = Link(np.zeros(3), Elasticity(np.zeros((6, 6))), np.eye(3), mark + element.name)
            # behind a joint its body begins; a link is given in the frame before it
            pair.insert(1 if isinstance(element, Joint | ParallelBlock) else 0, own)
        elements += pair
    return replace(chain, elements=tuple(elements))


@dataclass(frozen=True)
class RecordedAnchor:
    """A point (3,) of a body that holds an end of a spring, at the unloaded posture [m].

    The body is behind some elements of a chain of a leg; without these the base, or the platform.
    """

    point: np.ndarray
    leg: int | None = None
    chain: int | None = None
    after: int = 0
    on_platform: bool = False
    place: int = 0  # among the loads of that chain


@dataclass(frozen=True)
class RecordedBodySpring:
    """A spring that pulls with ``t = k l + c`` at its length l; see `FiniteBodySpring`."""

    ends: tuple[RecordedAnchor, RecordedAnchor]
    stiffness: float  # k [N/m]
    constant: Any  # entry or number: c [N]

    @property
    def legs(self) -> set[int]:
        """Whose bodies it is held on; none of base and platform alone."""
        return {end.leg for end in self.ends if end.leg is not None}

    @property
    def at_rest(self) -> RecordedBodySpring:
        """The same without tension at the unloaded posture."""
        d = self.ends[1].point - self.ends[0].point
        return replace(self, constant=square_root(d @ d) * -self.stiffness)

    def pulling(self, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[Any]]:
        """Force on its first point, the rate of that by ``b - a``, and what must be positive."""
        d = b - a
        if is_zero(self.constant):
            return d * self.stiffness, identity() * self.stiffness, []
        square = d @ d
        by = reciprocal(square_root(square))
        across, u = self.constant * by, d * by
        D = identity() * (self.stiffness + across) - u[:, None] * (u * across)[None, :]
        return d * (self.stiffness + across), D, [square * (1 / usual_size(square))]


@dataclass(frozen=True)
class SpringEnds:
    """What springs are held on: the base, the platform, and the chains of one leg."""

    platform: Body
    twist: Sequence[str]  # unknowns of its motion
    rows: Sequence[int]  # which of six coordinates these are
    # where loads act on each of them (1, L, 3), and the velocities there (1, L, 3, n)
    chains: Sequence[tuple[np.ndarray, np.ndarray]] = ()
    names: Sequence[Sequence[str]] = ()  # unknowns that move each of them

    def add(
        self, springs: Sequence[RecordedBodySpring], elimination: SymmetricElimination
    ) -> tuple[list[np.ndarray], np.ndarray]:
        """Add ``J^T D J`` of springs, and all that they do to the platform.

        Returns their pulls at the points of the loads on each chain (1, L, 3), which act in second
        order as dead forces do, and the moment (3,) that they take from the platform.
        """
        pulls = [points * 0 for points, _ in self.chains]
        moment = np.zeros(3, dtype=int).astype(object)
        for spring in springs:
            (a, J_a), (b, J_b) = (self._end(end) for end in spring.ends)
            force, D, positive = spring.pulling(a, b)
            elimination.pivots += positive
            names = list({**J_a, **J_b})
            J = [J_b.get(name, _STILL) - J_a.get(name, _STILL) for name in names]
            for i, name in enumerate(names):
                rate = D @ J[i]
                for other, column in zip(names[i:], J[i:], strict=True):
                    elimination.add(name, other, rate @ column)
            for end, at, pull in zip(spring.ends, (a, b), (force, -force), strict=True):
                if end.chain is not None:
                    pulls[end.chain][0, end.place] += pull
                if end.on_platform:
                    moment = moment + self._on_platform(elimination, at - self.platform.at, -pull)
        return pulls, moment

    def _end(self, anchor: RecordedAnchor) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Where an end is, and its velocity by unknowns."""
        if anchor.chain is not None:
            points, rates = (own[0, anchor.place] for own in self.chains[anchor.chain])
            return points, dict(zip(self.names[anchor.chain], rates.T, strict=True))
        if not anchor.on_platform:
            return anchor.point, {}
        at, unit = self.platform.of(anchor.point), np.eye(6, dtype=int).astype(object)
        turning = [cross(unit[row, 3:], at - self.platform.at) for row in self.rows]
        rates = [unit[row, :3] + own for row, own in zip(self.rows, turning, strict=True)]
        return at, dict(zip(self.twist, rates, strict=True))

    def _on_platform(
        self, elimination: SymmetricElimination, arm: np.ndarray, f: np.ndarray
    ) -> np.ndarray:
        """Add a force that the platform exerts at an arm; the moment of it."""
        wrench = np.concatenate([f, cross(arm, f)])
        turning = np.zeros((6, 6), dtype=int).astype(object)
        outer = arm[:, None] * f[None, :]
        turning[3:, 3:] = (outer + outer.T) * 0.5 - identity() * (arm @ f)
        for i, (name, row) in enumerate(zip(self.twist, self.rows, strict=True)):
            elimination.add_right(name, -wrench[row])
            for other, column in zip(self.twist[i:], self.rows[i:], strict=True):
                elimination.add(name, other, turning[row, column])
        return wrench[3:]


def has_symbols(spring: BodySpring) -> bool:
    """Whether any value of a spring is a formula."""
    ends = (x for end in spring.between for x in end.at)
    return any(map(is_formula, (spring.stiffness, spring.free_length, spring.preload, *ends)))


def with_anchors(leg: Leg, springs: Sequence[BodySpring], loads: Loads | None) -> Leg:
    """The same leg with a mark in the frame of each body that holds a spring, or a given mass."""
    bodies = {end.body for spring in springs for end in spring.between}
    bodies |= {_part_of(name) for name in loads or {}}
    return marked(leg, _ANCHOR, lambda body, _: body in bodies)


def _part_of(name: str) -> str:
    """The part whose frame a body has, by the name of one of its freedoms or beams."""
    return name.partition("[")[0].partition(".beam")[0]


def without_anchors(here: RobotOnEntries) -> tuple[RobotOnEntries, Frames]:
    """A robot whose legs were placed with marks, without them; and the frames of the bodies."""
    frames: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    placed = tuple(
        replace(own, leg=_taken(own.leg, f"{own.leg.name}/", frames)) for own in here.placed
    )
    return replace(here, placed=placed), frames


def _taken(
    leg: PlacedLeg, prefix: str, frames: dict[str, tuple[np.ndarray, np.ndarray]]
) -> PlacedLeg:
    def kept() -> Iterator[PlacedElement]:
        for element in leg.elements:
            if isinstance(element, PlacedBlock):
                branches = tuple(_taken(branch, prefix, frames) for branch in element.branches)
                yield replace(element, branches=branches)
            elif isinstance(element, PlacedSpring) and _ANCHOR in element.name:
                name = prefix + element.name.replace(_ANCHOR, "")
                frames[name] = element.rotation, element.point
            else:
                yield element

    return replace(leg, elements=tuple(kept()))


def recorded_body_springs(
    springs: Sequence[BodySpring],
    placed: Sequence[PlacedBodySpring],
    here: RobotOnEntries,
    frames: Frames,
    walks: Sequence[LegWalk],
) -> list[RecordedBodySpring]:
    """Springs between bodies of a robot on entries.

    They are given in numbers, with their tension and the names of their bodies in snapshots at one
    posture (`placed`); `frames` are those of the bodies, `walks` the legs in numbers.
    """
    known = {BASE: (np.eye(3), _NOWHERE), PLATFORM: (here.pose.R, here.pose.p), **frames}
    named = {name: (k, part) for k, walk in enumerate(walks) for name, part in walk.named.items()}
    found = []
    for spring, own in zip(springs, placed, strict=True):
        ends = []
        for end, body in zip(spring.between, own.bodies, strict=True):
            R, p = known[end.body]
            point = np.array(p, dtype=object) + np.array(R, dtype=object) @ end.at
            if body in named:
                leg, part = named[body]
                ends.append(RecordedAnchor(point, leg, part.chain, part.after))
            else:
                ends.append(RecordedAnchor(point, on_platform=body == PLATFORM))
        constant = own.tension - own.stiffness * own.length
        if abs(constant) <= _NONE * max(abs(own.tension), own.stiffness * own.length):
            constant = 0.0
        found.append(RecordedBodySpring((ends[0], ends[1]), own.stiffness, constant))
    return found


@dataclass(frozen=True)
class StandingLoads:
    """What acts beside the wrench, at every pose alike, and on what; as for `equilibrium`."""

    loads: Loads | None = None
    gravity: Gravity = None
    preload: Mapping[str, float] | None = None
    beams: Beams = _BOWING

    @property
    def given(self) -> dict[str, Any]:
        """As arguments of `equilibrium`."""
        return {name: getattr(self, name) for name in ("loads", "gravity", "preload", "beams")}

    def equilibria(self, robot: Any, pose: Pose, F: np.ndarray) -> Equilibria:
        """Of a robot at many poses, each under its wrench and what stands."""
        found = equilibrium(robot, pose, F, **self.given)
        if not isinstance(found, Equilibria):
            raise TypeError("a batch of poses gives equilibria")
        return found


def framed(leg: Leg) -> Leg:
    """The same leg with a mark in each frame in which masses are given."""
    return marked(leg, _FRAME, lambda _, e: isinstance(e, Rigid | Link) and bool(e.masses))


def with_recorded_masses(here: RobotOnEntries) -> RobotOnEntries:
    """A robot whose legs were placed with marks, without them, and its masses in place."""
    pairs = zip(here.robot.legs, here.placed, strict=True)
    placed = (replace(own, leg=_weighed(framed(leg).chain, own.leg)) for leg, own in pairs)
    return replace(here, placed=tuple(placed))


def _weighed(chain: Chain, placed: PlacedLeg) -> PlacedLeg:
    """Its masses as `with_masses` has them in numbers, in the same order."""
    left = iter(placed.elements)
    kept: list[PlacedElement] = []
    masses: list[PlacedMass] = []
    R, p = np.eye(3), _NOWHERE
    for element in chain.elements:
        if isinstance(element, Rigid):
            for mass in element.masses:
                centre = element.transform.p * 0.5 if mass.centre is None else mass.centre
                masses += _fixed(element.name, mass, p + R @ centre, len(kept))
            continue
        own = next(left)
        if isinstance(own, PlacedSpring) and element.name.startswith(_FRAME):
            R, p = own.rotation, own.point
            continue
        if isinstance(own, PlacedBlock) and isinstance(element, ParallelBlock):
            pairs = zip(element.branches, own.branches, strict=True)
            own = replace(own, branches=tuple(_weighed(b.chain, leg) for b, leg in pairs))
        kept.append(own)
        if isinstance(element, Joint):
            kept += [next(left) for _ in range(element.size - 1)]
        elif isinstance(element, Link):
            masses += _along(element, own, R, p, len(kept))
        elif isinstance(element, Telescope):
            for beam in element.beams:
                start, own = own, next(left)
                kept.append(own)
                masses += _of_beam(beam, start, own, len(kept))
    return replace(placed, elements=tuple(kept), masses=tuple(masses))


def _along(link: Link, own: Any, R: np.ndarray, p: np.ndarray, after: int) -> Iterator[PlacedMass]:
    """Masses of an elastic part that begins in the frame (R, p)."""
    for mass in link.masses:
        centre = p + R @ (link.to * 0.5 if mass.centre is None else mass.centre)
        if not np.any(link.to):
            yield from _fixed(own.name, mass, centre, after)
        elif mass.is_spread:
            yield _spread(mass.value, own, p, mass.span or (0.0, 1.0), after)
        else:
            yield from _fixed(own.name, mass, centre, after, p)


def _of_beam(beam: TelescopicBeam, start: Any, own: Any, after: int) -> Iterator[PlacedMass]:
    """Mass of a beam of a telescope, between the points of two parts."""
    value, density = beam.mass, beam.material.density
    if value is None and density is not None:
        length = (own.point - start.point) @ own.rotation[:, 0]
        value = length * beam.section.A * density
    if value is not None:
        yield _spread(value, own, start.point, (0.0, 1.0), after)


def _fixed(
    name: str, mass: Mass, centre: np.ndarray, after: int, start: np.ndarray | None = None
) -> list[PlacedMass]:
    """A mass in one place; where it turns does not matter to its weight."""
    count = 1 if mass.inertia is None else 6
    one = PlacedMass(name, mass.value * (1 / count), centre, after, start)
    return [one] * count


def _spread(
    value: Any, own: PlacedSpring, start: np.ndarray, span: tuple[float, float], after: int
) -> PlacedMass:
    centre = start + (own.point - start) * (0.5 * (span[0] + span[1]))
    return PlacedMass(own.name, value, centre, after, start, span)


def loads_on_legs(
    walks: Sequence[LegWalk],
    placed: Sequence[PlacedLeg],
    forces: Mapping[str, Sequence[DeadForce]],
    gravity: np.ndarray,
) -> list[dict[int, list[BodyLoad]]]:
    """What acts on the bodies of each leg, by chain: forces by ``leg/part``, and weights.

    The weights of one body are one force at their centre. `walks` has the legs in numbers, `placed`
    on entries.
    """
    found = []
    for walk, leg in zip(walks, placed, strict=True):
        points: dict[str, np.ndarray] = {}
        for element in leg.parts:
            joint = getattr(element, "joint", element.name)  # of a coupling the one that follows
            points |= {element.name: element.point, joint: element.point}
            points.setdefault(element.name.partition("[")[0], element.point)
        points |= {block.name: block.branches[0].end for block in leg.all_blocks}
        own: dict[int, list[BodyLoad]] = {}
        weights: dict[tuple[int, int], list[tuple[Any, np.ndarray]]] = {}
        if np.any(gravity):
            for own_mass, mass in zip(walk.carried, leg.all_masses, strict=True):
                end = points.get(mass.name, _NOWHERE)
                for point in mass.lumped(own_mass.parts, end):
                    at = own_mass.chain, own_mass.after - own_mass.parts + point.after
                    weights.setdefault(at, []).append((point.value, point.point))
        for (chain, after), several in weights.items():
            value, centre = _together(several)
            own.setdefault(chain, []).append(BodyLoad(after, centre, gravity * value))
        for name, part in walk.named.items():
            for force in forces.get(name, ()):
                point = force.point
                if point is None:
                    point = points[name.removeprefix(walk.prefix)]
                at = np.array(point, dtype=object)
                own.setdefault(part.chain, []).append(
                    BodyLoad(part.after, at, np.array(force.force, dtype=object))
                )
        still = {c for c, (start, _, _) in enumerate(walk.chains) if start is None}
        found.append(
            {
                chain: [load for load in loads if load.after or chain not in still]
                for chain, loads in own.items()
            }
        )
    return found


def loads_on_platform(
    here: RobotOnEntries, standing: StandingLoads, gravity: np.ndarray, bodies: Frames
) -> tuple[list[tuple[np.ndarray, np.ndarray]], dict[str, tuple[DeadForce, ...]]]:
    """Arms (3,) and forces (3,) of what acts on the platform; and forces on legs by their names.

    `bodies` are frames of bodies of the legs, by their names.
    """
    robot, pose, reference = here.robot, here.pose, here.reference
    frames = {"platform": (pose.R, pose.p), **bodies}

    def frame_of(name: str) -> tuple[np.ndarray, np.ndarray] | None:
        return frames.get(name) or frames.get(_part_of(name))

    forces = given_forces(standing.loads, gravity, robot.space, frame_of)
    found = []
    if np.any(gravity) and robot.platform_masses:
        several = [
            (mass.value, pose.p if mass.centre is None else pose.p + pose.R @ mass.centre)
            for mass in robot.platform_masses
        ]
        value, centre = _together(several)
        found.append((centre - reference, gravity * value))
    for own in forces.pop("platform", ()):
        arm = np.zeros(3, dtype=int).astype(object)
        if own.point is not None:
            arm = np.array(own.point, dtype=object) - reference
        found.append((arm, np.array(own.force, dtype=object)))
    return found, forces


def _together(several: Sequence[tuple[Any, np.ndarray]]) -> tuple[Any, np.ndarray]:
    """Masses as one at their centre."""
    several = [(value, np.array(point, dtype=object)) for value, point in several]
    if len(several) == 1:
        return several[0]
    total = sum(value for value, _ in several)
    if is_zero(total):
        return total, several[0][1]
    moment = reduce(add, (point * value for value, point in several))
    return total, moment * (1 / total)
