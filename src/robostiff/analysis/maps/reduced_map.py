"""A map of which only reductions are kept, in one file if it is to go on after an interruption."""

from __future__ import annotations

import json
import math
import time
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from robostiff.analysis.identity import plain
from robostiff.analysis.maps.dataset import coordinate_arrays, summary_attributes
from robostiff.analysis.maps.evaluator import MapEvaluator
from robostiff.analysis.maps.job import MapJob, MapSummary, Partition
from robostiff.analysis.maps.reduction import Reduction, State
from robostiff.analysis.maps.request import MapRequest
from robostiff.analysis.maps.store import already_there, check_same_map
from robostiff.analysis.maps.variables import Variable
from robostiff.errors import InputError
from robostiff.whole_file import whole_file

if TYPE_CHECKING:
    import xarray

# Poses of a block by a kernel, and of those left to the direct form at once.
_BLOCK, _TOGETHER = 2**20, 2**14
_CACHE = 2**22  # bytes of poses and values that stay in the second-level cache
_SAVED = 5.0  # s between two states on disk
_LARGEST = 2**30  # bytes of all arrays in a file
_FORMAT = "reductions of a map by robostiff"

#: What a worker gives for a block: counts, and a state for each reduction of each variable.
BlockFound = tuple[MapSummary, list[State]]


@dataclass(frozen=True)
class BlockReductions:
    """Computes blocks of which reductions are left; picklable.

    A block is gone through in pieces that stay in the cache. Poses that a kernel leaves to the
    direct form are computed together, some thousands at once.
    """

    job: MapJob
    reductions: tuple[Reduction, ...]

    @cached_property
    def each(self) -> list[tuple[Reduction, Variable]]:
        """Each reduction with each of its variables."""
        return [(own, v) for own in self.reductions for v in own.variables(self.job)]

    @cached_property
    def quick(self) -> MapJob | None:
        """The same by a kernel that leaves some poses; None without a kernel."""
        own = self.job.evaluator
        if not isinstance(own, MapEvaluator) or own.kernel is None:
            return None
        return replace(self.job, evaluator=replace(own, recomputes=False))

    @cached_property
    def partition(self) -> Partition:
        """The blocks."""
        job = self.job
        return job.partition if self.quick is None else Partition.of(job.source.shape, _BLOCK)

    def compute(self, index: int) -> BlockFound:
        """Counts of a block, and what reductions have of it."""
        part, (start, _) = self.partition.slices(index), self.partition.run(index)
        job, names = self.quick or self.job, self.job.variables
        most = max(1, _CACHE // (job.bytes_a_pose + 8 * len(job.columns.names)))
        pieces = Partition.of(tuple(s.stop - s.start for s in part), most)
        room = job.room(min(most, pieces.poses))
        states = [own.begun(math.prod(v.shape)) for own, v in self.each]
        statuses, guarded = Counter[int](), 0
        left: list[np.ndarray] = []  # poses of the direct form, and behind them their numbers
        for piece in range(len(pieces)):
            inside = zip(part, pieces.slices(piece), strict=True)
            poses = job.poses(tuple(slice(s.start + p.start, s.start + p.stop) for s, p in inside))
            first, stop = pieces.run(piece)
            arrays = {name: rows[..., : stop - first] for name, rows in room.items()}
            doubtful = np.flatnonzero(job.fill(poses, arrays))
            guarded += doubtful.size
            if doubtful.size and self.quick is not None:
                left.append(np.vstack([poses[doubtful].T, start + first + doubtful]))
                statuses.subtract(arrays["status"][doubtful].tolist())
                for rows in (arrays[v.name] for v in names if v.is_float):
                    rows[..., doubtful] = np.nan
            self._add(states, statuses, arrays, range(start + first, start + stop))
            if left and (piece == len(pieces) - 1 or sum(x.shape[1] for x in left) > _TOGETHER):
                self._add_direct(states, statuses, np.concatenate(left, axis=1))
                left = []
        return MapSummary(pieces.poses, dict(sorted((+statuses).items())), guarded), states

    def _add_direct(self, states: list[State], statuses: Counter[int], left: np.ndarray) -> None:
        evaluator = replace(cast("MapEvaluator", self.job.evaluator), kernel=None)
        job = replace(self.job, evaluator=evaluator, where=None)
        arrays = job.room(left.shape[1])
        job.fill(left[:-1].T, arrays)
        self._add(states, statuses, arrays, left[-1].astype(int).tolist())

    def _add(
        self,
        states: list[State],
        statuses: Counter[int],
        arrays: Mapping[str, np.ndarray],
        numbers: Sequence[int],
    ) -> None:
        """Add poses of such numbers to what was found before."""
        counts, count = np.bincount(arrays["status"]), len(numbers)
        statuses.update({int(code): int(counts[code]) for code in np.flatnonzero(counts)})
        for (own, v), state in zip(self.each, states, strict=True):
            own.extend(state, arrays[v.name].reshape(-1, count), numbers)


@dataclass
class ReducedMap:
    """What reductions have of the blocks that are done."""

    request: MapRequest
    work: BlockReductions
    path: Path | None  # where the state is kept
    summary: MapSummary = field(default_factory=MapSummary)
    states: list[State] = field(default_factory=list)
    done: set[int] = field(default_factory=set)

    @classmethod
    def begun(
        cls, request: MapRequest, reductions: tuple[Reduction, ...], path: Path | None, resume: bool
    ) -> ReducedMap:
        """Nothing yet, or the state at a path of an earlier run.

        Raises InputError when there is none to go on with: it is damaged, or of another map or
        other reductions, or `resume` is False.
        """
        made = cls(request, BlockReductions(request.job, reductions), path)
        if path is not None and not path.parent.is_dir():
            raise InputError(
                "store of a map", got=str(path), expected="a path in an existing folder"
            )
        if path is not None and path.exists():
            if not resume:
                raise already_there(path)
            made._read(path)
        return made

    @property
    def todo(self) -> Iterator[int]:
        """Blocks that are not done."""
        return (k for k in range(len(self.work.partition)) if k not in self.done)

    @property
    def _identity(self) -> dict[str, Any]:
        own = plain([self.work.reductions, self.work.partition.block])
        return {**self.request.identity(), "reductions": own}

    def _read(self, path: Path) -> None:
        """Go on from the state on disk; every part of such a file has a checksum."""
        try:
            with zipfile.ZipFile(path) as whole:
                if sum(part.file_size for part in whole.infolist()) > _LARGEST:
                    raise ValueError(f"more than {_LARGEST} bytes")
            with np.load(path, allow_pickle=False) as data:
                about = json.loads(data["about"].item())
                if about["format"] != _FORMAT:
                    raise ValueError("another format")
                each = [{name: data[f"{k}.{name}"] for name in own} for k, own in about["states"]]
            summary = MapSummary.from_data(about["summary"])
            done = {k for start, stop in about["done"] for k in range(start, stop)}
        except (
            *(OSError, ValueError, TypeError, LookupError, AttributeError, RecursionError),
            *(EOFError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error),
        ) as error:
            raise InputError(
                f"file to resume {str(path)!r}",
                got=f"no state of reductions that is whole ({error})",
                expected="one that was begun by robostiff",
                hint="use another path",
            ) from None
        check_same_map(path, about["parts"], self._identity)
        self.summary, self.states, self.done = summary, each, done

    def gathered(
        self, blocks: Iterable[tuple[int, BlockFound]]
    ) -> Iterator[tuple[int, MapSummary]]:
        """Add blocks as they are done, in any order, and keep the state now and then."""
        each = [own for own, _ in self.work.each]
        saved = -math.inf  # the first block shows whether there is room on the disk
        try:
            for index, (summary, states) in blocks:
                pairs = zip(each, self.states or states, states, strict=True)
                added = [own.added(a, b) for own, a, b in pairs] if self.states else states
                self.states, self.summary = added, MapSummary.total((self.summary, summary))
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
        ordered = sorted(self.done)
        starts = [k for k in ordered if k - 1 not in self.done]
        stops = [k + 1 for k in ordered if k + 1 not in self.done]
        about = {
            "format": _FORMAT,
            "parts": self._identity,
            "done": list(zip(starts, stops, strict=True)),
            "summary": self.summary.as_data(),
            "states": [[k, list(state)] for k, state in enumerate(self.states)],
        }
        arrays: dict[str, Any] = {
            f"{k}.{name}": own for k, state in enumerate(self.states) for name, own in state.items()
        }
        with whole_file(self.path) as begun, begun.open("wb") as file:
            np.savez_compressed(file, about=np.array(json.dumps(about)), **arrays)

    def dataset(self) -> xarray.Dataset:
        """Reductions of all poses, with names, units and words of their variables."""
        import xarray

        job = self.work.job
        arrays: dict[str, Any] = {}
        coordinates: dict[str, Any] = {}
        for (own, v), state in zip(self.work.each, self.states, strict=True):
            for name, labels, values, has_unit in own.found(state, v.name, job):
                coordinates |= {dim: (dim, list(known)) for dim, known in labels.items()}
                about = {"long_name": f"{name.removeprefix(v.name)[1:]} of the {v.long_name}"}
                if isinstance(v.units, str) and has_unit:
                    about["units"] = v.units
                shape = (*values.shape[:-1], *v.shape)
                arrays[name] = (*labels, *v.dims), values.reshape(shape), about
        dims = {dim for own, _, _ in arrays.values() for dim in own}
        known = coordinate_arrays(job).items()
        coordinates |= {name: array for name, array in known if dims.issuperset(array[0])}
        attributes = {**self.request.attributes, **summary_attributes(self.summary)}
        return xarray.Dataset(arrays, coordinates, attributes)
