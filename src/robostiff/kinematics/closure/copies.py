"""Blocks whose branches are copies of one another, such as parallelograms: one closes all."""

from __future__ import annotations

import numpy as np

from robostiff.kinematics.frames import PlacedChain, place_chain
from robostiff.model import Branch, Chain, Joint, Locked, ParallelBlock, Telescope
from robostiff.spatial import Screw

_SAME = 1e-9


def copied_places(chain: Chain) -> np.ndarray | None:
    """For each coordinate of a chain the one of its main path that it is equal to, (size,) int.

    That holds where all branches of every block are copies, shifted alike at both ends: while the
    bodies at both ends are not turned against each other, but about the line from copy to copy,
    equal coordinates close the loops. None where a branch is no such copy.
    """
    places: list[int] = []
    main = 0
    for element in chain.elements:
        if isinstance(element, Joint | Telescope):
            size = element.size if isinstance(element, Joint) else 1
            places += range(main, main + size)
            main += size
        elif isinstance(element, ParallelBlock):
            first = element.branches[0]
            for branch in element.branches:
                own = copied_places(branch.chain)
                if own is None or not _is_copy(first, branch):
                    return None
                places += [main + int(place) for place in own]
            main += first.chain.main_places.size
    return np.array(places, dtype=int)


def _is_copy(first: Branch, other: Branch) -> bool:
    if other is first:
        return True
    a, b = first.chain.main_path, other.chain.main_path
    if _kinds(a) != _kinds(b) or a.size != b.size:
        return False
    held = ~a.free
    if np.any(held != ~b.free) or np.any(np.abs(a.home - b.home)[held] > _SAME):
        return False
    one, two = _at_zero(first, a), _at_zero(other, b)
    shift = other.start.p - first.start.p
    size = _SAME * (np.linalg.norm(shift) + np.linalg.norm(one.p - first.start.p) + 1e-300)
    turned = (
        np.abs(other.start.R - first.start.R).max(),
        np.abs(other.end.R - first.end.R).max(),
        np.abs(two.R - one.R).max(),
    )
    shifted = [two.p - one.p - shift]
    for f, g in zip(one.freedoms, two.freedoms, strict=True):
        if not _moves_alike(f, g):
            return False
        if f.turns:
            apart = g.point - f.point - shift
            shifted.append(apart - f.axis * (f.axis @ apart))
    # The body after the block may be turned against the one before.
    longer = np.linalg.norm(other.end.p - first.end.p) - np.linalg.norm(shift)
    apart = max(abs(longer), *(np.linalg.norm(gap) for gap in shifted))
    return bool(max(turned) <= _SAME and apart <= size)


def _moves_alike(one: Screw, other: Screw) -> bool:
    """Whether two screws have the same direction and pitch, wherever they are."""
    if one.turns is not other.turns or np.abs(one.axis - other.axis).max() > _SAME:
        return False
    return not one.turns or bool(abs(one.pitch - other.pitch) <= _SAME * abs(one.pitch))


def _kinds(chain: Chain) -> list[object]:
    """Kinds of the coordinates, independent of their roles."""
    return [
        element.kind if isinstance(element, Joint) else type(element)
        for element, _ in chain.moving
        if not isinstance(element.role, Locked)
    ]


def _at_zero(branch: Branch, path: Chain) -> PlacedChain:
    return place_chain(path, path.zero, branch.start.R, branch.start.p)
