"""Maps on disk, damaged in every way: a map as it was written, or one message."""

# ruff: noqa: S311
from __future__ import annotations

import json
import os
import random
import shutil
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import xarray

import robostiff as rs
from robostiff import Axis, Grid, Quantity, Threads
from robostiff.errors import InputError
from robostiff.io.map_files import read_map, write_map_netcdf
from tests.campaign.answers import Complaint
from tests.campaign.mutations import mutated_bytes, mutated_tree

KINDS = ("map.zarr", "map.nc", "begun.zarr", "map.zarr")
LIMIT_SECONDS = 5.0
_WAITING = 20  # as long as the processor may take
GRID = Grid(x=Axis(-0.05, 0.05, 3), rz=Axis(-0.1, 0.1, 4))
POSES = rs.RandomPoses(20_000, {"x": (-0.05, 0.05)}, seed=1)


class Failure(AssertionError):
    """A damaged map that was taken for a whole one, or that ended in no message."""


@dataclass(frozen=True)
class Originals:
    """Maps as they were written, and what they hold."""

    folder: Path
    grid: xarray.Dataset
    poses: xarray.Dataset


class _Interruption(Exception):
    pass


def originals(folder: Path) -> Originals:
    """A map as NetCDF and as Zarr, and one in Zarr that was interrupted."""
    robot = rs.load("3-rpr")
    grid = rs.stiffness_map(robot, GRID, [Quantity.STIFFNESS, Quantity.WORST_DEFLECTION])
    write_map_netcdf(grid, folder / "map.nc")
    rs.stiffness_map(
        robot, GRID, [Quantity.STIFFNESS, Quantity.WORST_DEFLECTION], store=folder / "map.zarr"
    )

    def stop(_: Any) -> None:
        raise _Interruption

    with suppress(_Interruption):
        _of_poses(folder / "begun.zarr", progress=stop)
    return Originals(folder, grid, rs.stiffness_map(robot, POSES, method=rs.Batched()).load())


def _of_poses(path: Path, **options: Any) -> xarray.Dataset:
    one = {"method": rs.Batched(), "scheduler": Threads(1)}
    return rs.stiffness_map(rs.load("3-rpr"), POSES, store=path, resume=True, **one, **options)


def _damaged(content: bytes, random_: random.Random) -> bytes | None:
    """Other content of a file; None for no file."""
    kind, at = random_.randrange(9), random_.randrange(len(content))
    if kind < 2:
        return mutated_bytes(content, random_)
    if kind == 2:
        return content[:at]
    if kind == 3:
        return random_.choice((b"", bytes(len(content))))
    if kind == 4:
        return None
    if kind == 5:  # lengths and addresses are what HDF5 trusts
        number = random_.choice((0, 1, 2**16, 2**31, 2**32 - 1, 2**40, 2**63))
        return content[:at] + number.to_bytes(8, "little") + content[at + 8 :]
    if kind == 6:
        run = random_.randbytes(random_.randrange(1, 200))
        return content[:at] + run + content[at + random_.choice((0, len(run))) :]
    try:
        return json.dumps(mutated_tree(json.loads(content), random_)).encode()
    except ValueError:
        return bytes(x ^ (1 << random_.randrange(8)) * (k == at) for k, x in enumerate(content))


def _damage(target: Path, random_: random.Random) -> str:
    """Damage one file of a map; says which."""
    file = target
    if target.is_dir():
        files = sorted(f for f in target.rglob("*") if f.is_file() and f.stat().st_size)
        described = [file for file in files if file.name == "zarr.json"]
        file = random_.choice(described if random_.random() < 0.4 else files)
    content = _damaged(file.read_bytes(), random_)
    if content is None:
        file.unlink()
        if random_.random() < 0.3:
            file.mkdir()
    else:
        file.write_bytes(content)
    if random_.random() < 0.1 and target.is_dir():
        shutil.rmtree(file.parent, ignore_errors=True)
    return str(file.relative_to(target.parent))


def _read(kind: str, path: Path) -> xarray.Dataset:
    if kind == "begun.zarr":
        return _of_poses(path).load()
    return read_map(path).load()


def check(whole: Originals, kind: str, seed: int) -> str:
    """Damage a map and read it: the outcome in a word.

    Raises
    ------
    Failure
        When it ends in anything but the map as it was written, or a message that names the file.
        All of NetCDF but its values has no checksum: it may be read changed.
    """
    random_ = random.Random(seed)
    with tempfile.TemporaryDirectory(prefix="robostiff-damaged-") as folder:
        path = Path(folder) / kind
        original = whole.folder / kind
        if original.is_dir():
            shutil.copytree(original, path)
        else:
            shutil.copy(original, path)
        how = _damage(path, random_)
        started, spent = time.monotonic(), _processor()
        try:
            found = _read(kind, path)
        except InputError as error:
            if str(path) not in str(error):
                raise Failure(f"{kind}, seed {seed}, {how}: no file in {error}") from None
            outcome = "refused"
        except Exception as error:
            text = f"{kind}, seed {seed}, {how}: {type(error).__name__}: {error}"
            raise Failure(text) from error
        else:
            wanted = whole.poses if kind == "begun.zarr" else whole.grid
            if path.suffix == ".zarr" and not found.identical(wanted):
                raise Failure(f"{kind}, seed {seed}, {how}: taken for a whole map")
            outcome = "read"
        # What others do on this machine is no matter; a reader that waits in vain is.
        seconds = max(_processor() - spent, (time.monotonic() - started) / _WAITING)
        if seconds > LIMIT_SECONDS:
            raise Failure(f"{kind}, seed {seed}, {how}: {seconds:.1f} s")
        return outcome


def _processor() -> float:
    """Seconds of processor of this process and of those that it waited for."""
    return sum(os.times()[:4])


@cache
def _originals() -> tuple[tempfile.TemporaryDirectory[str], Originals]:
    """Those of this process, and their folder, which goes when it ends."""
    folder = tempfile.TemporaryDirectory(prefix="robostiff-maps-")
    return folder, originals(Path(folder.name))


def judged_store(seed: int, number: int) -> list[Complaint]:
    """What is wrong with the answer to a damaged map."""
    try:
        check(_originals()[1], KINDS[number % len(KINDS)], seed + number)
    except Failure as failure:
        return [Complaint("map", "damaged", str(failure))]
    return []
