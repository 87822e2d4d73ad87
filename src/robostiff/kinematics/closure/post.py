"""Closed form for a post that holds a point of the platform by one joint: S, U or R."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.kinematics.closure.body import (
    LegBody,
    body_of_directions,
    body_turned,
    constant_cosine,
    rest_of_directions,
    tidied,
)
from robostiff.kinematics.closure.closed_form import LegForm
from robostiff.kinematics.closure.closed_leg import ClosedLeg
from robostiff.kinematics.closure.skeleton import Cluster, Skeleton
from robostiff.kinematics.closure.vectors import dot


@dataclass(frozen=True)
class Post(LegForm):
    """A leg whose only joint turns about one point, and takes the turn that the pose has.

    It closes where the point is in the same place on the base and on the platform, and where axes
    of the joint take the turn, in one way.
    """

    joint: Cluster
    length: float = 1.0  # against which the distance of the two places counts [m]

    @property
    def leading(self) -> int:
        """Place of the first coordinate."""
        return self.joint.places[0]

    @property
    def signs(self) -> tuple[bool, bool, bool]:
        """None."""
        return False, False, False

    @property
    def turning(self) -> tuple[Cluster, ...]:
        """Joints whose coordinates are angles."""
        return (self.joint,)

    def closed(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform."""
        joint, at = self.joint, base.point(self.joint.point)
        near = [base.direction(axis) for axis in joint.axes]
        far = platform.direction(joint.axes[-1])
        bodies, ball_axes = {0: base, joint.places[-1] + 1: platform}, {}
        missed = [(platform.point(joint.point) - at) * (1 / self.length)]
        if joint.is_ball:
            ball_axes = dict(zip(joint.places, near, strict=True))
        elif len(joint.axes) == 1:
            missed.append(far - near[0])
        else:
            missed.append(np.array([dot(near[0], far) - constant_cosine(*joint.axes)]))
            bodies[joint.places[1]] = _between(joint, base, at, near[0], far)
        closing = [] if base.is_at_poses else [v @ v for v in map(tidied, missed)]
        return ClosedLeg(bodies, ball_axes, closing, [])


def _between(
    joint: Cluster, base: LegBody, at: np.ndarray, first: np.ndarray, second: np.ndarray
) -> LegBody:
    """What lies between the two axes of a universal joint."""
    a, b = joint.axes
    if base.is_at_poses:
        rest, _ = rest_of_directions(joint.point, a, b)
        return body_turned(base, rest, at, a, b, second)
    return body_of_directions((joint.point, a, b), (at, first, second))


def recognise_post(skeleton: Skeleton) -> Post | None:
    """The closed form, when the leg is of this kind."""
    match skeleton.parts:
        case (Cluster() as joint,):
            return Post(skeleton, joint)
        case _:
            return None
