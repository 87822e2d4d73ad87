"""Dask workers give the same map, and may die."""

import logging
import os
import signal
from typing import Any

import pytest
import xarray
from distributed import Client, LocalCluster

import robostiff as rs
from robostiff import Quantity, RandomPoses
from tests.analysis.maps.robots import loaded

POSES = RandomPoses(60_000, {"x": (-0.05, 0.05), "rz": (-0.2, 0.2)}, seed=1)


@pytest.fixture(scope="module")
def alone():
    return rs.stiffness_map(loaded("3-rpr"), POSES, [Quantity.INDICES])


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
            loaded("3-rpr"),
            POSES,
            [Quantity.INDICES],
            store=tmp_path / "map.zarr",
            scheduler=cluster.scheduler_address,
            progress=kill_one,
        )
    assert killed
    xarray.testing.assert_identical(found.load(), alone)


def test_a_scheduler_that_is_not_there_leaves_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.setattr("robostiff.analysis.maps.run._PATIENCE", "200ms")
    with pytest.raises(rs.InputError, match="one that answers"):
        rs.stiffness_map(
            loaded("3-rpr"), POSES, store=tmp_path / "map.zarr", scheduler="tcp://127.0.0.1:9"
        )
    assert list(tmp_path.iterdir()) == []
