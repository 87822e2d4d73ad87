"""Ranks near singular poses, from the wrenches of a record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.compiled import Backend, Checks, Kernel, kernel_of, unpack
from robostiff.elastostatics.conditioning import smallest_held_stiffness
from robostiff.elastostatics.tolerance import DEFAULT_TOLERANCE, scaling
from robostiff.recorded import RecordedRobot
from robostiff.spatial import Space
from robostiff.spatial.batch import empty_batch

# What is so much clearer than the tolerances ask for is decided alike with the characteristic
# length of another posture, and by wrenches of a record, which are rounded otherwise.
_CLEARLY = 10.0
_ROUNDED = 1e-2
# Part of the largest diagonal entry of K below which rounding shows in the others of its row.
_SMALL = 1e-8


@dataclass(frozen=True)
class RecordedRanks:
    """Decides ranks as `aggregate` does, by unit wrenches of the legs.

    Pivots of K fall with the square of the singular values of these: where they alone are unsafe,
    most poses are near a singular one, but not so near that anything is in doubt.
    """

    kernel: Kernel  # its results are the wrenches that the legs transmit, one after the other
    counts: tuple[int, ...]  # how many each leg has
    space: Space
    length: float  # characteristic length [m]

    @classmethod
    def of(cls, recorded: RecordedRobot) -> RecordedRanks:
        """The ranks of a record that needs no closure."""
        counts = tuple(len(leg.basis) for leg in recorded.legs)
        kernel = kernel_of(recorded, [_Wrenches(sum(counts))], Backend.ARRAYS, checks=Checks.NONE)
        return cls(kernel, counts, recorded.space, recorded.length)

    def decided(self, inputs: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ranks (N,), and where they are beyond doubt (N,).

        By inputs of the kernels (inputs, N), and the upper triangle of K at each pose (rows, N).
        """
        n, count, tolerance = self.space.size, inputs.shape[1], DEFAULT_TOLERANCE
        s = scaling(np.array(self.length), self.space)
        wrenches = self.kernel.evaluate(inputs).T.reshape(count, sum(self.counts), n) / s
        clear = np.isfinite(wrenches).all(axis=(1, 2))
        wrenches[~clear] = 0.0
        unit = self._unit(wrenches)
        values = np.linalg.svd(unit, compute_uv=False)
        rank = np.count_nonzero(values > tolerance.independence, axis=-1)
        kept = values > _CLEARLY * tolerance.near_independence
        clear &= np.all(kept | (values < _ROUNDED * tolerance.rounding), axis=-1)
        K = empty_batch((count,), (n, n))
        unpack(upper, K)
        K = K * np.outer(s, s)
        diagonal = np.einsum("nii->ni", K)
        # What no leg feels is zero in both forms, but for the same rounding.
        idle = np.max(np.abs(unit), axis=-1) < _ROUNDED * tolerance.rounding
        shown = diagonal > _SMALL * np.max(diagonal, axis=-1, keepdims=True)
        clear &= np.all(idle | shown, axis=-1)
        smallest = smallest_held_stiffness(K, rank)
        return rank, clear & (smallest > _CLEARLY * tolerance.near_rigidity)

    def _unit(self, wrenches: np.ndarray) -> np.ndarray:
        """An orthonormal basis for each leg, side by side (N, n, m)."""
        ends = np.cumsum(self.counts).tolist()
        found = []
        for own in set(self.counts) - {0}:  # legs with as many wrenches at once
            columns = [
                range(end - m, end) for m, end in zip(self.counts, ends, strict=True) if m == own
            ]
            Q = np.linalg.qr(np.swapaxes(wrenches[:, np.array(columns)], -1, -2))[0]
            found.append(np.moveaxis(Q, 1, 2).reshape(len(Q), self.space.size, -1))
        return np.concatenate(found, axis=-1)


@dataclass(frozen=True)
class _Wrenches:
    """So many wrenches that the legs of a robot transmit, as an output of a kernel."""

    count: int
    name = "wrenches"

    def shape(self, space: Space) -> tuple[int, ...]:
        """(count n,)."""
        return (self.count * space.size,)

    def recorded(self, robot: RecordedRobot) -> list[Any]:
        """Their entries, wrench by wrench; world axes, about the reference point."""
        return [x for leg in robot.legs for wrench in leg.basis for x in wrench]
