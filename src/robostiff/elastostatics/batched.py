"""Results at a batch of poses: some of the poses, another shape of the batch, batches joined."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Self

import numpy as np


class PoseBatch:
    """A frozen dataclass; its arrays, and those of parts of it, begin with the axes of a batch."""

    doubtful: np.ndarray  # (...) of bool

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """Shape of the batch of poses, () for a single one."""
        return self.doubtful.shape

    def __getitem__(self, index: Any) -> Self:
        """The same at one pose, or at some poses, of the batch."""
        return _mapped(lambda own: np.asarray(own[index]), self)

    def reshaped(self, batch: tuple[int, ...]) -> Self:
        """The same under another batch shape."""
        axes = len(self.batch_shape)
        return _mapped(lambda own: own.reshape((*batch, *own.shape[axes:])), self)

    @classmethod
    def joined(cls, parts: Sequence[Self], batch: tuple[int, ...] | None = None) -> Self:
        """Several batches, each along one axis, as one, or under the shape of all poses.

        Zeros fill up the other axes, and what one of the parts lacks the whole does, too.
        """
        whole = parts[0] if len(parts) == 1 else _mapped(_one_batch, *parts)
        return whole if batch is None else whole.reshaped(batch)


def _mapped(f: Callable[..., np.ndarray], first: Any, *others: Any) -> Any:
    """The first of several values that are alike, its arrays made from those of all."""
    found = first
    if isinstance(first, np.ndarray | np.generic):
        found = f(*map(np.asarray, (first, *others)))
    elif any(other is None for other in others):
        found = None
    elif isinstance(first, PoseBatch):
        own = vars(first)
        every = {}
        for name in first.__dataclass_fields__:  # type: ignore[attr-defined]
            is_alone = not others and type(own[name]) is np.ndarray  # most of all calls
            rest = [getattr(other, name) for other in others]
            every[name] = f(own[name]) if is_alone else _mapped(f, own[name], *rest)
        found = type(first)(**every)
    elif isinstance(first, str):
        found = "; ".join(dict.fromkeys(own for own in (first, *others) if own))
    elif isinstance(first, tuple) and not isinstance(next(iter(first), None), str):
        found = tuple(_mapped(f, *own) for own in zip(first, *others, strict=True))
    elif isinstance(first, dict):
        found = {key: _mapped(f, first[key], *(own[key] for own in others)) for key in first}
    return found


def _one_batch(*stacks: np.ndarray) -> np.ndarray:
    most = np.max([stack.shape[1:] for stack in stacks], axis=0).astype(int)
    missing = [[(0, 0), *((0, k) for k in most - stack.shape[1:])] for stack in stacks]
    return np.concatenate([np.pad(s, k) for s, k in zip(stacks, missing, strict=True)])
