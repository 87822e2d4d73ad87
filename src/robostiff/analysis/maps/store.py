"""A map on disk: Zarr written block by block, which can be resumed after a kill at any moment.

A block is one chunk of every array. When its chunks are safely on disk, one line is added to a
journal, with the summary of the block; what the journals hold is done, anything else is computed
again, into the same chunks. A worker has a journal of its own, so that nobody waits for a lock.
When all blocks are done the summary moves to the attributes of the store, and the journals go.
"""

from __future__ import annotations

import json
import os
import shutil
import uuid
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any
from zlib import crc32

import numpy as np

from robostiff.analysis.maps.job import MapJob, PoseBlock
from robostiff.analysis.maps.layout import (
    range_attributes,
    summary_attributes,
)
from robostiff.analysis.maps.new_store import sync
from robostiff.analysis.maps.stored import (
    IDENTITY,
    JOURNALS,
    StoredMap,
    damaged,
    read_store,
    sealed,
)
from robostiff.analysis.maps.summary import MapSummary
from robostiff.analysis.maps.variables import Variable

if TYPE_CHECKING:
    import zarr


class MapStore:
    """Writes blocks, and knows which are done; picklable, one copy a process.

    Parameters
    ----------
    path : Path
        Of a store that exists.
    job : MapJob
    """

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
            values = block.arrays[variable.name].reshape(*variable.shape, *shape)
            poses_first = np.moveaxis(
                values, range(len(variable.shape)), range(-len(variable.shape), 0)
            )
            self._array(variable.name)[part] = poses_first
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
        from robostiff.analysis.maps.dataset import is_sound

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
            config: Any = {"write_empty_chunks": True}
            self._arrays[name] = zarr.open_array(self.path / name, mode="r+", config=config)
        return self._arrays[name]
