"""The words of a picture, as a backend must have them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from typing import Any, TypeVar

from robostiff.errors import printable

Thing = TypeVar("Thing")


def with_words(thing: Thing, escape: Callable[[str], str]) -> Thing:
    """A picture whose words, names of robots and joints among them, mean nothing but themselves.

    Parameters
    ----------
    thing : Picture
        Or a part of one.
    escape : callable
        What a backend would take for a formula or for HTML, it takes for letters afterwards.
    """
    found: Any = thing
    if isinstance(thing, str):
        found = escape(printable(thing, kept="\n"))
    elif isinstance(thing, tuple):
        found = tuple(with_words(item, escape) for item in thing)
    elif is_dataclass(thing) and not isinstance(thing, type | Enum):
        own: Any = thing
        found = replace(
            own, **{f.name: with_words(getattr(own, f.name), escape) for f in fields(own)}
        )
    return found
