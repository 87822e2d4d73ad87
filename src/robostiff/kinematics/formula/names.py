"""Names of what a record computes, for those who read it."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.record import Entry


def named(value: Any, name: str) -> Any:
    """The same entry, or vector of entries, with a name; the components get _x, _y and _z.

    Parameters
    ----------
    value : Entry, number or (3,) array of them
    name : str
    """
    if isinstance(value, np.ndarray):
        for component, axis in zip(value, "xyz", strict=True):
            named(component, f"{name}_{axis}")
    elif isinstance(value, Entry):
        value.named(name)
    return value
