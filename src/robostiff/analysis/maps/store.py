"""A map on disk: Zarr written block by block, which can be resumed after a kill at any moment.

A block is one chunk of every array. When its chunks are safely on disk, one line is added to a
journal, with the summary of the block; what the journals hold is done, anything else is computed
again, into the same chunks. A worker has a journal of its own, so that no worker waits for a lock.
When all blocks are done the summary moves to the attributes of the store, and the journals go.
"""

from __future__ import annotations

import json
import os
import shutil
import uuid
from collections.abc import Mapping
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any
from zlib import crc32

import numpy as np

from robostiff.analysis.maps.dataset import (
    coordinate_arrays,
    own_coordinates,
    range_attributes,
    summary_attributes,
    variable_attributes,
)
from robostiff.analysis.maps.job import MapJob, MapSummary, PoseBlock
from robostiff.analysis.maps.stored import (
    IDENTITY,
    JOURNALS,
    StoredMap,
    array_checksum,
    damaged,
    read_store,
    sealed,
)
from robostiff.analysis.maps.variables import Variable
from robostiff.errors import InputError

if TYPE_CHECKING:
    import zarr

_LONGEST = 2**20  # values in a chunk of a coordinate
_SHRINKS = 20  # how much smaller a map may become on disk


def create_store(
    path: Path,
    job: MapJob,
    identity: Mapping[str, str],
    attributes: Mapping[str, Any],
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
    sync(path.parent)


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
    begun: Path, job: MapJob, identity: Mapping[str, str], attributes: Mapping[str, Any]
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
    for name, coordinate in coordinate_arrays(job).items():
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
    group.create_group(JOURNALS)
    every = dict(attributes)
    if names := own_coordinates(job):
        every["coordinates"] = " ".join(names)
    variables = [variable.name for variable in job.variables]
    described = {
        name: json.loads((begun / name / "zarr.json").read_text(encoding="utf-8"))
        for name in (*variables, *coordinate_arrays(job))
    }
    every[IDENTITY] = {
        "parts": dict(identity),
        "variables": variables,
        "complete": False,
        "attributes": sorted(every),
        "arrays": {name: array_checksum(own) for name, own in described.items()},
    }
    group.attrs.update(sealed(json.loads(json.dumps(every))))


def check_identity(path: Path, identity: Mapping[str, str]) -> None:
    """Raise unless a store holds the very map that is asked for."""
    stored = read_store(path).identity["parts"]
    other = [part for part in identity if stored.get(part) != identity[part]]
    if other:
        raise InputError(
            f"map in {str(path)!r}",
            got=f"one with other {' and other '.join(other)}",
            expected="the very map that was begun",
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


def sync(path: Path) -> None:
    """Wait until a file or the entries of a folder are on disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


class MapStore:
    """Writes blocks of a store that exists; picklable, one copy a process."""

    def __init__(self, path: Path, job: MapJob) -> None:
        self.path = path
        self.job = job
        self._lock = Lock()
        self._journal: int | None = None
        self._arrays: dict[str, zarr.Array] = {}

    def __getstate__(self) -> dict[str, Any]:
        """Open files stay with the process that has opened them."""
        return {"path": self.path, "job": self.job}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["path"], state["job"])

    def compute(self, index: int) -> MapSummary:
        """Compute a block, put it on disk, and sum it up."""
        block = self.job.compute(index)
        try:
            self.write(index, block)
        except (FileNotFoundError, FileExistsError, IsADirectoryError, NotADirectoryError) as error:
            raise damaged(self.path, f"{error.filename!r}: {error.strerror}") from None
        return block.summary

    def write(self, index: int, block: PoseBlock) -> None:
        """Put a block on disk, and only then into the journal."""
        part = self.job.partition.slices(index)
        shape = tuple(where.stop - where.start for where in part)
        chunks = []
        for variable in self.job.variables:
            values = block.arrays[variable.name]
            self._array(variable.name)[part] = variable.poses_first(values, shape)
            chunks.append(self._chunk(variable, index))
        for chunk in chunks:
            sync(chunk)
            sync(chunk.parent)
        text = json.dumps({"block": index, **block.summary.as_data()})
        line = f"{text} {crc32(text.encode()):08x}\n"
        with self._lock:
            if self._journal is None:
                name = self.path / JOURNALS / f"{uuid.uuid4().hex}.jsonl"
                self._journal = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND)
                sync(name.parent)
            os.write(self._journal, line.encode())
            os.fsync(self._journal)

    def done(self) -> dict[int, MapSummary]:
        """Blocks that are on disk as they were written, with their summaries.

        A block is computed again where its line in the journal or one of its chunks is damaged.
        """
        stored = read_store(self.path)
        found: dict[int, MapSummary] = {}
        journals = self.path / JOURNALS
        if not journals.is_dir():
            raise damaged(self.path, f"no folder {JOURNALS!r}")
        for journal in sorted(journals.glob("*.jsonl")):
            try:
                text = journal.read_text(encoding="utf-8", errors="replace")
            except OSError as error:
                what = f"{journal.name} that cannot be read ({error.strerror})"
                raise damaged(self.path, what) from None
            for line in text.splitlines(keepends=True):
                # The last line of a killed worker may be torn: that block is not done.
                data, _, mark = line.rpartition(" ")
                if mark == f"{crc32(data.encode()):08x}\n":
                    index, summary = self._entry(data)
                    found[index] = summary
        return {index: found[index] for index in sorted(found) if self._is_whole(stored, index)}

    def _entry(self, line: str) -> tuple[int, MapSummary]:
        try:
            data = json.loads(line)
            index, summary = data["block"], MapSummary.from_data(data)
            if not 0 <= index < len(self.job.partition):
                raise ValueError(index)
        except (ValueError, TypeError, KeyError, AttributeError):
            raise damaged(self.path, "a journal of blocks that it does not have") from None
        return index, summary

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
        """Mark the map as complete: final attributes first, then away with the journals."""
        import zarr

        self.close()
        for name, attributes in range_attributes(summary).items():
            self._array(name).attrs.update(attributes)
        group = zarr.open_group(self.path, mode="r+")
        attributes = {**group.attrs.asdict(), **summary_attributes(summary)}
        identity: Any = attributes[IDENTITY]
        names = sorted({*identity["attributes"], *summary_attributes(summary)})
        attributes[IDENTITY] = {
            **identity,
            "complete": True,
            "summary": summary.as_data(),
            "attributes": names,
        }
        group.attrs.update(sealed(json.loads(json.dumps(attributes))))
        sync(self.path / "zarr.json")
        # All at once: half a folder would not be Zarr.
        away = self.path.with_name(f".{self.path.name}.{uuid.uuid4().hex[:8]}")
        (self.path / JOURNALS).rename(away)
        shutil.rmtree(away, ignore_errors=True)

    def close(self) -> None:
        """Close the journal of this process."""
        with self._lock:
            if self._journal is not None:
                os.close(self._journal)
                self._journal = None

    def _array(self, name: str) -> zarr.Array:
        import zarr

        if name not in self._arrays:
            # A chunk without an answer is written, too: a chunk that is not there is lost.
            array = zarr.open_array(self.path / name, mode="r+")
            self._arrays[name] = array.with_config({"write_empty_chunks": True})
        return self._arrays[name]
