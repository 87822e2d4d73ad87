from robostiff.analysis.cable_stiffness import (
    CableResponse,
    CableStiffness,
    SlackEvent,
    cable_stiffness,
)
from robostiff.analysis.cable_tensions import CableTensions, cable_tensions
from robostiff.analysis.compiled_answer import CompiledAnswer
from robostiff.analysis.compiled_linkage import CompiledLinkage
from robostiff.analysis.compiled_robot import CompiledRobot
from robostiff.analysis.compiled_robot import compile_robot as compile
from robostiff.analysis.deflection_under_load import (
    ActuatorLoad,
    Deflection,
    DeflectionsOfPoses,
    JointReaction,
    PartShare,
    deflection,
)
from robostiff.analysis.free_motion import FreeMotion, free_motions_in_words
from robostiff.analysis.posed_stiffness import compliance, stiffness
from robostiff.analysis.result import RobotStiffness
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
