"""Random parallel robots: legs as plain matrices, and the same as a snapshot."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st

from robostiff.model import Snapshot
from tests.generators.chains import (
    SEEDS,
    FreeChain,
    Turning,
    ball,
    random_beam,
    random_block,
    random_joint,
    random_rotation,
    random_single,
    snapshot_of,
)


@dataclass(frozen=True)
class FreeRobot:
    """Legs between a base and a rigid platform."""

    legs: tuple[FreeChain, ...]
    reference: np.ndarray

    @property
    def snapshot(self) -> Snapshot:
        return snapshot_of(list(self.legs), self.reference)


def strut(rng: np.random.Generator, base: np.ndarray, tip: np.ndarray) -> FreeChain:
    """A beam between two balls: the spin about it is redundant."""
    joints = (*ball(base, random_rotation(rng)), *ball(tip, random_rotation(rng)))
    return FreeChain((random_beam(rng),), joints, tip)


def _general_leg(rng: np.random.Generator) -> FreeChain:
    springs = tuple((random_beam, random_block)[rng.integers(2)](rng) for _ in range(2))
    joints = tuple(random_joint(rng) for _ in range(int(rng.integers(0, 6))))
    return FreeChain(springs, joints, rng.uniform(-1, 1, 3))


def _soft_leg(rng: np.random.Generator) -> FreeChain:
    """Fewer springs than six, and turns enough."""
    joints = tuple(replace(random_joint(rng), pitch=0.0) for _ in range(4))
    return FreeChain((random_single(rng), random_single(rng)), joints, rng.uniform(-1, 1, 3))


KINDS_OF_ROBOTS = ("struts", "general", "over-constrained", "apex", "soft")


def random_robot(rng: np.random.Generator, kind: str, number: int) -> FreeRobot:
    """A random parallel robot of a kind; see `robots`."""
    reference = rng.uniform(-0.5, 0.5, 3)
    if kind == "struts":
        legs = [
            strut(rng, rng.uniform(-1, 1, 3) - [0, 0, 2], rng.uniform(-1, 1, 3))
            for _ in range(number + 3)
        ]
    elif kind == "apex":
        apex = rng.uniform(-1, 1, 3)
        legs = []
        for _ in range(number + 2):
            direction = rng.normal(size=3)
            legs.append(strut(rng, apex + 2 * direction, apex + direction))
    elif kind == "over-constrained":
        axis = rng.normal(size=3)
        legs = [
            FreeChain(
                (random_beam(rng),),
                tuple(Turning(0.0, rng.uniform(-1, 1, 3), axis) for _ in range(3)),
                rng.uniform(-1, 1, 3),
            )
            for _ in range(number + 1)
        ]
    elif kind == "soft":
        legs = [_soft_leg(rng) for _ in range(number)] + [_general_leg(rng)]
    else:
        legs = [_general_leg(rng) for _ in range(number)]
    return FreeRobot(tuple(legs), reference)


@st.composite
def robots(draw: st.DrawFn) -> FreeRobot:
    """Random parallel robots.

    Kinds: `struts`, legs between balls; `general`, legs of any joints; `over-constrained`, legs
    with the same parallel axes; `apex`, struts that meet in one point; `soft`, legs of few springs
    beside one full leg.
    """
    rng = np.random.default_rng(draw(SEEDS))
    kind = draw(st.sampled_from(KINDS_OF_ROBOTS))
    return random_robot(rng, kind, draw(st.integers(1, 5)))
