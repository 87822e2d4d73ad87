"""Rules that choose the tensions of a cable robot: given, nearest to an aim, or in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from robostiff.cables.nearest_tensions import TensionProblem, nearest_tensions
from robostiff.cables.status import CableStatus
from robostiff.errors import InputError
from robostiff.spatial import as_floats


@runtime_checkable
class TensionRule(Protocol):
    """A rule that chooses tensions at a batch of poses."""

    @property
    def name(self) -> str:
        """Name of the rule."""
        ...

    def choose(self, problem: TensionProblem) -> tuple[np.ndarray, np.ndarray]:
        """Tensions (N, m) [N], and a status (N,) of each pose."""
        ...


@dataclass(frozen=True)
class GivenTensions:
    """The tensions themselves, as measured or commanded.

    Attributes
    ----------
    values : (m,) or (..., m) array
        Of every cable [N], at all poses or at each.
    """

    values: ArrayLike
    name = "given"

    def choose(self, problem: TensionProblem) -> tuple[np.ndarray, np.ndarray]:
        """The tensions, and whether they balance the wrench.

        Raises
        ------
        InputError
            When there are not as many as cables, or some are negative.
        """
        poses, _, cables = problem.W.shape
        expected = f"{cables} tensions [N], one a cable"
        given = as_floats("tensions", self.values, expected, "N")
        if given.ndim == 0 or given.shape[-1] != cables:
            raise InputError("tensions", got=self.values, expected=expected)
        if np.any(given < 0):
            raise InputError("tensions", got=self.values, expected="none below 0: cables only pull")
        rows = given.reshape(-1, cables)
        if len(rows) not in {1, poses}:
            raise InputError("tensions", got=given.shape, expected=f"one row, or {poses} of them")
        tensions = np.array(np.broadcast_to(rows, (poses, cables)))
        status = np.zeros(poses, dtype=np.uint16)
        status[~problem.balanced(tensions)] = CableStatus.UNBALANCED
        return tensions, status


@dataclass(frozen=True)
class NearestTensions:
    """The tensions within the limits that are nearest to an aim, and balance the wrench.

    They exist wherever feasible tensions exist, and vary continuously with the pose. The aim lies
    between the least and the greatest tension of each cable by the level, 0 for the least.

    Attributes
    ----------
    level : float or None
        0 to 1; that of the robot when None.
    """

    level: float | None = None
    name = "nearest"

    def choose(self, problem: TensionProblem) -> tuple[np.ndarray, np.ndarray]:
        """The tensions, and a status where none exist."""
        tensions, solved, impossible = nearest_tensions(problem)
        status = np.where(impossible, int(CableStatus.INFEASIBLE), 0).astype(np.uint16)
        for i in np.flatnonzero(~solved & ~impossible):
            status[i] = _failure(problem, int(i))
        return tensions, status


@dataclass(frozen=True)
class ClosedFormTensions:
    """Pott's improved closed form, t = t_aim - (A^T)^+ (F + A^T t_aim), cables at limits fixed.

    The cable furthest beyond a limit is set to it and taken out, until all are within. Quick and
    continuous, but it may fail near the border of the workspace where `NearestTensions` does not.
    (Pott 2014, An improved force distribution algorithm for over-constrained cable robots.)

    Attributes
    ----------
    level : float or None
        0 to 1, and 0.5 in the source; that of the robot when None.
    """

    level: float | None = 0.5
    name = "closed-form"

    def choose(self, problem: TensionProblem) -> tuple[np.ndarray, np.ndarray]:
        """The tensions, and a status where the form finds none."""
        poses, _, cables = problem.W.shape
        least, greatest = problem.least, problem.greatest
        open_ = np.ones((poses, cables), dtype=bool)
        tensions = np.array(np.broadcast_to(problem.aim, (poses, cables)))
        for _ in range(cables + 1):
            missing = problem.missing(tensions)
            change = np.einsum(
                "nij,nj->ni", np.linalg.pinv(problem.W * open_[:, None, :], rcond=1e-9), missing
            )
            trial = tensions - np.where(open_, change, 0.0)
            beyond = np.maximum(least - trial, trial - greatest)
            beyond = np.where(open_ & (beyond > 0), beyond, 0.0)
            furthest = beyond.argmax(axis=-1)
            violated = beyond[np.arange(poses), furthest] > 0
            done = ~violated
            tensions = np.where(done[:, None], trial, tensions)
            open_[done] = False
            rows = np.flatnonzero(violated)
            if not len(rows):
                break
            fixed = furthest[rows]
            below = trial[rows, fixed] < least[fixed]
            tensions[rows, fixed] = np.where(below, least[fixed], greatest[fixed])
            open_[rows, fixed] = False
        right = problem.balanced(tensions) & problem.within(tensions)
        status = np.zeros(poses, dtype=np.uint16)
        for i in np.flatnonzero(~right):
            status[i] = _failure(problem, int(i))
        return tensions, status


def _failure(problem: TensionProblem, pose: int) -> CableStatus:
    """The status of a pose at which a rule found no tensions."""
    possible = problem.has_solution(pose)
    return CableStatus.RULE_FAILED if possible else CableStatus.INFEASIBLE
