"""Side files of robot descriptions: what may be written, and the joints of a tree with it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import cached_property
from typing import Annotated, Any, Literal

from annotated_types import MaxLen, MinLen
from pydantic import AfterValidator, Field, Tag

from robostiff.errors import FileError, InputError, Words, warn_of_slip
from robostiff.frozen import field, frozen, replace
from robostiff.io.document import Document
from robostiff.io.model_file.joints import MAKERS, STIFFNESS_OF, WrittenDrive, WrittenJoint
from robostiff.io.model_file.links import (
    MaterialChoice,
    SectionChoice,
    Theory,
    WrittenMatrices,
    WrittenSegment,
    WrittenSpring,
    WrittenStock,
)
from robostiff.io.model_file.place import (
    Direction,
    Pair,
    Place,
    Text,
    Value,
    Vector,
    WordOr,
    WrittenFrame,
    WrittenMapping,
    either,
    top_place,
)
from robostiff.io.rigid_tree.tree import JointType, RigidTree, TreeJoint
from robostiff.io.suggest import as_in_a_file, listing, values
from robostiff.io.units import Dimension
from robostiff.io.validation import validate
from robostiff.model import Actuated, Coupling, Joint, Locked, Passive, Role, StiffnessLaw, coupling

_LINK = "the name of a link"


class WrittenTreeJoint(WrittenMapping):
    """Role, stiffness and limits of a joint of the tree, and the spring beside its drive."""

    role: Literal["passive", "actuated", "locked"] | None = None
    stiffness: Value | None = None
    spring: Value | None = Field(
        default=None,
        description="stiffness of a spring beside the drive, in place of that of the description; "
        "0 for none",
    )
    limits: Pair | None = None
    inertia: Value | None = None


class WrittenLinkBeam(WrittenMapping):
    """A link that is a beam, from its joint to the next one."""

    type: Literal["beam"]
    to: Text | None = None
    y_axis: Direction | None = None
    material: MaterialChoice = Field(description="a name, such as steel, or {E: 70 GPa, ...}")
    section: SectionChoice | None = None
    theory: Theory | None = None
    taper: Annotated[list[WrittenSegment], MinLen(1)] | None = None


class WrittenLinkMatrix(WrittenMatrices):
    """A link given by its 6x6 matrix, about the next joint."""

    type: Literal["link"]
    to: Text | None = None


WrittenElasticLink = Annotated[WrittenLinkBeam | WrittenLinkMatrix, Field(discriminator="type")]


class WrittenLinkFrame(WrittenFrame):
    """A frame on a link."""

    link: Text = Field(description=_LINK)


LinkFrameChoice = WordOr[WrittenLinkFrame]
"""A link, whose own frame it is, or a frame on a link."""


class WrittenTool(WrittenMapping):
    """The point whose stiffness is computed."""

    link: Text = Field(description=_LINK)
    at: Vector | None = None


def _loop_word(value: str) -> str:
    if value in ("fixed", "spherical"):
        return value
    expected = "fixed, spherical, or a joint with its axis"
    hint = "write joint: {type: revolute, axis: z, role: passive} or the like"
    raise InputError("joint of the loop", got=value, expected=expected, hint=hint)


LoopJointChoice = Annotated[
    Annotated[str, AfterValidator(_loop_word), Tag("word")]
    | Annotated[WrittenJoint | WrittenSpring, Field(discriminator="type"), Tag("mapping")],
    either(str, "word", "mapping"),
]


class WrittenLoop(WrittenMapping):
    """Frames on two links of the tree that coincide up to the motion of a joint."""

    name: Text | None = None
    between: Annotated[list[LinkFrameChoice], MinLen(2), MaxLen(2)] = Field(
        description="the two frames, such as [hand, part] or [{link: rod, at: [0.3, 0, 0]}, disc]"
    )
    joint: LoopJointChoice = Field(
        description="fixed, spherical, or a joint such as {type: revolute, axis: z, role: passive}"
    )


class WrittenSide(WrittenStock):
    """A whole side file."""

    robostiff: Literal[1]
    robot: str | None = None
    name: Text | None = None
    title: str = ""
    source: Text = Field(description="where the stiffnesses come from, in a sentence")
    notes: str = ""
    parameters: dict[str, Value] = Field({})
    base: Text | None = None
    platform: Text | None = None
    tool: WordOr[WrittenTool] | None = None
    joints: dict[str, WrittenTreeJoint] = Field({})
    links: dict[str, WrittenElasticLink] = Field({})
    loops: list[WrittenLoop] = Field([])
    home: dict[str, Any] = Field({})
    start: dict[str, Any] = Field({})
    coordinates: list[Literal["x", "y", "z", "rx", "ry", "rz"]] | None = None


def check_known(place: Place, name: str, what: str, known: Sequence[str]) -> str:
    """The name, when it is one of those known."""
    if name not in known:
        raise place.unknown(what, name, known, most=30)
    return name


_TURN, _SLIDE = Dimension.ANGLE, Dimension.LENGTH
_DIMENSIONS = {
    JointType.REVOLUTE: (_TURN,),
    JointType.PRISMATIC: (_SLIDE,),
    JointType.SPHERICAL: (_TURN, _TURN, _TURN),
    JointType.PLANAR: (_SLIDE, _SLIDE, _TURN),
}
_WILD = frozenset("*?[")


def key_of_joint(keys: Collection[str], name: str) -> str | None:
    """The key of a side file that is about a joint; None where there is none.

    Its name takes precedence over a pattern; of several patterns the first in the file counts.
    """
    return name if name in keys else next((key for key in keys if fnmatchcase(name, key)), None)


_SERVO = (
    "drives {} have the stiffness kp gear^2 of their position servos; write stiffness: in the side "
    "file if it is another"
)
_BESIDE = (
    "springs {} act beside the stiffness in the side file; write spring: 0 there if that has them, "
    "or the stiffness of the spring"
)
_ALONE = (
    "springs {} act alone, as no stiffness of their drives is given; write stiffness: in the side "
    "file"
)


@frozen
class DescribedTree:
    """A tree of links with the side file that is written about it."""

    top: Place
    written: WrittenSide
    tree: RigidTree  # with the springs that the side file gives in place of its own
    #: of joints that a pattern fits by its name alone, what is to be said where they are used
    misfits: dict[str, FileError] = field(default_factory=dict)

    @classmethod
    def of(
        cls, tree: RigidTree, side: Document, parameters: Mapping[str, str | float] | None
    ) -> DescribedTree:
        """The tree with a side file, for other values of some of its parameters."""
        written = validate(WrittenSide, side)
        plain = cls(top_place(side, written.parameters, parameters or {}), written, tree)
        joints = []
        for joint in tree.joints:
            place, entry = plain._entry(joint)
            if entry.spring is None or joint.type not in _DIMENSIONS:
                joints.append(joint)
                continue
            here, dimensions = place / "spring", _DIMENSIONS[joint.type]
            if len(set(dimensions)) > 1:
                raise here.error(
                    f"spring of the {joint.type.value} joint {joint.name!r}",
                    expected="none: it slides and turns",
                    key=True,
                )
            k = here.number(entry.spring, STIFFNESS_OF[dimensions[0]])
            if not k >= 0:
                raise here.error("spring", got=entry.spring, expected="a stiffness, or 0 for none")
            joints.append(replace(joint, spring=float(k)))
        return replace(plain, tree=replace(tree, joints=tuple(joints)))

    @cached_property
    def _entries(self) -> dict[str, tuple[Place, WrittenTreeJoint]]:
        """For each joint its entry, with its place, by `key_of_joint`."""
        place, written = self.top / "joints", self.written.joints
        names = [joint.name for joint in self.tree.joints]
        for key in written:
            if _WILD.isdisjoint(key):
                check_known(place / key, key, "joint", names)
            elif key not in names and not any(fnmatchcase(name, key) for name in names):
                raise (place / key).error(
                    "pattern for joints", got=key, expected=f"one that fits {listing(names, 30)}"
                )
        keys = {name: key_of_joint(written, name) for name in names}
        return {name: (place / key, written[key]) for name, key in keys.items() if key is not None}

    def _entry(self, joint: TreeJoint) -> tuple[Place, WrittenTreeJoint]:
        return self._entries.get(joint.name, (self.top / "joints", WrittenTreeJoint()))

    @cached_property
    def joints(self) -> dict[str, Joint | None]:
        """The joints by name: None for a fixed one.

        Floating joints are left out, as they connect nothing, unless they are locked: then they
        are fixed.
        """
        coordinates, joints = self._given_coordinates(), {}
        by_name = {joint.name: joint for joint in self.tree.joints}
        for joint in self.tree.joints:
            place, entry = self._entry(joint)
            if joint.type in _DIMENSIONS:
                home = _home(joint, coordinates, by_name)
                role = joint.role
                try:
                    role = _beside(_role(place, entry, joint), joint, place)
                except FileError as error:
                    if joint.name in self.written.joints:
                        raise
                    if joint.name not in self.undecided:
                        self.misfits[joint.name] = FileError(
                            error.location,
                            f"{error.subject} of {joint.name!r}",
                            got=error.got,
                            expected=error.expected,
                            hint=f"it is {joint.type.value}: give it an entry of its own, "
                            f"{joint.name}: {{...}}",
                        )
                        continue
                if joint.inertia and isinstance(role, Actuated) and role.inertia is None:
                    role = replace(role, inertia=joint.inertia)
                axis = () if joint.type is JointType.SPHERICAL else (joint.axis,)
                make = MAKERS[joint.type.value]
                try:
                    joints[joint.name] = make(*axis, role, home=home, name=joint.name)
                except InputError as error:
                    subject, words = f"joint {joint.name!r}: {error.subject}", error.expected
                    raise self.tree.error(subject, got=error.got, expected=words) from None
                continue
            # Keys that a fixed or floating joint cannot have.
            fixed = joint.type is JointType.FIXED
            allowed = (None, "locked") if fixed else (None, "passive", "locked")
            keys = ("stiffness", "spring", "limits", "inertia")
            what = next((key for key in keys if getattr(entry, key) is not None), "role")
            if joint.name in self.written.joints and (what != "role" or entry.role not in allowed):
                locked = "role: locked, to fix it; it connects nothing otherwise"
                raise (place / what).error(
                    f"{what} of the {joint.type.value} joint {joint.name!r}",
                    expected="nothing: it does not move" if fixed else locked,
                    hint="give a link elasticity under links: instead" if fixed else None,
                    key=True,
                )
            if joint.type is JointType.FIXED or entry.role == "locked":
                joints[joint.name] = None
        return joints

    def _given_coordinates(self) -> dict[str, tuple[float, ...]]:
        """Coordinates that the side file gives under home or start."""
        coordinates: dict[str, tuple[float, ...]] = {}
        by_name = {joint.name: joint for joint in self.tree.joints}
        for key, mapping in (("home", self.written.home), ("start", self.written.start)):
            for name, value in mapping.items():
                place = self.top / key / name
                check_known(place, name, "joint", list(by_name))
                if name in coordinates:
                    expected = "a name under home or start, once"
                    raise place.error("joint", got=name, expected=expected)
                joint = by_name[name]
                dimensions = _DIMENSIONS.get(joint.type)
                if dimensions is None:
                    subject = f"coordinate of a {joint.type.value} joint"
                    raise place.error(subject, expected="none: it is not moved", key=True)
                alone, one = not isinstance(value, list), len(dimensions) == 1
                entries = [value] if alone else value
                if len(entries) != len(dimensions) or alone != one:
                    some = f"a list of {values(len(dimensions))}"
                    subject, wanted = f"coordinates of {name!r}", "a number or an expression"
                    raise place.error(
                        subject, got=as_in_a_file(value), expected=wanted if one else some
                    )
                coordinates[name] = tuple(
                    (place if alone else place / i).any_number("coordinate", *pair)
                    for i, pair in enumerate(zip(entries, dimensions, strict=True))
                )
        if self.tree.keyframes and not coordinates:
            names = listing(self.tree.keyframes, 12)
            instead = "write its coordinates under home: in the side file"
            warn_of_slip(f"{self.tree.file}: not read: keyframes {names}; {instead}")
        return coordinates

    def warn_of_stiffnesses(self, loaded: Collection[str]) -> None:
        """Name the joints between base and tool whose stiffness the description decides in part.

        Nothing is said of a joint where the side file gives what the description does.
        """
        by_words: dict[str, list[str]] = {_SERVO: [], _BESIDE: [], _ALONE: []}
        for joint in self.tree.joints:
            _, entry = self._entry(joint)
            if joint.name not in loaded or joint.type not in _DIMENSIONS or entry.role == "locked":
                continue
            unit = "N m/rad" if _DIMENSIONS[joint.type][0] is _TURN else "N/m"
            spring = f"{joint.name} ({joint.spring:g} {unit})"
            is_questioned = joint.spring and entry.spring is None
            if entry.stiffness is not None:
                by_words[_BESIDE] += [spring] * bool(is_questioned)
            elif entry.role != "passive" and isinstance(joint.role, Actuated):
                if joint.role.stiffness is not None:
                    by_words[_SERVO].append(f"{joint.name} ({joint.role.stiffness:g} {unit})")
                elif is_questioned:
                    by_words[_ALONE].append(spring)
        for words, joints in by_words.items():
            if joints:
                warn_of_slip(f"{self.tree.file}: {words.format(listing(joints, 12))}")

    @cached_property
    def undecided(self) -> frozenset[str]:
        """Joints that follow another one and have no role in the side file."""
        return frozenset(
            joint.name
            for joint in self.tree.joints
            if joint.mimic is not None
            and (entry := self._entry(joint)[1]).role is None
            and (entry.stiffness is None or joint.name not in self.written.joints)
        )

    def couplings(self, loaded: Collection[str]) -> tuple[tuple[Coupling, ...], dict[str, Role]]:
        """Couplings between the joints of a chain, which are `loaded`, and their roles.

        Joints that follow one outside of the chain, which carries no load, are held by its drive:
        as stiff as that, referred to their own motion. So do springs and servos of followers
        outside of it hold what they follow. A FileError where joints follow one another in a
        circle, or what a joint follows is none.
        """
        roles: dict[str, Role] = {}
        leaders: dict[str, tuple[str, float, float]] = {}
        outside: dict[str, float] = {}  # stiffness of followers, referred to what they follow
        couplings, tree = [], self.tree
        by_name = {joint.name: joint for joint in tree.joints}
        decided = by_name.keys() - self.undecided
        for joint in tree.joints:
            if joint.name not in self.undecided:
                continue
            name, servo = joint.name, getattr(joint.role, "stiffness", None) or 0.0
            root, factor, offset = _leader(name, by_name, decided)
            own = replace(joint, spring=joint.spring + servo)
            if name not in loaded:
                outside[root] = outside.get(root, 0.0) + factor**2 * own.spring
                continue
            if factor == 0:
                roles[name] = Locked()
                continue
            if root in self.misfits:
                raise self.misfits[root]
            if root not in decided:
                got = Words(f"a joint that follows {root!r}")
                expected = f"one of {listing(list(by_name), 30)} that does not follow it in turn"
                raise tree.error(f"joint {name!r}", got=got, expected=expected)
            if root not in leaders and root not in loaded:
                leaders[root] = (name, factor, offset)
                role = _driven_from(self.joints.get(root), factor, offset, name, tree)
                roles[name] = _beside(role, own, tree)
                continue
            leader, of_leader, start = leaders.setdefault(root, (root, 1.0, 0.0))
            roles[name] = _beside(joint.role if servo else Passive(), joint, tree)
            ratio = factor / of_leader
            offset -= ratio * start
            couplings.append(coupling(name, follows=leader, ratio=ratio, offset=offset))
        for root, k in outside.items():
            name, factor, _ = leaders.get(root, (root, 1.0, 0.0))
            if k and name in loaded and (held := self.joints.get(name)) is not None:
                spring = replace(by_name[name], spring=k / factor**2)
                roles[name] = _beside(roles.get(name, held.role), spring, tree)
        return tuple(couplings), roles


def _leader(
    name: str, by_name: Mapping[str, TreeJoint], ends: Collection[str]
) -> tuple[str, float, float]:
    """The joint that a joint follows in the end, one of `ends` at most: name, factor and offset.

    The name is that of no joint, or of one passed before, where there is no end.
    """
    passed, factor, offset = [name], 1.0, 0.0
    while factor and passed[-1] not in ends and passed[-1] in by_name:
        mimic = by_name[passed[-1]].mimic
        if mimic is None or passed[-1] in passed[:-1]:
            break
        factor, offset = factor * mimic.multiplier, offset + factor * mimic.offset
        passed.append(mimic.joint)
    return passed[-1], factor, offset


def _driven_from(
    leader: Joint | None, factor: float, offset: float, name: str, tree: RigidTree
) -> Role:
    """The role of a joint that the drive of another one moves alone."""
    role = None if leader is None else leader.role
    if isinstance(role, Passive):
        return role
    k = None if role is None else role.stiffness
    if isinstance(k, StiffnessLaw):
        got = Words("a drive whose stiffness depends on the coordinate of another joint")
        raise tree.error(f"joint {name!r}", got=got, expected="a constant one")
    k = None if k is None else k / factor**2
    if not isinstance(role, Actuated):
        return Locked(k)
    if role.limits is None:
        return Actuated(k)
    low, high = sorted(factor * x + offset for x in role.limits)
    return Actuated(k, (low, high))


def _home(
    joint: TreeJoint, coordinates: Mapping[str, tuple[float, ...]], by_name: Mapping[str, TreeJoint]
) -> tuple[float, ...]:
    """The given coordinates, those that follow from another joint, or those of the tree."""
    root, factor, offset = _leader(joint.name, by_name, coordinates)
    leader = by_name.get(root, joint)
    others = (0.0,) * (len(_DIMENSIONS.get(leader.type, (_TURN,))) - 1)
    given = coordinates.get(root, (leader.home, *others))
    return given if leader is joint else tuple(factor * value + offset for value in given)


def _role(place: Place, entry: WrittenTreeJoint, joint: TreeJoint) -> Role:
    """The role in the side file; otherwise that of the tree."""
    if all(x is None for x in (entry.role, entry.stiffness, entry.limits, entry.inertia)):
        return joint.role
    word = entry.role
    if word is None:
        moves_freely = entry.stiffness is None and isinstance(joint.role, Passive)
        word = "passive" if moves_freely else "actuated"
    drive = WrittenDrive(
        role=word, stiffness=entry.stiffness, limits=entry.limits, inertia=entry.inertia
    )
    role = drive.build_role(place, _DIMENSIONS[joint.type])
    if isinstance(role, Actuated) and isinstance(joint.role, Actuated):
        k = joint.role.stiffness if role.stiffness is None else role.stiffness
        role = replace(role, stiffness=k, limits=role.limits or joint.role.limits)
    return role


def _beside(role: Role, joint: TreeJoint, place: Place | RigidTree) -> Role:
    """The role of a joint with its spring beside the drive or lock, or alone."""
    if not joint.spring or role == Locked():
        return role
    k = None if isinstance(role, Passive) else role.stiffness
    if isinstance(k, StiffnessLaw):
        raise place.error(
            f"stiffness of {joint.name!r} by its coordinate",
            got=Words(f"a drive beside a spring of {joint.spring:g}"),
            expected="one law of both, and spring: 0",
        )
    k = joint.spring if k is None else k + joint.spring
    return Actuated(k) if isinstance(role, Passive) else replace(role, stiffness=k)
