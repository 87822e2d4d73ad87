"""Maps on disk: the same as in memory, safe against interruption, and never another map."""

import copy
import json
import re
import subprocess
import sys
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
from tests.analysis.maps.robots import loaded

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
    return rs.stiffness_map(loaded("3-rpr"), POSES, method=rs.Batched(), **more)


def begun(path, blocks=1):
    with pytest.raises(Interruption):
        asked(store=path, scheduler=Threads(1), progress=interrupted_after(blocks))


@pytest.mark.parametrize(
    "poses",
    [
        Grid(y=Axis(-0.1, 0.1, 21), x=Axis(-0.1, 0.1, 501)),
        PoseList(["x", "rz"], [[0, 0.1], [0.02, 0.3]], path_length=[0, 0.02]),
    ],
    ids=["grid", "list"],
)
def test_a_store_holds_what_memory_would(poses, tmp_path):
    robot = loaded("3-rpr")
    question = (robot, poses, [q for q in Quantity if q is not Quantity.TENSIONS])
    F = [10, 20, 0.5]
    memory = rs.stiffness_map(*question, wrench=F)
    stored = rs.stiffness_map(*question, wrench=F, store=tmp_path / "map.zarr")
    assert stored.K.chunks is not None
    xarray.testing.assert_identical(memory, stored.load())
    assert {name: own.dtype for name, own in memory.items()} == {
        name: own.dtype for name, own in stored.items()
    }
    assert list(memory.data_vars) == list(stored.data_vars)
    # Any other program can read it; of K it has the upper triangle, row by row.
    again = xarray.open_zarr(tmp_path / "map.zarr", consolidated=False)
    row, column = np.triu_indices(3)
    upper = memory.K.values[..., row, column]
    np.testing.assert_array_equal(again.K.transpose(..., "entry"), upper)
    assert again.K.attrs["entries"] == "Fx dx, Fx dy, Fx rz, Fy dy, Fy rz, Mz rz"
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
    question = (loaded(robot), poses, [Quantity.STIFFNESS, Quantity.WORST_DEFLECTION])
    stored = rs.stiffness_map(*question, store=tmp_path / "map.zarr")
    xarray.testing.assert_identical(rs.stiffness_map(*question), stored.load())
    assert stored.worst_deflection.isnull().all()


def test_an_interrupted_map_goes_on_where_it_was(tmp_path, undisturbed):
    path = tmp_path / "map.zarr"
    begun(path, blocks=2)
    reported = []
    found = asked(store=path, resume=True, progress=reported.append)
    assert reported[-1].resumed == POSES.count // 2  # two of four blocks
    assert reported[-1].done == POSES.count
    xarray.testing.assert_identical(found.load(), undisturbed)
    assert not list(path.glob("progress*"))


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
    xarray.testing.assert_identical(found.load(), undisturbed)


def test_a_store_is_filled_by_one_process_at_a_time(tmp_path, undisturbed):
    path = tmp_path / "map.zarr"
    begun(path)
    program = (
        "import sys; from pathlib import Path; from robostiff.analysis.maps.store import locked\n"
    )
    program += "with locked(Path(sys.argv[1])): print('locked', flush=True); input()"
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
    once, again = ([json.dumps(plain(loaded(name))) for name in names] for _ in range(2))
    assert once == again
    assert len(set(once)) == len(names)
    robot = loaded("hexapod")
    assert plain(copy.deepcopy(robot)) == plain(robot)


SMALL: dict[str, Any] = {
    "robot": loaded("3-rpr"),
    "poses": Grid(x=Axis(0, 0.1, 2), y=Axis(0, 0.2, 2)),
}
SMALL["method"] = rs.Batched()
#: What is asked for first, where it is something else, and then; and what is said.
OTHERS: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "robot": ({}, {"robot": loaded("3-rpr-beams")}, "other .*robot"),
    "poses": ({}, {"poses": Grid(x=Axis(0, 0.1, 3))}, "other .*poses"),
    "order of axes": (
        {},
        {"poses": Grid(y=Axis(0, 0.2, 2), x=Axis(0, 0.1, 2))},
        r"axes\[0\]: x, now y",
    ),
    "quantities": ({}, {"quantities": [Quantity.INDICES]}, "other .*quantities"),
    "selection": ({}, {"where": lambda pose: pose["x"] > 0}, "other .*selection"),
    "last digit": (
        {"robot": loaded("gough-stewart-b", {"h": 0.8})},
        {"robot": loaded("gough-stewart-b", {"h": np.nextafter(0.8, 1)})},
        r"other robot.*robot\.\S+.*: \S+, now ",
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


def test_a_changed_parameter_is_named(tmp_path):
    path, legs = tmp_path / "map.zarr", "legs 'leg1'.chain.elements 'actuator'.role.stiffness: "
    rs.stiffness_map(**SMALL, store=path)
    text = (Path(rs.__file__).parent / "robots/3-rpr.yaml").read_text(encoding="utf-8")
    (tmp_path / "3-rpr.yaml").write_text(text.replace("k: 1e6 N/m", "k: 2e6 N/m"))
    other = SMALL | {"robot": rs.load(tmp_path / "3-rpr.yaml")}
    with pytest.raises(InputError, match=re.escape(f"{legs}1000000.0, now 2000000.0")):
        rs.stiffness_map(**other, store=path, resume=True)


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "file").write_text("precious")
    (tmp_path / "folder").mkdir()
    grid = Grid(x=Axis(0, 0.1, 2))
    rs.stiffness_map(loaded("3-rpr"), grid, store=tmp_path / "map.zarr")
    for name in ("file", "folder", "map.zarr"):
        with pytest.raises(InputError, match="where nothing is yet"):
            rs.stiffness_map(loaded("3-rpr"), grid, store=tmp_path / name)
    with pytest.raises(InputError, match="begun by robostiff"):
        rs.stiffness_map(loaded("3-rpr"), grid, store=tmp_path / "folder", resume=True)
    with pytest.raises(InputError, match="existing folder"):
        rs.stiffness_map(loaded("3-rpr"), grid, store=tmp_path / "missing" / "map.zarr")
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
