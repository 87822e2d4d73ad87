"""The task of the child process that tries to read an HDF5 file; imports nothing of this package.

HDF5 may crash, spin or take all memory over a damaged file; what happens there, happens there only.
"""

from __future__ import annotations

from typing import Any

import h5py

_SPARE = 2**20
_OBJECTS = 10_000


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Nothing, or the reason why not all groups, values and attributes can be read."""
    try:
        _try_to_read(request["path"], request["expanded"] + _SPARE)
    except MemoryError:
        raise
    except Exception as error:  # any failure of HDF5
        return {"refusal": f"{type(error).__name__}: {error}"}
    return {}


def _try_to_read(path: str, room: int) -> None:
    count = 0
    with h5py.File(path, "r") as file:
        waiting: list[h5py.Group] = [file]
        while waiting:
            group = waiting.pop()
            list(group.attrs.items())
            for name in group:
                count += 1
                if count > _OBJECTS:
                    raise ValueError("more objects than a map has")
                if group.get(name, getlink=True).__class__ is not h5py.HardLink:
                    raise ValueError("links that lead elsewhere")
                entry = group[name]
                if isinstance(entry, h5py.Group):
                    waiting.append(entry)
                    continue
                if not isinstance(entry, h5py.Dataset):
                    continue
                list(entry.attrs.items())
                if entry.external or entry.is_virtual:
                    raise ValueError("values in other files")
                room -= entry.size * entry.dtype.itemsize
                if room < 0:
                    raise ValueError("more values than such a file can hold")
                if entry.size and entry.id.get_storage_size():
                    entry[()]
