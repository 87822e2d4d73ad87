"""Maps over coordinates of driven joints: kernel, networks, files."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.maps import Batched, Compiled
from robostiff.analysis.maps import map as maps
from robostiff.analysis.record_file import plain
from robostiff.io.map_files import read_poses

FOUR_BAR = Path(__file__).parents[2] / "examples" / "four-bar.xml"
QUANTITIES = [
    rs.Quantity.STIFFNESS,
    rs.Quantity.PRINCIPAL_STIFFNESS,
    rs.Quantity.WORST_DEFLECTION,
    rs.Quantity.INDICES,
    rs.Quantity.DEFLECTION,
]
F = [1.0, 2, 3, 0, 0, 0]
GRID = rs.Grid(crank=rs.Axis(-1.0, 3.0, 5))


@pytest.fixture(scope="module")
def four_bar():
    return rs.load_linkage(FOUR_BAR)


def test_kernel_and_networks_give_one_map_with_a_status_at_each_pose(four_bar):
    compiled = Compiled(rs.Backend.ARRAYS)
    fast, slow = (
        rs.stiffness_map(four_bar, GRID, QUANTITIES, wrench=F, method=method)
        for method in (compiled, Batched())
    )
    assert fast.status.values.tolist() == [0, 0, 0, 64, 64]
    assert fast["rank"].values.tolist() == [6, 6, 6, -1, -1]
    assert "networks" in fast.attrs["method"]
    for name, values in slow.data_vars.items():
        scale = np.nanmax(np.abs(values))
        rtol = 1e-9 if values.dtype == np.float64 else 1e-6
        np.testing.assert_allclose(fast[name], values, atol=rtol * scale, rtol=rtol)
    assert fast.crank.attrs["units"] == "rad"
    own = rs.stiffness(rs.network_at(four_bar, {"crank": -1.0})).K
    np.testing.assert_allclose(slow.K[0], own, rtol=1e-9, atol=1e-9 * own.max())
    bent = rs.deflection(rs.network_at(four_bar, {"crank": 1.0}), None, F)
    np.testing.assert_allclose(slow.displacement[2], bent.twist[:3], rtol=1e-6)


def test_many_poses_take_the_kernel_and_few_the_networks(four_bar, monkeypatch):
    def methods(count):
        poses = rs.Grid(crank=rs.Axis(0, 0.1, count))
        return maps.checked_job(four_bar, poses, QUANTITIES[:1], length=1.0).evaluator.method

    assert methods(3) == "networks"
    monkeypatch.setattr(maps, "_LINKAGE_PAYS", 3)
    assert "compiled" in methods(3)


def test_a_map_is_resumed_from_its_store(four_bar, tmp_path):
    poses = rs.PoseList(["crank"], [[0.1], [0.2]])
    store = tmp_path / "map.zarr"
    first = rs.stiffness_map(four_bar, poses, store=store)
    again = rs.stiffness_map(rs.load_linkage(FOUR_BAR), poses, store=store, resume=True)
    assert np.array_equal(first.translational_stiffness, again.translational_stiffness)
    other = replace(four_bar, held=frozenset())
    with pytest.raises(rs.InputError, match="robot"):
        rs.stiffness_map(other, poses, store=store, resume=True)


def test_a_linkage_is_sent_to_workers_without_its_records(four_bar):
    rs.stiffness(four_bar, {"crank": 0.1})
    again = pickle.loads(pickle.dumps(four_bar))  # noqa: S301
    driven = vars(four_bar)["_kept robostiff.linkage.driven.driven_by"].values()
    assert any("_kept robostiff.analysis.posed_stiffness.record_of" in vars(own) for own in driven)
    assert not any(name.startswith("_kept") for name in vars(again))
    assert plain(again) == plain(four_bar)


def test_poses_of_joints_are_read_from_files(four_bar, tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("crank [deg]\n0\n90\n")
    found = read_poses(four_bar, path)
    np.testing.assert_allclose(found.values((slice(0, 2),)), [[0, np.pi / 2]])
