"""A leg that closes in closed form, recorded at a recorded pose of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.kinematics.closure.assembly import middle_of_turn
from robostiff.kinematics.closure.leg_solver import LegSolver
from robostiff.kinematics.closure.rod import Rod
from robostiff.kinematics.closure.skeleton import Cluster, Slide
from robostiff.kinematics.closure.strut import Strut
from robostiff.kinematics.formula.body import (
    LegBody,
    constant_cosine,
    direction_across,
    size_of,
    tidied,
    tidied_point,
)
from robostiff.kinematics.formula.drive import driven_by_crank, driven_by_slide
from robostiff.kinematics.formula.layout import Layout, Stretch
from robostiff.kinematics.formula.placed import FormulaPose, PlacedFormula
from robostiff.kinematics.formula.rod_ends import PlacedRod, RodEnds, placed_rod
from robostiff.kinematics.frames import PlacedChain, place_chain
from robostiff.model import Actuated, Chain, Leg, Passive, PlacedBlock, PlacedLeg, PlacedSpring
from robostiff.record import Entry, is_one, is_zero, square_root


def named(value: Any, name: str) -> Any:
    """The same entry, or vector of entries, with a name; the components get _x, _y and _z.

    Parameters
    ----------
    value : Entry, number or (3,) array of them
    name : str
    """
    if isinstance(value, np.ndarray):
        for component, axis in zip(value, "xyz", strict=True):
            named(component, f"{name}_{axis}")
    elif isinstance(value, Entry):
        value.named(name)
    return value


_VANISHES = 1e-20  # a square beside 1


def place_leg(leg: Leg, pose: FormulaPose, solver: LegSolver) -> PlacedFormula:
    """Record a leg at a pose, its coordinates eliminated: struts, and rods on a slide or a crank.

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
    form = solver.closed_form
    if form is None:
        raise InputError(
            f"leg {leg.name!r}",
            got="a leg without a closed form",
            expected="a strut, or a rod on a slide or a crank",
            hint="close it by its solver and write place_leg_at_joints(leg, q)",
        )
    site = _Site.of(leg, pose, solver)
    if isinstance(form, Strut):
        return site.strut(form)
    if isinstance(form, Rod):
        return site.rod(form)
    return site.rod(form.rod, form.slide)


@dataclass(frozen=True)
class _Site:
    """A leg to be placed between its base and the platform.

    Attributes
    ----------
    leg, twin : Leg
        The one to be recorded, and the same in floats.
    copies : sequence of int
        For each coordinate of the leg its place on the main path.
    whole, zero : PlacedChain
        The leg and its main path at zero coordinates in its own base frame, locked joints at home.
    base, platform : LegBody
    pose : FormulaPose
        Of the platform.
    """

    leg: Leg
    twin: Leg
    copies: Sequence[int]
    whole: PlacedChain
    zero: PlacedChain
    base: LegBody
    platform: LegBody
    pose: FormulaPose

    @classmethod
    def of(cls, leg: Leg, pose: FormulaPose, solver: LegSolver) -> _Site:
        whole, zero = _at_zero(leg.chain), _at_zero(leg.chain.main_path)
        identity = np.eye(3, dtype=int), np.zeros(3, dtype=int)
        base = LegBody(*identity, tidied(leg.base.R), tidied_point(leg.base.p))
        # the platform frame at zero coordinates, in the leg's base frame
        R_platform = zero.R @ leg.attachment.R.T
        p_platform = zero.p - R_platform @ leg.attachment.p
        platform = LegBody(
            tidied(R_platform), tidied_point(p_platform), tidied(pose.R), tidied_point(pose.p)
        )
        return cls(leg, solver.leg, solver.copies.tolist(), whole, zero, base, platform, pose)

    def strut(self, form: Strut) -> PlacedFormula:
        A, B, place = self._own(form.A), self._own(form.B), form.slide.place
        B_now = named(self.platform.point(B.point), f"B_{self.leg.name}")
        A_to_B = B_now - self.base.point(A.point)
        length = named(square_root(A_to_B @ A_to_B) * form.mode.root, f"L_{self.leg.name}")
        along = self._axis(form.slide)
        rod = placed_rod(
            RodEnds(
                near=self.base,
                platform=self.platform,
                A=A,
                B=B,
                along=along,
                d=named(A_to_B / length, f"d_{self.leg.name}"),
                A_now=self.base.point(A.point),
                B_now=B_now,
                spin=form.spin,
                home=self.leg.chain.main_path.home,
                side=self._side(along),
                mode=form.mode,
                spin_matters=self._spin_matters(form.A, form.B),
            )
        )
        (fixed,) = tidied_point(np.array([along @ (B.point - A.point)], dtype=object))
        carried = rod.bodies[A.places[-1] + 1].at(B.point, B_now)
        bodies = {0: self.base, place + 1: carried, **rod.bodies}
        return self._formula(rod, bodies, {place: Stretch(length, -fixed)})

    def rod(self, form: Rod, slide: Slide | None = None) -> PlacedFormula:
        """Place a rod on a drive, which itself may be carried by a slide along its axis."""
        A, B = self._own(form.A), self._own(form.B)
        B_now = named(self.platform.point(B.point), f"B_{self.leg.name}")
        base, bodies, slides = self.base, {0: self.base}, {}
        if slide is not None:
            e = base.direction(self._axis(slide))
            s = e @ (B_now - base.point(B.point))
            slides[slide.place] = Stretch(s, 0)
            base = base.at(A.point, base.point(A.point) + e * s)
            bodies[slide.place + 1] = base
        A_to_B = B.point - A.point
        square = A_to_B @ A_to_B
        if isinstance(form.drive, Slide):
            place = form.drive.place
            own = replace(form.drive, axis=self._axis(form.drive))
            drive = driven_by_slide(base, own, A.point, B_now, square, form.mode.root)
            slides[place] = Stretch(named(drive.slide, f"s_{self.leg.name}"), 0)
        else:
            place = form.drive.places[0]
            crank = self._own(form.drive)
            drive = driven_by_crank(base, crank, A.point, B_now, square, form.mode.root)
        bodies[place + 1] = drive.carrier
        size = square_root(square)
        along = tidied(A_to_B / size)
        rod = placed_rod(
            RodEnds(
                near=drive.carrier,
                platform=self.platform,
                A=A,
                B=B,
                along=along,
                d=named(drive.A_to_B / size, f"d_{self.leg.name}"),
                A_now=drive.A_now,
                B_now=B_now,
                spin=None,
                home=self.leg.chain.main_path.home,
                side=self._side(along),
                mode=form.mode,
                spin_matters=self._spin_matters(form.A, form.B),
            )
        )
        rod = replace(rod, out_of_reach=[*rod.out_of_reach, drive.out_of_reach])
        placed = self._formula(rod, {**bodies, **rod.bodies}, slides)
        return replace(placed, losses=() if is_zero(drive.loss) else (drive.loss,))

    def _formula(
        self, rod: PlacedRod, bodies: dict[int, LegBody], slides: dict[int, Stretch]
    ) -> PlacedFormula:
        leg, zero = self.leg, self.zero
        layout = Layout(bodies, slides, rod.ball_axes)
        end = self.platform.point(zero.p)
        elements, apart = layout.elements(leg.chain, self.whole)
        closing = [x for x in (*rod.misses, *(v @ v for v in apart)) if size_of(x) > _VANISHES]
        lengths = [x for x in layout.lengths(leg.chain, self.copies) if isinstance(x, Entry)]
        reaching = [x for x in rod.out_of_reach if not is_zero(x)]
        return PlacedFormula(
            leg=self._with_coordinates(PlacedLeg(leg.name, tuple(elements), end), layout),
            gap=(*closing, *reaching),
            lengths=tuple(lengths),
            coordinate=lambda place: self._coordinate(layout, place),
            platform=self.pose,
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

    def _axis(self, slide: Slide) -> np.ndarray:
        return tidied(self.zero.freedoms[slide.place].axis)

    def _side(self, along: np.ndarray) -> np.ndarray:
        """A direction across the rod: that of a beam along it, where there is one."""
        for spring in self.zero.elements:
            if isinstance(spring, PlacedSpring) and is_one(
                constant_cosine(spring.rotation[:, 0], along)
            ):
                return tidied(spring.rotation[:, 1])
        return direction_across(along)


def _at_zero(chain: Chain) -> PlacedChain:
    return place_chain(chain, chain.zero, np.eye(3, dtype=int), np.zeros(3, dtype=int))
