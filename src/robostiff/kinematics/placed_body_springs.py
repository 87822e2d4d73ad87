"""Springs between bodies of a robot in the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches

import numpy as np

from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics.frames import ChainWalk, Way
from robostiff.kinematics.posture import Posture
from robostiff.kinematics.posture_finder import find_posture
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import (
    BodyPoint,
    Element,
    Joint,
    ParallelBlock,
    PlacedBlock,
    PlacedBodySpring,
    PlacedElement,
    Snapshot,
)
from robostiff.model.body_spring import BASE, PLATFORM


def with_body_springs(posture: Posture) -> Snapshot:
    """The snapshot of a posture, its springs between bodies in place.

    Parameters
    ----------
    posture : Posture

    Raises
    ------
    InputError
        When a spring names no body of the robot.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from robostiff.kinematics import find_posture
    >>> from robostiff.model import BodyPoint, BodySpring
    >>> from robostiff.robots import load
    >>> ends = BodyPoint("base"), BodyPoint("arm/upper arm", [0, 0, 0.1])
    >>> spring = BodySpring("compensator", ends, stiffness=2000.0, free_length=0.2)
    >>> arm = replace(load("six-joint-arm"), springs=(spring,))
    >>> with_body_springs(find_posture(arm)).springs[0].points[1].round(3)
    array([[0.184, 0.   , 0.544]])
    """
    springs = posture.robot.in_floats.springs
    if not springs:
        return posture.snapshot
    here = bodies_of(posture)
    home = bodies_of(find_posture(posture.robot, None))
    placed = []
    for spring in springs:
        ends = [_placed(here, end, spring.name) for end in spring.between]
        if spring.preload is None:
            length, tension = spring.free_length, 0.0
        else:
            a, b = (_placed(home, end, spring.name)[1].reshape(-1, 3)[0] for end in spring.between)
            length, tension = float(np.linalg.norm(b - a)), spring.preload
        placed.append(
            PlacedBodySpring(
                spring.name,
                (ends[0][0], ends[1][0]),
                (ends[0][1], ends[1][1]),
                float(spring.stiffness),
                float(length),
                float(tension),
            )
        )
    return replace(posture.snapshot, springs=tuple(placed))


@dataclass(frozen=True)
class PlacedBody:
    """A frame in which points of a body are given."""

    # ``base``, ``platform``, or ``leg/part``, the part that has been placed last before it
    name: str
    # (..., 3, 3) and (..., 3)
    R: np.ndarray
    p: np.ndarray


@kept
def bodies_of(posture: Posture) -> dict[str, PlacedBody]:
    """Frames of the bodies of a robot, by ``leg/part``: where a part begins, of a joint behind it.

    They are those in which masses and the ends of springs are given.
    """
    pose = posture.pose
    found = {
        BASE: PlacedBody(BASE, np.eye(3), np.zeros(3)),
        PLATFORM: PlacedBody(PLATFORM, turn_by_vector(pose[:, 3:]), pose[:, :3]),
    }
    for leg, q in zip(posture.robot.in_floats.legs, posture.coordinates, strict=True):
        way = _BodyWay.of(leg.chain, q)
        _BodyWalk(leg.base.R, leg.base.p, way).along(leg.chain)
        for name, (R, p, part) in way.bodies.items():
            own = BASE if part is None else f"{leg.name}/{part}"
            found[f"{leg.name}/{name}"] = PlacedBody(own, R, p)
    return found


def _placed(bodies: dict[str, PlacedBody], end: BodyPoint, spring: str) -> tuple[str, np.ndarray]:
    """The body, and where a point of it is (..., 3) [m]."""
    body = bodies.get(end.body)
    if body is None:
        near = get_close_matches(str(end.body), bodies, n=3) or list(bodies)[:4]
        raise InputError(
            f"body of spring {spring!r}",
            got=end.body,
            expected=f"base, platform or leg/part, such as {', '.join(map(repr, near))}",
        )
    p = body.p + np.einsum("...ij,j->...i", body.R, np.asarray(end.at, dtype=float))
    return body.name, p


@dataclass
class _BodyWay(Way):
    """Common state of the walks, with the bodies that have been met."""

    # Frame, and the part that has been placed last, by the name of each part
    bodies: dict[str, tuple[np.ndarray, np.ndarray, str | None]] = field(default_factory=dict)
    # The part that has been placed last before the block whose branches are walked along
    entering: str | None = None


class _BodyWalk(ChainWalk):
    """The way along a chain, with the frames of the bodies behind its parts."""

    way: _BodyWay

    def __init__(self, R: np.ndarray, p: np.ndarray, way: _BodyWay, prefix: str = "") -> None:
        super().__init__(R, p, way, prefix)
        self.before = way.entering

    def over(self, element: Element) -> None:
        R, p = self.R, self.p
        super().over(element)
        self.before = _last(self.placed) or self.before
        if isinstance(element, Joint | ParallelBlock):
            R, p = self.R, self.p
        self.way.bodies[self.prefix + element.name] = (R, p, self.before)

    def block(self, block: ParallelBlock) -> None:
        outer, self.way.entering = self.way.entering, self.before
        super().block(block)
        self.way.entering = outer


def _last(placed: Sequence[PlacedElement]) -> str | None:
    """The part before the body at the end; None where there is none."""
    if not placed:
        return None
    element = placed[-1]
    return _last(element.branches[0].elements) if isinstance(element, PlacedBlock) else element.name
