"""What is found out about frozen objects and kept with them: for all arguments, or the last."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

_Arguments = ParamSpec("_Arguments")
_Found = TypeVar("_Found")
_LARGEST = 10_000  # bytes of arguments: some 200 poses


def kept(find: Callable[_Arguments, _Found]) -> Callable[_Arguments, _Found]:
    """A function that finds out something about its first argument, and keeps it with it.

    What is found lives as long as the object, and is no part of it when objects are compared.
    Further arguments are hashable; for each of them it is found once.
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


def kept_for_last(find: Callable[..., _Found], owner: Any, *given: object) -> _Found:
    """What is found of an owner for what is given, kept with it until something else is given.

    Arguments are compared by their content. For many, or what has no content that can be compared,
    such as a function, nothing is kept.
    """
    try:
        content = pickle.dumps(given)
    except (AttributeError, TypeError, pickle.PicklingError):
        return find(owner, *given)
    if len(content) > _LARGEST:
        return find(owner, *given)
    last = vars(owner).get(name := f"_last {find.__qualname__}")
    if last is None or last[0] != content:
        vars(owner)[name] = last = content, find(owner, *given)
    return last[1]
