"""Packages that only maps need, and the message when they are missing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from robostiff.errors import InputError


@contextmanager
def maps_extra() -> Iterator[None]:
    """Turn a failed import into a message that names what to install.

    Raises
    ------
    InputError

    Examples
    --------
    >>> with maps_extra():
    ...     import a_package_that_is_missing
    Traceback (most recent call last):
    robostiff.errors.InputError: maps need 'a_package_that_is_missing', ...
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise InputError(
            f"maps need {error.name!r}, which is not installed",
            hint="write pip install 'robostiff[maps]'",
        ) from None
