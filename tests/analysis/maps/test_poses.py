"""Where poses come from: grids, lists, random poses, and how they are cut into blocks."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analysis.maps.job import Partition
from robostiff.analysis.maps.pose_columns import pose_columns
from tests.analysis.maps.robots import loaded

SHAPES = st.lists(st.integers(1, 7), min_size=1, max_size=6).map(tuple)


@given(SHAPES, st.integers(1, 500))
def test_blocks_are_runs_that_cover_the_map_once(shape, most):
    cut = Partition.of(shape, most)
    flat = np.arange(cut.poses).reshape(shape)
    end = 0
    for index in range(len(cut)):
        start, stop = cut.run(index)
        np.testing.assert_array_equal(flat[cut.slices(index)].ravel(), np.arange(start, stop))
        assert start == end
        assert stop - start <= most
        end = stop
    assert end == cut.poses


def test_blocks_are_not_smaller_than_they_must_be():
    assert Partition.of((20,) * 6, 2**20).block == (1, 5, 20, 20, 20, 20)
    assert len(Partition.of((10**9,), 2**20)) == 954


@given(SHAPES, st.integers(1, 100))
def test_blocks_of_a_grid_are_parts_of_the_mesh(shape, most):
    names = ("x", "y", "z", "rx", "ry", "rz")[: len(shape)]
    ends = [(0.5, 0.5) if n == 1 else (-1.0, 2.0) for n in shape]
    grid = rs.Grid(
        {name: rs.Axis(*end, n) for name, end, n in zip(names, ends, shape, strict=True)}
    )
    assert grid.shape == shape
    mesh = np.stack(np.meshgrid(*grid.axis_values().values(), indexing="ij"))
    cut = Partition.of(shape, most)
    part = cut.slices(len(cut) // 2)
    np.testing.assert_array_equal(grid.values(part), mesh[(slice(None), *part)])


@given(st.integers(0, 99), st.integers(1, 100), st.integers(0, 2**63 - 1))
def test_random_poses_do_not_depend_on_the_blocks(start, size, seed):
    poses = rs.RandomPoses(100, {"x": (-1, 1), "rz": (2, 5)}, seed)
    whole = poses.values((slice(0, 100),))
    part = poses.values((slice(start, start + size),))
    np.testing.assert_array_equal(part, whole[:, start : start + size])


def test_random_poses_fill_their_ranges_independently():
    x, rz = rs.RandomPoses(100_000, {"x": (-1, 1), "rz": (2, 5)}, 3).values((slice(None),))
    assert -1 <= x.min() < -0.999
    assert 4.999 < rz.max() <= 5
    np.testing.assert_allclose([x.mean(), rz.mean()], [0, 3.5], atol=0.02)
    assert abs(np.corrcoef(x, rz)[0, 1]) < 0.02
    other = rs.RandomPoses(100_000, {"x": (-1, 1)}, 4).values((slice(None),))[0]
    assert abs(np.corrcoef(x, other)[0, 1]) < 0.02


def test_coordinates_left_out_are_free_or_at_home():
    assert pose_columns(loaded("3-puu"), ["x"]).names == ("x", "y", "z")
    assert len(pose_columns(loaded("3-puu"), ["x", "rx"]).names) == 6
    hexapod = pose_columns(loaded("hexapod"), ["rz"])
    assert hexapod.home == (0, 0, 0.9, 0, 0, 0)
    assert pose_columns(loaded("two-link-arm"), ["elbow"]).of_joints
