"""Random parallel robots as snapshots, of legs that are plain matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robostiff.model import Snapshot
from tests.generators.chains import (
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


def random_robot(rng: np.random.Generator, kind: str, number: int) -> Snapshot:
    """A random parallel robot of a kind.

    Kinds: `struts`, legs between balls; `general`, legs of any joints; `over-constrained`, legs
    with the same parallel axes; `apex`, struts that meet in one point; `soft`, legs of few springs
    beside one full leg.
    """
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
    return snapshot_of(legs, reference)
