"""Functions of frozen objects whose results are kept with these objects."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

_Arguments = ParamSpec("_Arguments")
_Found = TypeVar("_Found")


def kept(find: Callable[_Arguments, _Found]) -> Callable[_Arguments, _Found]:
    """A function that finds out something about its first argument, and keeps it with it.

    What is found lives as long as the object, and is no part of it when objects are compared.
    Further arguments are hashable; for each of them it is found once.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> @kept
    ... def area(shape):
    ...     print("computed")
    ...     return shape.width * shape.height
    >>> rectangle = SimpleNamespace(width=2, height=3)
    >>> area(rectangle), area(rectangle)
    computed
    (6, 6)
    """
    name = f"_kept {find.__module__}.{find.__qualname__}"

    @wraps(find)
    def found(*args: _Arguments.args, **named: _Arguments.kwargs) -> _Found:
        owner, *more = args
        known = vars(owner).setdefault(name, {})
        key = (*more, *named.items())
        if key not in known:
            known[key] = find(*args, **named)
        return known[key]

    return found
