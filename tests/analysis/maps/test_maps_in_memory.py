"""Maps as datasets: dimensions, units, statuses, selection, and refusals."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff import Axis, Grid, PoseList, Quantity, RandomPoses
from robostiff.analysis.maps.evaluator import DirectForm, MapEvaluator
from robostiff.analysis.maps.job import MapJob, MapSummary
from robostiff.analysis.maps.map import MapArrays
from robostiff.analysis.maps.pose_columns import pose_columns
from robostiff.errors import InputError
from tests.analysis.maps.robots import loaded, values_at


def test_dimensions_coordinates_and_units():
    found = rs.stiffness_map(
        loaded("hexapod"),
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
        K, rs.stiffness(loaded("hexapod"), [0.05, 0, 0.9, 0, 0, 0.1]).K, rtol=1e-9, atol=1e-3
    )
    low, high = found.translational_stiffness.attrs["actual_range"]
    assert low == found.translational_stiffness.min()
    assert high == found.translational_stiffness.max()
    assert found.attrs["robot"] == "hexapod"
    assert found.attrs["robostiff_version"] == rs.__version__
    assert found.attrs["poses"] == 6


def test_status_tells_where_there_is_no_answer():
    found = rs.stiffness_map(loaded("3-puu"), Grid(x=Axis(-0.9, 0.9, 19)))
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
        loaded("hexapod"), poses, [Quantity.DEFLECTION], wrench=[0, 0, -100, 0, 0, 0]
    )
    assert found.displacement.dims == ("pose", "displacement_axis")
    np.testing.assert_array_equal(found.time, [0, 0.5, 1.5])
    np.testing.assert_array_equal(found.x, [0, 0.01, 0.02])
    assert {"x", "z", "time"} <= set(found.coords)
    bent = rs.deflection(loaded("hexapod"), [0.01, 0, 0.91, 0, 0, 0], [0, 0, -100, 0, 0, 0])
    np.testing.assert_allclose(
        found.displacement.sel(displacement_axis="dz")[1], bent.twist[2], rtol=1e-6
    )


def test_where_leaves_poses_out_and_does_not_touch_the_others():
    robot, grid = loaded("hexapod"), Grid(x=Axis(-0.1, 0.1, 9), y=Axis(-0.1, 0.1, 9))
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
        loaded("hexapod"), Grid(x=Axis(0, 0.1, 3)), where=lambda pose: pose["x"] > 1
    )
    assert found.attrs["poses_computed"] == 0
    assert set(found.status.values) == {256}


def test_guarded_poses_are_counted():
    """Of a form with a kernel of its own, which says what it has computed again."""
    robot, poses = loaded("3-rpr"), RandomPoses(5000, {"x": (-0.05, 0.05)}, seed=2)
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
    rs.stiffness_map(loaded("3-rpr"), poses, method=rs.Batched(), progress=reported.append)
    assert len(reported) > 1
    assert [p.done for p in reported] == sorted(p.done for p in reported)
    assert (reported[-1].done, reported[-1].total) == (20_000, 20_000)
    assert reported[-1].rate > 0


def test_joint_coordinates_choose_the_posture_of_all_poses(tmp_path):
    """As `stiffness` with ``near``; such a map is another map than that of home's posture."""
    robot = loaded("3-rrr")
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
    with pytest.raises(InputError, match="kernels have the posture of home"):
        rs.stiffness_map(robot, grid, near=near, method=rs.Compiled())
    with pytest.raises(InputError, match="near of '3-rrr'"):
        rs.stiffness_map(robot, grid, near=[1.0])


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
