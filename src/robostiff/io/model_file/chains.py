"""Chains and legs in a model file: patterns, couplings and parallel blocks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal, TypeVar, cast

from annotated_types import MinLen
from pydantic import Field, Tag

from robostiff.errors import InputError, Words
from robostiff.io.expression import ParameterError, parameter_values
from robostiff.io.model_file.joints import WrittenDrive, WrittenJoint
from robostiff.io.model_file.links import WrittenPart
from robostiff.io.model_file.place import (
    Name,
    Pair,
    Place,
    Text,
    Value,
    Vector,
    WrittenFrame,
    WrittenMapping,
    either,
    with_key,
)
from robostiff.io.model_file.platform import WrittenAttachment
from robostiff.io.suggest import did_you_mean, free_names
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


class WrittenCount(WrittenMapping):
    """Numbered copies: the variable is 1, 2, ... and the name has the same number."""

    count: Annotated[int, Field(ge=1, le=1000)] = Field(description="how many copies there are")
    variable: Text = Field(description="the name of the variable that numbers the copies")
    name: Text | None = None


WrittenCopy = dict[str, Value]
"""The name of a copy and the values of its variables."""


class WrittenRepeat(WrittenMapping):
    """Copies of a leg or branch: the list or number of copies, and their variables."""

    repeat: Annotated[
        Annotated[list[WrittenCopy], Tag("list"), Field(min_length=1)]
        | Annotated[WrittenCount, Tag("count")],
        either(list, "list", "count"),
    ] = Field(description="a list of copies, such as {name: leg1, phi: 0 deg}, or a count")
    let: dict[str, Value] = Field({})

    def copies(self, place: Place, kind: str) -> Iterator[tuple[str, Place, Place]]:
        """Each copy: its name, where that is written, and the place of its values."""
        here, let = place / "repeat", (place / "let", self.let)
        if isinstance(self.repeat, WrittenCount):
            count = self.repeat
            for number in range(1, count.count + 1):
                name = f"{count.name or kind}{number}"
                values = {count.variable: float(number)}
                yield name, here, _with_variables(place, name, (here / "variable", values), let)
            return
        for i, copy in enumerate(self.repeat):
            name, first = copy.get("name"), self.repeat[0]
            if not isinstance(name, str) or not name.strip():
                got = Words("no name" if name is None else repr(name))
                expected = f"a name, such as {{name: {kind}1, phi: 0 deg}}"
                raise (here / i).error(f"copy of the {kind}", got=got, expected=expected)
            if copy.keys() != first.keys():
                keys = ([key for key in entries if key != "name"] for entries in (copy, first))
                came, wanted = (", ".join(names) or "none" for names in keys)
                missing = sorted(first.keys() - copy.keys()) or sorted(copy.keys() - first.keys())
                hint = f"{missing[0]} must have a value in every copy"
                raise (here / i).error(
                    f"variables of the copy {name!r}", got=Words(came), expected=wanted, hint=hint
                )
            values = {key: value for key, value in copy.items() if key != "name"}
            yield name, here / i, _with_variables(place, name, (here / i, values), let)


One = TypeVar("One", bound=WrittenMapping)

Pattern = TypeVar("Pattern", bound=WrittenMapping)

_OneOrPattern = Annotated[
    Annotated[One, Tag("one")] | Annotated[Pattern, Tag("pattern")],
    with_key("repeat", "pattern", "one"),
]

OneOrSeveral = Annotated[
    Annotated[list[_OneOrPattern[One, Pattern]], Tag("list"), Field(min_length=1)]
    | Annotated[Pattern, Tag("repeated")],
    either(list, "list", "repeated"),
]
"""A list in which patterns stand for several, or one pattern alone."""


Part = TypeVar("Part")


def each_of(
    place: Place, written: list[Part] | Part, kind: str
) -> Iterator[tuple[str, Place, Part]]:
    """Everything of one kind that is written at a place, copies included: name, place, keys."""
    if isinstance(written, list):
        parts = [(place / i, part) for i, part in enumerate(cast("list[Part]", written))]
    else:
        parts = [(place, cast("Part", written))]
    taken = set()
    for where, part in parts:
        alone: Any = part
        copies = (
            part.copies(where, kind)
            if isinstance(part, WrittenRepeat)
            else [(alone.name, where / "name", where)]
        )
        for name, named_at, here in copies:
            if name in taken:
                raise named_at.error(f"name of a {kind}", got=name, expected="each name once")
            taken.add(name)
            yield name, here, part


def _with_variables(place: Place, leg: str, *variables: tuple[Place, WrittenCopy]) -> Place:
    """The template's place, with the variables of one copy among its names."""
    places: dict[str, Place] = {}
    values: WrittenCopy = {}
    for here, copy in variables:
        for name, value in copy.items():
            where = here if here.path[-1] == "variable" else here / name
            if name in place.names or name in values:
                kind = "parameter" if name in place.names else "variable"
                expected = f"a name of its own; a {kind} has it already"
                raise where.error("variable", got=name, expected=expected, key=True)
            places[name], values[name] = where, value
    known: dict[str, Any] = {**place.names, **values}
    try:
        names = parameter_values(known, mathematics=place.mathematics)
    except ParameterError as error:
        subject = error.subject.replace("parameter", "variable", 1)
        words = {"got": error.got, "expected": error.expected, "hint": error.hint}
        raise places[error.name].error(subject, **words) from None
    return replace(place, names=names, leg=leg)


_TURN, _SLIDE = Dimension.ANGLE, Dimension.LENGTH
_MOST_LEGS, _MOST_ELEMENTS, _MOST_PARTS = 200, 200, 1000


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
        None,
        description="of the belt or gear, referred to the joint that follows; rigid if left out",
    )

    def build(self, place: Place, joints: dict[str, Joint]) -> Coupling:
        """The coupling of these joints."""
        slides = _slides(place / "joint", self.joint, joints)
        leader_slides = _slides(place / "follows", self.follows, joints)
        if leader_slides and not slides:
            raise (place / "joint").error(
                f"joint {self.joint!r}, which turns and follows a slide",
                expected="a slide that follows a turn",
                hint=f"write joint: {self.follows}, follows: {self.joint}, with the advance for "
                "one radian as the ratio",
            )
        per = _SLIDE if slides and not leader_slides else Dimension.NUMBER
        ratio = (place / "ratio").number(self.ratio, per)
        offset = (place / "offset").number(self.offset, _SLIDE if slides else _TURN)
        drive = WrittenDrive(role="locked", stiffness=self.stiffness)
        role = cast("Locked", drive.build_role(place, (_SLIDE if slides else _TURN,)))
        k, name = role.stiffness, self.name or ""
        with (place / "ratio").complaints():
            return coupling(
                self.joint, follows=self.follows, ratio=ratio, offset=offset, stiffness=k, name=name
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

    def build(self, place: Place, joints: dict[str, Joint]) -> Coupling:
        """The sum of coordinates of these joints."""
        here = place / "sum"
        slides = {name: _slides(here / name, name, joints) for name in self.sum}
        of_lengths = next(iter(slides.values()))
        if not of_lengths and any(slides.values()):
            expected = "a slide as the first, so that the sum is a length"
            raise here.error("sum of joint coordinates", got=list(self.sum), expected=expected)
        terms = []
        for name, factor in self.sum.items():
            dimension = _SLIDE if of_lengths and not slides[name] else Dimension.NUMBER
            terms.append((name, (here / name).number(factor, dimension)))
        dimension = _SLIDE if of_lengths else _TURN
        if self.equals is not None and self.role == "actuated":
            raise (place / "equals").error(
                "equals of an actuated sum",
                expected="no such key here: the drive moves the sum",
                hint="its value at home follows from the home coordinates of the joints",
                key=True,
            )
        home = place.number_at(self, "equals", dimension)
        drive = WrittenDrive(role=self.role, stiffness=self.stiffness, limits=self.limits)
        role = cast("Locked | Actuated", drive.build_role(place, (dimension,)))
        with here.complaints():
            return Coupling(tuple(terms), role, home, self.name or "")


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


WrittenCoupling = Annotated[
    Annotated[WrittenFollower, Tag("follower")] | Annotated[WrittenSum, Tag("sum")],
    with_key("sum", "sum", "follower"),
]

_Couplings = Annotated[
    list[WrittenCoupling],
    Field(
        [],
        description="gears and differentials between joints of the chain, such as "
        "[{joint: wrist2, follows: wrist1, ratio: -1.5}]",
    ),
]


class WrittenCoupled(WrittenMapping):
    """The keys of what has a chain, whose joints may be coupled."""

    chain: Any
    couplings: _Couplings

    def build_chain(self, place: Place) -> Chain:
        """The chain, with its couplings."""
        here, written = place / "chain", self.chain
        if len(written) > _MOST_ELEMENTS:
            raise (here / _MOST_ELEMENTS).error(
                "elements of a chain", got=len(written), expected=f"at most {_MOST_ELEMENTS}"
            )
        written_names = [element.name for element in written]
        for i, name in enumerate(written_names):
            if name is not None and name in written_names[:i]:
                raise (here / i / "name").error(
                    "name of an element", got=name, expected="each name once in a chain"
                )
        names = free_names(written_names, [element.type for element in written])
        elements: tuple[Element, ...] = tuple(
            element.build(here / i, name)
            for i, (element, name) in enumerate(zip(written, names, strict=True))
        )
        joints = {e.name: e for e in elements if isinstance(e, Joint) and e.size == 1}
        at = place / "couplings"
        with here.complaints():
            built = tuple(entry.build(at / i, joints) for i, entry in enumerate(self.couplings))
            try:
                return Chain(elements, built)  # of the first alone another joint may follow
            except InputError:
                for i in range(len(built)):  # one after the other: an error is at its own place
                    with (at / i).complaints():
                        Chain(elements, built[: i + 1])
                raise


def _check_size(place: Place, chains: Sequence[Chain]) -> None:
    """Each parallelogram inside another doubles what is in it."""
    parts = sum(map(_parts, chains))
    if parts > _MOST_PARTS:
        raise place.error(
            "elements inside a parallel block",
            got=parts,
            expected=f"at most {_MOST_PARTS}",
            hint="nest fewer blocks in one another",
        )


def _parts(chain: Chain) -> int:
    """Number of elements of a chain, those inside its blocks included."""
    return sum(
        sum(_parts(branch.chain) for branch in element.branches)
        if isinstance(element, ParallelBlock)
        else 1
        for element in chain.elements
    )


class WrittenParallelogram(WrittenCoupled):
    """Two copies of a bar with its joints, side by side."""

    type: Literal["parallelogram"]
    name: Name | None = None
    across: Vector = Field(description="from the first bar to the second, such as [0, 80 mm, 0]")
    chain: Annotated[list[WrittenElement], MinLen(1)] = Field(
        description="the list of elements of one bar, its joints included"
    )

    def build(self, place: Place, name: str) -> ParallelBlock:
        """The two bars, side by side."""
        across = (place / "across").point(self.across)
        chain = self.build_chain(place)
        _check_size(place, [chain, chain])
        with (place / "across").complaints():
            return parallelogram(chain, across, name=name)


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

    def build(self, place: Place, name: str) -> ParallelBlock:
        """The branches, side by side."""
        branches = tuple(
            Branch(
                branch_name,
                part.start.build(here / "start"),
                part.build_chain(here),
                part.end.build(here / "end"),
            )
            for branch_name, here, part in each_of(place / "branches", self.branches, "branch")
        )
        _check_size(place, [branch.chain for branch in branches])
        with (place / "branches").complaints(hint="write at least two branches"):
            return ParallelBlock(branches, name)


WrittenElement = Annotated[
    WrittenJoint | WrittenPart | WrittenParallelogram | WrittenParallel, Field(discriminator="type")
]


class WrittenLegBody(WrittenCoupled):
    """Common keys of a leg and of the template of repeated legs."""

    base: WrittenFrame = WrittenFrame()
    chain: Annotated[list[WrittenElement], Field(min_length=1)] = Field(
        description="the list of elements from base to platform"
    )
    platform: WrittenAttachment = WrittenAttachment()
    elbow: Literal["home", "plus", "minus"] = "home"

    def build(self, place: Place, name: str) -> Leg:
        """The leg, which has this name."""
        chain = self.build_chain(place)
        base = self.base.build(place / "base")
        attachment = self.platform.build(place / "platform")
        node = self.platform.node
        if node is not None and self.platform.at is not None:
            expected = "one of the two: the leg ends at its node"
            raise (place / "platform" / "at").error(
                "place of the leg's end", got=Words("at beside node"), expected=expected, key=True
            )
        with (place / "chain").complaints():
            return Leg(name, base, chain, attachment, Elbow(self.elbow), node)


class WrittenLeg(WrittenLegBody):
    """One leg."""

    name: Text = Field(description="the name of the leg")


class WrittenPattern(WrittenRepeat, WrittenLegBody):
    """A leg, and what differs from copy to copy."""


WrittenLegs = OneOrSeveral[WrittenLeg, WrittenPattern]


def build_legs(
    place: Place, written: list[WrittenLeg | WrittenPattern] | WrittenPattern
) -> list[tuple[Place, Leg]]:
    """The legs that are written at a place, each with its own place."""
    built: list[tuple[Place, Leg]] = []
    for name, here, part in each_of(place, written, "leg"):
        if len(built) == _MOST_LEGS:
            raise here.error(
                "legs", got=Words(f"more than {_MOST_LEGS}"), expected=f"at most {_MOST_LEGS}"
            )
        built.append((here, part.build(here, name)))
    if built and not any(leg.chain.has_compliance for _, leg in built):
        here, leg = built[0]
        with (here / "chain").complaints():
            leg.check_has_compliance()
    return built
