"""Closure: leg coordinates for a platform pose.

Closed forms for the usual legs (``strut``: UPS, SPS, UPU, UCU, planar RPR; ``rod``: PUU, PUS, RUU,
RUS, planar RRR and PRR; ``sliding_rod``: PRRR and CRR with parallel axes), recognised from geometry
alone; damped Newton from the home configuration for the rest.
"""

from robostiff.kinematics.closure.leg_solver import LegSolver, leg_solver
from robostiff.kinematics.closure.newton import (
    NewtonTask,
    advance,
    attachment_frame,
    closing_rates,
    gaps,
)

__all__ = [
    "LegSolver",
    "NewtonTask",
    "advance",
    "attachment_frame",
    "closing_rates",
    "gaps",
    "leg_solver",
]
