"""Foreign data in an error message, whatever it is."""

from __future__ import annotations

from typing import Any


def shown(data: Any) -> str:
    """A text or number as it is; of anything else only the kind.

    Examples
    --------
    >>> shown("tan"), shown(["sym", ["x"]]), shown(10**9)
    ('tan', "list that starts with 'sym'", '1000000000')
    """
    if isinstance(data, str):
        return data[:80]
    if data is None or isinstance(data, bool | float):
        return str(data)
    if isinstance(data, int):
        return str(data) if abs(data) < 10**30 else "a very large integer"
    if isinstance(data, list) and data and isinstance(data[0], str):
        return f"list that starts with {data[0][:80]!r}"
    return type(data).__name__
