"""A map on disk: Zarr that is written block by block, and goes on after a kill at any moment.

A block is one chunk of every array, with the checksum (crc32c) that Zarr makes and looks at. The
array ``progress/done`` marks it afterwards; a marked block is read again when the map goes on, and
computed again if that fails. When all are done ``progress`` goes. Entries of a quantity come before
the poses, as in memory, and symmetric matrices have each entry once; `open_map` turns them round.
The description of the store has checksums (SHA-256) of those of its arrays, of coordinates that
several poses share, and of itself.
"""

from __future__ import annotations

import hashlib
import json
import math
import shutil
import sys
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.maps.job import (
    MOST_POSES,
    MapJob,
    MapSummary,
    auxiliary_coordinates,
    coordinate_arrays,
    identity,
    map_attributes,
    summarize,
    summary_attributes,
    variable_attributes,
)
from robostiff.analysis.record_file import differences
from robostiff.errors import InputError, Words, needs_extra
from robostiff.frozen import frozen, replace
from robostiff.whole_file import whole_file

if TYPE_CHECKING:
    import xarray

_IDENTITY, _ENTRIES, _DESCRIPTION = "robostiff_map", "entries", "zarr.json"
_OWN = {_IDENTITY, "checksum"}  # attributes of the store and not of the map
PROGRESS, _DONE = "progress", "progress/done"
_NAMED = 3  # differences between two maps
# Of stores from anywhere: values in a chunk, values a pose, bytes of a description.
_LARGEST_CHUNK, _MOST_VALUES, _LONGEST = 2**24, 2**10, 2**24


def create_store(path: Path, job: MapJob) -> None:
    """Make a store of attributes, coordinates and empty arrays, then move it to its place whole."""
    import zarr
    from zarr.codecs import BloscCodec, Crc32cCodec

    if not path.parent.is_dir():
        raise InputError("store of a map", got=str(path), expected="a path in an existing folder")
    draft, partition = path.with_name(f".{path.name}.{uuid.uuid4().hex[:8]}"), job.partition
    try:
        root = zarr.create_group(draft)
        for v in job.variables:
            entries, dims = dict[str, str](), v.dims
            if v.is_symmetric:
                (row, column), dims = v.labels, ("entry",)
                upper = zip(*np.triu_indices(len(row)), strict=True)
                entries[_ENTRIES] = ", ".join(f"{row[i]} {column[j]}" for i, j in upper)
            root.create_array(
                v.name,
                shape=(*v.stored_shape, *partition.shape),
                chunks=(*v.stored_shape, *partition.block),
                dtype=v.dtype,
                fill_value=v.missing,  # 0 would make a place that was not written an answer
                compressors=(BloscCodec(cname="lz4", clevel=1, shuffle="shuffle"), Crc32cCodec()),
                dimension_names=(*dims, *job.source.dims),
                attributes=variable_attributes(job, v) | entries,
            )
        for name, (dims, values, words) in coordinate_arrays(job).items():
            is_text = values.dtype.kind == "U"
            root.create_array(
                name,
                data=values.astype(np.dtypes.StringDType()) if is_text else values,
                compressors=Crc32cCodec(),
                dimension_names=dims,
                attributes=words,
            )
        marks = {"shape": (len(partition),), "chunks": (1,), "dtype": "int64"}
        files = sorted(file for file in draft.glob("*/**/*") if file.is_file())
        root.create_array(_DONE, compressors=Crc32cCodec(), **marks)
        about = {
            "parts": identity(job),
            "variables": {v.name: [v.dims, v.shape, v.is_symmetric] for v in job.variables},
            "complete": False,
            "ranges": {},
            "checksums": {
                file.relative_to(draft).as_posix(): _checksum(file.read_bytes()) for file in files
            },
        }
        coordinates = {"coordinates": " ".join(auxiliary_coordinates(job))}
        _describe(draft, {**map_attributes(job), **coordinates, _IDENTITY: about})
        if path.exists():
            raise already_there(path)
        draft.rename(path)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _describe(path: Path, attributes: Mapping[str, Any]) -> None:
    """Write the description of a store, with a checksum of all the rest in it."""
    content = {"zarr_format": 3, "node_type": "group", "attributes": {**attributes}}
    content["attributes"]["checksum"] = _checksum(json.dumps(content, sort_keys=True).encode())
    with whole_file(path / _DESCRIPTION) as draft:
        draft.write_text(json.dumps(content))


def _checksum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def is_complete(path: Path, job: MapJob) -> bool:
    """Whether the store of this very map is complete; InputError where it holds another map."""
    about = _attributes(path)[_IDENTITY]
    check_same_map(path, about["parts"], identity(job))
    return about["complete"]


def damage_error(path: Path, what: str) -> InputError:
    """The error for a damaged store or file."""
    return InputError(
        f"map {str(path)!r} is damaged: it has {what}",
        hint="make the map again at another path, or take a copy of it",
    )


@contextmanager
def _undamaged(path: Path, what: str) -> Iterator[None]:
    """Any failure of Zarr at a store of which it should be able to read this."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        words = f"{what} that cannot be read ({type(error).__name__}: {error})"
        raise damage_error(path, words) from None


def check_same_map(path: Path, parts: Mapping[str, Any], identity: Mapping[str, Any]) -> None:
    """Raise where a map that was begun depends on other parts than the one that is asked for."""
    different = [part for part in identity if parts.get(part) != identity[part]]
    if different:
        changes = [x for p in different for x in differences(parts.get(p), identity[p], p)]
        more = f", and {len(changes) - _NAMED} more" if len(changes) > _NAMED else ""
        raise InputError(
            f"map in {str(path)!r}: one with other {' and other '.join(different)}",
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
def lock(path: Path) -> Iterator[None]:
    """Keep other processes from filling the same store; the lock ends with the process."""
    with _undamaged(path, PROGRESS):
        file = (path / PROGRESS / "lock").open("w")
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
                got=Words("a store that another process is filling"),
                expected="one process at a time",
                hint="wait until it has ended, or use another path",
            ) from None
        yield


@frozen
class MapStore:
    """Writes blocks of a store that exists; picklable, one copy a process."""

    path: Path
    job: MapJob

    @cached_property
    def _arrays(self) -> dict[str, Any]:
        """Arrays by name, and which blocks are done: guarded poses and one, or zero."""
        import zarr

        with _undamaged(self.path, "arrays"):
            root: Any = zarr.open_group(self.path, mode="r+", zarr_format=3, use_consolidated=False)
            # A chunk of zeros is written, too: a chunk that is not there is lost.
            settings = {"write_empty_chunks": True}
            names = (*(v.name for v in self.job.variables), _DONE)
            return {name: root[name].with_config(settings) for name in names}

    def compute(self, index: int) -> MapSummary:
        """Compute a block and put it on disk, unless it is there, and sum it up."""
        job, part = self.job, self.job.partition.slices(index)
        with suppress(Exception):  # damaged in any way: computed again
            if mark := int(self._arrays[_DONE][index]):
                place = job.partition.place(index)
                stored = {
                    v.name: _chunk(self.path, v.name, (*[0] * len(v.stored_shape), *place))
                    for v in job.variables
                }
                count = stored["status"].size
                flat = {name: values.reshape(-1, count) for name, values in stored.items()}
                known = summarize(flat | {"status": flat["status"][0]}, job.answers, mark - 1)
                return replace(known, resumed=known.poses)
        shape = tuple(where.stop - where.start for where in part)
        block = job.room(math.prod(shape), job.variables)
        summary = job.compute(index, block)
        for v in job.variables:
            values = block[v.name][np.triu_indices(v.shape[0])] if v.is_symmetric else block[v.name]
            places = (*map(slice, v.stored_shape), *part)
            try:
                self._arrays[v.name][places] = values.reshape(*v.stored_shape, *shape)
            except IsADirectoryError:
                raise damage_error(self.path, f"a folder for a chunk of {v.name}") from None
        self._arrays[_DONE][index] = summary.guarded + 1
        return summary

    def finish(self, summary: MapSummary) -> None:
        """Write the summary, which makes the map complete."""
        attributes = _attributes(self.path)
        about = {**attributes[_IDENTITY], "complete": True, "ranges": summary.ranges}
        _describe(self.path, {**attributes, **summary_attributes(summary), _IDENTITY: about})


def _attributes(path: Path) -> dict[str, Any]:
    """Attributes of a store whose descriptions are as they were written; no larger than of maps.

    Raises InputError when it is none, or names the description that is damaged.
    """
    if not (path / _DESCRIPTION).is_file():
        raise InputError(
            "store of a map", got=str(path), expected="a map that was begun by robostiff"
        )
    text = _description(path, _DESCRIPTION)
    with _undamaged(path, _DESCRIPTION):
        content = json.loads(text)
        attributes = content["attributes"]
        written, about = attributes.pop("checksum"), attributes[_IDENTITY]
        if written != _checksum(json.dumps(content, sort_keys=True).encode()):
            raise damage_error(path, f"a {_DESCRIPTION} that was changed")
    for file, checksum in about["checksums"].items():
        text = _description(path, file)
        if _checksum(text) != checksum:
            raise damage_error(path, f"a {file} that was changed")
        if file.endswith(_DESCRIPTION):
            with _undamaged(path, file):
                described = json.loads(text)
                chunk = math.prod(described["chunk_grid"]["configuration"]["chunk_shape"])
                is_large = math.prod(described["shape"]) > _MOST_VALUES * MOST_POSES
            if is_large or chunk > _LARGEST_CHUNK:
                raise damage_error(path, f"a {file} of more than robostiff writes")
    return attributes


def _description(path: Path, file: str) -> bytes:
    with _undamaged(path, file):
        if file.endswith(_DESCRIPTION) and (path / file).stat().st_size > _LONGEST:
            raise damage_error(path, f"a {file} of more than {_LONGEST} bytes")
        return (path / file).read_bytes()


def open_map(path: Path) -> xarray.Dataset:
    """The map in a store, poses first, read and checked when its values are asked for."""
    with needs_extra("maps", "maps"):
        import dask.array
        import xarray
    about = _attributes(path)[_IDENTITY]
    with _undamaged(path, "contents"):
        store = xarray.open_zarr(path, chunks=None, consolidated=False, zarr_format=3)
        poses, arrays = store["status"].dims, {}
        for name, (dims, shape, is_symmetric) in about["variables"].items():
            stored = store[name].variable
            lead = stored.ndim - len(poses)
            sizes = zip(stored.shape[lead:], stored.encoding["chunks"][lead:], strict=True)
            blocks = [(b,) * (n // b) + ((n % b,) if n % b else ()) for n, b in sizes]
            read = partial(_block, path, name, shape, is_symmetric, about["complete"])
            values = dask.array.map_blocks(
                read,
                chunks=(*blocks, *((n,) for n in shape)),
                dtype=stored.dtype,
                meta=np.empty((0,) * (len(poses) + len(dims)), stored.dtype),
            )
            attributes = {k: value for k, value in stored.attrs.items() if k != _ENTRIES}
            if name in about["ranges"]:
                attributes["actual_range"] = about["ranges"][name]
            arrays[name] = (*poses, *dims), values, attributes
        coordinates: dict[str, Any] = {
            # NetCDF and older programs know no texts of any length
            str(name): array.copy(data=np.array(array.values.tolist()))
            if array.dtype.kind in "TO"
            else array
            for name, array in store.coords.items()
            if name not in arrays
        }
        words = {name: value for name, value in store.attrs.items() if name not in _OWN}
        opened = xarray.Dataset(arrays, coordinates, words)
        return opened.set_coords([name for name in arrays if name in store.coords])


def _block(
    path: Path,
    name: str,
    shape: tuple[int, ...],
    is_symmetric: bool,
    is_complete: bool,
    block_id: tuple[int, ...],
) -> np.ndarray:
    """A block of a variable (poses, *shape of a pose)."""
    axes = len(shape)
    place = (*[0] * (1 if is_symmetric else axes), *block_id[: len(block_id) - axes])
    values = _chunk(path, name, place, is_complete)
    if is_symmetric:
        entries, (row, column) = np.empty(shape, dtype=int), np.triu_indices(shape[0])
        entries[row, column] = entries[column, row] = range(len(row))
        values = values[entries]
    return np.moveaxis(values, range(axes), range(-axes, 0))


def _chunk(path: Path, name: str, place: tuple[int, ...], is_needed: bool = True) -> np.ndarray:
    """A chunk of an array; raises InputError where it is damaged, or not there though needed."""
    import zarr

    file = "/".join([name, "c", *map(str, place)])
    if is_needed and not (path / file).is_file():
        raise damage_error(path, f"no {file}")
    with _undamaged(path, file):
        array: Any = zarr.open_array(path, path=name, mode="r", zarr_format=3)
        return array.get_block_selection(place)
