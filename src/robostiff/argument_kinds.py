"""Arguments of other kinds than the annotations of a function say are named and refused."""

from __future__ import annotations

import ast
import builtins
import errno
import functools
import inspect
import re
import sys
import typing
from collections.abc import Callable, Iterable, KeysView, Mapping, Sequence, Set, Sized
from contextlib import suppress
from enum import Enum
from importlib import import_module
from types import ModuleType, SimpleNamespace, UnionType
from typing import Any

from robostiff.errors import InputError, RobostiffError, Words

#: Exceptions that arguments of other kinds cause.
_FOREIGN = (ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError)


class _Numbers:
    """Stands for what NumPy takes as an array of numbers."""


class _Scalar:
    """Stands for a number, or a formula in its place."""


_MARK = "_names_other_kinds"
#: Names in annotations that are checked by what they stand for.
_MEANT = {"ArrayLike": _Numbers, "NDArray": _Numbers, "Entries": _Numbers, "Scalar": _Scalar}
_IN_WORDS = {
    "ArrayLike": "numbers",
    "Entries": "numbers",
    "np.ndarray": "an array",
    "Scalar": "a number",
    "Any": "...",
    "Gravity": "three numbers [m/s^2] or an axis such as '-z'",
    "Loads": "loads by names: of bodies, with their forces and masses",
    "Masses": "masses by the names of bodies",
    "Laws": "force laws by the names of joints",
    "Symbols": "names of parameters",
    "Near": "joint coordinates",
    "Pose": "a pose",
}
_WORD = re.compile("|".join(rf"(?<![\w.]){re.escape(word)}\b" for word in _IN_WORDS))


def names_other_kinds(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which refuses arguments of other kinds than its annotations say.

    Long lists, and what a constructor must be given, are compared once the call has failed with a
    foreign exception, which becomes an InputError where one of them is the cause: parts of
    machines make what they need of several kinds.
    """
    if hasattr(function, _MARK):
        return function
    kinds = _Kinds(function)

    @functools.wraps(function)
    def named(*args: Any, **kwargs: Any) -> Any:
        if kinds.are_known_before and (error := kinds.error(args, kwargs, before=True)):
            raise error
        try:
            return function(*args, **kwargs)
        except RobostiffError as own:
            # What a function inside refused was given to this one.
            if not hasattr(own, _MARK) or (error := kinds.error(args, kwargs)) is None:
                raise
            raise error from None
        except _FOREIGN as foreign:
            error = kinds.error(args, kwargs)
            if getattr(foreign, "errno", None) == errno.ENAMETOOLONG:
                name = str(getattr(foreign, "filename", ""))
                error = InputError("name of a file", got=name, expected="a shorter one")
            if error is None and kinds.of_constructor:
                expected = "values of the kinds and shapes that its documentation says"
                subject, words = f"arguments of {type(args[0]).__name__}", Words(str(foreign))
                error = InputError(subject, got=words, expected=expected)
            if error is None:
                raise
            raise error from None

    setattr(named, _MARK, True)
    return named


class _Kinds:
    """What the annotations of a function say of its arguments."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function
        self.of_constructor = function.__name__ == "__init__"
        self.parameters = inspect.signature(function).parameters
        needed = sum(parameter.default is parameter.empty for parameter in self.parameters.values())
        self.are_known_before = not self.of_constructor or needed == 1  # a setting: self alone
        self._hints: dict[tuple[Any, ...], Any] = {}

    def error(
        self, args: tuple[Any, ...], kwargs: Mapping[str, Any], *, before: bool = False
    ) -> InputError | None:
        """The error for the first argument that its annotation excludes, if any.

        `before` the call nothing is imported or read to find out what an annotation stands for.
        What is as by default, or long, is not looked at then, nor are arrays, quantities and
        machines: functions name what is wrong with these in words of their own.
        """
        subject, owners = self.function.__name__, (inspect.unwrap(self.function),)
        if self.of_constructor:
            subject, owners = type(args[0]).__name__, type(args[0]).__mro__
        by_place = zip(self.parameters, args, strict=False)
        for name, value in (*by_place, *kwargs.items()):
            parameter = self.parameters.get(name)
            if parameter is None or parameter.annotation is parameter.empty:
                continue  # of keywords of any name, or self, which may not be complete
            if before and (
                value is parameter.default
                or name in _NAMED
                or hasattr(value, "shape")  # an array
                or hasattr(type(value), "to_root_units")  # a quantity with a unit
                or (isinstance(value, Sized) and len(value) > _LONG)
            ):
                continue
            key = name, before, owners
            if key not in self._hints:
                modules = dict.fromkeys(owner.__module__ for owner in owners)
                self._hints[key] = _hint(parameter.annotation, modules, imports=not before)
            if not _fits(value, self._hints[key], deep=not before):
                words = _in_words(str(parameter.annotation), self._hints[key])
                alone = isinstance(value, str) and re.search(r"(Sequence|Iterable|tuple)\[", words)
                in_list = alone and len(value) < _SHOWN and _fits([value], self._hints[key])
                hint = f"write [{value!r}]" if in_list else None
                found = InputError(f"{name} of {subject}", got=value, expected=words, hint=hint)
                setattr(found, _MARK, True)
                return found
        return None


# Arguments that functions refuse with what to write instead.
_NAMED = {"robot", "linkage", "network", "tolerance", "measured", "budget", "sequence", "where"}
_LONG, _SHOWN, _MOST_MEMBERS = 100, 40, 8


def _in_words(annotation: str, hint: Any) -> str:
    """What is expected: the members of an enumeration, the classes that one name stands for."""
    if isinstance(hint, type) and issubclass(hint, Enum) and len(hint) <= _MOST_MEMBERS:
        return " or ".join(f"{hint.__name__}.{member.name}" for member in hint)
    parts = typing.get_args(hint)
    if annotation.isidentifier() and parts and all(isinstance(part, type) for part in parts):
        annotation = " | ".join(part.__name__ for part in parts)
    return _WORD.sub(lambda match: _IN_WORDS[match[0]], annotation).replace(" | ", " or ")


def _hint(annotation: Any, modules: Iterable[str], *, imports: bool) -> Any:
    """What an annotation in some modules stands for; Any where that cannot be found out.

    Names that are imported for type checkers alone are known where it `imports` them.
    """
    meant = dict(_MEANT)
    if not imports:
        meant |= dict.fromkeys((name for name, x in _MEANT.items() if x is _Numbers), Any)
    loaded = [sys.modules[name] for name in modules if name in sys.modules]
    text = annotation if isinstance(annotation, str) else ""
    names = {x.id for x in ast.walk(ast.parse(text)) if isinstance(x, ast.Name)}
    for name in names - meant.keys():
        owner = next((vars(x) for x in (*loaded, builtins) if name in vars(x)), None)
        if owner is None:
            meant[name] = _imported_for_types(name, loaded) if imports else Any
        else:
            meant[name] = owner[name]
    x = SimpleNamespace(__annotations__={"value": annotation})
    try:
        return typing.get_type_hints(x, {}, meant)["value"]
    except (AttributeError, NameError, TypeError):
        return Any


def _imported_for_types(name: str, modules: Iterable[ModuleType]) -> Any:
    """What a name is that a module of this package imports for type checkers alone, or Any."""
    for module in modules:
        if not module.__name__.startswith("robostiff"):
            continue
        for node in ast.walk(ast.parse(inspect.getsource(module))):
            if not isinstance(node, ast.Import | ast.ImportFrom):
                continue
            for alias in node.names:
                if name == (alias.asname or alias.name):
                    with suppress(ImportError):  # Any where it is not installed
                        if isinstance(node, ast.Import):
                            return import_module(alias.name)
                        return getattr(import_module(str(node.module)), alias.name)
    return Any


def _fits(value: Any, hint: Any, *, deep: bool = True) -> bool:
    """Whether a value is of the kind that an annotation says, as far as it says any.

    Entries of lists and mappings count where it is `deep`.
    """
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, UnionType):
        fits = any(_fits(value, part, deep=deep) for part in parts)
    elif origin is typing.Literal:
        fits = value in parts
    elif isinstance(origin, type):
        fits = _fits_container(value, origin, parts if deep else ())
    elif not deep and (inspect.isabstract(hint) or getattr(hint, "_is_protocol", False)):
        fits = True  # one of several classes: functions say which there are
    elif hint in (float, int, complex, _Scalar):
        is_number = hasattr(type(value), "__index__" if hint is int else "__float__")
        is_number = (
            is_number and not isinstance(value, (bool, str)) and not getattr(value, "ndim", 0)
        )
        fits = is_number or (hint is _Scalar and hasattr(value, "free_symbols"))
    elif hint is _Numbers:
        import numpy as np

        try:
            entries = np.asarray(value)
            fits = entries.dtype.kind in "biuf" or all(
                hasattr(entry, "free_symbols") for entry in entries.flat
            )
        except (TypeError, ValueError):  # ragged, or no numbers
            fits = False
    else:
        try:
            fits = isinstance(value, hint) if isinstance(hint, type) else True
        except TypeError:  # a protocol
            fits = True
    return fits


def _fits_container(value: Any, origin: type, parts: tuple[Any, ...]) -> bool:
    """The same of a container of a kind, whose entries are of others, if any are said."""
    if not issubclass(origin, Iterable):
        return isinstance(value, origin)
    has_order = isinstance(value, KeysView) or not isinstance(value, Mapping | Set)
    of_kind = (
        isinstance(value, Mapping)
        if issubclass(origin, Mapping)
        else (
            isinstance(value, Iterable)
            and not isinstance(value, str | bytes)
            and getattr(value, "ndim", 1) > 0  # one number of NumPy is no collection
            and (has_order or not issubclass(origin, Sequence))
        )
    )
    # An iterator would be used up; lists in lists of NumPy are as deep as they may be.
    known = hasattr(type(value), "__len__") and not origin.__module__.startswith("numpy")
    if not (of_kind and parts and known) or hasattr(type(value), "to_root_units"):
        return of_kind
    if isinstance(value, Mapping):
        return all(_fits(key, parts[0]) and _fits(entry, parts[-1]) for key, entry in value.items())
    if issubclass(origin, tuple) and parts[-1] is not Ellipsis:
        entries = list(value)
        return len(entries) == len(parts) and all(map(_fits, entries, parts))
    return all(_fits(entry, parts[0]) for entry in value)
