"""Packages that only plots need, and the message when they are missing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from robostiff.errors import InputError


@contextmanager
def plot_extra() -> Iterator[None]:
    """Turn a failed import into a message that names what to install.

    Raises
    ------
    InputError

    Examples
    --------
    >>> with plot_extra():
    ...     import a_package_that_is_missing
    Traceback (most recent call last):
    robostiff.errors.InputError: plots need 'a_package_that_is_missing', ...
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise InputError(
            f"plots need {error.name!r}, which is not installed",
            hint="write pip install 'robostiff[plot]'",
        ) from None
