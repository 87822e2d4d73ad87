from robostiff.analysis.cable_stiffness import CableStiffness, cable_stiffness
from robostiff.analysis.cable_tensions import CableTensions, cable_tensions
from robostiff.analysis.compiled_answer import CompiledAnswer
from robostiff.analysis.compiled_linkage import CompiledLinkage
from robostiff.analysis.compiled_robot import CompiledRobot
from robostiff.analysis.compiled_robot import compile_robot as compile
from robostiff.analysis.deflection_under_load import (
    ActuatorLoad,
    Deflection,
    JointReaction,
    PartShare,
)
from robostiff.analysis.free_motion import FreeMotion, free_motions_in_words
from robostiff.analysis.loaded_cables import CableResponse, SlackEvent
from robostiff.analysis.many_deflections import DeflectionsOfPoses, deflection
from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.stiffness_at_pose import compliance, stiffness
from robostiff.analysis.verification import Comparison, Outcome, Verification, verify

__all__ = [
    "ActuatorLoad",
    "CableResponse",
    "CableStiffness",
    "CableTensions",
    "Comparison",
    "CompiledAnswer",
    "CompiledLinkage",
    "CompiledRobot",
    "Deflection",
    "DeflectionsOfPoses",
    "FreeMotion",
    "JointReaction",
    "Outcome",
    "PartShare",
    "RobotStiffness",
    "SlackEvent",
    "Verification",
    "cable_stiffness",
    "cable_tensions",
    "compile",
    "compliance",
    "deflection",
    "free_motions_in_words",
    "stiffness",
    "verify",
]
