"""Legs with equal chains: at a few poses all of them are closed and placed together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.kinematics.closure.arm import Arm
from robostiff.kinematics.closure.assembly import in_one, on_turn_of_home
from robostiff.kinematics.closure.leg_equations import gaps
from robostiff.kinematics.closure.leg_solver import (
    CLOSED,
    ClosedForm,
    LegSolver,
    recognised_solver,
)
from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.kinematics.legs_together import in_groups
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Leg, PlacedLeg
from robostiff.model.entries import are_equal
from robostiff.spatial.batch import poses_side_by_side, product, transposed


@dataclass(frozen=True)
class LegsAlike:
    """Legs with equal chains in one assembly mode."""

    places: tuple[int, ...]  # which legs of the robot
    solvers: tuple[LegSolver, ...]

    def solve(
        self, pose: np.ndarray, R: np.ndarray, *, from_afar: bool
    ) -> tuple[list[np.ndarray], list[np.ndarray], PlacedChain | None]:
        """Coordinates (N, size) of each leg at poses (N, 6); see `LegSolver.solve`.

        The third result is for `placed`.
        """
        first, count = self.solvers[0], len(pose)
        form, placed, chain = first.closed_form, None, first.leg.chain
        if form is None or isinstance(form, Arm) or len(self.solvers) == 1:
            return self._one_by_one(pose, R, from_afar=from_afar)
        q = on_turn_of_home(chain, self._in_form(form, R, pose[:, :3]), chain.home)
        each = np.split(q, len(self.solvers))
        if from_afar and chain.has_blocks:
            placed = self._together(each)
            if np.any(first.leaves_open(self._gaps(placed, R, pose[:, :3]))):
                return self._one_by_one(pose, R, from_afar=from_afar)
        return each, [np.zeros(count, dtype=bool)] * len(each), placed

    def in_modes_of_home(self) -> list[tuple[LegSolver, bool]]:
        """The legs in the assembly modes that are nearest to home, and whether they close there."""
        first, number = self.solvers[0], len(self.solvers)
        form, chain = first.closed_form, first.leg.chain
        if form is None:
            return [(own, False) for own in self.solvers]
        modes = first.modes
        pose = np.tile(first.home_pose, (len(modes), 1))
        R, p = turn_by_vector(pose[:, 3:]), pose[:, :3]
        each = np.split(self._in_form(form.in_mode(in_one(number * modes, 1)), R, p), number)
        shifts, turns = _largest(self._gaps(self._together(each), R, p))
        closes = np.maximum(shifts / first.length, turns).reshape(number, -1).T <= CLOSED
        every, given = np.stack(each, axis=1), chain.home_given[chain.main_places]
        chosen = first.nearest(form, every, closes, chain.home, given)
        home = on_turn_of_home(chain, every[chosen, range(number)], chain.home)
        if isinstance(form, Arm):  # where drives can move alone, home says how they stand
            given = self._together([chain.home[None]] * number)
            shifts, turns = _largest(self._gaps(given, R[:1], p[:1]))
            is_closed = np.maximum(shifts / first.length, turns) <= CLOSED
            own = on_turn_of_home(chain, chain.home[None].copy(), chain.home)
            home = np.where(is_closed[:, None], own, home)
        return [
            (replace(own, closed_form=form.in_mode(modes[i]), home=q), bool(closed[i]))
            for own, i, q, closed in zip(self.solvers, chosen, home, closes.T, strict=True)
        ]

    def _in_form(self, form: ClosedForm, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Coordinates (legs N, size) in closed form, the platform at (R, p)."""
        R_end, p_end = self._ends(R, p)
        R_base, p_base = self._bases(len(p))
        inside = transposed(R_base)
        p_inside = np.einsum("...ij,...j->...i", inside, p_end - p_base)
        return self.solvers[0].in_form(form, product(inside, R_end), p_inside)

    def _together(self, q: Sequence[np.ndarray]) -> PlacedChain:
        """The chain of all legs at coordinates (N, size) of each."""
        first = self.solvers[0].leg
        if len(q) == 1:
            return place_chain(first.chain, q[0], first.base.R, first.base.p)
        together = poses_side_by_side(np.concatenate(q), 1)
        return place_chain(first.chain, together, *self._bases(len(q[0])))

    def _gaps(self, placed: PlacedChain, R: np.ndarray, p: np.ndarray) -> Iterator[Loop]:
        return gaps(self.solvers[0].leg, placed, *self._ends(R, p))

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
        placed = self._together(q) if placed is None else placed
        shift, turn = _largest(self._gaps(placed, R, p))
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
        R_own, p_own = self._frames[1]
        at = p + np.einsum("nij,lj->lni", R, p_own)
        return _rows(product(R, R_own[:, None]), 2), _rows(at, 1)

    def _bases(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Frames in which the legs begin, for so many poses of each."""
        R, p = self._frames[0]
        number = len(R)
        return (
            _rows(np.broadcast_to(R[:, None], (number, count, 3, 3)), 2),
            _rows(np.broadcast_to(p[:, None], (number, count, 3)), 1),
        )

    @cached_property
    def _frames(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Axes (legs, 3, 3) and origins (legs, 3) of the bases, then of the attachments."""
        legs = [one.leg for one in self.solvers]
        each = [leg.base for leg in legs], [leg.attachment for leg in legs]
        return [(np.stack([f.R for f in own]), np.stack([f.p for f in own])) for own in each]


def legs_alike(solvers: Sequence[LegSolver]) -> tuple[LegsAlike, ...]:
    """Legs of a robot in groups of equal chains, closed in the same assembly mode or by steps."""
    groups = in_groups(solvers, _close_alike)
    return tuple(LegsAlike(group, tuple(solvers[i] for i in group)) for group in groups)


def _close_alike(one: LegSolver, other: LegSolver) -> bool:
    modes = [own.closed_form and own.closed_form.mode for own in (one, other)]
    same = modes[0] == modes[1] and one.leg.elbow is other.leg.elbow
    return same and are_equal(one.leg.chain, other.leg.chain)


def leg_solvers(legs: Sequence[Leg], home_pose: np.ndarray, length: float) -> tuple[LegSolver, ...]:
    """The solvers that close legs of a robot, of size `length`, at its home pose (6,).

    Raises InputError when a leg does not close there, or an elbow is named for a leg that has no
    choice.
    """
    recognised = [recognised_solver(leg, home_pose, length) for leg in legs]
    found: dict[int, tuple[LegSolver, bool]] = {}
    for group in legs_alike(recognised):
        found |= zip(group.places, group.in_modes_of_home(), strict=True)
    each = (found[i] for i in range(len(legs)))
    return tuple(own if closes else own.closing_at_home() for own, closes in each)


def _rows(values: np.ndarray, own_axes: int) -> np.ndarray:
    """Of all legs at all poses along one axis, poses side by side."""
    return poses_side_by_side(values.reshape(-1, *values.shape[2:]), own_axes)


def _largest(loops: Iterable[Loop]) -> tuple[np.ndarray, np.ndarray]:
    """Largest of the gaps of a chain and of loops in it: shift (N,) [m] and turn (N,) [rad]."""
    shifts, turns = zip(*(gap.missed for gap in loops), strict=True)
    if len(shifts) == 1:
        return shifts[0], turns[0]
    return np.max(shifts, axis=0), np.max(turns, axis=0)
