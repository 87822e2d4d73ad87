"""Maps by kernels say what maps by the batched form say, and are chosen where they can."""

import numpy as np
import pytest
import xarray

import robostiff as rs
from robostiff import Axis, Batched, Compiled, Grid, Quantity, RandomPoses, Threads
from robostiff.analysis.maps.evaluator import MapEvaluator
from robostiff.analysis.maps.map import checked_job
from robostiff.analysis.maps.pose_columns import joint_columns, pose_columns
from tests.analysis.maps.robots import values_at

OF_K = (Quantity.STIFFNESS, Quantity.PRINCIPAL_STIFFNESS, Quantity.INDICES)
ALL = (*OF_K, Quantity.WORST_DEFLECTION, Quantity.DEFLECTION)
# Robot, quantities, how far from home: out of reach for some, free motions, plane, arms.
ROBOTS = [
    ("hexapod", ALL, 0.4),
    ("3-puu", ALL, 0.2),
    ("3-rpr-beams", ALL, 0.4),
    ("3-rrr", ALL, 0.3),
    ("tripteron", ALL, 0.2),
    ("gough-stewart-a", OF_K, 0.3),
    ("planar-link", OF_K, 0.3),
    ("two-link-arm", ALL, 0.5),
]
COUNT = 150
ARRAYS = Compiled(rs.Backend.ARRAYS)


def is_batched(job) -> bool:
    return job.evaluator.kernel is None


def batched_of(name, quantities):
    robot = rs.load(name)
    by_joints = robot.is_serial and robot.home is None
    columns = joint_columns(robot.legs[0]) if by_joints else pose_columns(
        robot, [coordinate.value for coordinate in robot.coordinates]
    )  # fmt: skip
    wrench = tuple(range(1, robot.space.size + 1)) if Quantity.DEFLECTION in quantities else ()
    return MapEvaluator(robot, columns, quantities, wrench, 0.5)


@pytest.mark.parametrize(("name", "quantities", "spread"), ROBOTS)
def test_kernels_fill_maps_as_the_batched_form_does(name, quantities, spread):
    batched = batched_of(name, quantities)
    compiled = batched.with_kernel(rs.Backend.ARRAYS)
    home = np.array(batched.columns.home)
    poses = home + np.random.default_rng(2).uniform(-spread, spread, (COUNT, home.size))
    poses[0] = home  # a special place for some
    poses = np.ascontiguousarray(poses.T).T
    found, expected = values_at(compiled, poses), values_at(batched, poses)
    for variable in compiled.variables:
        own, other = found[variable.name], expected[variable.name]
        if not variable.is_float:
            np.testing.assert_array_equal(own, other, err_msg=variable.name)
            continue
        # Entries of K that vanish hold rounding: each array is compared by its largest entry.
        size = np.abs(other).reshape(len(other), -1).max(axis=1)
        precision = 1e-9 if np.dtype(variable.dtype) == np.float64 else 2e-6
        np.testing.assert_array_equal(np.isnan(own), np.isnan(other), err_msg=variable.name)
        apart = np.abs(own - other).reshape(len(other), -1).max(axis=1)
        assert np.all((apart <= precision * size) | np.isnan(size)), variable.name


def test_large_maps_are_compiled_and_small_ones_are_not():
    robot = rs.load("3-rpr")
    small = checked_job(robot, Grid(x=Axis(0, 0.1, 10)), OF_K)
    large = checked_job(robot, RandomPoses(100_000, {"x": (0, 0.1)}), OF_K)
    assert is_batched(small)
    assert not is_batched(large)
    asked = checked_job(robot, RandomPoses(100_000, {"x": (0, 0.1)}), OF_K, method=Batched())
    assert is_batched(asked)


@pytest.mark.parametrize(
    ("name", "poses", "quantities", "message"),
    [("hexapod", "x", [Quantity.ACTUATOR_FORCES], "actuator forces"),
     ("3-puu", "rx", [Quantity.STIFFNESS], "coordinates that are free: x y z"),
     ("gough-stewart-a", "x", [Quantity.WORST_DEFLECTION], "free motions at every pose")],
)  # fmt: skip
def test_what_kernels_cannot_do_is_left_to_the_batched_form(name, poses, quantities, message):
    robot, source = rs.load(name), RandomPoses(100_000, {poses: (0, 0.01)})
    wrench = [0, 0, 1, 0, 0, 0] if quantities[0].needs_wrench else None
    request = checked_job(robot, source, quantities, wrench=wrench)
    assert is_batched(request)
    with pytest.raises((rs.InputError, rs.NoAnswerError), match=message):
        checked_job(robot, source, quantities, wrench=wrench, method=Compiled())


def test_where_and_threads_change_no_bit_of_a_compiled_map():
    robot, poses = rs.load("3-rpr"), RandomPoses(300_000, {"x": (-0.1, 0.1)}, seed=2)
    one, two = (rs.stiffness_map(robot, poses, scheduler=Threads(n)) for n in (1, 2))
    assert one.attrs["method"].startswith("compiled")
    xarray.testing.assert_identical(one, two)
    half = rs.stiffness_map(robot, poses, where=lambda pose: pose["x"] > 0)
    kept = half.x > 0
    assert half.attrs["poses_computed"] == int(kept.sum())
    np.testing.assert_array_equal(
        half.translational_stiffness, one.translational_stiffness.where(kept)
    )
