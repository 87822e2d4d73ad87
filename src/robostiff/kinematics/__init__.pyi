from robostiff.kinematics.formula import FormulaPose, PlacedFormula, place_leg, place_leg_at_joints
from robostiff.kinematics.frames import PlacedChain, place_chain
from robostiff.kinematics.hybrid_machine import Module, hybrid_machine
from robostiff.kinematics.jacobians import (
    freedom_twists,
    leg_compliance,
    passive_jacobian,
    spring_compliance,
    spring_loads,
)
from robostiff.kinematics.machine_pose import ActuatorCoordinates, ToolPose, actuator_names
from robostiff.kinematics.masses_and_springs import with_body_springs, with_masses
from robostiff.kinematics.pose import JointCoordinates, Near, Pose
from robostiff.kinematics.posture import Posture
from robostiff.kinematics.posture_finder import (
    LegPosture,
    PostureFinder,
    find_posture,
    posture_finder,
    postures,
)
from robostiff.kinematics.spanning_tree import branches

__all__ = [
    "ActuatorCoordinates",
    "FormulaPose",
    "JointCoordinates",
    "LegPosture",
    "Module",
    "Near",
    "PlacedChain",
    "PlacedFormula",
    "Pose",
    "Posture",
    "PostureFinder",
    "ToolPose",
    "actuator_names",
    "branches",
    "find_posture",
    "freedom_twists",
    "hybrid_machine",
    "leg_compliance",
    "passive_jacobian",
    "place_chain",
    "place_leg",
    "place_leg_at_joints",
    "posture_finder",
    "postures",
    "spring_compliance",
    "spring_loads",
    "with_body_springs",
    "with_masses",
]
