"""Reductions against the whole map, in any blocks, by threads and processes, and after an end."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

import robostiff as rs
from robostiff import Quantity, Threads
from tests.analysis.maps.robots import loaded
from tests.analysis.maps.test_stores import Interruption, interrupted_after

WITHIN = {"x": (-0.4, 0.4), "y": (-0.4, 0.4), "rz": (-0.5, 0.5)}
POSES = rs.RandomPoses(4_000, WITHIN, seed=3)
QUANTITIES = [Quantity.PRINCIPAL_STIFFNESS, Quantity.WORST_DEFLECTION, Quantity.STIFFNESS]
LIMITS = np.array([1e4, 1e6])
ALL = [
    rs.Extremes(),
    rs.Quantiles(shares=[0, 0.01, 0.5, 0.99, 1]),
    rs.Histogram("translational_stiffness", np.geomspace(1e3, 1e7, 9)),
    rs.ShareAbove("rotational_stiffness", LIMITS),
]


@pytest.fixture(scope="module")
def whole() -> xarray.Dataset:
    return rs.stiffness_map(loaded("3-rpr"), POSES, QUANTITIES).load()


@pytest.fixture(scope="module")
def found() -> xarray.Dataset:
    return rs.stiffness_map(loaded("3-rpr"), POSES, QUANTITIES, reduce=ALL)


def test_statuses_are_those_of_the_map(whole, found):
    for name in ("statuses", "poses", "poses_computed", "poses_reachable", "robot", "method"):
        assert found.attrs[name] == whole.attrs[name]
    assert not {"status", "rank", "K"} & set(found.data_vars)


@pytest.mark.parametrize("name", ["translational_stiffness", "worst_deflection", "K"])
def test_extremes_and_where_they_are(name, whole, found):
    values, poses = whole[name], np.array([whole[own] for own in ("x", "y", "rz")])
    for end, place in (("least", values.argmin("pose")), ("greatest", values.argmax("pose"))):
        np.testing.assert_array_equal(
            found[f"{name}_extreme"].sel(extreme=end), values.isel(pose=place)
        )
        at = found[f"{name}_at"].sel(extreme=end)
        assert at.coordinate.values.tolist() == ["x", "y", "rz"]
        np.testing.assert_array_equal(at, poses[:, place.values])
    if name != "K":
        assert found[f"{name}_extreme"].attrs["units"] == whole[name].attrs["units"]
    else:
        np.testing.assert_array_equal(found.K_units, whole.K_units)


@pytest.mark.parametrize("name", ["translational_stiffness", "worst_deflection", "K"])
def test_quantiles_within_a_hundredth_of_a_percent(name, whole, found):
    values = whole[name].dropna("pose").transpose("pose", ...).values
    exact = np.quantile(values, [0, 0.01, 0.5, 0.99, 1], axis=0, method="inverted_cdf")
    np.testing.assert_allclose(found[f"{name}_quantile"], exact, rtol=1e-4)


def test_counts_and_shares(whole, found):
    edges = np.geomspace(1e3, 1e7, 9)
    values = whole.translational_stiffness.dropna("pose").values.astype(float)
    for k in range(2):
        expected = np.histogram(values[:, k], edges)[0]
        np.testing.assert_array_equal(found.translational_stiffness_count[:, k], expected)
    np.testing.assert_array_equal(found.translational_stiffness_from, edges[:-1])
    turning = whole.rotational_stiffness.dropna("pose").values
    expected = np.mean(turning[:, None, :] >= LIMITS[:, None], axis=0)
    np.testing.assert_allclose(found.rotational_stiffness_share_above, expected, rtol=1e-14)


@pytest.mark.parametrize("scheduler", [Threads(1), Threads(3)])
def test_blocks_in_any_order_give_the_same(scheduler, found, monkeypatch):
    monkeypatch.setattr("robostiff.analysis.maps.job._BLOCK_BYTES", 2**16)
    monkeypatch.setattr("robostiff.analysis.maps.reduced_map._CACHE", 2**17)
    again = rs.stiffness_map(loaded("3-rpr"), POSES, QUANTITIES, reduce=ALL, scheduler=scheduler)
    xarray.testing.assert_identical(again, found)


def test_processes_give_the_same(found):
    again = rs.stiffness_map(loaded("3-rpr"), POSES, QUANTITIES, reduce=ALL, workers=2)
    xarray.testing.assert_identical(again, found)


@pytest.fixture
def begun(tmp_path, monkeypatch) -> Path:
    monkeypatch.setattr("robostiff.analysis.maps.job._BLOCK_BYTES", 2**17)
    path = tmp_path / "map.npz"
    with pytest.raises(Interruption):
        rs.stiffness_map(
            loaded("3-rpr"), POSES, QUANTITIES, reduce=ALL, store=path,
            scheduler=Threads(1), progress=interrupted_after(2),
        )  # fmt: skip
    return path


def test_what_was_interrupted_goes_on(begun, found):
    reported = []
    question = (loaded("3-rpr"), POSES, QUANTITIES)
    again = rs.stiffness_map(
        *question, reduce=ALL, store=begun, resume=True, progress=reported.append
    )
    assert 0 < reported[0].resumed < reported[0].done
    assert reported[-1].done == POSES.count
    xarray.testing.assert_identical(again, found)
    finished = rs.stiffness_map(*question, reduce=ALL, store=begun, resume=True)
    xarray.testing.assert_identical(finished, found)
    assert [own.name for own in begun.parent.iterdir()] == ["map.npz"]


@pytest.mark.parametrize("harm", ["cut", "flipped", "empty", "other", "objects", "huge"])
def test_a_damaged_state_is_refused(harm, begun, monkeypatch):
    content = bytearray(begun.read_bytes())
    if harm == "objects":
        np.savez(begun, about=np.array([{}], dtype=object))
    elif harm == "huge":
        monkeypatch.setattr("robostiff.analysis.maps.reduced_map._LARGEST", 1000)
    else:
        flipped = bytearray(content)
        flipped[len(content) // 2] ^= 4
        cases = {"cut": content[:-9], "flipped": flipped, "empty": b"", "other": b"{}"}
        begun.write_bytes(cases[harm])
    with pytest.raises(rs.InputError, match="begun by robostiff"):
        rs.stiffness_map(loaded("3-rpr"), POSES, QUANTITIES, reduce=ALL, store=begun, resume=True)


def test_another_question_is_refused_and_nothing_overwritten(begun):
    question = (loaded("3-rpr"), POSES, QUANTITIES)
    with pytest.raises(rs.InputError, match="other reductions"):
        rs.stiffness_map(*question, reduce=[rs.Extremes()], store=begun, resume=True)
    with pytest.raises(rs.InputError, match="other robot"):
        rs.stiffness_map(
            loaded("3-rpr-beams"), POSES, QUANTITIES, reduce=ALL, store=begun, resume=True
        )
    with pytest.raises(rs.InputError, match="where nothing is yet"):
        rs.stiffness_map(*question, reduce=ALL, store=begun)


@pytest.mark.parametrize(
    ("poses", "where"),
    [
        (rs.RandomPoses(20_001, WITHIN, seed=5), None),
        (
            rs.Grid(x=rs.Axis(-0.3, 0.3, 7), y=rs.Axis(-0.3, 0.3, 23), rz=rs.Axis(-0.4, 0.4, 101)),
            lambda pose: pose["x"] + pose["y"] < 0.1,
        ),
    ],
    ids=["random", "grid"],
)
def test_kernels_reduce_as_their_maps(poses, where, monkeypatch):
    """In blocks and pieces of any size, poses of the careful form and excluded ones among them."""
    question = (loaded("3-rpr"), poses, QUANTITIES)
    given: Any = {"where": where, "method": rs.Compiled(rs.Backend.ARRAYS)}
    whole = rs.stiffness_map(*question, **given).load()
    assert whole.attrs["poses_guarded"] > 0
    monkeypatch.setattr("robostiff.analysis.maps.reduced_map._BLOCK", 5000)
    monkeypatch.setattr("robostiff.analysis.maps.reduced_map._CACHE", 2**17)
    monkeypatch.setattr("robostiff.analysis.maps.reduced_map._TOGETHER", 10)
    found = rs.stiffness_map(*question, **given, reduce=ALL)
    for name in ("statuses", "poses", "poses_computed", "poses_reachable", "poses_guarded"):
        assert found.attrs[name] == whole.attrs[name]
    for name in ("translational_stiffness", "worst_deflection", "K"):
        values = whole[name].stack(place=poses.dims).transpose("place", ...)
        entries = values.values.reshape(values.shape[0], -1)
        coordinates = np.array([values[own].values for own in ("x", "y", "rz")])
        for end, find in (("least", np.nanargmin), ("greatest", np.nanargmax)):
            at = find(entries, axis=0)
            extreme = found[f"{name}_extreme"].sel(extreme=end).values.ravel()
            np.testing.assert_array_equal(extreme, entries[at, np.arange(len(at))])
            own = found[f"{name}_at"].sel(extreme=end).values.reshape(3, -1)
            np.testing.assert_array_equal(own, coordinates[:, at])
    values = whole.rotational_stiffness.values.ravel()
    expected = [np.mean(values[~np.isnan(values)] >= limit) for limit in LIMITS]
    np.testing.assert_allclose(found.rotational_stiffness_share_above[:, 0], expected, rtol=1e-14)


def test_poses_without_an_answer_count_for_nothing():
    grid = rs.Grid(x=rs.Axis(5, 6, 7))  # none is reached
    found = rs.stiffness_map(loaded("3-puu"), grid, reduce=[
        rs.Extremes(), rs.Quantiles(), rs.ShareAbove("rotational_stiffness", 1.0)
    ])  # fmt: skip
    for name in ("extreme", "at", "quantile", "share_above"):
        assert np.isnan(found[f"rotational_stiffness_{name}"]).all()
    assert found.attrs["poses_reachable"] == 0


def test_negative_values_are_in_order():
    values = np.array([[-3.0, -0.5, np.nan, 0.0, 2.0, 7.0]])
    own: Any = rs.Quantiles(shares=[0, 0.4, 0.6, 1])
    state = own.begun(1)
    own.extend(state, values[:, :2], range(2))
    own.extend(state, values[:, 2:], range(2, 6))
    ((_, labels, found, _),) = own.found(own.closed(state), "", 1, None)
    assert labels == {"share": (0.0, 0.4, 0.6, 1.0)}
    np.testing.assert_allclose(found[:, 0], [-3.0, -0.5, 0.0, 7.0], rtol=1e-4, atol=1e-38)


def test_no_room_is_asked_for():
    """A map of 10^11 poses fits into no memory; its reductions do."""
    poses = rs.RandomPoses(10**11, {"x": (-0.1, 0.1)})
    question = (loaded("3-rpr"), poses, [Quantity.STIFFNESS])
    with pytest.raises(rs.InputError, match="map in memory"):
        rs.stiffness_map(*question)
    with pytest.raises(Interruption):
        rs.stiffness_map(
            *question, reduce=[rs.Extremes()], method=rs.Compiled(rs.Backend.ARRAYS),
            scheduler=Threads(1), progress=interrupted_after(1),
        )  # fmt: skip
