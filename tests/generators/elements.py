"""Random chains of the model: every kind of joint, telescopes, links, turned rigid parts."""

from __future__ import annotations

import numpy as np

import robostiff as rs
from robostiff.elasticity import Material, circle, elasticity_from_stiffness, rectangle
from robostiff.model import Element, Joint, Role, beam_axes
from robostiff.spatial import Frame
from tests.generators.chains import random_block, random_rotation

STEEL = Material.isotropic("steel", E=210e9, poisson_ratio=0.3)
ROD = circle(0.02)
BAR = rectangle(0.02, 0.05)

KINDS = (
    "revolute",
    "prismatic",
    "universal",
    "spherical",
    "cylindrical",
    "planar",
    "telescope",
    "telescope of two",
    "rigid telescope",
    "beam",
    "spring",
    "part",
    "helical",
)


def random_transform(rng: np.random.Generator, shift: float = 0.5) -> Frame:
    """A shift and a turn in any direction."""
    p = rng.uniform(-shift, shift, 3)
    return Frame(random_rotation(rng), p)


def shift_by(*xyz: float) -> Frame:
    """A shift without a turn."""
    return Frame(np.eye(3), np.array(xyz, dtype=float))


def random_role(rng: np.random.Generator) -> Role:
    k = 10 ** rng.uniform(4, 7)
    roles: list[Role] = [rs.Passive(), rs.Actuated(), rs.Actuated(k), rs.Locked(), rs.Locked(k)]
    return roles[rng.integers(len(roles))]


def random_joint_of(kind: str, rng: np.random.Generator, role: Role) -> Joint:
    a, b = rng.normal(size=(2, 3))
    home = rng.uniform(-0.8, 0.8, 3).tolist()
    match kind:
        case "revolute":
            return rs.revolute(a, role, home=home[:1])
        case "prismatic":
            return rs.prismatic(a, role, home=home[:1])
        case "helical":
            return rs.helical(a, rng.uniform(0.02, 0.4) * rng.choice([-1, 1]), role, home=home[:1])
        case "universal":
            return rs.universal(a, b, role, home=home[:2])
        case "spherical":
            return rs.spherical(role, home=home)
        case "cylindrical":
            return rs.cylindrical(a, role, home=home[:2])
        case _:
            return rs.planar(a, role, home=home)


def random_telescope(rng: np.random.Generator, role: Role, beams: int) -> rs.Telescope:
    direction = rng.normal(size=3)
    direction = direction / np.linalg.norm(direction)
    axes = beam_axes(direction, rng.normal(size=3))
    shares = [1.0] if beams == 1 else [0.25, 0.75]
    parts = tuple(
        rs.TelescopicBeam(STEEL, BAR, share, fixed=rng.uniform(0, 0.3)) for share in shares[:beams]
    )
    return rs.Telescope(direction, parts, axes, role, home=rng.uniform(0.2, 0.8))


def random_element(kind: str, rng: np.random.Generator) -> Element:
    match kind:
        case "telescope" | "telescope of two" | "rigid telescope":
            beams = {"telescope": 1, "telescope of two": 2}.get(kind, 0)
            return random_telescope(rng, random_role(rng), beams)
        case "beam":
            return rs.beam_link(rng.uniform(-0.6, 0.6, 3), STEEL, BAR, y_axis=rng.normal(size=3))
        case "spring":
            elasticity = elasticity_from_stiffness(random_block(rng).stiffness)
            return rs.Link(rng.uniform(-0.3, 0.3, 3), elasticity, random_rotation(rng), "spring")
        case "part":
            return rs.Rigid(random_transform(rng))
        case _:
            return random_joint_of(kind, rng, random_role(rng))
