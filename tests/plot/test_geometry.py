"""Ellipsoids, screws, isosurfaces and plates are what they stand for."""

import numpy as np
import pytest

from robostiff.plot.surfaces import (
    Quality,
    ellipsoid_mesh,
    isosurface,
    plate,
    principal_axes,
    screw_line,
)
from robostiff.spatial import Screw
from tests.plot.machines import held_across_x, hexapod_stiffness

BLOCKS = {
    Quality.COMPLIANCE: ("C", slice(0, 3)),
    Quality.STIFFNESS: ("K", slice(0, 3)),
    Quality.ROTATIONAL_COMPLIANCE: ("C", slice(3, 6)),
    Quality.ROTATIONAL_STIFFNESS: ("K", slice(3, 6)),
}


@pytest.mark.parametrize("quality", Quality, ids=lambda q: q.value)
def test_principal_axes_put_the_block_together_again(quality: Quality):
    result = hexapod_stiffness()
    matrix, part = BLOCKS[quality]
    block = (result.K if matrix == "K" else np.linalg.inv(result.K))[part, part]
    axes = principal_axes(result, quality)
    again = axes.directions.T @ np.diag(axes.lengths) @ axes.directions
    assert again == pytest.approx(block, rel=1e-9, abs=1e-12 * np.abs(block).max())
    assert not np.any(axes.is_free)


def test_free_translation_has_compliance_without_limit_and_stiffness_of_none():
    """Two wires along y and z hold a point, x is free."""
    axes = principal_axes(held_across_x(), Quality.COMPLIANCE)
    assert axes.lengths.tolist() == pytest.approx([1 / 3e6, 1 / 2e6, np.inf])
    assert np.abs(axes.directions) == pytest.approx(np.eye(3)[[2, 1, 0]])
    stiff = principal_axes(held_across_x(), Quality.STIFFNESS)
    assert stiff.lengths.tolist() == pytest.approx([0, 2e6, 3e6])
    assert np.abs(stiff.directions) == pytest.approx(np.eye(3))
    assert stiff.is_free.tolist() == [True, False, False]


@pytest.mark.parametrize("open_axes", [(), (2,), (1, 2)])
def test_points_of_the_surface_obey_its_equation(open_axes: tuple[int, ...]):
    half = np.diag([3.0, 2.0, 1.0])
    vertices, triangles = ellipsoid_mesh(half, open_axes)
    closed = [i for i in range(3) if i not in open_axes]
    assert np.sum((vertices[:, closed] / np.diag(half)[closed]) ** 2, axis=1) == pytest.approx(1.0)
    assert triangles.min() == 0
    assert triangles.max() == len(vertices) - 1


@pytest.mark.parametrize("pitch", [0.0, 0.02, -0.3])
def test_way_of_a_screw_is_that_of_a_point_that_turns_and_advances(pitch: float):
    e = np.array([1.0, 2, 2]) / 3
    point = np.array([0.3, -0.1, 0.2])
    screw = Screw(e, point, pitch)
    axis, way = screw_line(screw, np.array([1.0, 1, 1]), 0.5)
    steps = np.diff(way, axis=0)
    middle = (way[1:] + way[:-1]) / 2
    # the velocity of each point is that of the screw: w x (p - point) + pitch w
    velocity = np.cross(e, middle - point) + pitch * e
    rate = np.linalg.norm(steps[0]) / np.linalg.norm(velocity[0])
    assert steps == pytest.approx(rate * velocity, abs=2e-3 * rate * np.abs(velocity).max())
    along = way @ e
    assert np.ptp(along) <= 2 * 0.5 + 1e-12
    assert np.cross(axis[1] - axis[0], e) == pytest.approx(np.zeros(3), abs=1e-12)
    assert np.cross(axis[0] - point, e) == pytest.approx(np.zeros(3), abs=1e-12)


def test_isosurface_of_a_distance_is_a_closed_sphere():
    line = np.linspace(-1.2, 1.2, 25)
    x, y, z = np.meshgrid(line, line, line, indexing="ij")
    vertices, triangles = isosurface(np.sqrt(x**2 + y**2 + z**2), 0.987, (line, line, line))
    assert np.linalg.norm(vertices, axis=1) == pytest.approx(0.987, abs=5e-3)
    p = vertices[triangles]
    area = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum()
    assert area == pytest.approx(4 * np.pi * 0.987**2, rel=0.01)
    # closed: every edge belongs to two triangles
    corners = np.round(p / 1e-9).astype(np.int64)
    edges: dict[frozenset[tuple[int, ...]], int] = {}
    for one in corners:
        names = [tuple(corner) for corner in one]
        for a, b in ((0, 1), (1, 2), (2, 0)):
            edge = frozenset((names[a], names[b]))
            if len(edge) == 2:
                edges[edge] = edges.get(edge, 0) + 1
    assert set(edges.values()) == {2}


def test_isosurface_ends_where_there_are_no_values():
    line = np.linspace(0, 1, 5)
    values = np.broadcast_to(line, (5, 5, 5)).copy()
    values[:3] = np.nan
    vertices, _ = isosurface(values, 0.4, (line, line, line))
    assert vertices[:, 0].min() == line[3]
    assert len(isosurface(np.full((5, 5, 5), np.nan), 0.4, (line, line, line))[0]) == 0


def test_plate_goes_around_in_order_and_needs_an_area():
    angle = np.random.default_rng(2).permutation(np.linspace(0, 2 * np.pi, 6, endpoint=False))
    corners = np.stack([np.cos(angle), np.sin(angle), np.full(6, 0.3)], axis=1)
    around = plate(corners)
    assert around is not None
    sides = np.linalg.norm(around - np.roll(around, 1, axis=0), axis=1)
    assert sides == pytest.approx(np.ones(6))
    assert plate(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])) is None
    assert plate(corners[:2]) is None
