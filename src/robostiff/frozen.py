"""Frozen data: `dataclasses.dataclass(frozen=True)` in less time, of which a command takes much.

The standard decorator compiles six methods a class. All but ``__init__`` can be closures over the
names of the fields.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, FrozenInstanceError, field, replace
from operator import attrgetter
from reprlib import recursive_repr
from typing import Any, TypeVar, dataclass_transform, overload

__all__ = ["are_equal", "field", "frozen", "replace"]

_Class = TypeVar("_Class", bound=type)


@overload
def frozen(cls: _Class, /) -> _Class: ...
@overload
def frozen(
    *, init: bool = ..., repr: bool = ..., eq: bool = ..., kw_only: bool = ...
) -> Callable[[_Class], _Class]: ...
@dataclass_transform(frozen_default=True, field_specifiers=(field, Field))
def frozen(
    cls: Any = None,
    /,
    *,
    init: bool = True,
    repr: bool = True,
    eq: bool = True,
    kw_only: bool = False,
) -> Any:
    """Make a class one of frozen data: a dataclass whose objects do not change.

    Fields and parameters are those of `dataclasses.dataclass`, whose other functions take such
    classes and their objects. Methods that the class has of its own stay. Objects have a
    ``__dict__``; fields that `__init__` does not take have a default.

    Examples
    --------
    >>> @frozen
    ... class Beam:
    ...     length: float
    ...     name: str = "beam"
    >>> Beam(0.5), dataclasses.replace(Beam(0.5), name="strut")
    (Beam(length=0.5, name='beam'), Beam(length=0.5, name='strut'))
    >>> Beam(0.5).length = 0.6
    Traceback (most recent call last):
        ...
    dataclasses.FrozenInstanceError: cannot assign to field 'length'
    """

    def of(cls: Any) -> Any:
        own = {name for name, x in vars(cls).items() if (name, x) != ("__hash__", None)}
        own.update([] if init else ["__init__"], [] if repr else ["__repr__"])
        own.update([] if eq else ["__eq__", "__hash__"])
        dataclasses.dataclass(init=False, repr=False, eq=False, kw_only=kw_only)(cls)
        for method in _methods(cls):
            if method.__name__ not in own:
                method.__qualname__ = f"{cls.__qualname__}.{method.__name__}"
                setattr(cls, method.__name__, method)
        return cls

    return of if cls is None else of(cls)


def _methods(cls: Any) -> tuple[Callable[..., Any], ...]:
    """All that a class of frozen data has beside its fields."""
    fields = dataclasses.fields(cls)
    names = frozenset(x.name for x in fields)
    shown = [x.name for x in fields if x.repr]
    compared = _values([x.name for x in fields if x.compare])
    has_arrays = False  # among the values of some object of the class

    @recursive_repr()
    def __repr__(self: Any) -> str:
        values = ", ".join(f"{name}={getattr(self, name)!r}" for name in shown)
        return f"{self.__class__.__qualname__}({values})"

    def __eq__(self: Any, other: object) -> bool:
        nonlocal has_arrays
        if other.__class__ is not self.__class__:
            return NotImplemented
        if not has_arrays:
            try:
                return compared(self) == compared(other)
            except ValueError:  # of NumPy: an array of truth values has none itself
                has_arrays = True
        return are_equal(compared(self), compared(other))

    def __hash__(self: Any) -> int:
        return hash(compared(self))

    def __setattr__(self: Any, name: str, value: object) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return _init(cls, fields), __repr__, __eq__, __hash__, __setattr__, __delattr__


def are_equal(one: Any, other: Any) -> bool:
    """Whether two values are equal; arrays are where all entries are, or are no numbers."""
    if one is other:
        return True
    if hasattr(one, "shape") or hasattr(other, "shape"):
        import numpy as np

        are_floats = all(isinstance(x, np.ndarray) and x.dtype == float for x in (one, other))
        return np.array_equal(one, other) or (
            are_floats and np.array_equal(one, other, equal_nan=True)
        )
    if isinstance(one, tuple | list) and type(one) is type(other):
        return len(one) == len(other) and all(map(are_equal, one, other))
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(are_equal(one[k], other[k]) for k in one)
    return bool(one == other)


def _values(names: Sequence[str]) -> Callable[[Any], tuple[Any, ...]]:
    """A function that takes the values of attributes from an object."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda one: tuple(getattr(one, name) for name in names)


class _MadeAnew:
    """A default that is made for each object."""

    def __repr__(self) -> str:
        return "<factory>"


def _init(cls: Any, fields: Sequence[Field[Any]]) -> Callable[..., None]:
    """The method that takes the values of the fields, in their order, and calls `__post_init__`."""
    given: dict[str, Any] = {"__anew": _MadeAnew()}
    parameters: dict[bool, list[str]] = {False: [], True: []}
    lines = ["__values = self.__dict__"]
    for x in fields:
        parameter = value = x.name
        if x.default_factory is not MISSING:
            given[make := f"__new_{x.name}"] = x.default_factory
            parameter = f"{x.name}=__anew"
            value = f"{make}() if {x.name} is __anew else {x.name}" if x.init else f"{make}()"
        elif x.default is not MISSING:
            given[f"__default_{x.name}"] = x.default
            parameter = f"{x.name}=__default_{x.name}"
        if x.init:
            parameters[bool(x.kw_only)].append(parameter)
        if x.init or x.default_factory is not MISSING:
            lines.append(f"__values[{x.name!r}] = {value}")
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    named = ("*", *parameters[True]) if parameters[True] else ()
    head = f"def __init__({', '.join(('self', *parameters[False], *named))}):"
    text = f"def made({', '.join(given)}):\n {head}\n  {'; '.join(lines)}\n return __init__"
    found: dict[str, Any] = {}
    exec(text, vars(sys.modules[cls.__module__]), found)  # noqa: S102  # names of our own fields
    method = found["made"](**given)
    method.__annotations__ = {x.name: x.type for x in fields if x.init} | {"return": None}
    return method
