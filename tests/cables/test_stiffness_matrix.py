"""Stiffness of tensioned cables is the second derivative of their energy."""

from dataclasses import replace

import numpy as np
import pytest

from robostiff.cables import (
    PlacedCables,
    elastic_stiffness,
    force_stiffness,
    geometric_stiffness,
    structure_matrix,
    weight_stiffness,
    weight_wrench,
    wrench_derivative,
)
from robostiff.spatial import Space, move_stiffness
from robostiff.spatial.rotation import matrix_of_rotation
from tests.cables.exact_energy import hessian
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


@pytest.mark.parametrize("seed", range(3))
def test_matrix_is_the_second_derivative_of_the_energy(seed):
    placed, axial, tensions = random_placed(seed, cables=4)
    exact = hessian(placed, axial, tensions)
    K = whole(placed, axial, tensions)
    np.testing.assert_allclose(K, exact, rtol=1e-12, atol=1e-12 * np.abs(exact).max())


def test_geometric_part_is_the_second_derivative_of_the_energy_of_endless_soft_cables():
    placed, _, tensions = random_placed(7, cables=3)
    soft = np.full(3, 1e-9)
    exact = hessian(placed, soft, tensions)
    K = geometric_stiffness(placed, tensions) + weight_stiffness(placed)
    np.testing.assert_allclose(K, exact, rtol=1e-10, atol=1e-10 * np.abs(exact).max())


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


@pytest.mark.parametrize("seed", range(5))
def test_matrix_about_another_point(seed):
    placed, axial, tensions = random_placed(seed)
    point = np.random.default_rng(seed).uniform(-1, 1, 3)
    v = point - placed.reference_point
    held = -(pulled(placed, tensions) + weight_wrench(placed))
    there = move_stiffness(whole(placed, axial, tensions), v)
    there = there + force_stiffness(held[:3], v, placed.space)
    direct = whole(placed.about(point), axial, tensions)
    np.testing.assert_allclose(there, direct, rtol=1e-12, atol=1e-12 * np.abs(direct).max())


def test_matrix_in_equilibrium_is_the_derivative_of_the_wrench():
    placed, axial, _ = random_placed(11, cables=8)
    N = np.linalg.svd(structure_matrix(placed))[2][6:]
    placed = replace(placed, weight_force=np.zeros(3))
    tensions = 100 * N[0]  # of any sign: equilibrium is all that counts here
    K = whole(placed, axial, tensions)
    held = -pulled(placed, tensions)
    np.testing.assert_allclose(wrench_derivative(K, held), K, atol=1e-9 * np.abs(K).max())


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


def test_lengthening_is_the_structure_matrix():
    placed, _, _ = random_placed(2)
    step = 1e-6
    found = np.stack(
        [
            (moved(placed, step * x).lengths - moved(placed, -step * x).lengths) / (2 * step)
            for x in np.eye(6)
        ],
        axis=-1,
    )
    np.testing.assert_allclose(-structure_matrix(placed).T, found, atol=1e-9)


def test_torsion_of_a_trifilar_pendulum():
    """Turned about the vertical, three parallel cables give (weight) r^2 / l."""
    r, length, weight = 0.2, 1.5, 300.0
    angles = np.arange(3) * 2 * np.pi / 3
    ends = np.stack([r * np.cos(angles), r * np.sin(angles), np.zeros(3)], axis=-1)
    placed = PlacedCables(
        ends + np.array([0, 0, length]),
        ends,
        np.zeros(3),
        np.array([0, 0, -weight]),
        np.zeros(3),
        Space.SPATIAL,
    )
    K = geometric_stiffness(placed, np.full(3, weight / 3))
    assert K[5, 5] == pytest.approx(weight * r**2 / length, rel=1e-12)
    assert K[0, 0] == pytest.approx(weight / length, rel=1e-12)


@pytest.mark.parametrize("side", [1, -1])
def test_bar_pulled_at_its_ends_stands_and_one_pulled_across_itself_topples(side):
    """Turned by r, each half of the bar changes its cable by a^2 r^2/(2 l) + side a r^2/2."""
    a, far, t = 0.2, 1.0, 100.0
    exits, ends = np.array([[far, 0, 0], [-far, 0, 0]]), np.array([[a, 0, 0], [-a, 0, 0]])
    zero = np.zeros(3)
    placed = PlacedCables(exits, side * ends, zero, zero, zero, Space.PLANAR)
    K = geometric_stiffness(placed, np.full(2, t))
    expected = 2 * t * (a**2 / (far - side * a) + side * a)
    assert K[2, 2] == pytest.approx(expected, rel=1e-12)
    assert (K[2, 2] > 0) == (side > 0)
