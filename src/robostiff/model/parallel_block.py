"""Branches in parallel inside a chain: a parallelogram, a closed loop, a robot within a robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robostiff.errors import InputError
from robostiff.model.checks import check_distinct, vector3
from robostiff.spatial import Frame
from robostiff.spatial.formula import Entries

if TYPE_CHECKING:
    from robostiff.model.chain import Chain


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class ParallelBlock:
    """Branches side by side between two bodies of a chain.

    The first branch leads: its end defines the body after the block; the others close on it.

    Attributes
    ----------
    branches : tuple of Branch
        Two or more; each name once.
    name : str

    Raises
    ------
    InputError
        With fewer branches, or two of one name.
    """

    branches: tuple[Branch, ...]
    name: str = "parallel"

    def __post_init__(self) -> None:
        names = [branch.name for branch in self.branches]
        if len(names) < 2:
            raise InputError(
                f"branches of block {self.name!r}",
                got=names,
                expected="at least two",
                hint="elements of a single branch belong into the chain itself",
            )
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
        raise InputError(
            f"across of {name!r}",
            got=across,
            expected="a vector from the first bar to the second",
            hint="two bars in one place are one bar of twice the stiffness",
        )
    identity = np.eye(3, dtype=int) if shift.dtype == object else np.eye(3)
    sides = [Frame(identity, -shift / 2), Frame(identity, shift / 2)]
    return ParallelBlock(
        tuple(Branch(f"bar{i + 1}", side, chain, side) for i, side in enumerate(sides)), name
    )
