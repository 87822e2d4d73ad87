"""Forward kinematics of a chain, eq. (5): joints and springs in the world, and end frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import InitVar, dataclass, field, replace
from typing import Any, Self

import numpy as np

from robostiff.elasticity import Elasticity, beam_compliance
from robostiff.frozen import frozen
from robostiff.kinematics.turn import turn_about, turn_by_vector
from robostiff.model import (
    Chain,
    CoupledFreedom,
    Element,
    Joint,
    JointKind,
    Link,
    ParallelBlock,
    Passive,
    PlacedBlock,
    PlacedElement,
    PlacedFreedom,
    PlacedLeg,
    PlacedMass,
    PlacedSpring,
    Rigid,
    Role,
    StiffnessLaw,
    Telescope,
    TelescopicBeam,
)
from robostiff.model.coupled_joints import Transmission
from robostiff.spatial import Screw, is_formula
from robostiff.spatial.batch import poses_side_by_side, product

_EYE = np.eye(3)


@frozen
class Loop:
    """A branch of a parallel block, which must end where the first branch of the block does."""

    name: str  # of the branch; empty for the chain itself, which must end on the platform
    # (..., 3, 3) and (..., 3): frame in which the branch ends [m]
    R: np.ndarray
    p: np.ndarray
    # (..., 3, 3) and (..., 3): frame in which it should, as the first branch has it [m]
    R_wanted: np.ndarray
    p_wanted: np.ndarray

    @property
    def gap(self) -> tuple[np.ndarray, np.ndarray]:
        """By how much it is open: shift (...) [m] and turn (...) [rad].

        The turn is that of a chord: exact enough for small gaps, and never above pi.
        """
        shift, chord = self.p_wanted - self.p, self.R_wanted - self.R
        half_sine = np.sqrt(np.einsum("...ij,...ij->...", chord, chord) / 8.0)
        turn = 2.0 * np.arcsin(np.minimum(half_sine, 1.0))
        return np.sqrt(np.einsum("...i,...i->...", shift, shift)), turn


@frozen
class PlacedChain:
    """A chain in the world, with its end frame."""

    elements: tuple[PlacedElement, ...]
    R: np.ndarray  #: (..., 3, 3): axes of the end frame
    p: np.ndarray  #: (..., 3): origin of the end frame [m]
    loops: tuple[Loop, ...] = ()  #: of its parallel blocks

    def gaps(self, R: np.ndarray, p: np.ndarray) -> list[Loop]:
        """Gaps between its end and a frame where it should be, then of the loops inside it."""
        return [Loop("", self.R, self.p, R, p), *self.loops]

    @property
    def parts(self) -> list[PlacedFreedom | PlacedSpring]:
        """Its joints and elastic parts, those of its blocks included."""
        return list(PlacedLeg("", self.elements, self.p).parts)

    @property
    def freedoms(self) -> list[PlacedFreedom]:
        """Its elementary joints, one a coordinate."""
        return [e for e in self.parts if isinstance(e, PlacedFreedom)]


def place_chain(
    chain: Chain,
    q: np.ndarray,
    R_base: np.ndarray,
    p_base: np.ndarray,
    turned: Mapping[int, np.ndarray] | None = None,
) -> PlacedChain:
    """Place the elements of a chain at coordinates q, eq. (5).

    Parameters
    ----------
    chain : Chain
    q : (..., chain.size) array
        Joint coordinates [m, rad]; one row where they or the chain have recorded entries.
    R_base, p_base : (3, 3) and (3,) arrays
        Frame in which the chain begins.
    turned : mapping of int to (3, 3) arrays, optional
        Axes behind ball joints that do not come from their coordinates, by the first of their
        places.
    """
    walk = ChainWalk(R_base, p_base, Way(chain, q, turned))
    walk.along(chain)

    def each(R: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A frame for each pose, also where no joint moves it."""
        return np.broadcast_to(R, (*q.shape[:-1], 3, 3)), np.broadcast_to(p, (*q.shape[:-1], 3))

    loops = (Loop(x.name, *each(x.R, x.p), *each(x.R_wanted, x.p_wanted)) for x in walk.way.loops)
    return PlacedChain(tuple(walk.placed), *each(walk.R, walk.p), tuple(loops))


#: What gives axes (3, 3) and origin (3,) of a frame in the world [m].
Placing = Callable[[], tuple[np.ndarray, np.ndarray]]


@dataclass
class Way:
    """Common state of the walks along a chain and the branches of its blocks."""

    chain: InitVar[Chain]  # the whole
    given: np.ndarray  # its coordinates
    turned: Mapping[int, np.ndarray] | None = None  # axes behind some ball joints
    q: np.ndarray = field(init=False)  # of the joints, alike where none are coupled
    place: int = 0  # of the next coordinate
    loops: list[Loop] = field(default_factory=list)
    last: str | None = None  # the part that has been placed last, of a block in its first branch
    # Frames in which bodies are given, by parts: where a part begins, of a joint behind it; and the
    # part that has been placed last
    bodies: dict[str, tuple[Placing, str | None]] = field(default_factory=dict)
    weighs: bool = False  # whether masses of parts are placed

    def __post_init__(self, chain: Chain) -> None:
        self.q = chain.joint_coordinates(self.given)


class ChainWalk:
    """The frame reached so far, on the way from base to platform."""

    R: np.ndarray
    p: np.ndarray
    way: Way
    prefix: str

    def __init__(self, R: np.ndarray, p: np.ndarray, way: Way, prefix: str = "") -> None:
        self.R, self.p, self.way, self.prefix = R, p, way, prefix
        self.placed: list[PlacedElement] = []
        self.masses: list[PlacedMass] = []

    def along(self, chain: Chain) -> None:
        """Walk along a chain."""
        start, place = len(self.placed), self.way.place
        for element in chain.elements:
            self.over(element)
        if chain.transmission is not None:
            given = self.way.given[..., place : place + chain.size][..., list(chain.own_places)]
            alone = self.placed[start:]
            self.placed[start:] = with_couplings(alone, chain.transmission, given, self.prefix)

    def over(self, element: Element) -> None:
        """Walk over one element."""
        start = self.here()
        if isinstance(element, Rigid):
            self.go(element.transform.p, element.transform.R)
            self.weigh(element, element.transform.p, start)
        elif isinstance(element, Link):
            self.go(element.to)
            self.spring(element.name, element.axes, element.elasticity)
            self.weigh(element, element.to, start)
        elif isinstance(element, Joint):
            self.joint(element, self.coordinates(element.size))
        elif isinstance(element, ParallelBlock):
            self.block(element)
        else:
            self.telescope(element, self.coordinates(1)[..., 0])
        if isinstance(element, Joint | ParallelBlock):
            start = self.here()
        self.way.bodies[self.prefix + element.name] = start, self.way.last

    def here(self) -> Placing:
        """The frame reached so far, in the world."""
        found = self.R, self.p
        return lambda: found

    def weigh(self, part: Rigid | Link, to: np.ndarray, start: Placing) -> None:
        """Place the masses of a part that leads from a frame to a point of it."""
        is_long = isinstance(part, Link) and bool(np.any(to))
        for mass in part.masses if self.way.weighs else ():
            R, p = start()
            if is_long and mass.is_spread:
                self.spread(mass.value, p, mass.span or (0.0, 1.0))
                continue
            given = mass if mass.centre is not None else replace(mass, centre=0.5 * to, span=None)
            if R.dtype == object:  # where it turns does not matter to its weight
                given = replace(given, inertia=None)
            name, after = self.prefix + part.name, len(self.placed)
            self.masses += given.placed(name, R, p, after, p if is_long else None)

    def spread(self, value: Any, start: np.ndarray, span: tuple[float, float]) -> None:
        """A mass along the elastic part that has been placed last."""
        part: Any = self.placed[-1]
        centre = start + 0.5 * (span[0] + span[1]) * (part.point - start)
        after = len(self.placed)
        self.masses.append(PlacedMass(part.name, np.asarray(value), centre, after, start, span))

    def leg(self, name: str) -> PlacedLeg:
        """What has been walked along, as a leg or branch."""
        return PlacedLeg(name, tuple(self.placed), self.p, tuple(self.masses))

    def coordinates(self, size: int) -> np.ndarray:
        """The next coordinates (..., size)."""
        start = self.way.place
        self.way.place += size
        return self.way.q[..., start : start + size]

    def block(self, block: ParallelBlock) -> None:
        """Place the branches of a block."""
        legs, walks, lasts = [], list[Self](), [self.way.last]
        for branch in block.branches:
            self.way.last = lasts[0]
            name = f"{self.prefix}{block.name}/{branch.name}"
            walk = self.branch(name, next(iter(walks), None))
            walk.go(branch.start.p, branch.start.R)
            walk.along(branch.chain)
            legs.append(walk.leg(name))
            walks.append(walk)
            lasts.append(self.way.last)
        first, *others = walks
        end = block.branches[0].end.inverse
        first.go(end.p, end.R)
        for branch, leg, own in zip(block.branches[1:], legs[1:], others, strict=True):
            wanted = ChainWalk(first.R, first.p, self.way)
            wanted.go(branch.end.p, branch.end.R)
            self.way.loops.append(Loop(leg.name, own.R, own.p, wanted.R, wanted.p))
        self.placed.append(PlacedBlock(f"{self.prefix}{block.name}", tuple(legs)))
        self.R, self.p = first.R, first.p
        self.way.last = lasts[1]

    def branch(self, name: str, first: Any) -> Self:
        """The walk along a branch, from here; and that of the first of its block, which is done."""
        del first
        walk = copy(self)
        walk.prefix, walk.placed, walk.masses = f"{name}/", [], []
        return walk

    def go(self, to: np.ndarray, R: np.ndarray | None = None) -> None:
        """Move the frame to a point of itself, and turn it."""
        if to.any():
            self.p = self.p + np.einsum("...ij,j->...i", self.R, to)
        if R is not None and (R != _EYE).any():
            self.R = product(self.R, R)

    def joint(self, joint: Joint, q: np.ndarray) -> None:
        """Place the freedoms of a joint."""
        if joint.kind is JointKind.SPHERICAL:
            for i, screw in enumerate(joint.freedoms):
                self.freedom(f"{joint.name}[{i}]", screw, joint.role, q[..., i])
            known = (self.way.turned or {}).get(self.way.place - joint.size)
            self.R = product(self.R, turn_by_vector(q)) if known is None else known
            return
        for i, screw in enumerate(joint.freedoms):
            name = joint.name if joint.size == 1 else f"{joint.name}[{i}]"
            e = self.freedom(name, screw, joint.role, q[..., i])
            if screw.turns:
                self.R = product(self.R, turn_about(screw.axis, q[..., i]))
            if screw.slides:
                self.p = self.p + e * screw.advance(q[..., i, None])

    def telescope(self, telescope: Telescope, extension: np.ndarray) -> None:
        """Place the slide of a telescope and its beams."""
        (slide,) = telescope.freedoms
        e = self.freedom(telescope.name, slide, telescope.role, extension)
        if not telescope.beams:
            self.p = self.p + e * extension[..., None]
        for i, beam in enumerate(telescope.beams):
            start: Any = self.placed[-1]  # the slide, or the beam before
            length = np.asarray(beam.fixed + beam.share * extension)
            self.p = self.p + e * length[..., None]
            number = i + 1 if len(telescope.beams) > 1 else ""
            name = f"{telescope.name}.beam{number}"
            length = self.beam(name, telescope.axes, beam, length)
            if self.way.weighs and (value := beam.mass_at(length)) is not None:
                self.spread(value, start.point, (0.0, 1.0))

    def beam(
        self, name: str, axes: np.ndarray, beam: TelescopicBeam, length: np.ndarray
    ) -> np.ndarray:
        """Place a beam of a telescope that ends here; its length (...) [m]."""
        self.spring(name, axes, beam.fixed_elasticity or telescopic_elasticity(beam, length))
        return length

    def freedom(self, name: str, screw: Screw, role: Role, q: np.ndarray) -> np.ndarray:
        """Place one freedom; its axis in the world."""
        e = np.einsum("...ij,j->...i", self.R, screw.axis)
        x = own_coordinate(role, q)
        self.place(PlacedFreedom(e, self.p, screw.pitch, self.prefix + name, role, x))
        return e

    def spring(self, name: str, axes: np.ndarray, elasticity: Elasticity) -> None:
        """Place an elastic part that ends here."""
        R_spring = product(self.R, axes)
        self.place(PlacedSpring(self.prefix + name, self.p, R_spring, elasticity))

    def place(self, part: PlacedFreedom | PlacedSpring) -> None:
        """Add what is in its place."""
        self.way.last = part.name
        self.placed.append(part)


def with_couplings(
    placed: Sequence[PlacedElement],
    own: Transmission,
    given: np.ndarray | None = None,
    prefix: str = "",
) -> list[PlacedElement]:
    """Elements of a chain, its joints with the motions of the coordinates that move them.

    They are placed as if each joint moved alone. Coordinates (..., n) are needed for drives whose
    stiffness depends on them; the prefix comes before the names of couplings.
    """
    found = list(placed)
    joints = {k: e for k, e in enumerate(placed) if isinstance(e, PlacedFreedom)}
    names = [joint.name for joint in joints.values()]
    for i, (k, joint) in enumerate(joints.items()):
        moves = [
            (other.name, own.T[j, i], Screw(other.axis, other.point, other.pitch))
            for j, other in enumerate(joints.values())
            if own.T[j, i] != 0
        ]
        one = own.sums.get(i)
        if one is None and len(moves) == 1:
            continue
        role = joint.role if one is None else one.role
        found[k] = CoupledFreedom(
            joint.axis,
            joint.point,
            joint.pitch,
            joint.name if one is None else prefix + one.name,
            role,
            None if given is None else own_coordinate(role, given[..., i]),
            joint.name,
            tuple(moves),
            tuple((names[j], factor) for j, factor in enumerate(own.A[i]) if factor != 0),
        )
    return found


def own_coordinate(role: Role, q: Any) -> Any:
    """The coordinate of a drive whose stiffness depends on it; None of others."""
    if isinstance(role, Passive) or not isinstance(role.stiffness, StiffnessLaw):
        return None
    return q.item() if isinstance(q, np.ndarray) and q.dtype == object and q.ndim == 0 else q


def beam_lengths(chain: Chain, q: np.ndarray) -> Iterator[Any]:
    """Lengths (...) of the beams of its telescopes at coordinates q (..., size) [m]."""
    for element, place in chain.moving:
        if isinstance(element, Telescope):
            for beam in element.beams:
                yield beam.fixed + beam.share * q[..., place.start]


def telescopic_elasticity(beam: TelescopicBeam, length: np.ndarray) -> Elasticity:
    """Elasticity of a beam of a telescope at lengths (...) [m], or at one recorded length."""
    usable: Any = length.item() if length.dtype == object else length
    if not is_formula(usable) or getattr(usable, "is_positive", None) is False:
        # Out of reach, a length may be negative: a status reports it, and the other poses continue.
        usable = np.maximum(np.asarray(usable, dtype=float), np.finfo(float).tiny ** 0.25)
    C = beam_compliance(usable, beam.material, beam.section, beam.theory)
    bounds = (*beam.material.bounds, *beam.section.bounds)
    return Elasticity(poses_side_by_side(C, 2), bounds=bounds, segments=())
