from robostiff.analysis.cable_stiffness import (
    CableResponse,
    CableStiffness,
    SlackEvent,
    cable_stiffness,
)
from robostiff.analysis.cable_tensions import CableTensions, cable_tensions
from robostiff.analysis.compiled_answer import CompiledAnswer
from robostiff.analysis.compiled_stiffness import CompiledStiffness
from robostiff.analysis.compiled_stiffness import compile_stiffness as compile
from robostiff.analysis.deflection_under_load import (
    ActuatorLoad,
    Deflection,
    JointReaction,
    PartShare,
)
from robostiff.analysis.free_motion import FreeMotion, free_motions_in_words
from robostiff.analysis.posed_stiffness import compliance, deflection, stiffness
from robostiff.analysis.result import Stiffness
from robostiff.analysis.verification import Comparison, Outcome, Verification, verify

__all__ = [
    "ActuatorLoad",
    "CableResponse",
    "CableStiffness",
    "CableTensions",
    "Comparison",
    "CompiledAnswer",
    "CompiledStiffness",
    "Deflection",
    "FreeMotion",
    "JointReaction",
    "Outcome",
    "PartShare",
    "SlackEvent",
    "Stiffness",
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
