"""A leg that closes in closed form, recorded at a recorded pose of the platform."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen, replace
from robostiff.kept import kept
from robostiff.kinematics.closure.body import (
    ClosedLeg,
    LegBody,
    Rest,
    constant_cosine,
    direction_across,
    tidy_numbers,
    tidy_point,
)
from robostiff.kinematics.closure.leg_forms import Cluster, Post, Slide
from robostiff.kinematics.closure.leg_solver import LegSolver, RecordedForm
from robostiff.kinematics.closure.rods import Strut
from robostiff.kinematics.frames import (
    ChainWalk,
    PlacedChain,
    Placing,
    Way,
    beam_lengths,
    place_chain,
    telescopic_elasticity,
)
from robostiff.kinematics.turn import turn_about, turn_by_vector_of_entries
from robostiff.model import (
    Chain,
    Leg,
    ParallelBlock,
    Passive,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    Telescope,
    TelescopicBeam,
)
from robostiff.record import Entry, greater, is_one, is_zero, most_size, square_root
from robostiff.spatial.batch import product


@frozen
class FormulaPose:
    """A pose of the platform in the world.

    Attributes
    ----------
    R : (3, 3) array of entries and numbers
    p : (3,) array of entries and numbers
        [m].
    """

    R: np.ndarray
    p: np.ndarray

    @classmethod
    def of_coordinates(cls, coordinates: np.ndarray) -> FormulaPose:
        """The pose of x, y, z and a rotation vector (6,) [m, rad], entries or numbers."""
        six = np.array(coordinates, dtype=object)
        return cls(turn_by_vector_of_entries(six[3:]), six[:3])


@frozen
class PlacedFormula:
    """A leg in the world, its entries recorded."""

    leg: PlacedLeg  #: points, axes, rotations and compliances are arrays of objects, in world axes
    #: tuple of Entry: gaps, zero when the leg meets the platform: squares of sines, and of shifts
    #: over the length of the rod or crank. Those that vanish at all samples are left out.
    gap: tuple[Any, ...]
    #: tuple of Entry: lengths of the telescopes' beams that must be positive [m]
    lengths: tuple[Any, ...]
    #: callable: records the leg coordinate of a place in the coordinate vector [m, rad]
    coordinate: Callable[[int], Any]
    platform: FormulaPose  #: where the leg holds the platform
    losses: tuple[Any, ...] = ()  #: tuple of Entry: digits that the closure loses
    #: what places the frames of its bodies, by the names of parts, see `Way`
    bodies: Mapping[str, tuple[Placing, str | None]] = field(default_factory=dict)


def place_leg_at_joints(
    leg: Leg, q: np.ndarray, turned: Mapping[int, np.ndarray] | None = None, *, weighs: bool = False
) -> PlacedFormula:
    """Record a leg at recorded coordinates, eq. (5); it has no gap.

    Parameters
    ----------
    leg : Leg
        Of floats or recorded entries.
    q : (size,) array of entries and numbers
        Leg coordinates [m, rad].
    turned : mapping of int to (3, 3) arrays, optional
        Axes in the world behind ball joints that do not come from their coordinates.
    weighs : bool
        Whether masses of parts are placed.
    """
    q = np.array(q, dtype=object)
    way = Way(leg.chain, q, turned, weighs=weighs)
    walk = ChainWalk(tidy_numbers(leg.base.R), tidy_point(leg.base.p), way)
    walk.along(leg.chain)
    R = walk.R @ np.array(leg.attachment.R, dtype=object).T
    return PlacedFormula(
        leg=walk.leg(leg.name),
        gap=(),
        lengths=tuple(x for x in beam_lengths(leg.chain, q) if isinstance(x, Entry)),
        coordinate=lambda place: q[place],
        platform=FormulaPose(R, walk.p - R @ np.array(leg.attachment.p, dtype=object)),
        bodies=way.bodies,
    )


class _Layout(ChainWalk):
    """A leg at zero coordinates, its elements where the bodies of the closed leg take them.

    Branches of blocks are copies, shifted from the first: they move as it does.
    """

    def __init__(self, site: Site, closed: ClosedLeg, *, weighs: bool) -> None:
        chain = site.leg.chain
        way = Way(chain, chain.zero, weighs=weighs)
        super().__init__(np.eye(3, dtype=int), np.zeros(3, dtype=int), way)
        self.site, self.closed = site, closed
        self.joints = 0  # of the main path that are passed
        # From the first branch of a block to this copy, at zero coordinates and now
        self.shift: tuple[np.ndarray, np.ndarray] | None = None
        self.share: Any = 0  # of the extension of a telescope, up to the beam placed last
        # By how much bodies after blocks miss the ends of branches, as parts of the shift
        self.misses: list[np.ndarray] = []

    def whole(self) -> PlacedFormula:
        """The whole leg on the bodies of the closed leg, and what keeps it from closing."""
        site, closed, chain = self.site, self.closed, self.site.leg.chain
        end = site.platform.point(site.zero.p)
        self.along(chain)
        misses = (*closed.misses, *(v @ v for v in self.misses))
        closing = [x for x in misses if most_size(x) > _VANISHES]
        lengths = [  # that a pose can make negative
            closed.slides[site.copies[where.start]].of(beam)
            for element, where in chain.moving
            if isinstance(element, Telescope) and site.copies[where.start] in closed.slides
            for beam in element.beams
            if not is_zero(beam.share)
        ]
        reaching = [x for x in closed.out_of_reach if not is_zero(x)]
        return PlacedFormula(
            leg=replace(self.leg(site.leg.name), end=end),
            gap=(*closing, *reaching),
            lengths=tuple(x for x in lengths if isinstance(x, Entry)),
            coordinate=self.coordinate,
            platform=site.pose,
            losses=() if is_zero(closed.loss) else (closed.loss,),
            bodies=self.way.bodies,
        )

    def here(self) -> Placing:
        R, p, body, shift = self.R, self.p, self.closed.after(self.joints), self.shift
        return lambda: (body.axes(R), _point(body, p, shift))

    def leg(self, name: str) -> PlacedLeg:
        end = _point(self.closed.after(self.joints), self.p, self.shift)
        return replace(super().leg(name), end=end)

    def block(self, block: ParallelBlock) -> None:
        super().block(block)
        self.joints += block.branches[0].chain.main_places.size

    def branch(self, name: str, first: Any) -> Self:
        walk = super().branch(name, first)
        if first is not None:
            near, far = (self.closed.after(one.joints) for one in (self, first))
            loop = next(one for one in self.site.whole.loops if one.name == name)
            apart = tidy_point(loop.p - first.p)
            now = near.direction(apart)
            walk.shift = apart, now
            if self.shift is not None:
                walk.shift = self.shift[0] + apart, self.shift[1] + now
            wanted = tidy_point(loop.p_wanted - first.p)
            size = np.linalg.norm([most_size(x) for x in wanted])
            self.misses.append((far.direction(wanted) - now) * (1 / size))
        return walk

    def place(self, part: PlacedFreedom | PlacedSpring) -> None:
        body = self.closed.after(self.joints)
        point = _point(body, part.point, self.shift)
        if isinstance(part, PlacedSpring):
            super().place(replace(part, point=point, rotation=body.axes(part.rotation)))
            return
        # any three axes of a ball joint, but where a preload may act about one
        axis = None if self.way.weighs else self.closed.ball_axes.get(self.joints)
        x = part.coordinate
        if x is not None:  # the stiffness of the drive depends on it
            names = [own.name for own in self.site.whole.freedoms]
            x = self.coordinate(names.index(part.name))
        axis = body.direction(part.axis) if axis is None else axis
        self.joints += 1
        super().place(replace(part, axis=axis, point=point, coordinate=x))

    def telescope(self, telescope: Telescope, extension: np.ndarray) -> None:
        self.share = 0
        super().telescope(telescope, extension)

    def beam(
        self, name: str, axes: np.ndarray, beam: TelescopicBeam, length: np.ndarray
    ) -> np.ndarray:
        place = self.joints - 1
        if place not in self.closed.slides:  # locked: its length is that at home
            return super().beam(name, axes, beam, length)
        near, far = self.closed.after(place), self.closed.after(place + 1)
        stretch, R = self.closed.slides[place], product(self.R, axes)
        self.share = self.share + beam.share
        if self.share == 1:
            point = _point(far, self.p, self.shift)
        else:
            e = R[:, 0]
            point = _point(near, self.p + e * (self.share * stretch.offset), self.shift)
            point = point + near.direction(e) * (self.share * stretch.length)
        length = np.asarray(stretch.of(beam), dtype=object)
        elasticity = telescopic_elasticity(beam, length)
        super().place(PlacedSpring(self.prefix + name, point, near.axes(R), elasticity))
        return length

    def coordinate(self, place: int) -> Any:
        """Record a coordinate [m, rad]: the turn of a joint between the bodies on its two sides.

        An angle is recorded on the half turns before and after that of home, which is moved into
        the limits, or on another turn where that is within them. A spherical joint has none.
        """
        chain = self.site.twin.chain
        low, high = chain.limits[:, place].tolist()
        about = min(max(float(chain.home[place]), low), high)
        place = self.site.copies[place]
        if place in self.closed.slides:
            return self.closed.slides[place].coordinate
        freedom = self.site.zero.freedoms[place]
        if place in self.closed.ball_axes:
            raise InputError(
                f"coordinate of {freedom.name!r}",
                got=Words("a spherical joint of a leg in closed form"),
                expected="a joint about one axis",
                hint="give limits to the joints that are driven",
            )
        across = ahead = direction_across(freedom.axis)
        if about != 0:
            ahead = turn_about(freedom.axis, np.array(about, dtype=object)) @ across
        q = self.closed.angle(place, freedom.axis, ahead, across)
        q = q if about == 0 else q + about
        if math.isinf(low) or (low >= about - math.pi and high <= about + math.pi):
            return q
        turn = 2.0 * math.pi
        up = greater(low, q) * (1 - greater(q, high - turn))
        down = greater(q, high) * (1 - greater(low + turn, q))
        return q + (up - down) * turn


def _point(body: LegBody, x: np.ndarray, shift: tuple[np.ndarray, np.ndarray] | None) -> np.ndarray:
    """Where a point is that a body like this one carries, shifted as a copy is."""
    return body.point(x) if shift is None else body.point(x - shift[0]) + shift[1]


_VANISHES = 1e-20  # a square beside 1


def place_leg(
    leg: Leg, pose: FormulaPose, solver: LegSolver, *, weighs: bool = False
) -> PlacedFormula:
    """Record a leg at a pose, its coordinates eliminated: a strut, a rod on a drive, or a post.

    Points and directions are computed, no angles, in the assembly mode of home. Results are not
    finite where a universal joint points its rod along its own first axis, and where a strut has
    no length.

    Parameters
    ----------
    leg : Leg
        Of floats or of recorded entries.
    pose : FormulaPose
        Samples of its inputs, and of those of the leg, must be generic: what is 0 or 1 at all of
        them counts as a number.
    solver : LegSolver
        Of the same leg in floats, with its closed form and working mode.
    weighs : bool
        Whether masses of parts are placed, and ball joints turn about axes of their own, not any.

    Raises
    ------
    InputError
        When the leg has no closed form.
    """
    form = solver.recorded_form
    if form is None:
        raise InputError(
            f"leg {leg.name!r}",
            got=Words("a leg without a closed form"),
            expected="a strut, a rod on a slide or a crank, or a post with one joint",
            hint="close it by its solver and write place_leg_at_joints(leg, q)",
        )
    site = Site.of(leg, pose, solver)
    closed = site.own_form(form).leg_between(site.base, site.platform)
    return _Layout(site, closed, weighs=weighs).whole()


@frozen
class Site:
    """A leg to be placed between its base and the platform."""

    # The one to be recorded, and the same in floats
    leg: Leg
    twin: Leg
    copies: Sequence[int]  # for each coordinate of the leg its place on the main path
    # The leg and its main path at zero coordinates in its own base frame, locked joints at home
    whole: PlacedChain
    zero: PlacedChain
    base: LegBody
    platform: LegBody
    pose: FormulaPose  # of the platform
    length: float  # characteristic length [m]

    @classmethod
    def of(cls, leg: Leg, pose: FormulaPose, solver: LegSolver) -> Site:
        """A leg at a pose, its solver of the same leg in floats."""
        whole, path = _at_zero(leg.chain), leg.chain.main_path
        zero = whole if path is leg.chain else _at_zero(path)
        identity = np.eye(3, dtype=int), np.zeros(3, dtype=int)
        base = LegBody(Rest(*identity), tidy_numbers(leg.base.R), tidy_point(leg.base.p))
        # the platform frame at zero coordinates, in the leg's base frame
        R_platform = zero.R @ leg.attachment.R.T
        p_platform = zero.p - R_platform @ leg.attachment.p
        rest = Rest(tidy_numbers(R_platform), tidy_point(p_platform))
        platform = LegBody(rest, tidy_numbers(pose.R), tidy_point(pose.p))
        copies = solver.copies.tolist()
        return cls(leg, solver.leg, copies, whole, zero, base, platform, pose, solver.length)

    @property
    def home(self) -> np.ndarray:
        """Home coordinates of the main path, as they are recorded."""
        return np.array(self.leg.chain.main_path.home, dtype=object)

    def own_form(self, form: RecordedForm) -> RecordedForm:
        """A closed form recognised in floats, with the entries of the leg to be recorded."""
        if isinstance(form, Post):
            joint = self._own(form.joint)
            return replace(form, joint=joint, length=self.length, name=self.leg.name)
        A, B = self._own(form.A), self._own(form.B)
        parts: dict[str, Any] = {}
        if isinstance(form, Strut):
            parts["slide"] = self._slide(form.slide)
            along = parts["slide"].axis
        else:
            rod = B.point - A.point
            along = tidy_numbers(rod / square_root(rod @ rod))
            if form.across is not None:
                parts["across"] = self._slide(form.across)
            d = form.drive
            parts["drive"] = self._slide(d) if isinstance(d, Slide) else self._own(d)
        chain, side = self.twin.chain, None
        for spring in self.zero.elements:  # a direction across a beam along the rod
            if side is None and isinstance(spring, PlacedSpring):
                x, y, _ = spring.rotation.T
                side = tidy_numbers(y) if is_one(constant_cosine(x, along)) else None
        return replace(
            form,
            A=A,
            B=B,
            along=along,
            side=direction_across(along) if side is None else side,
            home=self.leg.chain.main_path.home,
            # Between passive spherical joints only a force along the rod passes, and meets the same
            # compliance however the rod is spun. That moves other branches of parallel blocks.
            spin_matters=chain.has_blocks
            or not all(isinstance(chain.roles[i], Passive) for one in (A, B) for i in one.places),
            name=self.leg.name,
            **parts,
        )

    def _own(self, cluster: Cluster) -> Cluster:
        """A cluster recognised on the leg in floats, with the entries of the leg to be recorded."""
        axes = tuple(tidy_numbers(self.zero.freedoms[place].axis) for place in cluster.places)
        point = tidy_point(self.zero.freedoms[cluster.drawn_at].point)
        return replace(cluster, point=point, axes=axes)

    def _slide(self, slide: Slide) -> Slide:
        return replace(slide, axis=tidy_numbers(self.zero.freedoms[slide.place].axis))


@kept
def _at_zero(chain: Chain) -> PlacedChain:
    """The chain at zero coordinates; several legs may have one."""
    return place_chain(chain, chain.zero, np.eye(3, dtype=int), np.zeros(3, dtype=int))
