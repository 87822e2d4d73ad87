"""Maps as datasets: poses, quantities, dimensions, units, statuses and selection."""

import json
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff import Axis, Grid, PoseList, Quantity, RandomPoses
from robostiff.analysis.maps.evaluator import DirectForm, MapEvaluator
from robostiff.analysis.maps.job import MapJob, MapSummary, Partition
from robostiff.analysis.maps.map import MapArrays
from robostiff.analysis.maps.pose_columns import pose_columns
from robostiff.analysis.measures import stiffness_indices, symmetric_eigenvalues
from robostiff.errors import InputError
from tests.analysis.maps.robots import values_at


def test_dimensions_coordinates_and_units():
    found = rs.stiffness_map(
        rs.load("hexapod"),
        Grid(rz=Axis(-0.1, 0.1, 3), x=Axis(0, 0.05, 2)),
        [Quantity.PRINCIPAL_STIFFNESS, Quantity.STIFFNESS],
    )
    assert found.K.dims == ("rz", "x", "row", "column")
    assert list(found.row.values) == ["Fx", "Fy", "Fz", "Mx", "My", "Mz"]
    assert found.x.attrs["units"] == "m"
    assert found.rz.attrs["units"] == "rad"
    assert found.translational_stiffness.attrs["units"] == "N/m"
    K = found.K.sel(rz=0.1, x=0.05).values
    np.testing.assert_allclose(
        K, rs.stiffness(rs.load("hexapod"), [0.05, 0, 0.9, 0, 0, 0.1]).K, rtol=1e-9, atol=1e-3
    )
    low, high = found.translational_stiffness.attrs["actual_range"]
    assert low == found.translational_stiffness.min()
    assert high == found.translational_stiffness.max()
    assert found.attrs["robot"] == "hexapod"
    assert found.attrs["robostiff_version"] == rs.__version__
    assert found.attrs["poses"] == 6


def test_status_tells_where_there_is_no_answer():
    found = rs.stiffness_map(rs.load("3-puu"), Grid(x=Axis(-0.9, 0.9, 19)))
    masks, words = found.status.attrs["flag_masks"], found.status.attrs["flag_meanings"].split()
    flag = masks[words.index("unreachable")]
    unreachable = (found.status & flag) != 0
    assert 0 < int(unreachable.sum()) < 19
    np.testing.assert_array_equal(
        np.isnan(found.translational_stiffness).any("principal_translation"), unreachable
    )
    np.testing.assert_array_equal(found["rank"] == -1, unreachable)
    assert found.attrs["poses_reachable"] == 19 - int(unreachable.sum())
    assert sum(json.loads(found.attrs["statuses"]).values()) == 19


def test_time_runs_along_a_trajectory():
    poses = PoseList(["x", "z"], [[0, 0.9], [0.01, 0.91], [0.02, 0.9]], time=[0, 0.5, 1.5])
    found = rs.stiffness_map(
        rs.load("hexapod"), poses, [Quantity.DEFLECTION], wrench=[0, 0, -100, 0, 0, 0]
    )
    assert found.displacement.dims == ("pose", "displacement_axis")
    np.testing.assert_array_equal(found.time, [0, 0.5, 1.5])
    np.testing.assert_array_equal(found.x, [0, 0.01, 0.02])
    assert {"x", "z", "time"} <= set(found.coords)
    bent = rs.deflection(rs.load("hexapod"), [0.01, 0, 0.91, 0, 0, 0], [0, 0, -100, 0, 0, 0])
    np.testing.assert_allclose(
        found.displacement.sel(displacement_axis="dz")[1], bent.twist[2], rtol=1e-6
    )


def test_where_leaves_poses_out_and_does_not_touch_the_others():
    robot, grid = rs.load("hexapod"), Grid(x=Axis(-0.1, 0.1, 9), y=Axis(-0.1, 0.1, 9))
    whole = rs.stiffness_map(robot, grid)
    disc = rs.stiffness_map(
        robot, grid, where=lambda pose: pose["x"] ** 2 + pose["y"] ** 2 <= 0.1**2 + 1e-12
    )
    inside = whole.x**2 + whole.y**2 <= 0.1**2 + 1e-12
    assert disc.attrs["poses_computed"] == int(inside.sum()) == 49
    np.testing.assert_array_equal(disc.status, np.where(inside, 0, 256))
    np.testing.assert_array_equal(disc["rank"], np.where(inside, 6, -1))
    np.testing.assert_allclose(
        disc.rotational_stiffness, whole.rotational_stiffness.where(inside), rtol=1e-6
    )


def test_where_may_leave_nothing():
    found = rs.stiffness_map(
        rs.load("hexapod"), Grid(x=Axis(0, 0.1, 3)), where=lambda pose: pose["x"] > 1
    )
    assert found.attrs["poses_computed"] == 0
    assert set(found.status.values) == {256}


def test_guarded_poses_are_counted():
    """Of a form with a kernel of its own, which says what it has computed again."""
    robot, poses = rs.load("3-rpr"), RandomPoses(5000, {"x": (-0.05, 0.05)}, seed=2)
    slow = MapEvaluator(robot, pose_columns(robot, poses.names), (Quantity.STIFFNESS,))

    def guarding(asked: MapEvaluator, poses: np.ndarray) -> dict[str, np.ndarray]:
        return {**slow.direct.compute(asked, poses), "guarded": poses[:, 0] > 0}

    job = MapJob(replace(slow, form=DirectForm(guarding, "guarding", 1000)), poses)
    assert len(job.partition) == 5
    arrays = MapArrays(job)
    found = arrays.dataset(sum((arrays.compute(index) for index in range(5)), MapSummary()))
    assert found.attrs["poses_guarded"] == int((found.x > 0).sum()) > 0
    K = values_at(slow, job.poses((slice(None),)))["K"]
    np.testing.assert_allclose(found.K, K, rtol=1e-12)


def test_progress_is_reported_to_the_end():
    reported = []
    poses = RandomPoses(20_000, {"x": (0, 0.1)})
    rs.stiffness_map(rs.load("3-rpr"), poses, method=rs.Batched(), progress=reported.append)
    assert len(reported) > 1
    assert [p.done for p in reported] == sorted(p.done for p in reported)
    assert (reported[-1].done, reported[-1].total) == (20_000, 20_000)
    assert reported[-1].rate > 0


def test_joint_coordinates_choose_the_posture_of_all_poses(tmp_path):
    """As `stiffness` with ``near``; such a map is another map than that of home's posture."""
    robot = rs.load("3-rrr")
    grid = Grid(x=Axis(-0.02, 0.02, 2), rz=Axis(0.05, 0.1, 2))
    near = [own[-1].coordinates for own in rs.postures(robot, [0.0, 0.0, 0.07]).values()]
    wanted = [Quantity.STIFFNESS, Quantity.ACTUATOR_FORCES]
    load: dict[str, Any] = {"wrench": [100.0, 0, 0], "near": near, "store": tmp_path / "near.zarr"}
    found = rs.stiffness_map(robot, grid, wanted, **load)
    pose = [0.02, 0.0, 0.1]
    expected = rs.stiffness(robot, pose, near=near)
    K = found.K.sel(x=0.02, rz=0.1).values
    np.testing.assert_allclose(K, expected.K, rtol=1e-12, atol=1e-3)
    assert np.abs(K / rs.stiffness(robot, pose).K - 1).max() > 1e-2
    bent = rs.deflection(robot, pose, [100.0, 0, 0], near=near)
    forces = sorted(abs(found.actuator_force.sel(x=0.02, rz=0.1).values))
    np.testing.assert_allclose(forces, sorted(abs(f.load) for f in bent.actuators), rtol=1e-6)
    np.testing.assert_allclose(found.attrs["near"], np.concatenate(near))
    other: dict[str, Any] = load | {"near": None}
    with pytest.raises(InputError, match="quantities"):
        rs.stiffness_map(robot, grid, wanted, **other, resume=True)


def test_entries_of_the_matrix_have_units_that_udunits_reads(tmp_path):
    """CF conventions, 3.1: unit names with exponents, separated by blanks; none for a mixture."""
    grid = rs.Grid(x=rs.Axis(0.4, 0.5, 2), y=rs.Axis(0.3, 0.4, 2))
    store = tmp_path / "map.zarr"
    for found in (
        rs.stiffness_map(rs.load("3-rpr"), grid, [rs.Quantity.STIFFNESS]),
        rs.stiffness_map(rs.load("3-rpr"), grid, [rs.Quantity.STIFFNESS], store=store),
    ):
        assert "units" not in found.K.attrs
        assert "K_units" in found.K.coords
        coupled, turning = ["N m-1", "N m-1", "N"], ["N", "N", "N m rad-1"]
        assert found.K_units.values.tolist() == [coupled, coupled, turning]
        stiff = found.K.where(found.K_units == "N m rad-1", drop=True)
        assert (stiff.sizes["row"], stiff.sizes["column"]) == (1, 1)


def test_loads_on_drives_that_turn_and_that_slide_have_a_unit_each():
    axes = rs.Grid(spline=rs.Axis(-0.05, 0, 2))
    forces = [rs.Quantity.ACTUATOR_FORCES]
    found = rs.stiffness_map(rs.load("scara"), axes, forces, wrench=[10, 0, -50, 0, 0, 2])
    assert "units" not in found.actuator_force.attrs
    assert "actual_range" not in found.actuator_force.attrs
    names, units = found.actuator.values, found.actuator_force_units.values
    units = dict(zip(names.tolist(), units.tolist(), strict=True))
    turning = {f"arm/{name}": "N m" for name in ("shoulder", "elbow", "spline")}
    assert units == {**turning, "arm/quill": "N"}


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


@pytest.mark.parametrize(
    ("make", "others"),
    [
        (lambda n=3, **more: Grid(x=Axis(0, 1, n), **more), [{"n": 4}, {"y": Axis(0, 1, 2)}]),
        (
            lambda a=0.0, **more: PoseList("x", np.arange(3.0)[:, None] + a, **more),
            [{"a": 1e-15}, {"time": [0, 1, 2]}],
        ),
        (lambda n=3, **more: RandomPoses(n, {"x": (0, 1)}, **more), [{"n": 4}, {"seed": 1}]),
    ],
)
def test_sources_of_the_same_poses_are_equal(make, others):
    assert make() == pickle.loads(pickle.dumps(make()))  # noqa: S301
    assert len({make(), make()}) == 1
    assert all(make() != make(**other) for other in others)
    assert make() != "x"


def test_random_poses_fill_their_ranges_independently():
    x, rz = rs.RandomPoses(100_000, {"x": (-1, 1), "rz": (2, 5)}, 3).values((slice(None),))
    assert -1 <= x.min() < -0.999
    assert 4.999 < rz.max() <= 5
    np.testing.assert_allclose([x.mean(), rz.mean()], [0, 3.5], atol=0.02)
    assert abs(np.corrcoef(x, rz)[0, 1]) < 0.02
    other = rs.RandomPoses(100_000, {"x": (-1, 1)}, 4).values((slice(None),))[0]
    assert abs(np.corrcoef(x, other)[0, 1]) < 0.02


def test_coordinates_left_out_are_free_or_at_home():
    assert pose_columns(rs.load("3-puu"), ["x"]).names == ("x", "y", "z")
    assert len(pose_columns(rs.load("3-puu"), ["x", "rx"]).names) == 6
    hexapod = pose_columns(rs.load("hexapod"), ["rz"])
    assert hexapod.home == (0, 0, 0.9, 0, 0, 0)
    assert pose_columns(rs.load("two-link-arm"), ["elbow"]).of_joints


# Robot, coordinates, spread about home: regular, free motions, plane, arms, lower mobility.
ROBOTS = [
    ("hexapod", "x", 0.05),
    ("gough-stewart-a", "x", 0.1),
    ("3-rpr-beams", "x", 0.03),
    ("two-link-arm", "elbow", 0.5),
    ("planar-link", "tip", 0.1),
    ("3-puu", "x", 0.3),
    ("capaman", "x", 0.02),  # drives in parallel blocks
    ("h4", "x", 0.05),
]


def evaluated(name, coordinate, spread, count=6):
    robot = rs.load(name)
    columns = pose_columns(robot, [coordinate])
    random = np.random.default_rng(5)
    poses = np.array(columns.home) + random.uniform(-spread, spread, (count, len(columns.home)))
    # Loads that do no work on free motions are distinguished at home alone.
    poses[0] = columns.home
    wrench = tuple([0.0] * (robot.space.translations - 1) + [100.0])
    wrench += tuple([0.0] * (robot.space.size - len(wrench)))
    without = {Quantity.TENSIONS} | ({Quantity.ACTUATOR_FORCES} if name == "planar-link" else set())
    quantities = [q for q in Quantity if q not in without]
    evaluator = MapEvaluator(robot, columns, tuple(quantities), wrench, 0.5)
    return robot, columns, poses, np.array(wrench), values_at(evaluator, poses)


@pytest.mark.parametrize(("name", "coordinate", "spread"), ROBOTS)
def test_every_quantity_is_that_of_the_single_pose(name, coordinate, spread):
    robot, columns, poses, wrench, found = evaluated(name, coordinate, spread)
    d = robot.space.translations
    for i, pose in enumerate(poses):
        one = rs.stiffness(robot, columns.as_pose(pose))
        bent = rs.deflection(robot, columns.as_pose(pose), wrench)
        assert int(bent.status) == found["status"][i]
        assert found["rank"][i] == one.rank
        if not one.status.has_stiffness:
            assert np.all(np.isnan(found["K"][i]))
            assert np.all(np.isnan(found["translational_stiffness"][i]))
            continue
        np.testing.assert_allclose(found["K"][i], one.K, rtol=1e-9, atol=1e-9 * np.abs(one.K).max())
        for variable, block in (
            ("translational_stiffness", one.K[:d, :d]),
            ("rotational_stiffness", one.K[d:, d:]),
        ):
            expected = np.linalg.eigvalsh(block)
            np.testing.assert_allclose(
                found[variable][i], expected, rtol=1e-6, atol=1e-7 * expected[-1]
            )
        if one.compliance is None:
            assert np.isnan(found["worst_deflection"][i])
        else:
            worst = np.linalg.norm(one.compliance[:d, :d], 2)
            np.testing.assert_allclose(found["worst_deflection"][i], worst, rtol=1e-5)
        twist = np.concatenate([found["displacement"][i], found["rotation"][i]])
        if bent.has_answer:
            size = np.abs(bent.twist).max()
            np.testing.assert_allclose(twist, bent.twist, rtol=1e-6, atol=1e-7 * size)
        else:
            assert np.all(np.isnan(twist))
        if bent.has_answer and "actuator_force" in found:
            loads = [actuator.load for actuator in bent.actuators]
            np.testing.assert_allclose(found["actuator_force"][i], loads, rtol=1e-5, atol=1e-4)


@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.floats(-12, 12))
def test_eigenvalues_are_those_of_lapack(seed, n, exponent):
    random = np.random.default_rng(seed)
    B = random.normal(size=(20, n, n)) * 10.0 ** random.uniform(-3, 3, (20, 1, n))
    A = 10.0**exponent * (B @ np.swapaxes(B, 1, 2))
    expected = np.linalg.eigvalsh(A)
    found = symmetric_eigenvalues(A)
    assert np.all(np.abs(found - expected) <= 1e-14 * expected[:, -1:])


@pytest.mark.parametrize(
    ("matrix", "values"),
    [
        (np.zeros((3, 3)), [0, 0, 0]),
        (np.ones((3, 3)), [0, 0, 3]),
        (np.diag([2.0, 1.0, 2.0]), [1, 2, 2]),
        (np.full((3, 3), np.nan), [np.nan] * 3),
    ],
)
def test_eigenvalues_of_special_matrices(matrix, values):
    np.testing.assert_allclose(symmetric_eigenvalues(matrix[None])[0], values, atol=1e-15)


def test_indices_do_not_depend_on_the_unit_of_length():
    K = rs.stiffness(rs.load("hexapod"), [0.05, 0.02, 0.9, 0, 0.1, 0]).K[None]
    to_mm = np.diag([1e3, 1e3, 1e3, 1, 1, 1])
    K_mm = 1e3 * np.linalg.inv(to_mm) @ K @ np.linalg.inv(to_mm)  # works in N mm, not in J
    metres = stiffness_indices(K, np.array([6]), 0.4)
    millimetres = stiffness_indices(K_mm, np.array([6]), 400.0)
    np.testing.assert_allclose(metres["isotropy"], millimetres["isotropy"], rtol=1e-12)
    # N/m against N/mm, six times over
    np.testing.assert_allclose(
        metres["log10_determinant"] - millimetres["log10_determinant"], 18, rtol=1e-9
    )
    np.testing.assert_allclose(
        metres["log10_determinant"],
        np.linalg.slogdet(K / np.outer(s := [1, 1, 1, 0.4, 0.4, 0.4], s))[1] / np.log(10),
    )


def test_a_singular_matrix_has_isotropy_zero_and_no_logarithm():
    K = np.diag([1.0, 1, 1, 1, 1, 0])[None]
    found = stiffness_indices(K, np.array([5]), 1.0)
    assert found["smallest_eigenvalue"] == 0
    assert found["isotropy"] == 0
    assert np.isnan(found["log10_determinant"])
