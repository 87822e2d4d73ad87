"""From written couplings of joints to those of the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from robostiff.io.model_file.build_joint import build_role
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_elements import (
    WrittenCoupling,
    WrittenDrive,
    WrittenFollower,
    WrittenSum,
)
from robostiff.io.suggest import did_you_mean
from robostiff.io.units import Dimension
from robostiff.model import Chain, Coupling, Element, Joint, coupling

if TYPE_CHECKING:
    from robostiff.model import Actuated, Locked

_TURN, _SLIDE = Dimension.ANGLE, Dimension.LENGTH


def coupled_chain(
    elements: Sequence[Element], place: Place, written: Sequence[WrittenCoupling]
) -> Chain:
    """The chain of elements with the couplings that are written at a place."""
    joints = {own.name: own for own in elements if isinstance(own, Joint) and own.size == 1}
    built: list[Coupling] = []
    chain = Chain(tuple(elements))
    for i, own in enumerate(written):
        here = place / i
        if isinstance(own, WrittenFollower):
            built.append(_follower(here, own, joints))
        else:
            built.append(_sum(here, own, joints))
        with here.complaints():  # one after the other, so that an error is at its own place
            chain = Chain(tuple(elements), tuple(built))
    return chain


def _follower(place: Place, written: WrittenFollower, joints: dict[str, Joint]) -> Coupling:
    own = _slides(place / "joint", written.joint, joints)
    leader = _slides(place / "follows", written.follows, joints)
    if leader and not own:
        raise (place / "joint").error(
            f"joint {written.joint!r}, which turns and follows a slide",
            expected="a slide that follows a turn",
            hint=f"write joint: {written.follows}, follows: {written.joint}, with the advance for "
            "one radian as the ratio",
        )
    per = _SLIDE if own and not leader else Dimension.NUMBER
    ratio = (place / "ratio").number(written.ratio, per)
    offset = (place / "offset").number(written.offset, _SLIDE if own else _TURN)
    drive = WrittenDrive(role="locked", stiffness=written.stiffness)
    role = cast("Locked", build_role(place, drive, (_SLIDE if own else _TURN,)))
    name = written.name or ""
    with (place / "ratio").complaints():
        found = coupling(
            written.joint, follows=written.follows, ratio=ratio, offset=offset, name=name
        )
    return Coupling(found.terms, role, found.home, found.name)


def _sum(place: Place, written: WrittenSum, joints: dict[str, Joint]) -> Coupling:
    here = place / "sum"
    slides = {name: _slides(here / name, name, joints) for name in written.sum}
    of_lengths = next(iter(slides.values()))
    if not of_lengths and any(slides.values()):
        raise here.error(
            "sum of joint coordinates",
            got=list(written.sum),
            expected="a slide as the first, so that the sum is a length",
        )
    terms = []
    for name, factor in written.sum.items():
        dimension = _SLIDE if of_lengths and not slides[name] else Dimension.NUMBER
        terms.append((name, (here / name).number(factor, dimension)))
    dimension = _SLIDE if of_lengths else _TURN
    if written.equals is not None and written.role == "actuated":
        raise (place / "equals").error(
            "equals of an actuated sum",
            expected="no such key here: the drive moves the sum",
            hint="its value at home follows from the home coordinates of the joints",
            key=True,
        )
    equals = written.equals
    home = None if equals is None else (place / "equals").number(equals, dimension)
    drive = WrittenDrive(role=written.role, stiffness=written.stiffness, limits=written.limits)
    role = cast("Locked | Actuated", build_role(place, drive, (dimension,)))
    with here.complaints():
        return Coupling(tuple(terms), role, home, written.name or "")


def _slides(place: Place, name: str, joints: dict[str, Joint]) -> bool:
    """Whether a joint slides."""
    if name not in joints:
        listed = ", ".join(joints) or "none"
        raise place.error(
            "joint of a coupling",
            got=name,
            expected=f"a revolute, prismatic or helical joint of the same chain: {listed}",
            hint=did_you_mean(name, joints),
            key=place.path[-2] == "sum",
        )
    return not joints[name].freedoms[0].turns
