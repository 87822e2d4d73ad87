"""The questions: stiffness at a pose, compliance, deflection under a load and who bends."""

from robostiff.analysis.compiled_robot import CompiledAnswer, CompiledRobot
from robostiff.analysis.compiled_robot import compile_robot as compile
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
from robostiff.analysis.verification import Comparison, Outcome, Verification, verify

__all__ = [
    "ActuatorLoad",
    "Comparison",
    "CompiledAnswer",
    "CompiledRobot",
    "Deflection",
    "FreeMotion",
    "JointReaction",
    "Outcome",
    "PartShare",
    "RobotStiffness",
    "Verification",
    "compile",
    "compliance",
    "deflection",
    "free_motions_in_words",
    "stiffness",
    "verify",
]
