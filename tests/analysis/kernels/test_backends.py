"""Machine code and NumPy: the same answers, in any number of threads, in given arrays."""

import sys
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.compiled import ArrayCode, MachineCode
from robostiff.compiled.codes import this_processor
from robostiff.record import Flag
from tests.analysis.kernels.cases import BACKENDS, around_home, model


@pytest.fixture
def no_llvmlite(monkeypatch):
    monkeypatch.setitem(sys.modules, "llvmlite.binding", None)
    this_processor.cache_clear()
    yield
    this_processor.cache_clear()


@pytest.mark.parametrize("backend", BACKENDS)
def test_threads_change_no_bit(backend, monkeypatch):
    robot = model("hexapod")
    compiled = rs.compile(robot, [rs.PrincipalStiffness()], backend=backend)
    pose = around_home(robot, 30_001)
    monkeypatch.setattr("robostiff.compiled.kernel._POSES_A_THREAD", 1000)
    one, two, many = (compiled.evaluate(pose, threads=n) for n in (1, 2, None))
    name = rs.PrincipalStiffness.name
    for other in (two, many):
        np.testing.assert_array_equal(one.values[name], other.values[name])
        np.testing.assert_array_equal(one.status_codes, other.status_codes)


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_raw_kernel_fills_arrays_of_the_caller(backend):
    robot = model("3-rpr")
    kernel = rs.compile(robot, backend=backend).kernel
    pose = np.asarray(around_home(robot, 10))
    inputs = np.ascontiguousarray(pose.T)
    out = np.full((kernel.rows, 10), np.nan)
    assert kernel.evaluate(inputs, out) is out
    K = direct_stiffness(robot, pose).K
    for r, (i, j) in enumerate(np.ndindex(3, 3)):
        np.testing.assert_allclose(out[r], K[:, i, j], rtol=1e-9, atol=1e-9 * np.abs(K).max())
    assert kernel.checks == ("flags",)
    assert np.isin(out[9:], (0, Flag.RANK_DOUBTFUL)).all()  # home is nearly singular
    np.testing.assert_array_equal(kernel.evaluate(inputs), out)
    planes = np.full((2, kernel.rows, 10), np.nan)  # rows at places of their own
    kernel.evaluate(inputs, list(planes[1]))
    np.testing.assert_array_equal(planes[1], out)
    fixed = out.copy()
    fixed.flags.writeable = False
    single, apart = list(out.astype("float32")), list(out[:, ::2])
    for wrong in (fixed, list(fixed), out[:-1], single, apart, out.T.copy().T):
        with pytest.raises(rs.InputError, match="results of the kernel"):
            kernel.evaluate(inputs, wrong)


@pytest.mark.parametrize("backend", BACKENDS)
def test_answers_are_written_into_given_arrays(backend):
    """With poses side by side, a pose after the other, and in single precision."""
    robot = model("3-rrr")
    near: Any = around_home(robot, 2000)
    pose = np.concatenate([near, [[3.0, 0, 0], [0, 3.0, 0]]])
    compiled = rs.compile(robot, [rs.StiffnessMatrix(), rs.WorstDeflection()], backend=backend)
    expected = compiled.evaluate(pose)
    count = len(pose)
    assert np.isnan(expected.matrix[-2:]).all()
    for K in (
        np.zeros((3, 3, count)).transpose(2, 0, 1),
        np.zeros((count, 3, 3)),
        np.zeros((count, 3, 3), dtype=np.float32),
        np.zeros((2 * count, 3, 3))[::2],
    ):
        found = compiled.evaluate(pose, out={"K": K})
        assert found.matrix is K
        np.testing.assert_array_equal(K, expected.matrix.astype(K.dtype))
        np.testing.assert_array_equal(found.status_codes, expected.status_codes)
        name = rs.WorstDeflection.name
        np.testing.assert_array_equal(found.values[name], expected.values[name])
    for out in ({"k": K}, {"K": K[:-1]}, {"K": np.zeros((count, 3, 3), dtype=int)}):
        with pytest.raises(rs.InputError, match="array for"):
            compiled.evaluate(pose, out=out)


def test_without_llvmlite_numpy_serves_and_says_so(no_llvmlite):
    robot = model("3-rpr")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        compiled, _ = rs.compile(robot), rs.compile(robot)
    assert [w.category for w in caught] == [rs.NoMachineCodeWarning]  # once
    assert "some ten times slower" in str(caught[0].message)
    assert isinstance(compiled.kernel.code, ArrayCode)
    pose = around_home(robot, 3)
    np.testing.assert_allclose(
        compiled.evaluate(pose).values["K"], direct_stiffness(robot, pose).K, rtol=1e-9, atol=1e-3
    )


def test_without_llvmlite_arrays_are_given_where_asked_for_and_machine_code_is_not(no_llvmlite):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rs.compile(model("3-rpr"), backend=rs.Backend.ARRAYS)
    with pytest.raises(rs.InputError, match=r"write pip install 'robostiff\[fast\]'"):
        rs.compile(model("3-rpr"), backend=rs.Backend.MACHINE)


@pytest.mark.needs("llvmlite")
def test_the_best_backend_is_machine_code_where_it_is_there():
    assert isinstance(rs.compile(model("3-rpr")).kernel.code, MachineCode)


@pytest.mark.parametrize("name", ["hexapod", "3-prs", "six-joint-arm", "double-pantograph"])
def test_one_pose_has_an_answer_without_an_axis_of_poses(name):
    """As of `rs.stiffness`; also where it is computed again, and in given arrays."""
    machine = rs.load_linkage(name) if name == "double-pantograph" else model(name)
    fast = rs.compile(machine, backend=rs.Backend.ARRAYS)
    row = np.full(len(fast.inputs), 0.01)
    if isinstance(machine, rs.Robot) and not machine.is_posed_by_joints:
        row += rs.find_posture(machine).pose[0, machine.coordinate_places]
    poses = [row, rs.JointCoordinates(row)] if name == "six-joint-arm" else [row]
    for pose in poses:
        rows = row[None] if pose is row else rs.JointCoordinates(row[None])
        for compiled in (fast, replace(fast, verified=False)):
            one, several = compiled.evaluate(pose), compiled.evaluate(rows)
            assert (one.batch_shape, several.batch_shape) == ((), (1,))
            np.testing.assert_array_equal(one.values["K"], several.values["K"][0])
            assert (one.rank, one.status) == (several.rank[0], several.status)
            assert bool(one.guarded) is (compiled is not fast)
        K = np.empty((6, 6))
        np.testing.assert_array_equal(fast.evaluate(pose, out={"K": K}).values["K"], K)
        assert fast.evaluate(pose, again=False).values["K"].shape == (6, 6)
        assert np.any(K)
