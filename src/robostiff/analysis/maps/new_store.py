"""An empty map on disk, and the identity of a map."""

from __future__ import annotations

import json
import os
import shutil
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.analysis.maps.job import MapJob
from robostiff.analysis.maps.layout import coordinate_arrays, own_coordinates, variable_attributes
from robostiff.analysis.maps.stored import (
    IDENTITY,
    JOURNALS,
    array_checksum,
    read_store,
    sealed,
)
from robostiff.errors import InputError, needs_extra

_LONGEST = 2**20  # values in a chunk of a coordinate
_SHRINKS = 20  # how much smaller a map may become on disk


def create_store(
    path: Path,
    job: MapJob,
    identity: Mapping[str, str],
    attributes: Mapping[str, Any],
) -> None:
    """Make an empty store beside its place, then move it there whole.

    Raises
    ------
    InputError
        When something is there already, or its folder is missing.
    """
    with needs_extra("maps", "maps"):
        import zarr  # noqa: F401

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


def _checksum_of(array: Path) -> str:
    return array_checksum(json.loads((array / "zarr.json").read_text(encoding="utf-8")))


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
        group.create_array(
            name,
            data=_storable(coordinate.values),
            chunks=tuple(max(1, min(n, _LONGEST)) for n in coordinate.values.shape),
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
    arrays = [variable.name for variable in job.variables] + list(coordinate_arrays(job))
    every[IDENTITY] = {
        "parts": dict(identity),
        "variables": [variable.name for variable in job.variables],
        "complete": False,
        "attributes": sorted(every),
        "arrays": {name: _checksum_of(begun / name) for name in arrays},
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
    try:
        handle = os.open(path, os.O_RDONLY)
    except FileNotFoundError:  # Zarr writes no chunk that holds nothing but its fill value
        return
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _storable(values: np.ndarray) -> np.ndarray:
    """Texts of any length, as Zarr has them."""
    return values.astype(np.dtypes.StringDType()) if values.dtype.kind == "U" else values
