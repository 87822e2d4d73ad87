"""A map of which only reductions are kept, in one file if it is to go on after an interruption."""

from __future__ import annotations

import json
import math
import os
import time
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.identity import plain
from robostiff.analysis.maps.dataset import coordinate_arrays, summary_attributes
from robostiff.analysis.maps.job import MapJob, MapSummary
from robostiff.analysis.maps.reduction import Reduction, State
from robostiff.analysis.maps.request import MapRequest
from robostiff.analysis.maps.store import already_there, check_same_map
from robostiff.errors import InputError

if TYPE_CHECKING:
    import xarray

_SAVED = 5.0  # s between two states on disk
_LARGEST = 2**30  # bytes of all arrays in a file
_FORMAT = "reductions of a map by robostiff"

#: What a worker gives for a block: counts, and a state for each reduction of each variable.
BlockFound = tuple[MapSummary, list[State]]


@dataclass(frozen=True)
class BlockReductions:
    """Computes blocks of which reductions are left; picklable."""

    job: MapJob
    reductions: tuple[Reduction, ...]

    def compute(self, index: int) -> BlockFound:
        """Counts of a block, and what reductions have of it."""
        arrays, summary = self.job.compute(index)
        first, stop = self.job.partition.run(index)
        return summary, [
            own.of_block(arrays[v.name].reshape(-1, stop - first), first)
            for own in self.reductions
            for v in own.variables(self.job)
        ]


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
        cls,
        request: MapRequest,
        reductions: tuple[Reduction, ...],
        path: Path | None,
        resume: bool,
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
        return (k for k in range(len(self.request.job.partition)) if k not in self.done)

    @property
    def _identity(self) -> dict[str, Any]:
        return {**self.request.identity(), "reductions": plain(self.work.reductions)}

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
        each = [own for own in self.work.reductions for _ in own.variables(self.work.job)]
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
        begun = self.path.with_name(f".{self.path.name}.begun")
        with begun.open("wb") as file:
            np.savez_compressed(file, about=np.array(json.dumps(about)), **arrays)
            file.flush()
            os.fsync(file.fileno())
        begun.replace(self.path)

    def dataset(self) -> xarray.Dataset:
        """Reductions of all poses, with names, units and words of their variables."""
        import xarray

        job, states = self.work.job, iter(self.states)
        arrays: dict[str, Any] = {}
        coordinates: dict[str, Any] = {}
        for own in self.work.reductions:
            for v in own.variables(job):
                for name, labels, values, has_unit in own.found(next(states), v.name, job):
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
