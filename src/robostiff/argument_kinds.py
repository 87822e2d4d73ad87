"""Arguments of other kinds than the annotations of a function say, named once it has failed."""

from __future__ import annotations

import ast
import builtins
import errno
import functools
import inspect
import sys
import typing
from collections.abc import Callable, Iterable, Mapping, Set, Sized
from contextlib import suppress
from importlib import import_module
from types import SimpleNamespace, UnionType
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
    " | ": " or ",
}


def names_other_kinds(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, whose foreign exceptions become an InputError where an argument is the cause.

    Arguments are compared with their annotations after a failure only: a call costs no more.

    Examples
    --------
    >>> @names_other_kinds
    ... def half(number: float) -> float:
    ...     return number / 2
    >>> half("x")
    Traceback (most recent call last):
    robostiff.errors.InputError: number of half: got 'x', expected float
    """
    if hasattr(function, _MARK):
        return function

    @functools.wraps(function)
    def named(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except RobostiffError:
            raise
        except _FOREIGN as foreign:
            error = _error_of_kinds(function, args, kwargs, foreign)
            if getattr(foreign, "errno", None) == errno.ENAMETOOLONG:
                name = str(getattr(foreign, "filename", ""))
                error = InputError("name of a file", got=name, expected="a shorter one")
            if error is None:
                raise
            raise error from None

    setattr(named, _MARK, True)
    return named


def _error_of_kinds(
    function: Callable[..., Any],
    args: tuple[Any, ...],
    kwargs: Mapping[str, Any],
    foreign: BaseException,
) -> InputError | None:
    """The error for the first argument that its annotation excludes.

    Where there is none, of a constructor the foreign one in words, and else None.
    """
    signature = inspect.signature(function)
    try:
        given = signature.bind(*args, **kwargs).arguments
    except TypeError:  # arguments that the function does not have
        return None
    subject, owners = function.__name__, (inspect.unwrap(function),)
    if function.__name__ == "__init__":
        subject, owners = type(args[0]).__name__, type(args[0]).__mro__
    names = _AnnotationNames(dict.fromkeys(own.__module__ for own in owners))
    for name, value in given.items():
        parameter = signature.parameters[name]
        if parameter.annotation is parameter.empty:  # self, which may not be complete
            continue
        values = [value]
        if parameter.kind is inspect.Parameter.VAR_KEYWORD:
            values = list(value.values())
        own = SimpleNamespace(__annotations__={"own": parameter.annotation})
        try:
            hint = typing.get_type_hints(own, {}, names)["own"]
        except (AttributeError, NameError, TypeError):  # what it stands for cannot be found out
            continue
        for one in values:
            if not _fits(one, hint):
                words = str(parameter.annotation)
                for code, word in _IN_WORDS.items():
                    words = words.replace(code, word)
                return InputError(f"{name} of {subject}", got=one, expected=words)
    if function.__name__ == "__init__":
        expected = "values of the kinds and shapes that its documentation says"
        return InputError(f"arguments of {subject}", got=Words(str(foreign)), expected=expected)
    return None


class _AnnotationNames(dict[str, Any]):
    """Names in annotations of some modules, also those imported for type checkers alone."""

    def __init__(self, modules: Iterable[str]) -> None:
        super().__init__(_MEANT)
        self.modules = [sys.modules[name] for name in modules if name in sys.modules]

    def __missing__(self, name: str) -> Any:
        for module in self.modules:
            if name in vars(module):
                return vars(module)[name]
        if name in vars(builtins):
            return vars(builtins)[name]
        for module in self.modules:
            if not module.__name__.startswith("robostiff"):
                continue
            for node in ast.walk(ast.parse(inspect.getsource(module))):
                if not isinstance(node, ast.Import | ast.ImportFrom):
                    continue
                for own in node.names:
                    if name == (own.asname or own.name):
                        with suppress(ImportError):  # Any where it is not installed
                            if isinstance(node, ast.Import):
                                return import_module(own.name)
                            return getattr(import_module(str(node.module)), own.name)
        return Any


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value is of the kind that an annotation says, as far as it says any."""
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, UnionType):
        fits = any(_fits(value, part) for part in parts)
    elif origin is typing.Literal:
        fits = value in parts
    elif isinstance(origin, type):
        fits = _fits_container(value, origin, parts)
    elif hint in (float, int, _Scalar):
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
                hasattr(own, "free_symbols") for own in entries.flat
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
    if issubclass(origin, Mapping):
        return isinstance(value, Mapping) and all(
            _fits(key, parts[0]) and _fits(own, parts[1]) for key, own in value.items()
        )
    if not issubclass(origin, Iterable):
        return isinstance(value, origin)
    has_order = not isinstance(value, (str, bytes, Mapping, Set)) or issubclass(origin, Set)
    if not has_order or not isinstance(value, Iterable):
        return False
    if not isinstance(value, Sized):  # an iterator, which would be used up
        return True
    if issubclass(origin, tuple) and parts[-1] is not Ellipsis:
        return len(value) == len(parts) and all(map(_fits, value, parts))
    return all(_fits(own, parts[0]) for own in value)
