"""Processes that are killed or stopped with Ctrl-C in the middle of a map, and workers that die."""

import gc
import logging
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from typing import Any

import pytest
import xarray
from distributed import Client, LocalCluster

import robostiff as rs
from robostiff import Quantity, RandomPoses
from robostiff.io.map_files import read_map
from tests.analysis.maps.test_stores import Interruption, interrupted_after
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
    return rs.stiffness_map(rs.load("3-rpr"), poses, method=rs.Batched())


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
    [pytest.param(signal.SIGKILL, id="kill", marks=pytest.mark.slow),
     pytest.param(signal.SIGINT, id="ctrl-c")],
)  # fmt: skip
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


POSES = RandomPoses(60_000, {"x": (-0.05, 0.05), "rz": (-0.2, 0.2)}, seed=1)


@pytest.fixture(scope="module")
def alone():
    return rs.stiffness_map(rs.load("3-rpr"), POSES, [Quantity.INDICES])


def test_a_killed_worker_is_survived(tmp_path, alone):
    killed = []
    cluster: Any = LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        dashboard_address="localhost:0",
        silence_logs=logging.CRITICAL,
    )
    with cluster, Client(cluster) as client:
        pids_by_worker: Any = client.run(os.getpid)
        pids = list(pids_by_worker.values())

        def kill_one(done):
            if not killed:
                os.kill(pids[0], signal.SIGKILL)
                killed.append(pids[0])

        found = rs.stiffness_map(
            rs.load("3-rpr"), POSES, [Quantity.INDICES], store=tmp_path / "map.zarr",
            scheduler=cluster.scheduler_address, progress=kill_one,
        )  # fmt: skip
    assert killed
    xarray.testing.assert_identical(found.load(), alone)


def test_an_interrupted_map_leaves_nothing_to_be_done_by_a_closed_cluster(tmp_path, monkeypatch):
    monkeypatch.setattr("robostiff.analysis.maps.job._BLOCK_BYTES", 2**17)
    unraisable: list[Any] = []
    monkeypatch.setattr(sys, "unraisablehook", unraisable.append)
    one: Any = LocalCluster(n_workers=1, processes=False, dashboard_address="localhost:0")
    with one as cluster, suppress(Interruption):
        rs.stiffness_map(
            rs.load("3-rpr"), POSES, store=tmp_path / "map.zarr",
            scheduler=cluster.scheduler_address, progress=interrupted_after(1),
        )  # fmt: skip
    gc.collect()
    assert unraisable == []


def test_a_scheduler_that_is_not_there_leaves_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.setattr("robostiff.analysis.maps.run._PATIENCE", "200ms")
    with pytest.raises(rs.InputError, match="one that answers"):
        rs.stiffness_map(
            rs.load("3-rpr"), POSES, store=tmp_path / "map.zarr", scheduler="tcp://127.0.0.1:9"
        )
    assert list(tmp_path.iterdir()) == []
