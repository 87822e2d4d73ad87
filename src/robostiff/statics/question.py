"""What is asked of a robot under load."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robostiff.model import Snapshot
from robostiff.spatial import Space
from robostiff.statics.force_law import Laws, with_laws
from robostiff.statics.problem import EquilibriumProblem
from robostiff.statics.status import EquilibriumStatus


@dataclass(frozen=True)
class Question:
    """A robot at one posture with its loads, ready to be solved.

    Attributes
    ----------
    name : str
    problem : EquilibriumProblem
    space : Space
    frame : tuple of (3, 3) and (3,) arrays
        Axes and origin of the platform frame at the unloaded posture [m].
    status : EquilibriumStatus
        What is to be said of the posture.
    snapshot : Snapshot
        At that posture.
    """

    name: str
    problem: EquilibriumProblem
    space: Space
    frame: tuple[np.ndarray, np.ndarray]
    status: EquilibriumStatus
    snapshot: Snapshot

    def under(self, laws: Laws | None) -> Question:
        """The same, some joints following laws of their own."""
        if not laws:
            return self
        groups = with_laws(self.problem.groups, laws)
        return replace(self, problem=replace(self.problem, groups=groups))
