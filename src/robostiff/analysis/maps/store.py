"""A map on disk: Zarr written block by block, which a kill at any moment leaves good to resume.

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

import numpy as np

from robostiff.analysis.maps.job import Block, MapJob
from robostiff.analysis.maps.layout import (
    range_attributes,
    summary_attributes,
)
from robostiff.analysis.maps.new_store import IDENTITY, JOURNALS, read_identity, sync
from robostiff.analysis.maps.summary import MapSummary

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
        self.write(index, block)
        return block.summary

    def write(self, index: int, block: Block) -> None:
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
            place = (*self.job.partition.place(index), *[0] * len(variable.shape))
            chunks.append(self.path.joinpath(variable.name, "c", *map(str, place)))
        for chunk in chunks:
            sync(chunk)
            sync(chunk.parent)
        line = json.dumps({"block": index, **block.summary.as_data()}) + "\n"
        with self._lock:
            if self._journal is None:
                name = self.path / JOURNALS / f"{uuid.uuid4().hex}.jsonl"
                self._journal = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND)
                sync(name.parent)
            os.write(self._journal, line.encode())
            os.fsync(self._journal)

    def done(self) -> dict[int, MapSummary]:
        """Blocks that are on disk, with their summaries."""
        found: dict[int, MapSummary] = {}
        for journal in sorted((self.path / JOURNALS).glob("*.jsonl")):
            for line in journal.read_text(encoding="utf-8").splitlines(keepends=True):
                # The last line of a killed worker may be torn: that block is not done.
                if line.endswith("}\n"):
                    data = json.loads(line)
                    found[data["block"]] = MapSummary.from_data(data)
        return found

    def finish(self, summary: MapSummary) -> None:
        """Mark the map as complete: final attributes first, then away with the journals."""
        import zarr

        self.close()
        for name, attributes in range_attributes(summary).items():
            self._array(name).attrs.update(attributes)
        group = zarr.open_group(self.path, mode="r+")
        identity = {**read_identity(self.path), "complete": True, "summary": summary.as_data()}
        group.attrs.update({**summary_attributes(summary), IDENTITY: identity})
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
            self._arrays[name] = zarr.open_array(self.path / name, mode="r+")
        return self._arrays[name]
