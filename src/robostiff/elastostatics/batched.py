"""Results at a batch of poses: some of the poses, another shape of the batch, batches joined."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
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
        return _mapped(lambda arrays: np.asarray(arrays[0][index]), [self])

    def reshaped(self, batch: tuple[int, ...]) -> Self:
        """The same under another batch shape."""
        axes = len(self.batch_shape)
        return _mapped(lambda arrays: arrays[0].reshape((*batch, *arrays[0].shape[axes:])), [self])

    @classmethod
    def joined(cls, parts: Sequence[Self], batch: tuple[int, ...] | None = None) -> Self:
        """Several batches, each along one axis, as one, or under the shape of all poses.

        Zeros fill up the other axes, and what one of the parts lacks the whole does, too.
        """
        whole = parts[0] if len(parts) == 1 else _mapped(_one_batch, parts)
        return whole if batch is None else whole.reshaped(batch)


def _mapped(f: Callable[[Sequence[np.ndarray]], np.ndarray], values: Sequence[Any]) -> Any:
    """The first of several values that are alike, its arrays made from those of all."""
    first = None if any(value is None for value in values) else values[0]
    if isinstance(first, np.ndarray | np.generic):
        return f([np.asarray(value) for value in values])
    if isinstance(first, str):
        return "; ".join(dict.fromkeys(value for value in values if value))
    if isinstance(first, tuple):
        return tuple(_mapped(f, own) for own in zip(*values, strict=True))
    if isinstance(first, Mapping):
        return {key: _mapped(f, [value[key] for value in values]) for key in first}
    if not (isinstance(first, PoseBatch) and is_dataclass(first)):
        return first
    names = [own.name for own in fields(first)]
    own = {name: _mapped(f, [getattr(value, name) for value in values]) for name in names}
    return replace(first, **own)


def _one_batch(stacks: Sequence[np.ndarray]) -> np.ndarray:
    most = np.max([stack.shape[1:] for stack in stacks], axis=0).astype(int)
    missing = [[(0, 0), *((0, k) for k in most - stack.shape[1:])] for stack in stacks]
    return np.concatenate([np.pad(s, k) for s, k in zip(stacks, missing, strict=True)])
