"""A map of which only reductions are kept, in one file if it is to go on after an interruption."""

from __future__ import annotations

import json
import math
import time
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.maps.job import (
    MapJob,
    MapSummary,
    Partition,
    coordinate_arrays,
    count_of_each,
    identity,
    map_attributes,
    summary_attributes,
)
from robostiff.analysis.maps.reduction import Reduction, State
from robostiff.analysis.maps.run import Run
from robostiff.analysis.maps.store import already_there, check_same_map
from robostiff.analysis.maps.variables import Variable
from robostiff.analysis.record_file import plain
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.whole_file import whole_file

if TYPE_CHECKING:
    import xarray

# Poses of a block by a kernel, and of those left to the direct form at once.
_BLOCK, _TOGETHER = 2**20, 2**14
_CACHE = 2**22  # bytes of poses and values of a piece, so that most stays in the cache
_SAVED = 5.0  # s between two states on disk
_LARGEST = 2**30  # bytes of all arrays in a file
_FORMAT = "reductions of a map by robostiff, 2"

#: What a worker gives for a block: counts, and a state for each reduction of each variable.
BlockFound = tuple[MapSummary, list[State]]


@frozen
class BlockReductions:
    """Computes blocks of which reductions are left; picklable.

    A block is several pieces of a map that stay in the cache. Poses that a kernel leaves to the
    direct form are computed together, some thousands at once.
    """

    job: MapJob
    reductions: tuple[Reduction, ...]

    @cached_property
    def pairs(self) -> list[tuple[Reduction, Variable]]:
        """Each reduction with each of its variables."""
        return [(r, v) for r in self.reductions for v in r.variables(self.job)]

    @cached_property
    def pieces(self) -> Partition:
        """Parts of the map that are computed one after the other."""
        job = self.job
        if job.evaluator.kernel is None:
            return job.partition
        size = sum(v.bytes_a_pose for v in job.answers) + 8 * len(job.columns.names)
        return Partition.of(job.source.shape, max(1, _CACHE // size))

    @cached_property
    def blocks(self) -> list[range]:
        """Numbers of the pieces of each block."""
        if self.job.evaluator.kernel is None:
            return [range(k, k + 1) for k in range(len(self.pieces))]
        size, count = max(1, _BLOCK // math.prod(self.pieces.block)), len(self.pieces)
        return [range(k, min(k + size, count)) for k in range(0, count, size)]

    def compute(self, index: int) -> BlockFound:
        """Counts of a block, and what reductions have of it."""
        job, pieces = self.job, self.pieces
        room = job.room(math.prod(pieces.block), job.answers)
        states = [reduction.initial_state(math.prod(v.shape)) for reduction, v in self.pairs]
        statuses, guarded = Counter[int](), 0
        rest: list[np.ndarray] = []  # poses of the direct form, and behind them their numbers
        for piece in self.blocks[index]:
            poses, (start, stop) = job.poses(pieces.slices(piece)), pieces.run(piece)
            arrays = {name: rows[..., : stop - start] for name, rows in room.items()}
            doubtful = np.flatnonzero(job.fill(poses, arrays, again=False))
            guarded += doubtful.size
            if doubtful.size and job.evaluator.kernel is not None:
                rest.append(np.vstack([poses[doubtful].T, start + doubtful]))
                statuses.subtract(arrays["status"][doubtful].tolist())
                for rows in (arrays[v.name] for v in job.answers if v.is_float):
                    rows[..., doubtful] = np.nan
            self._add(states, statuses, arrays, range(start, stop))
            is_last = piece == self.blocks[index][-1]
            if rest and (is_last or sum(x.shape[1] for x in rest) > _TOGETHER):
                together = np.concatenate(rest, axis=1)
                direct = replace(job, evaluator=replace(job.evaluator, kernel=None), where=None)
                arrays, rest = job.room(together.shape[1], job.answers), []
                direct.fill(together[:-1].T, arrays)
                self._add(states, statuses, arrays, together[-1].astype(int).tolist())
        closed = [r.final_state(state) for (r, _), state in zip(self.pairs, states, strict=True)]
        return MapSummary(dict(sorted((+statuses).items())), guarded), closed

    def _add(
        self,
        states: list[State],
        statuses: Counter[int],
        arrays: Mapping[str, np.ndarray],
        numbers: Sequence[int],
    ) -> None:
        """Add poses of such numbers to what was found before."""
        statuses.update(count_of_each(arrays["status"]))
        for (reduction, v), state in zip(self.pairs, states, strict=True):
            reduction.extend(state, arrays[v.name].reshape(-1, len(numbers)), numbers)


@dataclass
class ReducedMap:
    """What reductions have of the blocks that are done."""

    work: BlockReductions
    path: Path | None  # where the state is kept
    summary: MapSummary = field(default_factory=MapSummary)
    states: list[State] = field(default_factory=list)
    done: set[int] = field(default_factory=set)

    @classmethod
    def start(
        cls, job: MapJob, reductions: tuple[Reduction, ...], path: Path | None, resume: bool
    ) -> ReducedMap:
        """Nothing yet, or the state at a path of an earlier run.

        Raises InputError when there is none to go on with: it is damaged, or of another map or
        other reductions, or `resume` is False.
        """
        made = cls(BlockReductions(job, reductions), path)
        if path is not None and not path.parent.is_dir():
            raise InputError(
                "store of a map", got=str(path), expected="a path in an existing folder"
            )
        if path is None or not path.exists():
            return made
        if not resume:
            raise already_there(path)
        # Every part of such a file has a checksum. Damaged ones may ask `zipfile` for compressions
        # and encryptions that it has not implemented.
        try:
            with zipfile.ZipFile(path) as whole:
                if sum(part.file_size for part in whole.infolist()) > _LARGEST:
                    raise ValueError(f"more than {_LARGEST} bytes")
            with np.load(path, allow_pickle=False) as data:
                about = json.loads(data["about"].item())
                if about["format"] != _FORMAT:
                    raise ValueError("another format")
                made.states = [
                    {name: data[f"{k}.{name}"] for name in names} for k, names in about["states"]
                ]
                made.done = set(data["done"].tolist())
            made.summary = MapSummary(dict(about["statuses"]), about["guarded"])
        except (
            *(OSError, ValueError, TypeError, LookupError, AttributeError, RecursionError),
            *(EOFError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error),
        ) as error:
            raise InputError(
                f"file to resume {str(path)!r}",
                got=Words(f"no state of reductions that is whole ({error})"),
                expected="one that was begun by robostiff",
                hint="use another path",
            ) from None
        check_same_map(path, about["parts"], made._identity)
        return made

    @property
    def _identity(self) -> dict[str, Any]:
        reductions = plain([self.work.reductions, self.work.pieces.block])
        return {**identity(self.work.job), "reductions": reductions}

    def run_blocks(self, run: Run[BlockFound]) -> Iterator[tuple[int, MapSummary]]:
        """Run what is not done, add blocks in any order, and keep the state now and then."""
        work, saved = self.work, -math.inf  # the first shows whether there is room on the disk
        todo = (k for k in range(len(work.blocks)) if k not in self.done)
        try:
            for index, (summary, states) in run(work.compute, todo):
                pairs = zip(work.pairs, self.states, states, strict=True) if self.states else ()
                self.states = [reduction.sum_of(a, b) for (reduction, _), a, b in pairs] or states
                self.summary += summary
                self.done.add(index)
                if time.monotonic() - saved > _SAVED:
                    self._save()
                    saved = time.monotonic()
                yield index, summary
        finally:
            self._save()

    def _save(self) -> None:
        """Write the state, whole or not at all."""
        if self.path is None or not self.done:
            return
        about = {
            "format": _FORMAT,
            "parts": self._identity,
            "statuses": list(self.summary.statuses.items()),
            "guarded": self.summary.guarded,
            "states": [[k, list(state)] for k, state in enumerate(self.states)],
        }
        arrays: dict[str, Any] = {
            f"{k}.{name}": x for k, state in enumerate(self.states) for name, x in state.items()
        }
        arrays |= {"about": np.array(json.dumps(about)), "done": np.array(sorted(self.done))}
        with whole_file(self.path) as draft, draft.open("wb") as file:
            np.savez_compressed(file, **arrays)

    def dataset(self) -> xarray.Dataset:
        """Reductions of all poses, with names, units and words of their variables."""
        import xarray

        job = self.work.job
        arrays: dict[str, Any] = {}
        coordinates: dict[str, Any] = {}
        for (r, v), state in zip(self.work.pairs, self.states, strict=True):
            for name, labels, values, has_unit in r.results(state, v.name, math.prod(v.shape), job):
                coordinates |= {dim: (dim, list(known)) for dim, known in labels.items()}
                about = {"long_name": f"{name.removeprefix(v.name)[1:]} of the {v.long_name}"}
                if isinstance(v.units, str) and has_unit:
                    about["units"] = v.units
                shape = (*values.shape[:-1], *v.shape)
                arrays[name] = (*labels, *v.dims), values.reshape(shape), about
        dims = {dim for names, _, _ in arrays.values() for dim in names}
        known = coordinate_arrays(job).items()
        coordinates |= {name: array for name, array in known if dims.issuperset(array[0])}
        attributes = {**map_attributes(job), **summary_attributes(self.summary)}
        return xarray.Dataset(arrays, coordinates, attributes)
