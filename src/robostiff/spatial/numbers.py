"""Numbers that a caller hands over: what they must be before they become arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.errors import InputError

_LARGEST = 1e30  # far beyond any robot, and far from overflow


def as_floats(subject: str, value: Any, expected: str) -> np.ndarray:
    """Real finite numbers as an array of floats.

    Parameters
    ----------
    subject : str
        What the numbers are, in words.
    value : array-like
        What came.
    expected : str
        What was expected, for the message.

    Raises
    ------
    InputError
        For texts, truth values, complex or ragged input, and for numbers that are not finite or
        beyond 1e30.

    Examples
    --------
    >>> as_floats("point", [0, 0, 1], "three numbers")
    array([0., 0., 1.])
    """
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
