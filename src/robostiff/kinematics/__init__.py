"""Where everything is at a pose: frames, Jacobians and closure."""

from robostiff.kinematics.frames import PlacedChain, place_chain
from robostiff.kinematics.jacobians import (
    freedom_twist,
    freedom_twists,
    leg_compliance,
    passive_jacobian,
    spring_compliance,
    spring_jacobian,
)
from robostiff.kinematics.pose import JointCoordinates, Pose
from robostiff.kinematics.posture import Posture, PostureFinder, find_posture

__all__ = [
    "JointCoordinates",
    "PlacedChain",
    "Pose",
    "Posture",
    "PostureFinder",
    "find_posture",
    "freedom_twist",
    "freedom_twists",
    "leg_compliance",
    "passive_jacobian",
    "place_chain",
    "spring_compliance",
    "spring_jacobian",
]
