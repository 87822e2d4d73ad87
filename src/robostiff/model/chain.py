"""A chain of elements from base to platform."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.model.checks import coordinate_array
from robostiff.model.coupled_joints import Coupling, Transmission, transmission
from robostiff.model.joint import Joint, Locked, Role
from robostiff.model.link import Link, Rigid, Telescope
from robostiff.model.parallel_block import ParallelBlock
from robostiff.spatial import CoupledScrew, Screw
from robostiff.spatial.formula import is_formula

Element = Rigid | Link | Joint | Telescope | ParallelBlock

_ROUNDING = 1e-9  # of a home coordinate


@dataclass(frozen=True)
class Chain:
    """Elements in series, from base to platform.

    Attributes
    ----------
    elements : tuple of Rigid, Link, Joint, Telescope or ParallelBlock
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
            raise InputError("chain", got="no element", expected="at least one element")
        object.__setattr__(self, "couplings", tuple(self.couplings))
        if self.couplings:
            _ = self.home

    @property
    def is_coupled(self) -> bool:
        """Whether it, or a branch in it, has couplings."""
        return bool(self.couplings) or any(
            branch.chain.is_coupled
            for element in self.elements
            if isinstance(element, ParallelBlock)
            for branch in element.branches
        )

    @cached_property
    def own_places(self) -> tuple[int, ...]:
        """Places of the coordinates of its own joints, those of parallel blocks left out."""
        places, start = [], 0
        for element in self.elements:
            size = 0
            if isinstance(element, ParallelBlock):
                start += sum(branch.chain.size for branch in element.branches)
            elif isinstance(element, Joint | Telescope):
                size = element.size if isinstance(element, Joint) else 1
            places += range(start, start + size)
            start += size
        return tuple(places)

    @cached_property
    def transmission(self) -> Transmission | None:
        """How its own coordinates move its own joints, by their places in it; None where alike."""
        if not self.couplings:
            return None
        joints: dict[str, tuple[int, Joint | Telescope]] = {}
        for element, place in _own_moving(self.elements):
            if element.name in joints and any(
                element.name == name for own in self.couplings for name, _ in own.terms
            ):
                raise InputError(
                    "name of a coupled joint", got=element.name, expected="each name once"
                )
            joints[element.name] = place, element
        return transmission(joints, len(self.own_places), self.couplings)

    @cached_property
    def joint_motions(self) -> np.ndarray | None:
        """T, motions (size, size) of all joints for each coordinate; None where they are equal."""
        if not self.is_coupled:
            return None
        own = self.transmission
        of_blocks = []
        start = 0
        for element in self.elements:
            if isinstance(element, ParallelBlock):
                for branch in element.branches:
                    inner = branch.chain.joint_motions
                    if inner is not None:
                        of_blocks.append((start, inner))
                    start += branch.chain.size
            elif isinstance(element, Joint | Telescope):
                start += element.size if isinstance(element, Joint) else 1
        parts = [T for _, T in of_blocks] + ([] if own is None else [own.T])
        exact = any(T.dtype == object for T in parts)
        T = np.eye(self.size, dtype=int).astype(object) if exact else np.eye(self.size)
        if own is not None:
            T[np.ix_(self.own_places, self.own_places)] = own.T
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
        return tuple(self._moving())

    def _moving(self) -> Iterator[tuple[Joint | Telescope, slice]]:
        start = 0
        for element in self.elements:
            if isinstance(element, Joint | Telescope):
                size = element.size if isinstance(element, Joint) else 1
                yield element, slice(start, start + size)
                start += size
            elif isinstance(element, ParallelBlock):
                for branch in element.branches:
                    for inner, place in branch.chain.moving:
                        yield inner, slice(start + place.start, start + place.stop)
                    start += branch.chain.size

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
        plain = np.eye(self.size, dtype=bool)
        moves_others = np.any((plain.astype(int) != T), axis=0)
        return tuple(
            CoupledScrew(screw.axis, screw.point, screw.pitch) if coupled else screw
            for screw, coupled in zip(screws, moves_others, strict=True)
        )

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Name of each coordinate: the joint's, ``block/branch/joint`` inside a parallel block.

        That of a sum of joints that a drive moves is the name of its coupling.
        """
        names = list(self.joint_names)
        for i, own in self._driven_sums():
            names[i] = own
        return tuple(names)

    def _driven_sums(self, prefix: str = "", start: int = 0) -> Iterator[tuple[int, str]]:
        """Places and names of couplings that a drive moves, those inside of blocks included."""
        if self.transmission is not None:
            for i, own in self.transmission.sums.items():
                if not isinstance(own.role, Locked):
                    yield start + self.own_places[i], prefix + own.name
        for element in self.elements:
            if isinstance(element, ParallelBlock):
                for branch in element.branches:
                    yield from branch.chain._driven_sums(
                        f"{prefix}{element.name}/{branch.name}/", start
                    )
                    start += branch.chain.size
            elif isinstance(element, Joint | Telescope):
                start += element.size if isinstance(element, Joint) else 1

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Name of each motion of a joint, as those of coordinates."""
        return tuple(self._joint_names(""))

    def _joint_names(self, prefix: str) -> Iterator[str]:
        for element in self.elements:
            if isinstance(element, ParallelBlock):
                for branch in element.branches:
                    own = f"{prefix}{element.name}/{branch.name}/"
                    yield from branch.chain._joint_names(own)
            elif isinstance(element, Joint) and element.size > 1:
                yield from (f"{prefix}{element.name}[{i}]" for i in range(element.size))
            elif isinstance(element, Joint | Telescope):
                yield prefix + element.name

    @cached_property
    def size(self) -> int:
        """Number of coordinates."""
        return sum(place.stop - place.start for _, place in self.moving)

    @property
    def home(self) -> np.ndarray:
        """Coordinates in the home configuration, (size,) [m, rad]; objects if one is a formula."""
        home: list[Any] = []
        for element in self.elements:
            if isinstance(element, ParallelBlock):
                home.extend(x for branch in element.branches for x in branch.chain.home)
            elif isinstance(element, Joint):
                home.extend(element.home)
            elif isinstance(element, Telescope):
                home.append(element.home)
        q = coordinate_array(home)
        return q if self.transmission is None else self._coupled_home(q, self.transmission)

    def _coupled_home(self, q: np.ndarray, own: Transmission) -> np.ndarray:
        """Coordinates with those of couplings in them, from home coordinates of the joints."""
        places = list(self.own_places)
        given = q[places]
        p = given.copy() if given.dtype == object else given.astype(object)
        for i, one in own.sums.items():
            p[i] = own.A[i] @ given if one.home is None else one.home
        p = coordinate_array(p.tolist())
        reached = own.T @ p
        for element, i in _own_moving(self.elements):
            if i not in own.sums or not element.home_given:
                continue
            apart = reached[i] - given[i]
            if not is_formula(apart) and abs(apart) > _ROUNDING * max(1.0, abs(given[i])):
                names = ", ".join(repr(one.name) for one in self.couplings)
                unit = element.freedoms[0].unit
                raise InputError(
                    f"home of joint {element.name!r}",
                    got=f"{given[i]:.6g} {unit}",
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
        for element in self.elements:
            if isinstance(element, ParallelBlock):
                roles += [role for branch in element.branches for role in branch.chain.roles]
            elif isinstance(element, Joint | Telescope):
                roles += [element.role] * (element.size if isinstance(element, Joint) else 1)
        if self.transmission is not None:
            for i, own in self.transmission.sums.items():
                roles[self.own_places[i]] = own.role
        return tuple(roles)

    @property
    def free(self) -> np.ndarray:
        """Which coordinates may change, (size,) bool: all but the locked."""
        return np.array([not isinstance(role, Locked) for role in self.roles], dtype=bool)

    @property
    def home_given(self) -> np.ndarray:
        """Which home coordinates were given, (size,) bool."""
        given = [
            bool(element.home_given)
            for element, place in self.moving
            for _ in range(place.start, place.stop)
        ]
        return np.array(given, dtype=bool)

    @property
    def has_blocks(self) -> bool:
        """Whether it holds a parallel block."""
        return any(isinstance(element, ParallelBlock) for element in self.elements)

    @property
    def main_places(self) -> np.ndarray:
        """Places of the coordinates that lead to its end: of each block, the first branch's."""
        return np.array(list(self._main_places()), dtype=int)

    def _main_places(self) -> Iterator[int]:
        start = 0
        for element in self.elements:
            if isinstance(element, ParallelBlock):
                yield from (start + place for place in element.branches[0].chain._main_places())
                start += sum(branch.chain.size for branch in element.branches)
            elif isinstance(element, Joint | Telescope):
                size = element.size if isinstance(element, Joint) else 1
                yield from range(start, start + size)
                start += size

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
        held = any(own.role.stiffness is not None for own in self.couplings)
        return held or any(is_elastic(element) for element in self.elements)


def _own_moving(elements: Sequence[Element]) -> Iterator[tuple[Joint | Telescope, int]]:
    """Joints and telescopes of a chain, with the places of their first coordinates among its own.

    Those of parallel blocks are left out.
    """
    place = 0
    for element in elements:
        if isinstance(element, Joint | Telescope):
            yield element, place
            place += element.size if isinstance(element, Joint) else 1


def is_elastic(element: Element | None) -> bool:
    """Whether an element of a chain, or a branch of it, has a compliance."""
    if isinstance(element, ParallelBlock):
        return any(branch.chain.has_compliance for branch in element.branches)
    if isinstance(element, Link):
        return bool(np.any(element.elasticity.compliance))
    if isinstance(element, Telescope) and element.beams:
        return True
    return getattr(getattr(element, "role", None), "stiffness", None) is not None
