"""Legs with equal chains: at a few poses all of them are closed and placed together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.kinematics.closure.leg_equations import gaps
from robostiff.kinematics.closure.leg_solver import LegSolver
from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.model import PlacedLeg
from robostiff.model.entries import are_equal
from robostiff.spatial.batch import poses_side_by_side, product, transposed


@dataclass(frozen=True)
class LegsAlike:
    """Legs with equal chains in one assembly mode.

    Attributes
    ----------
    places : tuple of int
        Which legs of the robot.
    solvers : tuple of LegSolver
    """

    places: tuple[int, ...]
    solvers: tuple[LegSolver, ...]

    def solve(
        self, pose: np.ndarray, R: np.ndarray, *, from_afar: bool
    ) -> tuple[list[np.ndarray], list[np.ndarray], PlacedChain | None]:
        """Coordinates (N, size) of each leg at poses (N, 6); see `LegSolver.solve`.

        The third result is for `placed`.
        """
        first, count = self.solvers[0], len(pose)
        form, placed = first.closed_form, None
        if form is None or len(self.solvers) == 1:
            return self._one_by_one(pose, R, from_afar=from_afar)
        ends = self._ends(R, pose[:, :3])
        R_base, p_base = self._bases(count)
        inside = transposed(R_base)
        p_inside = np.einsum("...ij,...j->...i", inside, ends[1] - p_base)
        q = first.closed_at(form, product(inside, ends[0]), p_inside)
        if from_afar and first.leg.chain.has_blocks:
            placed = place_chain(first.leg.chain, q, R_base, p_base)
            if np.any(first.leaves_open(gaps(first.leg, placed, *ends))):
                return self._one_by_one(pose, R, from_afar=from_afar)
        rows = range(0, len(q), count)
        each = [q[start : start + count] for start in rows]
        return each, [np.zeros(count, dtype=bool)] * len(each), placed

    def _one_by_one(
        self, pose: np.ndarray, R: np.ndarray, *, from_afar: bool
    ) -> tuple[list[np.ndarray], list[np.ndarray], PlacedChain | None]:
        each = [one.solve(pose, R, from_afar=from_afar) for one in self.solvers]
        alone = each[0][2] if len(each) == 1 else None
        return [q for q, _, _ in each], [away for _, away, _ in each], alone

    def placed(
        self,
        q: Sequence[np.ndarray],
        R: np.ndarray,
        p: np.ndarray,
        placed: PlacedChain | None = None,
    ) -> tuple[list[PlacedLeg], np.ndarray, np.ndarray]:
        """The legs at coordinates (N, size) of each, with the platform at (R, p).

        The chain of all of them may be placed already.

        Returns
        -------
        legs : list of PlacedLeg
        shifts, turns : (legs, N) arrays
            By how much each misses the platform, or a loop in it is open [m], [rad].
        """
        first, count, number = self.solvers[0].leg, len(p), len(self.solvers)
        if number == 1:
            R_base, p_base, together = first.base.R, first.base.p, q[0]
        else:
            R_base, p_base = self._bases(count)
            together = poses_side_by_side(np.concatenate(q), 1)
        if placed is None:
            placed = place_chain(first.chain, together, R_base, p_base)
        shift, turn = _largest(gaps(first, placed, *self._ends(R, p)))
        whole = PlacedLeg(first.name, placed.elements, placed.p)
        legs = [whole]
        if number > 1:
            legs = [
                replace(whole.at(slice(i * count, (i + 1) * count)), name=one.leg.name)
                for i, one in enumerate(self.solvers)
            ]
        return legs, shift.reshape(number, count), turn.reshape(number, count)

    def _ends(self, R: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Frames (legs N, 3, 3) and (legs N, 3) on the platform at which the legs end."""
        R_own, p_own = self._attachments
        at = p + np.einsum("nij,lj->lni", R, p_own)
        return _rows(product(R, R_own[:, None]), 2), _rows(at, 1)

    def _bases(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Frames in which the legs begin, for so many poses of each."""
        R, p = self._begin
        number = len(R)
        return (
            _rows(np.broadcast_to(R[:, None], (number, count, 3, 3)), 2),
            _rows(np.broadcast_to(p[:, None], (number, count, 3)), 1),
        )

    @cached_property
    def _begin(self) -> tuple[np.ndarray, np.ndarray]:
        own = [one.leg.base for one in self.solvers]
        return np.stack([frame.R for frame in own]), np.stack([frame.p for frame in own])

    @cached_property
    def _attachments(self) -> tuple[np.ndarray, np.ndarray]:
        own = [one.leg.attachment for one in self.solvers]
        return np.stack([frame.R for frame in own]), np.stack([frame.p for frame in own])


def each_alone(solvers: Sequence[LegSolver]) -> tuple[LegsAlike, ...]:
    """Every leg for itself."""
    return tuple(LegsAlike((i,), (one,)) for i, one in enumerate(solvers))


def legs_alike(solvers: Sequence[LegSolver]) -> tuple[LegsAlike, ...]:
    """Legs of a robot in groups of equal chains, closed in the same assembly mode or by steps."""
    groups: list[list[int]] = []
    for i, one in enumerate(solvers):
        for group in groups:
            first = solvers[group[0]]
            modes = [own.closed_form and own.closed_form.mode for own in (one, first)]
            if modes[0] == modes[1] and are_equal(one.leg.chain, first.leg.chain):
                group.append(i)
                break
        else:
            groups.append([i])
    return tuple(LegsAlike(tuple(group), tuple(solvers[i] for i in group)) for group in groups)


def _rows(values: np.ndarray, own_axes: int) -> np.ndarray:
    """Of all legs at all poses along one axis, poses side by side."""
    return poses_side_by_side(values.reshape(-1, *values.shape[2:]), own_axes)


def _largest(loops: Iterable[Loop]) -> tuple[np.ndarray, np.ndarray]:
    """Largest of the gaps of a chain and of loops in it: shift (N,) [m] and turn (N,) [rad]."""
    shifts, turns = zip(*(gap.missed for gap in loops), strict=True)
    if len(shifts) == 1:
        return shifts[0], turns[0]
    return np.max(shifts, axis=0), np.max(turns, axis=0)
