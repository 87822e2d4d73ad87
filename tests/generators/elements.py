"""Frames and rods of random robots."""

from __future__ import annotations

import numpy as np

from robostiff.elasticity import Material, circle, rectangle
from robostiff.spatial import Frame
from tests.generators.chains import random_rotation

STEEL = Material.isotropic("steel", E=210e9, poisson_ratio=0.3)
ROD = circle(0.02)
BAR = rectangle(0.02, 0.05)


def random_transform(rng: np.random.Generator, shift: float = 0.5) -> Frame:
    """A shift and a turn in any direction."""
    p = rng.uniform(-shift, shift, 3)
    return Frame(random_rotation(rng), p)


def shift_by(*xyz: float) -> Frame:
    """A shift without a turn."""
    return Frame(np.eye(3), np.array(xyz, dtype=float))
