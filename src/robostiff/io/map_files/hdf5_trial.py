"""A separate program that reads every value of an HDF5 file, within limits; status 0 on success.

HDF5 may crash, spin or take all memory over a damaged file; what happens here, happens here only.
"""

import sys
from contextlib import suppress

_MOST_EXPANSION = 1100  # of deflate
_SPARE = 2**20
_OBJECTS = 10_000


def try_to_read(path: str, size: int) -> None:
    """Read all groups, values and attributes of a file of so many bytes."""
    import h5py

    room = _MOST_EXPANSION * size + _SPARE
    seen = 0
    with h5py.File(path, "r") as file:
        waiting: list[h5py.Group] = [file]
        while waiting:
            group = waiting.pop()
            list(group.attrs.items())
            for name in group:
                seen += 1
                if seen > _OBJECTS:
                    raise ValueError("more objects than a map has")
                if group.get(name, getlink=True).__class__ is not h5py.HardLink:
                    raise ValueError("links that lead elsewhere")
                thing = group[name]
                if isinstance(thing, h5py.Group):
                    waiting.append(thing)
                    continue
                if not isinstance(thing, h5py.Dataset):
                    continue
                list(thing.attrs.items())
                if thing.external or thing.is_virtual:
                    raise ValueError("values in other files")
                room -= thing.size * thing.dtype.itemsize
                if room < 0:
                    raise ValueError("more values than such a file can hold")
                if thing.size and thing.id.get_storage_size():
                    thing[()]


def limit(size: int, seconds: int) -> None:
    """Bound memory and time of this process, where the system can."""
    with suppress(ImportError):
        import resource

        memory = 2**31 + _MOST_EXPANSION * size
        for kind, most in (
            (resource.RLIMIT_AS, memory),
            (resource.RLIMIT_CPU, seconds),
            (resource.RLIMIT_CORE, 0),
        ):
            with suppress(ValueError, OSError):
                resource.setrlimit(kind, (most, most))


if __name__ == "__main__":
    limit(int(sys.argv[2]), int(sys.argv[3]))
    try:
        try_to_read(sys.argv[1], int(sys.argv[2]))
    except Exception as error:
        sys.stderr.write(f"{error}\n")
        raise SystemExit(1) from None
