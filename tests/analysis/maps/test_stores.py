"""Maps on disk and reductions: as in memory, safe against interruption, never another map."""

import copy
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray

import robostiff as rs
from robostiff import Axis, Grid, PoseList, Quantity, RandomPoses, Threads
from robostiff.analysis.record_file import plain
from robostiff.errors import InputError

POSES = RandomPoses(30_000, {"x": (-0.05, 0.05), "rz": (-0.2, 0.2)}, seed=1)


class Interruption(Exception):
    """Stands for anything that ends a process."""


def interrupted_after(blocks):
    reported = []

    def progress(done):
        reported.append(done)
        if len(reported) == blocks:
            raise Interruption

    return progress


@pytest.fixture(scope="module")
def undisturbed():
    return asked()


def asked(**more):
    return rs.stiffness_map(rs.load("3-rpr"), POSES, method=rs.Batched(), **more)


def begun(path, blocks=1):
    with pytest.raises(Interruption):
        asked(store=path, scheduler=Threads(1), progress=interrupted_after(blocks))


@pytest.mark.parametrize(
    ("name", "poses"),
    [("3-rpr", Grid(y=Axis(-0.1, 0.1, 21), x=Axis(-0.1, 0.1, 501))),
     ("3-rpr", PoseList(["x", "rz"], [[0, 0.1], [0.02, 0.3]], path_length=[0, 0.02])),
     ("cable-4-planar", Grid(x=Axis(0.05, 1.95, 90), y=Axis(0, 1.5, 80)))],
    ids=["grid", "list", "cables"],
)  # fmt: skip
def test_a_store_holds_what_memory_would(name, poses, tmp_path):
    robot = rs.load(name)
    quantities = [q for q in Quantity if q is not Quantity.TENSIONS or name[0] == "c"]
    question, F = (robot, poses, quantities), [10, 20, 0.5]
    memory = rs.stiffness_map(*question, wrench=F)
    stored = rs.stiffness_map(*question, wrench=F, store=tmp_path / "map.zarr")
    assert stored.K.chunks is not None
    xarray.testing.assert_identical(memory, stored.load())
    assert {name: own.dtype for name, own in memory.items()} == {
        name: own.dtype for name, own in stored.items()
    }
    assert list(memory.data_vars) == list(stored.data_vars)
    # Any other program can read it; of a symmetric K it has the upper triangle, row by row.
    again = xarray.open_zarr(tmp_path / "map.zarr", consolidated=False)
    (row, column), whole = np.triu_indices(3), memory.K.values
    if name == "3-rpr":
        np.testing.assert_array_equal(again.K.transpose(..., "entry"), whole[..., row, column])
        assert again.K.attrs["entries"] == "Fx dx, Fx dy, Fx rz, Fy dy, Fy rz, Mz rz"
    else:  # under moments K is not symmetric
        np.testing.assert_array_equal(again.K.transpose(..., "row", "column"), whole)
    assert set(again.coords) == set(memory.coords)
    assert not list((tmp_path).glob(".*"))


@pytest.mark.parametrize(
    ("robot", "poses"),
    [
        ("3-puu", Grid(x=Axis(5, 6, 7))),  # none is reached
        ("gough-stewart-a", Grid(x=Axis(-0.1, 0.1, 7))),  # a force drives a free motion at each
    ],
)
def test_a_block_without_an_answer_is_not_lost(robot, poses, tmp_path):
    question = (rs.load(robot), poses, [Quantity.STIFFNESS, Quantity.WORST_DEFLECTION])
    stored = rs.stiffness_map(*question, store=tmp_path / "map.zarr")
    xarray.testing.assert_identical(rs.stiffness_map(*question), stored.load())
    assert stored.worst_deflection.isnull().all()


def test_a_map_that_is_half_there_says_so(tmp_path):
    path = tmp_path / "map.zarr"
    begun(path)
    half = xarray.open_zarr(path, consolidated=False)
    assert set(np.unique(half.status)) == {0, 512}
    np.testing.assert_array_equal(half["rank"] == -1, half.status == 512)
    assert np.all(np.isnan(half.rotational_stiffness.where(half.status == 512)))


def test_a_torn_mark_and_torn_chunks_are_made_again(tmp_path, undisturbed):
    path = tmp_path / "map.zarr"
    begun(path, blocks=3)
    torn = path / "progress" / "done" / "c" / "0"
    torn.write_bytes(torn.read_bytes()[:-2])
    (path / "translational_stiffness" / "c" / "0" / "1").write_bytes(b"torn")
    reported = []
    found = asked(store=path, resume=True, progress=reported.append)
    assert reported[-1].resumed == POSES.count // 4  # one of four blocks
    assert reported[-1].done == POSES.count
    xarray.testing.assert_identical(found.load(), undisturbed)
    assert not list(path.glob("progress*"))


def test_a_store_is_filled_by_one_process_at_a_time(tmp_path, undisturbed):
    path = tmp_path / "map.zarr"
    begun(path)
    program = (
        "import sys; from pathlib import Path; from robostiff.analysis.maps.store import lock\n"
    )
    program += "with lock(Path(sys.argv[1])): print('locked', flush=True); input()"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, "-c", program, str(path)], **pipes) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "locked\n"
        with pytest.raises(InputError, match="another process is filling"):
            asked(store=path, resume=True)
        other.kill()  # a lock ends with its process
    found = asked(store=path, resume=True)
    xarray.testing.assert_identical(found.load(), undisturbed)


def test_a_finished_map_is_given_without_work(tmp_path, undisturbed):
    path = tmp_path / "map.zarr"
    asked(store=path)
    reported = []
    found = asked(store=path, resume=True, progress=reported.append)
    assert reported == []
    xarray.testing.assert_identical(found.load(), undisturbed)


def test_robots_are_recognised_and_distinguished():
    names = rs.shipped_robots()
    once, again = ([json.dumps(plain(rs.load(name))) for name in names] for _ in range(2))
    assert once == again
    assert len(set(once)) == len(names)
    robot = rs.load("hexapod")
    assert plain(copy.deepcopy(robot)) == plain(robot)


SMALL: dict[str, Any] = {
    "robot": rs.load("3-rpr"),
    "poses": Grid(x=Axis(0, 0.1, 2), y=Axis(0, 0.2, 2)),
}
SMALL["method"] = rs.Batched()
CABLES: dict[str, Any] = {"robot": rs.load("cable-4-planar"), "quantities": [Quantity.TENSIONS]}
#: What is asked for first, where it is something else, and then; and what is said.
OTHERS: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "robot": ({}, {"robot": rs.load("3-rpr-beams")}, "other .*robot"),
    "poses": ({}, {"poses": Grid(x=Axis(0, 0.1, 3))}, "other .*poses"),
    "order of axes": (
        {},
        {"poses": Grid(y=Axis(0, 0.2, 2), x=Axis(0, 0.1, 2))},
        r"axes\[0\]: x, now y",
    ),
    "method": ({"method": rs.Compiled(rs.Backend.ARRAYS)}, {}, "method"),
    "tensions": (
        CABLES,
        CABLES | {"robot": replace(CABLES["robot"], tension_level=0.5)},
        "other .*robot",
    ),
    "quantities": ({}, {"quantities": [Quantity.INDICES]}, "other .*quantities"),
    "selection": ({}, {"where": lambda pose: pose["x"] > 0}, "other .*selection"),
    "last digit": (
        {"robot": rs.load("gough-stewart-b", {"h": 0.8})},
        {"robot": rs.load("gough-stewart-b", {"h": np.nextafter(0.8, 1)})},
        r"other robot.*robot\.\S+.*: \S+, now ",
    ),
    "parameter": (
        {"robot": rs.load("gough-stewart-b")},
        {"robot": rs.load("gough-stewart-b", {"k": 2e8})},
        r"legs 'leg1'.chain.elements 'actuator'.role.stiffness: 100000000\.0, now 200000000\.0",
    ),
    "version": ({}, {}, "other version of robostiff"),
}


@pytest.mark.parametrize("part", OTHERS)
def test_another_map_is_refused(part, tmp_path, monkeypatch):
    first, then, words = OTHERS[part]
    rs.stiffness_map(**(SMALL | first), store=tmp_path / "map.zarr")
    if part == "version":
        monkeypatch.setattr("robostiff.analysis.maps.job.__version__", "99.0")
    with pytest.raises(InputError, match=words):
        rs.stiffness_map(**(SMALL | then), store=tmp_path / "map.zarr", resume=True)


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "file").write_text("precious")
    (tmp_path / "folder").mkdir()
    grid = Grid(x=Axis(0, 0.1, 2))
    rs.stiffness_map(rs.load("3-rpr"), grid, store=tmp_path / "map.zarr")
    for name in ("file", "folder", "map.zarr"):
        with pytest.raises(InputError, match="where nothing is yet"):
            rs.stiffness_map(rs.load("3-rpr"), grid, store=tmp_path / name)
    with pytest.raises(InputError, match="begun by robostiff"):
        rs.stiffness_map(rs.load("3-rpr"), grid, store=tmp_path / "folder", resume=True)
    with pytest.raises(InputError, match="existing folder"):
        rs.stiffness_map(rs.load("3-rpr"), grid, store=tmp_path / "missing" / "map.zarr")
    assert (tmp_path / "file").read_text() == "precious"


def test_a_store_needs_nothing_of_posix(tmp_path, undisturbed, monkeypatch):
    """As Windows has it: no `fcntl`, folders that cannot be opened, locks of bytes."""
    held: list[int] = []

    def locking(handle: int, mode: int, count: int) -> None:
        if held:
            raise PermissionError(13, "Permission denied")
        assert (mode, count) == (2, 1)
        held.append(handle)

    windows = SimpleNamespace(LK_NBLCK=2, locking=locking)
    monkeypatch.setitem(sys.modules, "msvcrt", windows)
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setattr("robostiff.analysis.maps.store.sys", SimpleNamespace(platform="win32"))
    path = tmp_path / "map.zarr"
    begun(path)
    with pytest.raises(InputError, match="another process is filling"):
        asked(store=path, resume=True)
    held.clear()
    found = asked(store=path, resume=True)
    xarray.testing.assert_identical(found.load(), undisturbed)


WITHIN = {"x": (-0.4, 0.4), "y": (-0.4, 0.4), "rz": (-0.5, 0.5)}
REDUCED = rs.RandomPoses(4_000, WITHIN, seed=3)
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
    return rs.stiffness_map(rs.load("3-rpr"), REDUCED, QUANTITIES).load()


@pytest.fixture(scope="module")
def found() -> xarray.Dataset:
    return reduced()


def test_statuses_are_those_of_the_map(whole, found):
    for name in ("statuses", "poses", "poses_computed", "poses_reachable", "robot", "method"):
        assert found.attrs[name] == whole.attrs[name]
    assert not {"status", "rank", "K"} & set(found.data_vars)


def test_extremes_have_units_and_coordinates(whole, found):
    for name in ("translational_stiffness", "worst_deflection"):
        assert found[f"{name}_extreme"].attrs["units"] == whole[name].attrs["units"]
        assert found[f"{name}_at"].coordinate.values.tolist() == ["x", "y", "rz"]
    np.testing.assert_array_equal(found.K_units, whole.K_units)


@pytest.mark.parametrize("name", ["translational_stiffness", "worst_deflection", "K"])
def test_quantiles_within_a_hundredth_of_a_percent(name, whole, found):
    values = whole[name].dropna("pose").transpose("pose", ...).values
    exact = np.quantile(values, [0, 0.01, 0.5, 0.99, 1], axis=0, method="inverted_cdf")
    np.testing.assert_allclose(found[f"{name}_quantile"], exact, rtol=1e-4)


def test_counts(whole, found):
    edges = np.geomspace(1e3, 1e7, 9)
    values = whole.translational_stiffness.dropna("pose").values.astype(float)
    for k in range(2):
        expected = np.histogram(values[:, k], edges)[0]
        np.testing.assert_array_equal(found.translational_stiffness_count[:, k], expected)
    np.testing.assert_array_equal(found.translational_stiffness_from, edges[:-1])


@pytest.mark.parametrize(
    "how", [{"scheduler": Threads(1)}, {"scheduler": Threads(3)}, {"workers": 2}]
)
def test_blocks_in_any_order_and_processes_give_the_same(how, found, monkeypatch):
    if "scheduler" in how:  # in one process
        monkeypatch.setattr("robostiff.analysis.maps.job._BLOCK_BYTES", 2**16)
        monkeypatch.setattr("robostiff.analysis.maps.reduced_map._CACHE", 2**17)
    xarray.testing.assert_identical(reduced(**how), found)


@pytest.fixture
def begun_reduction(tmp_path, monkeypatch) -> Path:
    monkeypatch.setattr("robostiff.analysis.maps.job._BLOCK_BYTES", 2**17)
    path = tmp_path / "map.npz"
    with pytest.raises(Interruption):
        reduced(store=path, scheduler=Threads(1), progress=interrupted_after(2))
    return path


def reduced(robot="3-rpr", reduce=ALL, **more: Any) -> xarray.Dataset:
    return rs.stiffness_map(rs.load(robot), REDUCED, QUANTITIES, reduce=reduce, **more)


def test_what_was_interrupted_goes_on(begun_reduction, found):
    reported = []
    again = reduced(store=begun_reduction, resume=True, progress=reported.append)
    assert 0 < reported[0].resumed < reported[0].done
    assert reported[-1].done == REDUCED.count
    xarray.testing.assert_identical(again, found)
    xarray.testing.assert_identical(reduced(store=begun_reduction, resume=True), found)
    assert [own.name for own in begun_reduction.parent.iterdir()] == ["map.npz"]


@pytest.mark.parametrize("harm", ["cut", "flipped", "empty", "other", "objects", "huge"])
def test_a_damaged_state_is_refused(harm, begun_reduction, monkeypatch):
    content = bytearray(begun_reduction.read_bytes())
    if harm == "objects":
        np.savez(begun_reduction, about=np.array([{}], dtype=object))
    elif harm == "huge":
        monkeypatch.setattr("robostiff.analysis.maps.reduced_map._LARGEST", 1000)
    else:
        flipped = bytearray(content)
        flipped[len(content) // 2] ^= 4
        cases = {"cut": content[:-9], "flipped": flipped, "empty": b"", "other": b"{}"}
        begun_reduction.write_bytes(cases[harm])
    with pytest.raises(rs.InputError, match="begun by robostiff"):
        reduced(store=begun_reduction, resume=True)


def test_another_question_is_refused_and_nothing_overwritten(begun_reduction):
    for words, asked in (
        ("other reductions", {"reduce": [rs.Extremes()], "resume": True}),
        ("other robot", {"robot": "3-rpr-beams", "resume": True}),
        ("where nothing is yet", {}),
    ):
        with pytest.raises(rs.InputError, match=words):
            reduced(store=begun_reduction, **asked)


@pytest.mark.parametrize(
    ("poses", "where", "method"),
    [
        (REDUCED, None, rs.Batched()),
        (rs.RandomPoses(20_001, WITHIN, seed=5), None, rs.Compiled(rs.Backend.ARRAYS)),
        (rs.Grid(x=rs.Axis(-0.3, 0.3, 7), y=rs.Axis(-0.3, 0.3, 23), rz=rs.Axis(-0.4, 0.4, 101)),
         lambda pose: pose["x"] + pose["y"] < 0.1, rs.Compiled(rs.Backend.ARRAYS)),
    ],
    ids=["batched", "random", "grid"],
)  # fmt: skip
def test_maps_are_reduced_as_they_are(poses, where, method, monkeypatch):
    """In blocks and pieces of any size, poses of the careful form and excluded ones among them."""
    question = (rs.load("3-rpr"), poses, QUANTITIES)
    given: Any = {"where": where, "method": method}
    whole = rs.stiffness_map(*question, **given).load()
    assert (whole.attrs["poses_guarded"] > 0) == (method != rs.Batched())
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
    found = rs.stiffness_map(rs.load("3-puu"), grid, reduce=[
        rs.Extremes(), rs.Quantiles(), rs.ShareAbove("rotational_stiffness", 1.0)
    ])  # fmt: skip
    for name in ("extreme", "at", "quantile", "share_above"):
        assert np.isnan(found[f"rotational_stiffness_{name}"]).all()
    assert found.attrs["poses_reachable"] == 0


def test_negative_values_are_in_order():
    values = np.array([[-3.0, -0.5, np.nan, 0.0, 2.0, 7.0]])
    own: Any = rs.Quantiles(shares=[0, 0.4, 0.6, 1])
    state = own.initial_state(1)
    own.extend(state, values[:, :2], range(2))
    own.extend(state, values[:, 2:], range(2, 6))
    ((_, labels, found, _),) = own.results(own.final_state(state), "", 1, None)
    assert labels == {"share": (0.0, 0.4, 0.6, 1.0)}
    np.testing.assert_allclose(found[:, 0], [-3.0, -0.5, 0.0, 7.0], rtol=1e-4, atol=1e-38)


def test_no_room_is_asked_for():
    """A map of 10^11 poses fits into no memory; its reductions do."""
    poses = rs.RandomPoses(10**11, {"x": (-0.1, 0.1)})
    question = (rs.load("3-rpr"), poses, [Quantity.STIFFNESS])
    with pytest.raises(rs.InputError, match="map in memory"):
        rs.stiffness_map(*question)
    with pytest.raises(Interruption):
        rs.stiffness_map(
            *question, reduce=[rs.Extremes()], method=rs.Compiled(rs.Backend.ARRAYS),
            scheduler=Threads(1), progress=interrupted_after(1),
        )  # fmt: skip
