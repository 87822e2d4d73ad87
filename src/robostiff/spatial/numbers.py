"""Numbers that a caller hands over: the one gate through which they become arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial.quantities import Units, in_si

_LARGEST = 1e30  # far beyond any robot, and far from overflow


def as_floats(subject: str, value: Any, expected: str, units: Units | None = None) -> np.ndarray:
    """Real finite numbers, or quantities in SI units, as an array of floats.

    Parameters
    ----------
    subject : str
        What the numbers are, in words.
    value : array-like
        What came.
    expected : str
        What was expected, for the message.
    units : str, sequence of str, mapping of int to sequence of str, optional
        SI unit of all entries, or of those of the last axis, by its length if need be: that of the
        numbers, and what quantities are converted to. Left out, none are taken.

    Raises
    ------
    InputError
        For texts, truth values, complex or ragged input, for numbers that are not finite or beyond
        1e30, and for quantities that measure something else.

    Examples
    --------
    >>> as_floats("point", [0, 0, 1], "three numbers")
    array([0., 0., 1.])
    """
    value = in_si(subject, value, expected, units)
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.asarray(None)
    if array.dtype.kind not in "iuf":
        raise InputError(subject, got=value, expected=expected)
    # NaN fails the comparison as well.
    wrong = ~(np.abs(array) <= _LARGEST)
    if np.any(wrong):
        place = tuple(int(i) for i in np.argwhere(wrong)[0])
        entry = f"{subject}, entry {list(place)}" if place else subject
        raise InputError(entry, got=array[place], expected="a finite number up to 1e30")
    return array.astype(float, copy=False)


def as_float(subject: str, value: Any, expected: str, unit: str | None = None) -> float:
    """One real finite number, or a quantity in an SI unit, as a float.

    Raises
    ------
    InputError
        As `as_floats`, and for an array.

    Examples
    --------
    >>> as_float("length", 3, "a length [m]", "m")
    3.0
    """
    array = as_floats(subject, value, expected, unit)
    if array.shape != ():
        raise InputError(subject, got=value, expected=expected)
    return float(array)
