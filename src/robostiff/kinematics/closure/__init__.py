"""Closure: leg coordinates for a platform pose.

Closed forms for the usual legs (`Strut`: UPS, SPS, UPU, UCU, planar RPR; `Rod`: PUU, PUS, RUU, RUS,
planar RRR and PRR, PRRR and CRR with parallel axes; `Post`: one joint S, U or R), recognised from
geometry alone, for poses in numbers and for records, and for three turns with a wrist in numbers;
Newton's method from the home configuration, in its assembly mode, for the rest.
"""

from robostiff.kinematics.closure.assembly_mode import AssemblyMode as AssemblyMode
from robostiff.kinematics.closure.assembly_mode import follow as follow
from robostiff.kinematics.closure.assembly_mode import nearest as nearest
from robostiff.kinematics.closure.leg_forms import Post as Post
from robostiff.kinematics.closure.leg_solver import LegSolver as LegSolver
from robostiff.kinematics.closure.legs_alike import leg_solvers as leg_solvers
from robostiff.kinematics.closure.legs_alike import legs_alike as legs_alike
from robostiff.kinematics.closure.legs_alike import reach as reach
from robostiff.kinematics.closure.loops import ClosurePart as ClosurePart
from robostiff.kinematics.closure.loops import Loops as Loops
from robostiff.kinematics.closure.loops import loops_of_legs as loops_of_legs
from robostiff.kinematics.closure.rods import Rod as Rod
from robostiff.kinematics.closure.rods import Strut as Strut
