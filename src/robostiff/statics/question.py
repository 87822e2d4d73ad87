"""What is asked of a robot under load."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from robostiff.model import Snapshot
from robostiff.spatial import Space
from robostiff.statics.joint_laws import Laws, with_laws
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
    snapshot : Snapshot or None
        At that posture; None of a network.
    laws : Laws
        That the robot has.
    """

    name: str
    problem: EquilibriumProblem
    space: Space
    frame: tuple[np.ndarray, np.ndarray]
    status: EquilibriumStatus
    snapshot: Snapshot | None
    laws: Laws = field(default_factory=dict)

    def under(self, laws: Laws | None) -> Question:
        """The same, joints following the laws of the robot, or given ones in their place."""
        all_laws = {**self.laws, **(laws or {})}
        if not all_laws:
            return self
        groups = with_laws(self.problem.groups, all_laws)
        return replace(self, problem=replace(self.problem, groups=groups))
