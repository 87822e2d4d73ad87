"""Legs of slender beams, drives of any stiffness and passive joints, at random."""

from __future__ import annotations

import numpy as np

import robostiff as rs
from robostiff.elasticity import Elasticity
from robostiff.model import PlacedElement, PlacedFreedom, PlacedLeg, PlacedSpring
from tests.generators.chains import drawn_pitch


def beam_compliance(length: float, radius: float, E: float = 2.1e11) -> np.ndarray:
    """Tip of a round Euler-Bernoulli beam, nu = 0.3."""
    A, I = np.pi * radius**2, np.pi * radius**4 / 4
    C = np.diag([1 / A, length**2 / 3 / I, length**2 / 3 / I, 1.3 / I, 1 / I, 1 / I]) * length / E
    C[1, 5] = C[5, 1] = length**2 / (2 * E * I)
    C[2, 4] = C[4, 2] = -C[1, 5]
    return C


def random_frame(rng: np.random.Generator) -> np.ndarray:
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q * np.sign(np.diag(R)) * np.linalg.det(Q * np.sign(np.diag(R)))


def random_beam(rng: np.random.Generator, slenderness: float, name: str = "beam") -> PlacedSpring:
    """A beam of 0.3 to 1 m somewhere; `slenderness` is its radius over its length."""
    length = rng.uniform(0.3, 1.0)
    C = beam_compliance(length, slenderness * length)
    return PlacedSpring(name, rng.uniform(-1, 1, 3), random_frame(rng), Elasticity(C))


def passive_joint(rng: np.random.Generator, name: str = "joint") -> PlacedFreedom:
    axis = rng.normal(size=3)
    pitch = drawn_pitch(rng.uniform(), 0.2, 0.4)
    unit = axis / np.linalg.norm(axis)
    return PlacedFreedom(unit, rng.uniform(-1, 1, 3), pitch, name, rs.Passive())


def drive(rng: np.random.Generator, stiffness: float, name: str = "drive") -> PlacedFreedom:
    axis = rng.normal(size=3)
    pitch = drawn_pitch(rng.uniform(), 0.5, 0.7)
    unit = axis / np.linalg.norm(axis)
    return PlacedFreedom(unit, rng.uniform(-1, 1, 3), pitch, name, rs.Actuated(stiffness))


def robot_of(legs: list[list[PlacedElement]], rng: np.random.Generator) -> rs.Snapshot:
    """Legs of these elements that meet at a random point."""
    end = rng.uniform(-1, 1, 3)
    placed = tuple(PlacedLeg(f"leg{i}", tuple(own), end) for i, own in enumerate(legs))
    return rs.Snapshot("random", placed, end)
