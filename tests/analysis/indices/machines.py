"""Robots whose stiffness is known or random, for tests of indices."""

from __future__ import annotations

import numpy as np

import robostiff as rs
from robostiff.analysis import Stiffness
from robostiff.elasticity import elasticity_from_compliance, elasticity_from_stiffness
from robostiff.model import PlacedLeg, PlacedSpring, Snapshot
from robostiff.spatial import Space
from tests.generators.chains import beam_compliance_of, random_rotation, snapshot_of
from tests.generators.robots import strut


def body_on_spring(K: np.ndarray, at: np.ndarray | None = None) -> Stiffness:
    """A platform on one spring of a 6 x 6 stiffness, about its own point."""
    point = np.zeros(3) if at is None else np.asarray(at, dtype=float)
    return _alone(elasticity_from_stiffness(K), point)


def clamped_beam(length: float, turn: np.ndarray) -> tuple[Stiffness, dict[str, float]]:
    """A cantilever from the origin along the first column of `turn`, and its rigidities."""
    E, G, A, Iy, Iz, J = 2e11, 8e10, 4e-4, 2e-8, 5e-8, 3e-8
    rigidities = {"EA": E * A, "GJ": G * J, "EIy": E * Iy, "EIz": E * Iz}
    C = beam_compliance_of(length, **rigidities)
    return _alone(elasticity_from_compliance(C), length * turn[:, 0], turn), rigidities


def random_stiffness(rng: np.random.Generator, size: float = 1e3) -> np.ndarray:
    """A full regular matrix [N/m, N, N m]."""
    A = rng.normal(size=(6, 6))
    scale = np.diag([size] * 3 + [0.3 * size] * 3)
    K = scale @ (A @ A.T + 0.3 * np.eye(6)) @ scale
    return 0.5 * (K + K.T)


def random_body(seed: int) -> Stiffness:
    """A platform on a random full spring, somewhere."""
    rng = np.random.default_rng(seed)
    return body_on_spring(random_stiffness(rng), rng.uniform(-1, 1, 3))


def on_struts(seed: int, number: int) -> Stiffness:
    """A platform on struts between balls: of rank `number` up to six."""
    rng = np.random.default_rng(seed)
    legs = [
        strut(rng, rng.uniform(-1, 1, 3) - [0, 0, 2], rng.uniform(-1, 1, 3)) for _ in range(number)
    ]
    return rs.stiffness(snapshot_of(legs, rng.uniform(-0.5, 0.5, 3)))


def planar_body(seed: int) -> Stiffness:
    """A planar platform on a random spring."""
    rng = np.random.default_rng(seed)
    K = random_stiffness(rng)
    inside, outside = [0, 1, 5], [2, 3, 4]
    K[np.ix_(inside, outside)] = 0.0
    K[np.ix_(outside, inside)] = 0.0
    point = np.append(rng.uniform(-1, 1, 2), 0.0)
    return _alone(elasticity_from_stiffness(K), point, space=Space.PLANAR)


def turned_body(seed: int, R: np.ndarray) -> Stiffness:
    """The body of `random_body`, turned about the world's origin."""
    rng = np.random.default_rng(seed)
    K, point = random_stiffness(rng), rng.uniform(-1, 1, 3)
    return _alone(elasticity_from_stiffness(K), R @ point, R)


def any_rotation(seed: int) -> np.ndarray:
    return random_rotation(np.random.default_rng(seed))


def _alone(elasticity, point, rotation=None, space=Space.SPATIAL) -> Stiffness:
    axes = np.eye(3) if rotation is None else rotation
    leg = PlacedLeg("leg", (PlacedSpring("spring", point, axes, elasticity),), point)
    return rs.stiffness(Snapshot("body", (leg,), point, space))
