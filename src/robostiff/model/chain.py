"""A chain of elements from base to platform."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.model.checks import coordinate_array
from robostiff.model.joint import Joint, Locked, Role
from robostiff.model.link import Link, Rigid, Telescope
from robostiff.model.parallel_block import ParallelBlock
from robostiff.spatial import Screw

Element = Rigid | Link | Joint | Telescope | ParallelBlock


@dataclass(frozen=True)
class Chain:
    """Elements in series, from base to platform.

    Attributes
    ----------
    elements : tuple of Rigid, Link, Joint, Telescope or ParallelBlock

    Raises
    ------
    InputError
        When it holds no element.
    """

    elements: tuple[Element, ...]

    def __post_init__(self) -> None:
        if not self.elements:
            raise InputError("chain", got="no element", expected="at least one element")

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
        """The unit screw of each coordinate, in the frame made by those before it."""
        return tuple(screw for element, _ in self.moving for screw in element.freedoms)

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Name of each coordinate: the joint's, ``block/branch/joint`` inside a parallel block."""
        return tuple(self._coordinate_names(""))

    def _coordinate_names(self, prefix: str) -> Iterator[str]:
        for element in self.elements:
            if isinstance(element, ParallelBlock):
                for branch in element.branches:
                    own = f"{prefix}{element.name}/{branch.name}/"
                    yield from branch.chain._coordinate_names(own)
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
        for element, _ in self.moving:
            home.extend(element.home if isinstance(element, Joint) else (element.home,))
        return coordinate_array(home)

    @cached_property
    def roles(self) -> tuple[Role, ...]:
        """Role of each coordinate."""
        return tuple(
            element.role for element, place in self.moving for _ in range(place.start, place.stop)
        )

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
        return Chain(tuple(path))

    @property
    def zero(self) -> np.ndarray:
        """Coordinates all zero, but those of locked joints, which keep home's (size,) [m, rad]."""
        return np.where(self.free, 0.0, self.home)

    @property
    def has_compliance(self) -> bool:
        """Whether any element is elastic."""
        return any(is_elastic(element) for element in self.elements)


def is_elastic(element: Element | None) -> bool:
    """Whether an element of a chain, or a branch of it, has a compliance."""
    if isinstance(element, ParallelBlock):
        return any(branch.chain.has_compliance for branch in element.branches)
    if isinstance(element, Link):
        return bool(np.any(element.elasticity.compliance))
    if isinstance(element, Telescope) and element.beams:
        return True
    return getattr(getattr(element, "role", None), "stiffness", None) is not None
