"""The answer of a kernel at a batch of poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.compiled import StiffnessMatrix
from robostiff.elastostatics.batched import PoseBatch
from robostiff.elastostatics.status import StatusOfPoses


@dataclass(frozen=True, repr=False)
class CompiledAnswer(StatusOfPoses, PoseBatch):
    """The result of a compiled robot at a batch of poses.

    Attributes
    ----------
    values : dict of names to (N, ...) arrays
        One array an output; not a number where the status says that there is no answer.
    status_codes : (N,) array of uint16
        See `Status`.
    rank : (N,) array of int8
        -1 where out of reach.
    guarded : (N,) array of bool
        Poses that were computed again by the wrench basis form on batches.
    """

    values: dict[str, np.ndarray]
    status_codes: np.ndarray
    rank: np.ndarray
    guarded: np.ndarray

    def __repr__(self) -> str:
        names = ", ".join(self.values)
        share = f"{self.guarded_share:.2%} recomputed"
        return f"<CompiledAnswer of {len(self.rank)} poses: {names}; {share}>"

    @property
    def matrix(self) -> np.ndarray:
        """Stiffness matrices (N, n, n), of a kernel that has them."""
        return self.values[StiffnessMatrix.name]

    @property
    def guarded_share(self) -> float:
        """Part of the poses that were recomputed."""
        return float(np.mean(self.guarded)) if self.guarded.size else 0.0
