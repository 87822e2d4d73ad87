"""Stiffness of tensioned cables is the rate of their wrench; that of their energy is in robots."""

from dataclasses import replace

import numpy as np
import pytest

from robostiff.cables import (
    PlacedCables,
    elastic_stiffness,
    force_stiffness,
    geometric_stiffness,
    weight_stiffness,
    weight_wrench,
    wrench_derivative,
)
from robostiff.spatial import Space
from robostiff.spatial.rotation import matrix_of_rotation
from tests.cables.machines import pulled, random_placed


def whole(placed, axial, tensions):
    return (
        elastic_stiffness(placed, axial)
        + geometric_stiffness(placed, tensions)
        + weight_stiffness(placed)
    )


def moved(placed: PlacedCables, x: np.ndarray) -> PlacedCables:
    """Displaced by a translation of the reference point and then a turn about it (6,)."""
    p, R = placed.reference_point + x[:3], matrix_of_rotation(x[3:])
    attachments, weight = p + placed.arms @ R.T, p + R @ placed.weight_arm
    return replace(placed, attachments=attachments, reference_point=p, weight_point=weight)


@pytest.mark.parametrize("seed", range(5))
def test_derivative_of_the_wrench(seed):
    placed, axial, tensions = random_placed(seed)

    def holding(now: PlacedCables) -> np.ndarray:
        """The wrench that must be applied to hold the platform there."""
        pulls = np.maximum(tensions + axial * (now.lengths - placed.lengths), 0.0)
        return -(pulled(now, pulls) + weight_wrench(now))

    K = wrench_derivative(whole(placed, axial, tensions), holding(placed))
    step = 1e-5
    found = np.stack(
        [
            (holding(moved(placed, step * x)) - holding(moved(placed, -step * x))) / (2 * step)
            for x in np.eye(6)
        ],
        axis=-1,
    )
    np.testing.assert_allclose(K, found, rtol=1e-6, atol=1e-7 * np.abs(found).max())
    assert np.abs(K - K.T).max() > 1e-6 * np.abs(K).max()  # a moment is held


def test_planar_matrix_is_part_of_the_spatial_one():
    rng = np.random.default_rng(5)
    exits, ends = rng.uniform(-2, 2, (4, 3)), rng.uniform(-0.3, 0.3, (4, 3))
    exits[:, 2] = ends[:, 2] = 0
    reference, force, at = (
        np.array([0.1, 0.2, 0]),
        np.array([5.0, -80, 0]),
        np.array([0.1, -0.3, 0]),
    )
    args = (exits, ends, reference, force, at)
    spatial, planar = PlacedCables(*args, Space.SPATIAL), PlacedCables(*args, Space.PLANAR)
    axial, tensions = rng.uniform(1e4, 1e5, 4), rng.uniform(10, 100, 4)
    rows = np.ix_([0, 1, 5], [0, 1, 5])
    np.testing.assert_allclose(
        whole(planar, axial, tensions), whole(spatial, axial, tensions)[rows], rtol=1e-14
    )
    v, held = np.array([0.4, -0.1, 0]), np.array([3.0, 4.0, 0])
    in_plane, in_space = (force_stiffness(held, v, own.space) for own in (planar, spatial))
    np.testing.assert_allclose(in_plane, in_space[rows], rtol=1e-12)
