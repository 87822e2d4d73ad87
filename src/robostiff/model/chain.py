"""A chain of elements from base to platform, and branches in parallel inside it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen, replace
from robostiff.model.checks import check_distinct, coordinate_array, vector3
from robostiff.model.coupled_joints import Coupling, Transmission, transmission
from robostiff.model.joint import Actuated, Joint, Locked, Role
from robostiff.model.link import Link, Rigid, Telescope
from robostiff.spatial import CoupledScrew, Frame, Screw
from robostiff.spatial.formula import Entries, is_formula


@frozen
class Branch:
    """A chain from the body before a block to the body after it.

    Attributes
    ----------
    name : str
    start : Frame
        Where the chain begins, in the frame before the block.
    chain : Chain
    end : Frame
        Where the chain ends, in the frame after the block.
    """

    name: str
    start: Frame
    chain: Chain
    end: Frame

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", Frame.of(self.start))
        object.__setattr__(self, "end", Frame.of(self.end))


@frozen
class ParallelBlock:
    """Branches side by side between two bodies of a chain.

    The first branch leads: its end defines the body after the block; the others close on it.

    Attributes
    ----------
    branches : tuple of Branch
        Two or more; each name once.
    name : str
    robot : Robot or None
        In a machine of modules: what it is by itself, from the frame before it to that after it.

    Raises
    ------
    InputError
        With fewer branches, or two of one name.
    """

    branches: tuple[Branch, ...]
    name: str = "parallel"
    robot: Any = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        names = [branch.name for branch in self.branches]
        if len(names) < 2:
            subject = f"branches of block {self.name!r}"
            hint = "elements of a single branch belong into the chain itself"
            raise InputError(subject, got=names, expected="at least two", hint=hint)
        check_distinct(f"names of the branches of {self.name!r}", names)


def parallelogram(chain: Chain, across: Entries, *, name: str = "parallelogram") -> ParallelBlock:
    """Two copies of a bar with its joints, side by side.

    Parameters
    ----------
    chain : Chain
        One bar, from joint to joint.
    across : (3,) array
        From the first bar to the second, in the frame before the block and in that after it [m];
        both frames lie in the middle.

    Raises
    ------
    InputError
        When `across` is no vector, or the bars lie in one place.

    Examples
    --------
    >>> from robostiff.model import Chain, Passive, Rigid, revolute
    >>> bar = Rigid(Frame(np.eye(3), np.array([0.4, 0.0, 0.0])))
    >>> pins = [revolute([0, 0, 1], Passive(), name=name) for name in ("near pin", "far pin")]
    >>> block = parallelogram(Chain((pins[0], bar, pins[1])), [0, 0.1, 0])
    >>> [branch.start.p[1].item() for branch in block.branches]
    [-0.05, 0.05]
    """
    shift = vector3(f"across of {name!r}", across)
    if not np.any(shift):
        expected = "a vector from the first bar to the second"
        hint = "two bars in one place are one bar of twice the stiffness"
        raise InputError(f"across of {name!r}", got=across, expected=expected, hint=hint)
    identity = np.eye(3, dtype=int) if shift.dtype == object else np.eye(3)
    sides = [Frame(identity, -shift / 2), Frame(identity, shift / 2)]
    return ParallelBlock(
        tuple(Branch(f"bar{i + 1}", side, chain, side) for i, side in enumerate(sides)), name
    )


Element = Rigid | Link | Joint | Telescope | ParallelBlock

_ROUNDING = 1e-9  # of a home coordinate


class _Movable(NamedTuple):
    """What has coordinates: a joint, a telescope, or the chain of a branch."""

    element: Joint | Telescope | Chain
    first: int  # place of its first coordinate
    prefix: str  # block/branch/, in front of names inside
    leads: bool  # to the end; only the first branch of a block does


@frozen
class Chain:
    """Elements in series, from base to platform.

    Attributes
    ----------
    elements : tuple of Rigid, Link, Joint, Telescope or ParallelBlock
        Links, joints and blocks are known by their names; where several have one name, they are
        numbered: three links ``beam`` are ``beam1``, ``beam2`` and ``beam3``. A joint whose name
        no other joint has keeps it.
    couplings : tuple of Coupling
        Gears and differentials between its own joints. Each takes the place of a passive joint
        among the coordinates p of the chain, by which the joints move as ``q = T p``.

    Raises
    ------
    InputError
        When it holds no element, or its couplings or home coordinates contradict one another.
    """

    elements: tuple[Element, ...]
    couplings: tuple[Coupling, ...] = ()

    def __post_init__(self) -> None:
        if not self.elements:
            raise InputError("chain", got=Words("no element"), expected="at least one element")
        object.__setattr__(self, "couplings", tuple(self.couplings))
        # Each element gets a name of its own; joints that have theirs alone keep it.
        coupled = {name for coupling in self.couplings for name, _ in coupling.terms}
        named = [e for e in self.elements if not isinstance(e, Rigid)]
        count = Counter(e.name for e in named)
        moving = Counter(e.name for e in named if isinstance(e, Joint | Telescope))
        unchanged = coupled | {name for name, of_joints in moving.items() if of_joints == 1}
        number = dict.fromkeys((n for n, k in count.items() if k > 1 and n not in coupled), 0)
        elements: list[Element] = []
        for element in self.elements:
            name = element.name
            alone = name in unchanged and isinstance(element, Joint | Telescope)
            if name in number and not alone and not isinstance(element, Rigid):
                while name in count:
                    number[element.name] += 1
                    name = f"{element.name}{number[element.name]}"
                count[name] += 1
            elements.append(element if name == element.name else replace(element, name=name))
        object.__setattr__(self, "elements", tuple(elements))
        if self.couplings:
            _ = self.home
            joints = [element.name for element in self.elements if isinstance(element, Joint)]
            names = [coupling.name for coupling in self.couplings]
            check_distinct("names of couplings and joints", [*names, *dict.fromkeys(joints)])

    @cached_property
    def _parts(self) -> tuple[_Movable, ...]:
        parts: list[_Movable] = []
        start = 0
        for element in self.elements:
            inside: list[tuple[Joint | Telescope | Chain, str]] = []
            if isinstance(element, ParallelBlock):
                inside = [(b.chain, f"{element.name}/{b.name}/") for b in element.branches]
            elif isinstance(element, Joint | Telescope):
                inside = [(element, "")]
            for i, (part, prefix) in enumerate(inside):
                parts.append(_Movable(part, start, prefix, leads=i == 0))
                start += part.size
        return tuple(parts)

    @cached_property
    def size(self) -> int:
        """Number of coordinates."""
        return sum(part.element.size for part in self._parts)

    @property
    def is_coupled(self) -> bool:
        """Whether it, or a branch in it, has couplings."""
        inner = (part.element for part in self._parts if isinstance(part.element, Chain))
        return bool(self.couplings) or any(chain.is_coupled for chain in inner)

    @cached_property
    def own_places(self) -> tuple[int, ...]:
        """Places of the coordinates of its own joints, those of parallel blocks left out."""
        own = (part for part in self._parts if not isinstance(part.element, Chain))
        return tuple(part.first + i for part in own for i in range(part.element.size))

    def _own_moving(self) -> Iterator[tuple[Joint | Telescope, int]]:
        """Its own joints, with the places of their first coordinates among `own_places`."""
        place = 0
        for part in self._parts:
            if not isinstance(part.element, Chain):
                yield part.element, place
                place += part.element.size

    @cached_property
    def transmission(self) -> Transmission | None:
        """How its own coordinates move its own joints, by their places in it; None where alike."""
        if not self.couplings:
            return None
        joints: dict[str, tuple[int, Joint | Telescope]] = {}
        coupled = {name for coupling in self.couplings for name, _ in coupling.terms}
        for element, place in self._own_moving():
            if element.name in joints and element.name in coupled:
                subject = "name of a coupled joint"
                raise InputError(subject, got=element.name, expected="each name once")
            joints[element.name] = place, element
        return transmission(joints, len(self.own_places), self.couplings)

    @cached_property
    def joint_motions(self) -> np.ndarray | None:
        """T, motions (size, size) of all joints for each coordinate; None where they are equal."""
        if not self.is_coupled:
            return None
        gears = self.transmission
        chains = [(p.first, p.element) for p in self._parts if isinstance(p.element, Chain)]
        motions = [(first, chain.joint_motions) for first, chain in chains]
        of_blocks = [(first, T) for first, T in motions if T is not None]
        parts = [T for _, T in of_blocks] + ([] if gears is None else [gears.T])
        exact = any(T.dtype == object for T in parts)
        T = np.eye(self.size, dtype=int).astype(object) if exact else np.eye(self.size)
        if gears is not None:
            T[np.ix_(self.own_places, self.own_places)] = gears.T
        for first, inner in of_blocks:
            T[first : first + len(inner), first : first + len(inner)] = inner
        return T

    def joint_coordinates(self, p: np.ndarray) -> np.ndarray:
        """Coordinates q = T p of all joints (..., size) [m, rad]."""
        T = self.joint_motions
        return p if T is None else p @ T.T

    @cached_property
    def moving(self) -> tuple[tuple[Joint | Telescope, slice], ...]:
        """The elements that have coordinates, with their places in the coordinate vector.

        Those of a parallel block follow one another, branch by branch.
        """
        elements: list[tuple[Joint | Telescope, slice]] = []
        for part, first, _, _ in self._parts:
            if isinstance(part, Chain):
                for inner, at in part.moving:
                    elements.append((inner, slice(first + at.start, first + at.stop)))
            else:
                elements.append((part, slice(first, first + part.size)))
        return tuple(elements)

    @cached_property
    def freedoms(self) -> tuple[Screw, ...]:
        """The unit screw of each coordinate, in the frame made by those before it.

        Of a coordinate that moves several joints it is that of the joint at its place, and no full
        turn brings all back.
        """
        screws = [screw for element, _ in self.moving for screw in element.freedoms]
        T = self.joint_motions
        if T is None:
            return tuple(screws)
        moves_others = np.any(np.eye(self.size, dtype=int) != T, axis=0)
        return tuple(
            CoupledScrew(screw.axis, screw.point, screw.pitch) if coupled else screw
            for screw, coupled in zip(screws, moves_others, strict=True)
        )

    @cached_property
    def coordinate_names(self) -> tuple[str, ...]:
        """Name of each coordinate: the joint's, ``block/branch/joint`` inside a parallel block.

        That of a sum of joints that a drive moves is the name of its coupling.
        """
        names = self._names(lambda chain: chain.coordinate_names)
        if self.transmission is not None:
            for i, coupling in self.transmission.sums.items():
                if not isinstance(coupling.role, Locked):
                    names[self.own_places[i]] = coupling.name
        return tuple(names)

    @property
    def part_names(self) -> tuple[str, ...]:
        """Names of joints, elastic parts and blocks, of parts inside as block/branch/part."""
        names: list[str] = []
        for element in self.elements:
            if not isinstance(element, Rigid):
                names.append(element.name)
            if isinstance(element, ParallelBlock):
                for branch in element.branches:
                    inside = branch.chain.part_names
                    names += [f"{element.name}/{branch.name}/{name}" for name in inside]
        return tuple(names)

    @property
    def in_words(self) -> list[str]:
        """Its elements by name, with the roles of joints and what is in a block.

        Examples
        --------
        >>> from robostiff.robots import load
        >>> load("orthoglide").legs[0].chain.in_words[2]
        'parallelogram 2 x [near pin (passive), bar, far pin (passive)]'
        """
        words = []
        for element in self.elements:
            if isinstance(element, ParallelBlock):
                insides = {branch.name: branch.chain.in_words for branch in element.branches}
                words.append(block_in_words(element.name, insides))
            else:
                moves = isinstance(element, Joint | Telescope)
                role = f" ({type(element.role).__name__.lower()})" if moves else ""
                if isinstance(element, Link) and (free := element.elasticity.freedoms.shape[1]):
                    role = f" ({free} free direction{'s' * (free > 1)})"
                words.append(f"{element.name}{role}")
        of_sums = (f"{c.in_words} ({type(c.role).__name__.lower()})" for c in self.couplings)
        return [*words, *of_sums]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Name of each motion of a joint, as those of coordinates."""
        return tuple(self._names(lambda chain: chain.joint_names))

    def _names(self, of_chain: Callable[[Chain], tuple[str, ...]]) -> list[str]:
        names: list[str] = []
        for part, _, prefix, _ in self._parts:
            if isinstance(part, Chain):
                names += [prefix + name for name in of_chain(part)]
            elif part.size > 1:
                names += [f"{part.name}[{i}]" for i in range(part.size)]
            else:
                names.append(part.name)
        return names

    @property
    def home(self) -> np.ndarray:
        """Coordinates in the home configuration, (size,) [m, rad]; objects if one is a formula."""
        home: list[Any] = []
        for element, *_ in self._parts:
            home += [element.home] if isinstance(element, Telescope) else list(element.home)
        q, gears, places = coordinate_array(home), self.transmission, list(self.own_places)
        if gears is None:
            return q
        q_own = q[places]
        p = q_own.copy() if q_own.dtype == object else q_own.astype(object)
        for i, coupling in gears.sums.items():
            p[i] = gears.A[i] @ q_own if coupling.home is None else coupling.home
        p = coordinate_array(p.tolist())
        reached = gears.T @ p
        for element, i in self._own_moving():
            if i not in gears.sums or not element.home_given:
                continue
            apart = reached[i] - q_own[i]
            if not is_formula(apart) and abs(apart) > _ROUNDING * max(1.0, abs(q_own[i])):
                names = ", ".join(repr(coupling.name) for coupling in self.couplings)
                unit = element.freedoms[0].unit
                raise InputError(
                    f"home of joint {element.name!r}",
                    got=f"{q_own[i]:.6g} {unit}",
                    expected=f"{reached[i]:.6g} {unit}, to which it is held by {names}",
                    hint="leave it out, or change the offset of the coupling",
                )
        whole = q.astype(np.result_type(q, p))
        whole[places] = p
        return whole

    @cached_property
    def roles(self) -> tuple[Role, ...]:
        """Role of each coordinate."""
        roles: list[Role] = []
        for part in self._parts:
            element = part.element
            roles += element.roles if isinstance(element, Chain) else [element.role] * element.size
        if self.transmission is not None:
            for i, coupling in self.transmission.sums.items():
                roles[self.own_places[i]] = coupling.role
        return tuple(roles)

    @cached_property
    def limits(self) -> np.ndarray:
        """Lowest and highest coordinates (2, size) [m, rad], infinite where no drive has any."""
        limits = np.tile([[-np.inf], [np.inf]], (1, self.size))
        for i, role in enumerate(self.roles):
            if isinstance(role, Actuated) and role.limits is not None:
                limits[:, i] = role.limits
        return limits

    @property
    def free(self) -> np.ndarray:
        """Which coordinates may change, (size,) bool: all but the locked."""
        return np.array([not isinstance(role, Locked) for role in self.roles], dtype=bool)

    def sizes(self, length: float) -> np.ndarray:
        """Units of its coordinates (size,): 1 rad, of slides a length [m], 0 of the locked."""
        return np.where([screw.turns for screw in self.freedoms], 1.0, length) * self.free

    @property
    def home_given(self) -> np.ndarray:
        """Which home coordinates were given, (size,) bool."""
        flags = [bool(own.home_given) for own, _ in self.moving for _ in range(own.size)]
        return np.array(flags, dtype=bool)

    @cached_property
    def has_blocks(self) -> bool:
        """Whether it holds a parallel block."""
        return any(isinstance(element, ParallelBlock) for element in self.elements)

    @property
    def main_places(self) -> np.ndarray:
        """Places of the coordinates that lead to its end: of each block, the first branch's."""
        places: list[int] = []
        for part, first, _, leads in self._parts:
            if leads:
                inside = part.main_places if isinstance(part, Chain) else range(part.size)
                places += [first + int(i) for i in inside]
        return np.array(places, dtype=int)

    @property
    def main_path(self) -> Chain:
        """The chain with the first branch of each block in place of the block."""
        if not self.has_blocks:
            return self
        path: list[Element] = []
        for element in self.elements:
            if isinstance(element, ParallelBlock):
                first = element.branches[0]
                path += [
                    Rigid(first.start, f"{element.name} start"),
                    *first.chain.main_path.elements,
                    Rigid(first.end.inverse, f"{element.name} end"),
                ]
            else:
                path.append(element)
        return Chain(tuple(path), self.couplings)

    @property
    def zero(self) -> np.ndarray:
        """Coordinates all zero, but those of locked joints, which keep home's (size,) [m, rad]."""
        return np.where(self.free, 0.0, self.home)

    @property
    def has_compliance(self) -> bool:
        """Whether any element is elastic."""
        is_held = any(coupling.role.stiffness is not None for coupling in self.couplings)
        return is_held or any(is_elastic(element) for element in self.elements)


def block_in_words(name: str, insides: Mapping[str, Iterable[str]]) -> str:
    """A parallel block of branches with words for what is in each; equal ones are listed once."""
    called: dict[str, list[str]] = {}
    for branch, words in insides.items():
        called.setdefault(", ".join(words), []).append(branch)
    if len(called) == 1:
        return f"{name} {len(insides)} x [{next(iter(called))}]"
    listed = "; ".join(f"{', '.join(branches)}: {words}" for words, branches in called.items())
    return f"{name} [{listed}]"


def is_elastic(element: Element | None) -> bool:
    """Whether an element of a chain, or a branch of it, has a compliance."""
    if isinstance(element, ParallelBlock):
        return any(branch.chain.has_compliance for branch in element.branches)
    if isinstance(element, Link):
        return bool(np.any(element.elasticity.compliance))
    if isinstance(element, Telescope) and element.beams:
        return True
    return getattr(getattr(element, "role", None), "stiffness", None) is not None
