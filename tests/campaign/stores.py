"""Maps on disk, damaged in every way: a map as it was written, or one message."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray

import robostiff as rs
from robostiff import Axis, Grid, Quantity, Threads
from robostiff.errors import InputError
from robostiff.io.map_files import read_map, write_map_netcdf
from tests.campaign.answers import Complaint

KINDS = ("map.zarr", "map.nc", "begun.zarr", "map.zarr")
LIMIT_SECONDS = 5.0
_WAITING = 20  # as long as the processor may take
GRID = Grid(x=Axis(-0.05, 0.05, 3), rz=Axis(-0.1, 0.1, 4))
POSES = rs.RandomPoses(20_000, {"x": (-0.05, 0.05)}, seed=1)
_WORDS = ("NaN", "9" * 30, "-1", "null", "[]", '""', "1e308", "\u202e", "{}", "true", "\\u0000")


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


# How a file is damaged: takes what it holds, gives what it holds then; None for no file.


def _flip(content: bytes, random: np.random.Generator) -> bytes | None:
    bits = bytearray(content)
    for _ in range(int(random.integers(1, 4))):
        place = int(random.integers(len(bits)))
        bits[place] ^= 1 << int(random.integers(8))
    return bytes(bits)


def _overwrite(content: bytes, random: np.random.Generator) -> bytes | None:
    start = int(random.integers(len(content)))
    run = int(random.integers(1, 64))
    return content[:start] + random.bytes(run) + content[start + run :]


def _cut(content: bytes, random: np.random.Generator) -> bytes | None:
    return content[: int(random.integers(len(content)))]


def _lengthen(content: bytes, random: np.random.Generator) -> bytes | None:
    start = int(random.integers(len(content) + 1))
    return content[:start] + random.bytes(int(random.integers(1, 200))) + content[start:]


def _empty(content: bytes, random: np.random.Generator) -> bytes | None:
    return b""


def _zeros(content: bytes, random: np.random.Generator) -> bytes | None:
    return bytes(len(content))


def _remove(content: bytes, random: np.random.Generator) -> bytes | None:
    return None


def _integers(content: bytes, random: np.random.Generator) -> bytes | None:
    """Lengths and addresses are what HDF5 trusts."""
    start = int(random.integers(max(1, len(content) - 8)))
    number = int(random.choice([0, 1, 2**16, 2**31, 2**32 - 1, 2**40, 2**63]))
    return content[:start] + number.to_bytes(8, "little") + content[start + 8 :]


def _json(content: bytes, random: np.random.Generator) -> bytes | None:
    """One value of a JSON file becomes another."""
    try:
        data = json.loads(content)
    except ValueError:
        return _flip(content, random)
    places: list[tuple[Any, Any]] = []

    def walk(thing: Any) -> None:
        for key, value in list(thing.items() if isinstance(thing, dict) else enumerate(thing)):
            places.append((thing, key))
            if isinstance(value, dict | list):
                walk(value)

    if not isinstance(data, dict):
        return _flip(content, random)
    walk(data)
    thing, key = places[int(random.integers(len(places)))]
    if random.random() < 0.2:
        del thing[key]
    elif random.random() < 0.3:
        thing[key] = [[]] if random.random() < 0.5 else 10 ** int(random.integers(1, 25))
    else:
        thing[key] = str(random.choice(_WORDS))
    return json.dumps(data).encode()


_DAMAGES: tuple[Callable[[bytes, np.random.Generator], bytes | None], ...] = (
    _flip,
    _flip,
    _overwrite,
    _cut,
    _lengthen,
    _empty,
    _zeros,
    _remove,
    _integers,
    _json,
    _json,
)


def _damage(target: Path, random: np.random.Generator) -> str:
    """Damage one file of a map; says how."""
    if target.is_dir():
        files = sorted(f for f in target.rglob("*") if f.is_file() and f.stat().st_size)
        described = [file for file in files if file.name == "zarr.json"]
        chosen = described if random.random() < 0.4 else files
        file = chosen[int(random.integers(len(chosen)))]
    else:
        file = target
    damage = _DAMAGES[int(random.integers(len(_DAMAGES)))]
    content = damage(file.read_bytes(), random)
    where = file.relative_to(target.parent)
    if content is None:
        file.unlink()
        if random.random() < 0.3:
            file.mkdir()
    else:
        file.write_bytes(content)
    if random.random() < 0.1 and target.is_dir():
        shutil.rmtree(file.parent, ignore_errors=True)
        return f"{where.parent} removed"
    return f"{where}: {damage.__name__.strip('_')}"


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
    random = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory(prefix="robostiff-damaged-") as folder:
        path = Path(folder) / kind
        original = whole.folder / kind
        if original.is_dir():
            shutil.copytree(original, path)
        else:
            shutil.copy(original, path)
        how = _damage(path, random)
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
