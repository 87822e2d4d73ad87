"""A map on disk: Zarr that xarray writes region by region, resumed after a kill at any moment.

A block is a region of every array, in one chunk. When it is written it is marked as done, by a
file with its summary; a block without a mark, or with a damaged chunk, is computed again. When all
are done the summary moves to the attributes of the store, and the marks go.
"""

from __future__ import annotations

import json
import shutil
import sys
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zlib import crc32

import numpy as np

from robostiff.analysis.identity import differences
from robostiff.analysis.maps.dataset import (
    coordinate_arrays,
    map_dataset,
    range_attributes,
    summary_attributes,
)
from robostiff.analysis.maps.job import MapJob, MapSummary
from robostiff.analysis.maps.stored import (
    IDENTITY,
    StoredMap,
    damaged,
    is_sound,
    read_store,
    write_root,
)
from robostiff.analysis.maps.variables import Variable
from robostiff.errors import InputError, needs_extra

if TYPE_CHECKING:
    import xarray

_MARKS = "progress"
_LOCK = "lock"
_LONGEST = 2**20  # values in a chunk of a coordinate
_NAMED = 3  # differences between two maps
_SHRINKS = 20  # how much smaller a map may become on disk


def create_store(
    path: Path, job: MapJob, identity: Mapping[str, Any], attributes: Mapping[str, Any]
) -> None:
    """Make an empty store beside its place, then move it there whole."""
    if not path.parent.is_dir():
        raise InputError("store of a map", got=str(path), expected="a path in an existing folder")
    begun = path.with_name(f".{path.name}.{uuid.uuid4().hex[:8]}")
    try:
        _fill_with_nothing(begun, job, identity, attributes)
        if path.exists():
            raise already_there(path)
        begun.rename(path)
    finally:
        shutil.rmtree(begun, ignore_errors=True)


def check_room(path: Path, job: MapJob) -> None:
    """Raise where even a map that is nearly all out of reach would fill the disk."""
    if path.exists() or not path.parent.is_dir():
        return  # nothing is begun here
    needed, free = job.bytes_a_pose * job.partition.poses, shutil.disk_usage(path.parent).free
    if needed > _SHRINKS * free:
        raise InputError(
            "map on disk",
            got=f"{needed / 2**30:.3g} GiB for {job.partition.poses} poses",
            expected=f"not much more than the {free / 2**30:.3g} GiB that are free",
            hint="take fewer poses or quantities, or another disk",
        )


def _fill_with_nothing(
    begun: Path, job: MapJob, identity: Mapping[str, Any], attributes: Mapping[str, Any]
) -> None:
    """Attributes, coordinates, and arrays without a chunk."""
    import dask.array
    import zarr
    from zarr.codecs import BloscCodec, Crc32cCodec, TransposeCodec

    partition = job.partition
    lead, arrays, encoding = len(partition.shape), {}, {}
    for variable in job.variables:
        shape, own = (*partition.shape, *variable.shape), len(variable.shape)
        arrays[variable.name] = dask.array.empty(shape, dtype=variable.dtype, chunks=-1)
        # Entries of a matrix lie in planes, as in memory: writing needs no transposition, and
        # neighbours are alike.
        order = (*range(lead, lead + own), *range(lead))
        encoding[variable.name] = {
            "chunks": (*partition.block, *variable.shape),
            "filters": (TransposeCodec(order=order),) if own else (),
            "compressors": (BloscCodec(cname="lz4", clevel=1, shuffle="shuffle"), Crc32cCodec()),
            # 0 would make a place that was not written look like an answer.
            "fill_value": variable.missing,
            "_FillValue": None,
        }
    identity = {"parts": dict(identity), "variables": list(arrays), "complete": False}
    empty = map_dataset(job, arrays, {**attributes, IDENTITY: identity})
    for name in coordinate_arrays(job):
        values = empty[name]
        encoding[name] = {
            "chunks": tuple(max(1, min(n, _LONGEST)) for n in values.shape),
            "compressors": (Crc32cCodec(),),
        }
        if values.dtype.kind == "U":  # of any length, as Zarr has them
            empty[name] = values.astype(np.dtypes.StringDType())
    empty.to_zarr(
        begun,
        mode="w-",
        compute=False,
        zarr_format=3,
        consolidated=False,
        encoding=encoding,
        write_empty_chunks=True,  # zeros are values like others
    )
    zarr.open_group(begun).create_group(_MARKS)
    root = json.loads((begun / "zarr.json").read_text(encoding="utf-8"))
    root["consolidated_metadata"] = {
        "kind": "inline",
        "must_understand": False,
        "metadata": {
            name: json.loads((begun / name / "zarr.json").read_text(encoding="utf-8"))
            for name in encoding
        },
    }
    write_root(begun, root)


def check_identity(path: Path, identity: Mapping[str, Any]) -> StoredMap:
    """The store at a path; InputError unless it holds the very map that is asked for."""
    stored = read_store(path)
    check_same_map(path, stored.identity["parts"], identity)
    return stored


def check_same_map(path: Path, parts: Mapping[str, Any], identity: Mapping[str, Any]) -> None:
    """Raise where a map that was begun depends on other parts than the one that is asked for."""
    other = [part for part in identity if parts.get(part) != identity[part]]
    if other:
        changes = [own for p in other for own in differences(parts.get(p), identity[p], p)]
        more = f", and {len(changes) - _NAMED} more" if len(changes) > _NAMED else ""
        raise InputError(
            f"map in {str(path)!r}: one with other {' and other '.join(other)}",
            expected=f"the very map that was begun; different are "
            f"{', '.join(changes[:_NAMED])}{more}",
            hint="use another path, or remove that map",
        )


def already_there(path: Path) -> InputError:
    """The error for a path that exists."""
    return InputError(
        "output of a map",
        got=str(path),
        expected="a path where nothing is yet",
        hint="use another path"
        + ("; an interrupted map continues with resume=True (--resume)" if path.is_dir() else ""),
    )


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Keep other processes from filling the same store; the lock ends with the process."""
    try:
        file = (path / _MARKS / _LOCK).open("w")
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
        raise damaged(path, f"no folder {_MARKS!r} of its own") from None
    with file:
        try:
            if sys.platform == "win32":
                import msvcrt

                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                import fcntl

                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):  # of POSIX, of Windows
            raise InputError(
                f"map in {str(path)!r}",
                got="a store that another process is filling",
                expected="one process at a time",
                hint="wait until it has ended, or use another path",
            ) from None
        yield


@dataclass(frozen=True)
class MapStore:
    """Writes blocks of a store that exists; picklable, one copy a process."""

    path: Path
    job: MapJob

    def compute(self, index: int) -> MapSummary:
        """Compute a block, put it on disk, and sum it up."""
        block, summary = self.job.compute(index)
        try:
            self._write(index, block, summary)
        except (FileNotFoundError, FileExistsError, IsADirectoryError, NotADirectoryError) as error:
            raise damaged(self.path, f"{error.filename!r}: {error.strerror}") from None
        return summary

    def _write(self, index: int, block: Mapping[str, np.ndarray], summary: MapSummary) -> None:
        """Put a block on disk, and only then mark it as done."""
        import xarray

        part, dims = self.job.partition.slices(index), self.job.source.dims
        shape = tuple(where.stop - where.start for where in part)
        arrays: dict[str, Any] = {
            v.name: ((*dims, *v.dims), v.poses_first(block[v.name], shape))
            for v in self.job.variables
        }
        # A chunk without an answer is written, too: a chunk that is not there is lost.
        region = dict(zip(dims, part, strict=True))
        xarray.Dataset(arrays).to_zarr(self.path, region=region, write_empty_chunks=True)
        text = json.dumps(summary.as_data())
        mark = f"{text} {crc32(text.encode()):08x}"
        (self.path / _MARKS / str(index)).write_text(mark, encoding="utf-8")

    def done(self) -> dict[int, MapSummary]:
        """Blocks that are on disk as they were written, with their summaries.

        A block is computed again where its mark or one of its chunks is damaged. Descriptions of
        arrays are written again from that of the whole, which was checked.
        """
        stored = read_store(self.path)
        try:
            self._describe(stored)
        except OSError as error:
            raise damaged(self.path, f"{error.filename!r}: {error.strerror}") from None
        found: dict[int, MapSummary] = {}
        for index in range(len(self.job.partition)):
            try:
                mark = (self.path / _MARKS / str(index)).read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError):
                continue
            text, _, checksum = mark.rpartition(" ")  # of a killed process it may be torn
            chunks = (self._chunk(variable, index) for variable in self.job.variables)
            if checksum == f"{crc32(text.encode()):08x}" and all(map(is_sound, chunks)):
                found[index] = MapSummary.from_data(json.loads(text))
        return found

    def _chunk(self, variable: Variable, index: int) -> bytes | None:
        """What the file of a chunk holds; None without one."""
        place = (*self.job.partition.place(index), *[0] * len(variable.shape))
        with suppress(OSError):
            return self.path.joinpath(variable.name, "c", *map(str, place)).read_bytes()
        return None

    def finish(self, summary: MapSummary) -> None:
        """Write the summary, which makes the map complete."""
        stored = read_store(self.path)
        for name, attributes in range_attributes(summary).items():
            stored.described[name]["attributes"] |= attributes
        self._describe(stored)
        stored.root["attributes"] |= summary_attributes(summary)
        stored.identity["complete"] = True
        write_root(self.path, stored.root)

    def _describe(self, stored: StoredMap) -> None:
        for name, own in stored.described.items():
            (self.path / name / "zarr.json").write_text(json.dumps(own), encoding="utf-8")

    def remove_marks(self) -> None:
        """Away with the marks of a complete map, all at once: half a folder would not be Zarr."""
        away = self.path.with_name(f".{self.path.name}.{uuid.uuid4().hex[:8]}")
        (self.path / _MARKS).rename(away)
        shutil.rmtree(away, ignore_errors=True)


def open_map(path: Path) -> xarray.Dataset:
    """The map in a store, read and checked when its values are asked for."""
    with needs_extra("maps", "maps"):
        import xarray

        from robostiff.analysis.maps.chunks import CheckedChunks

    store: Any = CheckedChunks(read_store(path))
    try:
        found = xarray.open_zarr(store, consolidated=True, zarr_format=3)
    except InputError:
        raise
    except Exception as error:  # any failure of Zarr at a store of another program
        raise damaged(
            path, f"contents that Zarr cannot read ({type(error).__name__}: {error})"
        ) from None
    about = found.attrs.pop(IDENTITY)
    ordered = [name for name in about["variables"] if name in found.data_vars]
    words = {
        name: found[name].copy(data=np.array(found[name].values.tolist()))
        for name in found.coords
        if found[name].dtype.kind in "TO"  # NetCDF and older programs know no such texts
    }
    return found[ordered].assign_coords(words)
