"""Closed form for a leg of variable length between two joints: UPS, SPS, UPU, UCU, planar RPR."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robostiff.kinematics.closure.body import LegBody, tidied_point
from robostiff.kinematics.closure.closed_form import RodForm, joints_of
from robostiff.kinematics.closure.closed_leg import ClosedLeg, Stretch
from robostiff.kinematics.closure.rod_ends import RodEnds, fits, placed_rod
from robostiff.kinematics.closure.skeleton import Cluster, Skeleton, Slide
from robostiff.kinematics.closure.vectors import dot, quotient, root


@dataclass(frozen=True)
class Strut(RodForm):
    """A slide along the line from joint A to joint B, perhaps with a turn about it.

    Its length, the fixed one and the slide's coordinate, has the sign that its mode says.
    """

    slide: Slide

    @property
    def leading(self) -> int:
        """Place of the slide."""
        return self.slide.place

    def closed(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform."""
        joints, place = self.joints, self.slide.place
        A, B = joints.A, joints.B
        A_now, B_now = base.point(A.point), self.named(platform.point(B.point), "B")
        A_to_B = B_now - A_now
        length = self.named(root(dot(A_to_B, A_to_B)) * self.mode.root, "L")
        d = self.named(quotient(A_to_B, length), "d")
        rod = placed_rod(RodEnds(joints, base, platform, d, A_now, B_now, self.mode))
        (fixed,) = tidied_point(np.array([joints.along @ (B.point - A.point)], dtype=object))
        carried = rod.bodies[A.places[-1] + 1].at(B.point, B_now)
        bodies = {0: base, place + 1: carried, **rod.bodies}
        return replace(rod, bodies=bodies, slides={place: Stretch(length, -fixed)})


def recognise_strut(skeleton: Skeleton) -> Strut | None:
    """The closed form, when the leg is of this kind."""
    spin = None
    match skeleton.parts:
        case (Cluster() as A, Slide() as slide, Cluster() as B):
            pass
        case (Cluster() as A, Slide() as slide, Cluster() as turn, Cluster() as B):
            if not _turns_along(turn, slide):
                return None
            spin = turn.places[0]
        case _:
            return None
    along = slide.axis
    A_to_B = B.point - A.point
    size = 1e-9 * (np.linalg.norm(A_to_B) + np.linalg.norm(skeleton.p_end) + 1e-300)
    if np.linalg.norm(np.cross(along, A_to_B)) > size or not fits(A, B, along):
        return None
    return Strut(skeleton, joints_of(skeleton, A, B, along, spin), slide)


def _turns_along(turn: Cluster, slide: Slide) -> bool:
    """Whether a joint turns about the slide itself, as a cylindrical joint does."""
    if turn.is_ball or len(turn.axes) != 1:
        return False
    return float(np.linalg.norm(turn.axes[0] - slide.axis)) < 1e-9
