"""Gears and differentials in a model file: their keys, and the chain that has them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, cast

from pydantic import Field, Tag

from robostiff.errors import InputError
from robostiff.io.model_file.joints import WrittenDrive, build_role
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_parts import Name, Pair, Value, Written, with_key
from robostiff.io.suggest import did_you_mean
from robostiff.io.units import Dimension
from robostiff.model import Actuated, Chain, Coupling, Element, Joint, Locked, coupling


class WrittenFollower(Written):
    """A joint that follows another one: a gear, belt, rack or mimic joint."""

    name: Name | None = None
    joint: Name = Field(description="the joint that follows, such as wrist2; it is passive")
    follows: Name = Field(description="the joint that it follows, such as wrist1")
    ratio: Value = Field(
        description="how far it moves for one of the other, such as -1.5; of a slide that follows "
        "a turn the length for one radian"
    )
    offset: Value = Field(0, description="its coordinate where the other one is 0")
    stiffness: Value | None = Field(
        None, description="of the belt or gear, felt at the joint that follows; rigid if left out"
    )


class WrittenSum(Written):
    """A sum of joint coordinates that is held, or moved by a drive: a differential."""

    name: Name | None = None
    sum: Annotated[dict[Name, Value], Field(min_length=2)] = Field(
        description="joints with their factors, such as {roll: 1, pitch: -1}"
    )
    equals: Value | None = Field(
        None, description="the value of the sum; that of the home configuration if left out"
    )
    role: Literal["locked", "actuated"] = Field(
        "locked", description="locked, or actuated where a drive moves the sum"
    )
    stiffness: Value | None = Field(None, description="against the sum; rigid if left out")
    limits: Pair | None = Field(None, description="lowest and highest sum of an actuated one")


WrittenCoupling = Annotated[
    Annotated[WrittenFollower, Tag("follower")] | Annotated[WrittenSum, Tag("sum")],
    with_key("sum", "sum", "follower"),
]
_Couplings = Annotated[
    list[WrittenCoupling],
    Field(
        default_factory=list,
        description="gears and differentials between joints of the chain, such as "
        "[{joint: wrist2, follows: wrist1, ratio: -1.5}]",
    ),
]


class WrittenCoupled(Written):
    """The key of what has a chain whose joints may be coupled."""

    couplings: _Couplings


_TURN, _SLIDE = Dimension.ANGLE, Dimension.LENGTH


def coupled_chain(
    elements: Sequence[Element], place: Place, written: Sequence[WrittenCoupling]
) -> Chain:
    """The chain of elements with the couplings that are written at a place."""
    joints = {own.name: own for own in elements if isinstance(own, Joint) and own.size == 1}
    built = tuple(
        _follower(place / i, own, joints)
        if isinstance(own, WrittenFollower)
        else _sum(place / i, own, joints)
        for i, own in enumerate(written)
    )
    try:
        return Chain(tuple(elements), built)
    except InputError:
        for i in range(len(built)):  # one after the other, so that an error is at its own place
            with (place / i).complaints():
                Chain(tuple(elements), built[: i + 1])
        raise


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
    if name not in joints:
        listed = ", ".join(joints) or "none"
        raise place.error(
            "joint of a coupling",
            got=name,
            expected=f"a joint with one coordinate of the same chain: {listed}",
            hint=did_you_mean(name, joints),
            key=place.path[-2] == "sum",
        )
    return not joints[name].freedoms[0].turns
