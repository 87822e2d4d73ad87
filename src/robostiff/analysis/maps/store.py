"""A map on disk: Zarr written block by block, which can be resumed after a kill at any moment.

A block is one chunk of every array. When its chunks are safely on disk it is marked as done, by a
file with its summary; any other block is computed again, into the same chunks. When all are done
the summary moves to the attributes of the store, and the marks go.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from robostiff.analysis.maps.dataset import (
    coordinate_arrays,
    own_coordinates,
    range_attributes,
    summary_attributes,
    variable_attributes,
)
from robostiff.analysis.maps.identity import differences
from robostiff.analysis.maps.job import MapJob, MapSummary, PoseBlock
from robostiff.analysis.maps.stored import IDENTITY, StoredMap, damaged, read_store, write_root
from robostiff.analysis.maps.variables import Variable
from robostiff.errors import InputError

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
    _sync(path.parent)


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
    import zarr
    from zarr.codecs import BloscCodec, Crc32cCodec, TransposeCodec

    group = zarr.open_group(begun, mode="w-")
    source, partition = job.source, job.partition
    lead = len(partition.shape)
    for variable in job.variables:
        own = len(variable.shape)
        # Entries of a matrix lie in planes, as in memory: writing needs no transposition, and
        # neighbours are alike.
        order = (*range(lead, lead + own), *range(lead))
        group.create_array(
            variable.name,
            shape=(*partition.shape, *variable.shape),
            chunks=(*partition.block, *variable.shape),
            dtype=variable.dtype,
            # 0 would make a place that was not written look like an answer.
            fill_value=variable.missing,
            filters=[TransposeCodec(order=order)] if own else None,
            compressors=[BloscCodec(cname="lz4", clevel=1, shuffle="shuffle"), Crc32cCodec()],
            dimension_names=(*source.dims, *variable.dims),
            attributes=variable_attributes(job, variable),
        )
    coordinates = coordinate_arrays(job)
    for name, coordinate in coordinates.items():
        values = coordinate.values  # texts of any length, as Zarr has them
        group.create_array(
            name,
            data=values.astype(np.dtypes.StringDType()) if values.dtype.kind == "U" else values,
            chunks=tuple(max(1, min(n, _LONGEST)) for n in values.shape),
            compressors=[Crc32cCodec()],
            # Zeros are values like others: every chunk is there.
            config={"write_empty_chunks": True},
            dimension_names=coordinate.dims,
            attributes=dict(coordinate.attributes),
        )
    group.create_group(_MARKS)
    every = dict(attributes)
    if names := own_coordinates(job):
        every["coordinates"] = " ".join(names)
    variables = [variable.name for variable in job.variables]
    every[IDENTITY] = {"parts": dict(identity), "variables": variables, "complete": False}
    root = json.loads((begun / "zarr.json").read_text(encoding="utf-8"))
    root["attributes"] = json.loads(json.dumps(every))
    root["consolidated_metadata"] = {
        "kind": "inline",
        "must_understand": False,
        "metadata": {
            name: json.loads((begun / name / "zarr.json").read_text(encoding="utf-8"))
            for name in (*variables, *coordinates)
        },
    }
    write_root(begun, root)


def check_identity(path: Path, identity: Mapping[str, Any]) -> StoredMap:
    """The store at a path; InputError unless it holds the very map that is asked for."""
    stored = read_store(path)
    parts = stored.identity["parts"]
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
    return stored


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


def _sync(path: Path) -> None:
    """Wait until a file or the entries of a folder are on disk.

    Windows syncs no folders, and files that may be written only.
    """
    if sys.platform == "win32" and path.is_dir():
        return
    handle = os.open(path, os.O_RDWR if sys.platform == "win32" else os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


class MapStore:
    """Writes blocks of a store that exists; picklable, one copy a process."""

    def __init__(self, path: Path, job: MapJob) -> None:
        self.path, self.job = path, job

    def __getstate__(self) -> dict[str, Any]:
        """Open arrays stay with the process that has opened them."""
        return {"path": self.path, "job": self.job}

    def compute(self, index: int) -> MapSummary:
        """Compute a block, put it on disk, and sum it up."""
        block = self.job.compute(index)
        try:
            self._write(index, block)
        except (FileNotFoundError, FileExistsError, IsADirectoryError, NotADirectoryError) as error:
            raise damaged(self.path, f"{error.filename!r}: {error.strerror}") from None
        return block.summary

    def _write(self, index: int, block: PoseBlock) -> None:
        """Put a block on disk, and only then mark it as done."""
        part = self.job.partition.slices(index)
        shape = tuple(where.stop - where.start for where in part)
        for variable in self.job.variables:
            values = block.arrays[variable.name]
            self._arrays[variable.name][part] = variable.poses_first(values, shape)
        for variable in self.job.variables:
            chunk = self._chunk(variable, index)
            _sync(chunk)
            _sync(chunk.parent)
        text = json.dumps(block.summary.as_data())
        with (self.path / _MARKS / str(index)).open("w", encoding="utf-8") as mark:
            mark.write(f"{text} {crc32(text.encode()):08x}")
            mark.flush()
            os.fsync(mark.fileno())
        _sync(self.path / _MARKS)

    def done(self) -> dict[int, MapSummary]:
        """Blocks that are on disk as they were written, with their summaries.

        A block is computed again where its mark or one of its chunks is damaged.
        """
        stored = read_store(self.path)
        found: dict[int, MapSummary] = {}
        for index in range(len(self.job.partition)):
            try:
                mark = (self.path / _MARKS / str(index)).read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError):
                continue
            text, _, checksum = mark.rpartition(" ")  # of a killed process it may be torn
            if checksum == f"{crc32(text.encode()):08x}" and self._is_whole(stored, index):
                found[index] = MapSummary.from_data(json.loads(text))
        return found

    def _is_whole(self, stored: StoredMap, index: int) -> bool:
        from robostiff.analysis.maps.chunks import is_sound

        try:
            return all(
                is_sound(self._chunk(variable, index).read_bytes(), stored.arrays[variable.name])
                for variable in self.job.variables
            )
        except OSError:
            return False

    def _chunk(self, variable: Variable, index: int) -> Path:
        """The file of a chunk."""
        place = (*self.job.partition.place(index), *[0] * len(variable.shape))
        return self.path.joinpath(variable.name, "c", *map(str, place))

    def finish(self, summary: MapSummary) -> None:
        """Write the summary, which makes the map complete."""
        stored = read_store(self.path)
        for name, attributes in range_attributes(summary).items():
            stored.described[name]["attributes"] |= attributes
        for name, own in stored.described.items():
            (self.path / name / "zarr.json").write_text(json.dumps(own), encoding="utf-8")
        stored.root["attributes"] |= summary_attributes(summary)
        stored.identity["complete"] = True
        write_root(self.path, stored.root)

    def remove_marks(self) -> None:
        """Away with the marks of a complete map, all at once: half a folder would not be Zarr."""
        away = self.path.with_name(f".{self.path.name}.{uuid.uuid4().hex[:8]}")
        (self.path / _MARKS).rename(away)
        shutil.rmtree(away, ignore_errors=True)

    @cached_property
    def _arrays(self) -> Mapping[str, Any]:
        """The arrays of Zarr, by the description that was checked."""
        import zarr

        group: Any = zarr.open_group(self.path, mode="r+", use_consolidated=True)
        # A chunk without an answer is written, too: a chunk that is not there is lost.
        return {
            variable.name: group[variable.name].with_config({"write_empty_chunks": True})
            for variable in self.job.variables
        }
