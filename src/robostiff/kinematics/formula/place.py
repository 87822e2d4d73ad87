"""A leg that closes in closed form, recorded at a recorded pose of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics.closure.assembly import middle_of_turn
from robostiff.kinematics.closure.body import (
    LegBody,
    Rest,
    constant_cosine,
    direction_across,
    tidied,
    tidied_point,
)
from robostiff.kinematics.closure.closed_leg import ClosedLeg
from robostiff.kinematics.closure.leg_solver import LegSolver, RecordedForm
from robostiff.kinematics.closure.post import Post
from robostiff.kinematics.closure.rod_ends import RodJoints
from robostiff.kinematics.closure.skeleton import Cluster, Slide
from robostiff.kinematics.closure.strut import Strut
from robostiff.kinematics.formula.layout import Layout
from robostiff.kinematics.formula.placed import FormulaPose, PlacedFormula
from robostiff.kinematics.frames import PlacedChain, place_chain
from robostiff.model import Actuated, Chain, Leg, Passive, PlacedBlock, PlacedLeg, PlacedSpring
from robostiff.record import Entry, is_one, is_zero, most_size, square_root

_VANISHES = 1e-20  # a square beside 1


def place_leg(leg: Leg, pose: FormulaPose, solver: LegSolver) -> PlacedFormula:
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

    Raises
    ------
    InputError
        When the leg has no closed form.
    """
    form = solver.recorded_form
    if form is None:
        raise InputError(
            f"leg {leg.name!r}",
            got="a leg without a closed form",
            expected="a strut, a rod on a slide or a crank, or a post with one joint",
            hint="close it by its solver and write place_leg_at_joints(leg, q)",
        )
    site = Site.of(leg, pose, solver)
    return site.placed(site.own_form(form).closed(site.base, site.platform))


@dataclass(frozen=True)
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
        base = LegBody(Rest(*identity), tidied(leg.base.R), tidied_point(leg.base.p))
        # the platform frame at zero coordinates, in the leg's base frame
        R_platform = zero.R @ leg.attachment.R.T
        p_platform = zero.p - R_platform @ leg.attachment.p
        rest = Rest(tidied(R_platform), tidied_point(p_platform))
        platform = LegBody(rest, tidied(pose.R), tidied_point(pose.p))
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
        A, B = self._own(form.joints.A), self._own(form.joints.B)
        parts: dict[str, Any] = {}
        if isinstance(form, Strut):
            parts["slide"] = self._slide(form.slide)
            along = parts["slide"].axis
        else:
            rod = B.point - A.point
            along = tidied(rod / square_root(rod @ rod))
            if form.across is not None:
                parts["across"] = self._slide(form.across)
            d = form.drive
            parts["drive"] = self._slide(d) if isinstance(d, Slide) else self._own(d)
        joints = RodJoints(
            A,
            B,
            along,
            form.joints.spin,
            home=self.leg.chain.main_path.home,
            side=self._side(along),
            spin_matters=self._spin_matters(A, B),
        )
        return replace(form, joints=joints, name=self.leg.name, **parts)

    def placed(self, closed: ClosedLeg) -> PlacedFormula:
        """The leg's elements on the bodies of the closed leg, and what keeps it from closing."""
        leg, layout = self.leg, Layout(closed)
        end = self.platform.point(self.zero.p)
        elements, apart = layout.elements(leg.chain, self.whole)
        closing = [x for x in (*closed.misses, *(v @ v for v in apart)) if most_size(x) > _VANISHES]
        lengths = [x for x in layout.lengths(leg.chain, self.copies) if isinstance(x, Entry)]
        reaching = [x for x in closed.out_of_reach if not is_zero(x)]
        return PlacedFormula(
            leg=self._with_coordinates(PlacedLeg(leg.name, tuple(elements), end), layout),
            gap=(*closing, *reaching),
            lengths=tuple(lengths),
            coordinate=lambda place: self._coordinate(layout, place),
            platform=self.pose,
            losses=() if is_zero(closed.loss) else (closed.loss,),
        )

    def _with_coordinates(self, placed: PlacedLeg, layout: Layout) -> PlacedLeg:
        """Drives whose stiffness depends on their coordinate have it."""
        places = {part.name: i for i, part in enumerate(self.whole.freedoms)}

        def of(part: Any) -> Any:
            if isinstance(part, PlacedBlock):
                return replace(part, branches=tuple(map(along, part.branches)))
            if getattr(part, "coordinate", None) is None:
                return part
            return replace(part, coordinate=self._coordinate(layout, places[part.name]))

        def along(leg: PlacedLeg) -> PlacedLeg:
            return replace(leg, elements=tuple(map(of, leg.elements)))

        return along(placed)

    def _coordinate(self, layout: Layout, place: int) -> Any:
        """A coordinate of the leg on the turn of home, or within its limits."""
        chain = self.twin.chain
        role = chain.roles[place]
        limits = role.limits if isinstance(role, Actuated) else None
        about = middle_of_turn(chain.home[place], limits)
        return layout.coordinate(self.zero, self.copies[place], about, limits)

    def _spin_matters(self, *joints: Cluster) -> bool:
        """Whether the spin of a rod between two spherical joints matters to the stiffness.

        With passive ones only a force along the rod passes, and meets the same compliance however
        the rod is spun. Where the leg has parallel blocks, the spin moves their other branches.
        """
        chain = self.twin.chain
        if chain.has_blocks:
            return True
        return not all(isinstance(chain.roles[i], Passive) for one in joints for i in one.places)

    def _own(self, cluster: Cluster) -> Cluster:
        """A cluster recognised on the leg in floats, with the entries of the leg to be recorded."""
        axes = tuple(tidied(self.zero.freedoms[place].axis) for place in cluster.places)
        point = tidied_point(self.zero.freedoms[cluster.drawn_at].point)
        return replace(cluster, point=point, axes=axes)

    def _slide(self, slide: Slide) -> Slide:
        return replace(slide, axis=tidied(self.zero.freedoms[slide.place].axis))

    def _side(self, along: np.ndarray) -> np.ndarray:
        """A direction across the rod: that of a beam along it, where there is one."""
        for spring in self.zero.elements:
            if isinstance(spring, PlacedSpring) and is_one(
                constant_cosine(spring.rotation[:, 0], along)
            ):
                return tidied(spring.rotation[:, 1])
        return direction_across(along)


@kept
def _at_zero(chain: Chain) -> PlacedChain:
    """The chain at zero coordinates; several legs may have one."""
    return place_chain(chain, chain.zero, np.eye(3, dtype=int), np.zeros(3, dtype=int))
