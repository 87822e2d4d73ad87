"""Matching of entries of a side file with joints and links of the tree."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import TypeVar

from robostiff.io.model_file.place import Place
from robostiff.io.suggest import did_you_mean, listing

Entry = TypeVar("Entry")
_WILD = frozenset("*?[")


def check_known(place: Place, name: str, what: str, known: Sequence[str]) -> str:
    """The name, when it is one of those known."""
    if name not in known:
        raise place.error(
            what,
            got=name,
            expected=f"one of {listing(list(known), 30)}",
            hint=did_you_mean(name, known),
        )
    return name


def chosen(
    place: Place, written: Mapping[str, Entry], names: Iterable[str], what: str
) -> dict[str, tuple[Place, Entry]]:
    """For each name its entry, with its place; a name takes precedence over a pattern.

    Of several patterns the first in the file counts.

    Raises
    ------
    FileError
        When an entry is about none of the names.
    """
    names = list(names)
    found: dict[str, tuple[Place, Entry]] = {}
    for key, entry in written.items():
        if _WILD.isdisjoint(key):
            check_known(place / key, key, what, names)
            found[key] = place / key, entry
    for key, entry in written.items():
        if _WILD.isdisjoint(key):
            continue
        fitting = [name for name in names if fnmatchcase(name, key)]
        if not fitting:
            raise (place / key).error(
                f"pattern for {what}s", got=key, expected=f"one that fits {listing(names, 30)}"
            )
        for name in fitting:
            found.setdefault(name, (place / key, entry))
    return found
