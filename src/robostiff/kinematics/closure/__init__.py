"""Closure: leg coordinates for a platform pose.

Closed forms for the usual legs (``strut``: UPS, SPS, UPU, UCU, planar RPR; ``rod``: PUU, PUS, RUU,
RUS, planar RRR and PRR, PRRR and CRR with parallel axes; ``post``: one joint S, U or R), recognised
from geometry alone, for poses in numbers and for records; Newton's method from the home
configuration, in its assembly mode, for the rest.
"""

from robostiff.kinematics.closure.assembly_mode import AssemblyMode, follow, nearest
from robostiff.kinematics.closure.leg_forms import Post
from robostiff.kinematics.closure.leg_solver import LegSolver
from robostiff.kinematics.closure.legs_alike import leg_solvers, legs_alike
from robostiff.kinematics.closure.loops import (
    ClosurePart,
    Loops,
    attachment_frame,
    body_of_tool,
    loops_of_legs,
)
from robostiff.kinematics.closure.rods import Rod, Strut

__all__ = [
    "AssemblyMode",
    "ClosurePart",
    "LegSolver",
    "Loops",
    "Post",
    "Rod",
    "Strut",
    "attachment_frame",
    "body_of_tool",
    "follow",
    "leg_solvers",
    "legs_alike",
    "loops_of_legs",
    "nearest",
]
