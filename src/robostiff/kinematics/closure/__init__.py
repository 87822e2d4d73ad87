"""Closure: leg coordinates for a platform pose.

Closed forms for the usual legs (``strut``: UPS, SPS, UPU, UCU, planar RPR; ``rod``: PUU, PUS, RUU,
RUS, planar RRR and PRR, PRRR and CRR with parallel axes; ``post``: one joint S, U or R), recognised
from geometry alone, for poses in numbers and for records; Newton's method from the home
configuration, in its assembly mode, for the rest.
"""

from robostiff.kinematics.closure.assembly_mode import AssemblyMode, nearest
from robostiff.kinematics.closure.leg_equations import (
    Followed,
    NewtonTask,
    attachment_frame,
    gaps,
)
from robostiff.kinematics.closure.leg_solver import LegSolver
from robostiff.kinematics.closure.legs_alike import (
    LegsAlike,
    leg_solvers,
    legs_alike,
)
from robostiff.kinematics.closure.loop_equations import ClosurePart, LoopEquations

__all__ = [
    "AssemblyMode",
    "ClosurePart",
    "Followed",
    "LegSolver",
    "LegsAlike",
    "LoopEquations",
    "NewtonTask",
    "attachment_frame",
    "gaps",
    "leg_solvers",
    "legs_alike",
    "nearest",
]
