"""From written springs between bodies to those of the model."""

from __future__ import annotations

from collections.abc import Sequence

from robostiff.io.model_file.geometry import point
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_robot import WrittenBodySpring
from robostiff.io.units import Dimension
from robostiff.kinematics import find_posture, with_body_springs
from robostiff.model import BodyPoint, BodySpring, Robot
from robostiff.spatial.formula import is_above


def build_body_springs(
    place: Place, written: Sequence[WrittenBodySpring]
) -> tuple[BodySpring, ...]:
    """The springs that are written, in any order."""
    return tuple(_spring(place / i, own) for i, own in enumerate(written))


def check_body_springs(place: Place, robot: Robot) -> None:
    """Raise at a spring whose bodies the robot does not have."""
    if robot.springs:
        for i, spring in enumerate(robot.springs):
            alone = robot.with_springs((spring,))
            with (place / i / "between").complaints():
                with_body_springs(find_posture(alone, None))


def _spring(place: Place, written: WrittenBodySpring) -> BodySpring:
    ends = [
        BodyPoint(own.body, point(place / "between" / i / "at", own.at))
        for i, own in enumerate(written.between)
    ]
    stiffness = (place / "stiffness").number(written.stiffness, Dimension.TRANSLATIONAL_STIFFNESS)
    if is_above(0, stiffness):
        raise (place / "stiffness").error(
            "stiffness", got=written.stiffness, expected="zero or more, such as 2 kN/m"
        )
    length = preload = None
    if written.free_length is not None:
        length = (place / "free_length").number(written.free_length, Dimension.LENGTH)
    if written.preload is not None:
        preload = (place / "preload").number(written.preload, Dimension.FORCE)
    with place.complaints():
        return BodySpring(written.name, (ends[0], ends[1]), stiffness, length, preload)
