"""Chains and legs in a model file, parallel blocks and copies included: keys, and what is built."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal, TypeVar, cast

from annotated_types import MinLen
from pydantic import Field, Tag

from robostiff.errors import InputError
from robostiff.io.expression import ParameterError, parameter_values
from robostiff.io.model_file.build_link import (
    WrittenBeam,
    WrittenLink,
    WrittenRigid,
    WrittenSpring,
    WrittenTelescope,
    build_beam,
    build_link,
    build_rigid,
    build_spring,
    build_telescope,
)
from robostiff.io.model_file.build_platform import WrittenAttachment
from robostiff.io.model_file.joints import WrittenDrive, WrittenJoint, build_joint, build_role
from robostiff.io.model_file.place import Place, point, transform
from robostiff.io.model_file.stock import Stock
from robostiff.io.model_file.written_parts import (
    Name,
    OneOrSeveral,
    Pair,
    Text,
    Value,
    Vector,
    WrittenCopy,
    WrittenCount,
    WrittenFrame,
    WrittenMapping,
    WrittenRepeat,
    with_key,
)
from robostiff.io.suggest import Words, did_you_mean, numbered
from robostiff.io.units import Dimension
from robostiff.model import (
    Actuated,
    Branch,
    Chain,
    Coupling,
    Elbow,
    Element,
    Joint,
    Leg,
    Locked,
    ParallelBlock,
    coupling,
    parallelogram,
)


class WrittenFollower(WrittenMapping):
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


class WrittenSum(WrittenMapping):
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


class WrittenCoupled(WrittenMapping):
    """The keys of what has a chain, whose joints may be coupled."""

    chain: Any
    couplings: _Couplings


class WrittenParallelogram(WrittenCoupled):
    """Two copies of a bar with its joints, side by side."""

    type: Literal["parallelogram"]
    name: Name | None = None
    across: Vector = Field(description="from the first bar to the second, such as [0, 80 mm, 0]")
    chain: Annotated[list[WrittenElement], MinLen(1)] = Field(
        description="the list of elements of one bar, its joints included"
    )


class WrittenBranchBody(WrittenCoupled):
    """Common keys of a branch and of the template of repeated branches."""

    start: WrittenFrame = WrittenFrame()
    chain: Annotated[list[WrittenElement], MinLen(1)] = Field(
        description="the list of elements from the body before the block to the body after it"
    )
    end: WrittenFrame = WrittenFrame()


class WrittenBranch(WrittenBranchBody):
    """One branch."""

    name: Name = Field(description="the name of the branch")


class WrittenBranchPattern(WrittenRepeat, WrittenBranchBody):
    """A branch, and what differs from copy to copy."""


class WrittenParallel(WrittenMapping):
    """Branches side by side between two bodies of a chain."""

    type: Literal["parallel"]
    name: Name | None = None
    branches: OneOrSeveral[WrittenBranch, WrittenBranchPattern] = Field(
        description="a list of branches, or one branch with repeat:"
    )


WrittenElement = Annotated[
    WrittenJoint
    | WrittenRigid
    | WrittenBeam
    | WrittenSpring
    | WrittenLink
    | WrittenTelescope
    | WrittenParallelogram
    | WrittenParallel,
    Field(discriminator="type"),
]


class WrittenLegBody(WrittenCoupled):
    """Common keys of a leg and of the template of repeated legs."""

    base: WrittenFrame = WrittenFrame()
    chain: Annotated[list[WrittenElement], Field(min_length=1)] = Field(
        description="the list of elements from base to platform"
    )
    platform: WrittenAttachment = WrittenAttachment()
    elbow: Literal["home", "plus", "minus"] = "home"


class WrittenLeg(WrittenLegBody):
    """One leg."""

    name: Text = Field(description="the name of the leg")


class WrittenPattern(WrittenRepeat, WrittenLegBody):
    """A leg, and what differs from copy to copy."""


WrittenLegs = OneOrSeveral[WrittenLeg, WrittenPattern]


Part = TypeVar("Part")


def each_of(
    place: Place, written: list[Part] | Part, kind: str
) -> Iterator[tuple[str, Place, Part]]:
    """Everything of one kind that is written at a place, copies included: name, place, keys."""
    if isinstance(written, list):
        parts = [(place / i, own) for i, own in enumerate(cast("list[Part]", written))]
    else:
        parts = [(place, cast("Part", written))]
    taken = set()
    for where, own in parts:
        for name, named_at, here in _named_copies(where, own, kind):
            if name in taken:
                raise named_at.error(f"name of a {kind}", got=name, expected="each name once")
            taken.add(name)
            yield name, here, own


def _named_copies(place: Place, written: Any, kind: str) -> Iterator[tuple[str, Place, Place]]:
    """For one of a kind, or each copy of a repeated one: its name, where that is, its own place."""
    if not isinstance(written, WrittenRepeat):
        yield written.name, place / "name", place
        return
    here, let = place / "repeat", (place / "let", written.let)
    if isinstance(written.repeat, WrittenCount):
        count = written.repeat
        for number in range(1, count.count + 1):
            name = f"{count.name or kind}{number}"
            own = {count.variable: float(number)}
            yield name, here, _with_variables(place, name, (here / "variable", own), let)
        return
    for i, copy in enumerate(written.repeat):
        name = _copy_name(here / i, copy, written.repeat[0], kind)
        own = {key: value for key, value in copy.items() if key != "name"}
        yield name, here / i, _with_variables(place, name, (here / i, own), let)


def _copy_name(place: Place, copy: WrittenCopy, first: WrittenCopy, kind: str) -> str:
    name = copy.get("name")
    if not isinstance(name, str) or not name.strip():
        raise place.error(
            f"copy of the {kind}",
            got=Words("no name" if name is None else repr(name)),
            expected=f"a name, such as {{name: {kind}1, phi: 0 deg}}",
        )
    if copy.keys() != first.keys():
        missing = sorted(first.keys() - copy.keys()) or sorted(copy.keys() - first.keys())
        raise place.error(
            f"variables of the copy {name!r}",
            got=Words(", ".join(key for key in copy if key != "name") or "none"),
            expected=Words(", ".join(key for key in first if key != "name") or "none"),
            hint=f"{missing[0]} must have a value in every copy",
        )
    return name


def _with_variables(place: Place, leg: str, *variables: tuple[Place, WrittenCopy]) -> Place:
    """The template's place, with the variables of one copy among its names."""
    places: dict[str, Place] = {}
    values: WrittenCopy = {}
    for here, own in variables:
        for name, value in own.items():
            where = here if here.path[-1] == "variable" else here / name
            if name in place.names or name in values:
                taken = "parameter" if name in place.names else "variable"
                raise where.error(
                    "variable",
                    got=name,
                    expected=f"a name of its own; a {taken} has it already",
                    key=True,
                )
            places[name], values[name] = where, value
    known: dict[str, Any] = {**place.names, **values}
    try:
        names = parameter_values(known, mathematics=place.mathematics)
    except ParameterError as error:
        subject = error.subject.replace("parameter", "variable", 1)
        words = {"got": error.got, "expected": error.expected, "hint": error.hint}
        raise places[error.name].error(subject, **words) from None
    return replace(place, names=names, leg=leg)


_MOST_PARTS = 1000
_MOST_ELEMENTS = 200


def build_chain(place: Place, own: WrittenCoupled, stock: Stock) -> Chain:
    """The chain that is written at the place of a leg or branch, with its couplings."""
    couplings, place, written = place / "couplings", place / "chain", own.chain
    if len(written) > _MOST_ELEMENTS:
        raise (place / _MOST_ELEMENTS).error(
            "elements of a chain", got=len(written), expected=f"at most {_MOST_ELEMENTS}"
        )
    given = [element.name for element in written]
    for i, name in enumerate(given):
        if name is not None and name in given[:i]:
            raise (place / i / "name").error(
                "name of an element", got=name, expected="each name once in a chain"
            )
    names = numbered(given, [element.type for element in written])
    elements = [
        build_element(place / i, element, name, stock)
        for i, (element, name) in enumerate(zip(written, names, strict=True))
    ]
    with place.complaints():
        return _coupled(elements, couplings, own.couplings)


_TURN, _SLIDE = Dimension.ANGLE, Dimension.LENGTH


def _coupled(
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
        return Chain(tuple(elements), built)  # of the first alone another joint may follow
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
    home = place.number_at(written, "equals", dimension)
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


def build_element(place: Place, written: WrittenElement, name: str, stock: Stock) -> Element:
    """The element that is written at a place."""
    match written:
        case WrittenRigid():
            element: Element = build_rigid(place, written, name)
        case WrittenBeam():
            element = build_beam(place, written, name, stock)
        case WrittenSpring():
            element = build_spring(place, written, name)
        case WrittenLink():
            element = build_link(place, written, name)
        case WrittenTelescope():
            element = build_telescope(place, written, name, stock)
        case WrittenParallelogram() | WrittenParallel():
            element = _block(place, written, name, stock)
        case _:
            element = build_joint(place, written, name)
    return element


def _block(
    place: Place, written: WrittenParallelogram | WrittenParallel, name: str, stock: Stock
) -> ParallelBlock:
    if isinstance(written, WrittenParallelogram):
        across = point(place / "across", written.across)
        chain = build_chain(place, written, stock)
        _refuse_many(place, 2 * _parts(chain))
        with (place / "across").complaints():
            return parallelogram(chain, across, name=name)
    branches = tuple(
        Branch(
            own,
            transform(here / "start", part.start),
            build_chain(here, part, stock),
            transform(here / "end", part.end),
        )
        for own, here, part in each_of(place / "branches", written.branches, "branch")
    )
    _refuse_many(place, sum(_parts(branch.chain) for branch in branches))
    with (place / "branches").complaints(hint="write at least two branches"):
        return ParallelBlock(branches, name)


def _parts(chain: Chain) -> int:
    """Number of elements of a chain, those inside its blocks included."""
    return sum(
        sum(_parts(branch.chain) for branch in element.branches)
        if isinstance(element, ParallelBlock)
        else 1
        for element in chain.elements
    )


def _refuse_many(place: Place, parts: int) -> None:
    """Each parallelogram inside another doubles what is in it."""
    if parts > _MOST_PARTS:
        raise place.error(
            "elements inside a parallel block",
            got=parts,
            expected=f"at most {_MOST_PARTS}",
            hint="nest fewer blocks in one another",
        )


MOST_LEGS = 200


def build_legs(
    place: Place, written: list[WrittenLeg | WrittenPattern] | WrittenPattern, stock: Stock
) -> list[tuple[Place, Leg]]:
    """The legs that are written at a place, each with its own place."""
    built: list[tuple[Place, Leg]] = []
    for name, here, part in each_of(place, written, "leg"):
        if len(built) == MOST_LEGS:
            raise here.error(
                "legs", got=Words(f"more than {MOST_LEGS}"), expected=f"at most {MOST_LEGS}"
            )
        chain = build_chain(here, part, stock)
        base = transform(here / "base", part.base)
        attachment = transform(here / "platform", part.platform)
        node = part.platform.node
        if node is not None and part.platform.at is not None:
            raise (here / "platform" / "at").error(
                "place of the leg's end",
                got=Words("at beside node"),
                expected="one of the two: the leg ends at its node",
                key=True,
            )
        with (here / "chain").complaints():
            built.append((here, Leg(name, base, chain, attachment, Elbow(part.elbow), node)))
    if built and not any(leg.chain.has_compliance for _, leg in built):
        here, leg = built[0]
        with (here / "chain").complaints():
            leg.check_has_compliance()
    return built
