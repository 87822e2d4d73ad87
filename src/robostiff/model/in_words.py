"""Short descriptions of robots and of the elements of their legs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from robostiff.model.chain import ParallelBlock
from robostiff.model.joint import Joint
from robostiff.model.link import Telescope
from robostiff.model.snapshot import PlacedBlock

if TYPE_CHECKING:
    from robostiff.model.chain import Chain
    from robostiff.model.joint import Role
    from robostiff.model.snapshot import PlacedElement, PlacedLeg


def elements_in_words(chain: Chain) -> list[str]:
    """The elements of a chain by name, with the roles of joints and what is in a block.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> elements_in_words(load("orthoglide").legs[0].chain)[1:3]
    ['carriage joint (passive)', 'parallelogram 2 x [near pin (passive), bar, far pin (passive)]']
    """
    words = []
    for part in chain.elements:
        if isinstance(part, ParallelBlock):
            insides = {branch.name: elements_in_words(branch.chain) for branch in part.branches}
            words.append(_block(part.name, insides))
        else:
            is_moved = isinstance(part, Joint | Telescope)
            words.append(f"{part.name} ({_role(part.role)})" if is_moved else part.name)
    return words + [f"{own.in_words} ({_role(own.role)})" for own in chain.couplings]


def placed_in_words(leg: PlacedLeg) -> list[str]:
    """The elements of a leg of a snapshot by name, with what is in a block.

    Examples
    --------
    >>> from robostiff.kinematics import find_posture
    >>> from robostiff.robots import load
    >>> placed_in_words(find_posture(load("planar-link")).snapshot.legs[0])
    ['beam', 'tip']
    """
    return [_placed(part, "") for part in leg.elements]


def _role(role: Role) -> str:
    return type(role).__name__.lower()


def _placed(part: PlacedElement, prefix: str) -> str:
    """Without the names of the blocks around it."""
    name = part.name.removeprefix(prefix)
    if not isinstance(part, PlacedBlock):
        return name
    insides = {
        branch.name.removeprefix(f"{part.name}/"): [
            _placed(inner, f"{branch.name}/") for inner in branch.elements
        ]
        for branch in part.branches
    }
    return _block(name, insides)


def _block(name: str, insides: Mapping[str, Iterable[str]]) -> str:
    """A parallel block; branches that are equal are listed once."""
    called: dict[str, list[str]] = {}
    for branch, words in insides.items():
        called.setdefault(", ".join(words), []).append(branch)
    if len(called) == 1:
        return f"{name} {len(insides)} x [{next(iter(called))}]"
    listed = "; ".join(f"{', '.join(own)}: {words}" for words, own in called.items())
    return f"{name} [{listed}]"
