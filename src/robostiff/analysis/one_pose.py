"""Check for functions that take a single pose."""

from __future__ import annotations

from robostiff.errors import InputError


def require_one_pose(subject: str, batch: tuple[int, ...], hint: str | None = None) -> None:
    """Raise for a batch of poses.

    Parameters
    ----------
    subject : str
        What the pose is of, such as ``"a deflection"``.
    batch : tuple of int
        Shape of the batch, () for one pose.
    hint : str, optional
        What to do with several.

    Raises
    ------
    InputError

    Examples
    --------
    >>> require_one_pose("a deflection", ())
    >>> require_one_pose("a deflection", (2, 3))
    Traceback (most recent call last):
    ...
    robostiff.errors.InputError: pose of a deflection: got '6 poses', expected one pose
    """
    if not batch:
        return
    count = 1
    for size in batch:
        count *= size
    raise InputError(f"pose of {subject}", got=f"{count} poses", expected="one pose", hint=hint)
