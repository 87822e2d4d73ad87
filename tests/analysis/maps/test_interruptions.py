"""A real process, killed or stopped with Ctrl-C in the middle of a map."""

import os
import signal
import subprocess
import sys
import time

import pytest
import xarray

import robostiff as rs
from robostiff import RandomPoses
from robostiff.io.map_files import read_map
from tests.analysis.maps.robots import loaded
from tests.interrupts import interrupts_heard

COUNT = 100_000
ARGUMENTS = (
    "map", "3-rpr", "--random", str(COUNT), "--seed", "7", "--x", "-50 mm 50 mm",
    "--rz", "-10 deg 10 deg", "-o", "map.zarr", "--batched",
)  # fmt: skip


@pytest.fixture(scope="module")
def undisturbed():
    turn = 10 * 0.017453292519943295
    poses = RandomPoses(COUNT, {"x": (-0.05, 0.05), "rz": (-turn, turn)}, seed=7)
    return rs.stiffness_map(loaded("3-rpr"), poses, method=rs.Batched())


def started(folder, *more):
    command = [sys.executable, "-m", "robostiff.cli.main", *ARGUMENTS, *more]
    with interrupts_heard():
        return subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )


def wait_for_a_block(folder):
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        if any(p.stat().st_size for p in folder.glob("map.zarr/progress/done/c/[0-9]*")):
            return
        time.sleep(0.01)
    pytest.fail("no block was written")


@pytest.mark.parametrize(
    "how",
    [
        pytest.param(signal.SIGKILL, id="kill", marks=pytest.mark.slow),
        pytest.param(signal.SIGINT, id="ctrl-c"),
    ],
)
def test_what_was_done_is_kept(how, tmp_path, undisturbed):
    process = started(tmp_path)
    wait_for_a_block(tmp_path)
    os.kill(process.pid, how)
    out, err = process.communicate(timeout=60)
    assert out == ""
    if how is signal.SIGINT:
        assert process.returncode == 130
        assert "continue with\n  robostiff map 3-rpr" in err
        assert "--resume" in err
    else:
        assert process.returncode == -signal.SIGKILL
    half = xarray.open_zarr(tmp_path / "map.zarr", consolidated=False)
    assert (half.status == 512).any()
    process = started(tmp_path, "--resume")
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert f"3-rpr: {COUNT} poses" in out
    xarray.testing.assert_identical(read_map(tmp_path / "map.zarr").load(), undisturbed)
    assert [path.name for path in tmp_path.iterdir()] == ["map.zarr"]
