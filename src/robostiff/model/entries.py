"""Replacing or listing every number of a robot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.spatial.formula import is_formula

if TYPE_CHECKING:
    from robostiff.model.robot import Robot

# Limits and laws of drives and nominal values of symbols are not part of a formula.
_NO_ENTRIES = frozenset(("limits", "nominal", "laws"))


def with_entries(robot: Robot, convert: Callable[[Any], Any]) -> Robot:
    """The same robot with ``convert(entry)`` in place of every number or formula.

    Parameters
    ----------
    robot : Robot
    convert : callable
        Gets a Python float, or a formula as it is; gives a float or a formula, of SymPy or of any
        kind that has ``free_symbols``. The limits of drives and the nominal values of symbols are
        no entries and stay.

    Returns
    -------
    Robot
        With arrays of floats where all their entries are floats, and of objects elsewhere.

    Raises
    ------
    InputError
        When an entry cannot be what it has become, such as a negative area.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> from robostiff.spatial import exact_number
    >>> with_entries(load("planar-link"), exact_number).legs[0].chain.elements[0].to
    array([1/2, 0, 0], dtype=object)
    """
    return _converted(robot, convert)


def formulas(part: Any) -> Iterator[Any]:
    """Every formula of a robot, or of a part of one; exact SymPy numbers among them."""
    if is_formula(part):
        yield part
    elif isinstance(part, np.ndarray):
        if part.dtype == object:
            yield from filter(is_formula, part.flat)
    elif isinstance(part, tuple):
        for member in part:
            yield from formulas(member)
    elif is_dataclass(part):
        for field in fields(part):
            if field.name not in _NO_ENTRIES:
                yield from formulas(getattr(part, field.name))


def _converted(part: Any, convert: Callable[[Any], Any]) -> Any:
    if is_formula(part) or _is_number(part):
        return _entry(part, convert)
    if isinstance(part, np.ndarray):
        return _array(part, convert)
    if isinstance(part, tuple):
        return tuple(_converted(member, convert) for member in part)
    if is_dataclass(part):
        values = {
            field.name: getattr(part, field.name)
            if field.name in _NO_ENTRIES
            else _converted(getattr(part, field.name), convert)
            for field in fields(part)
        }
        return type(part)(**values)  # pyright: ignore[reportCallIssue]
    return part


def _array(values: np.ndarray, convert: Callable[[Any], Any]) -> np.ndarray:
    converted = np.empty(values.shape, dtype=object)
    # Filled one by one: some entries look like sequences to NumPy.
    for place in np.ndindex(values.shape):
        converted[place] = _entry(values[place], convert)
    return converted if any(map(is_formula, converted.flat)) else converted.astype(float)


def _entry(value: Any, convert: Callable[[Any], Any]) -> Any:
    return convert(value if is_formula(value) else float(value))


def _is_number(part: Any) -> bool:
    return isinstance(part, int | float | np.number) and not isinstance(part, bool)
