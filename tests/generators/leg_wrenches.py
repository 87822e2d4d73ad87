"""Legs of slender beams, drives of any stiffness and passive joints, at random."""

from __future__ import annotations

import numpy as np

import robostiff as rs
from robostiff.elasticity import Elasticity
from robostiff.model import PlacedElement, PlacedFreedom, PlacedLeg, PlacedSpring, Role
from tests.generators.chains import beam_compliance_of, drawn_pitch, random_rotation


def random_beam(rng: np.random.Generator, slenderness: float, name: str = "beam") -> PlacedSpring:
    """A beam of 0.3 to 1 m somewhere; `slenderness` is its radius over its length."""
    length = rng.uniform(0.3, 1.0)
    radius = slenderness * length
    EA, EI = 2.1e11 * np.pi * radius**2, 2.1e11 * np.pi * radius**4 / 4
    C = beam_compliance_of(length, EA, EI, EI, EI / 1.3)
    return PlacedSpring(name, rng.uniform(-1, 1, 3), random_rotation(rng), Elasticity(C))


def passive_joint(rng: np.random.Generator, name: str = "joint") -> PlacedFreedom:
    return _joint(rng, name, rs.Passive(), 0.2, 0.4)


def drive(rng: np.random.Generator, stiffness: float, name: str = "drive") -> PlacedFreedom:
    return _joint(rng, name, rs.Actuated(stiffness), 0.5, 0.7)


def _joint(rng: np.random.Generator, name: str, role: Role, *shares: float) -> PlacedFreedom:
    axis = rng.normal(size=3)
    pitch = drawn_pitch(rng.uniform(), *shares)
    unit = axis / np.linalg.norm(axis)
    return PlacedFreedom(unit, rng.uniform(-1, 1, 3), pitch, name, role)


def robot_of(legs: list[list[PlacedElement]], rng: np.random.Generator) -> rs.Snapshot:
    """Legs of these elements that meet at a random point."""
    end = rng.uniform(-1, 1, 3)
    placed = tuple(PlacedLeg(f"leg{i}", tuple(own), end) for i, own in enumerate(legs))
    return rs.Snapshot("random", placed, end)
