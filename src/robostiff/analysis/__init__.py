"""The questions: stiffness at a pose, compliance, deflection under a load and who bends."""

from robostiff.analysis.deflection_under_load import (
    ActuatorLoad,
    Deflection,
    JointReaction,
    PartShare,
    deflection,
)
from robostiff.analysis.free_motion import FreeMotion, free_motions_in_words
from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.stiffness_at_pose import compliance, stiffness

__all__ = [
    "ActuatorLoad",
    "Deflection",
    "FreeMotion",
    "JointReaction",
    "PartShare",
    "RobotStiffness",
    "compliance",
    "deflection",
    "free_motions_in_words",
    "stiffness",
]
