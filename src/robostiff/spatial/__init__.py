"""Twists, wrenches and stiffness between points and frames, eq. (11)-(14) and (17).

A twist is ``(dx, dy, dz, rx, ry, rz)``: translation of the reference point, then rotation. A wrench
is ``(Fx, Fy, Fz, Mx, My, Mz)``: force, then moment about the reference point. World-aligned axes
unless a name says otherwise; SI units.
"""

from robostiff.spatial.compliance_modes import compliance_modes as compliance_modes
from robostiff.spatial.formula import exact_number as exact_number
from robostiff.spatial.formula import is_formula as is_formula
from robostiff.spatial.quantities import as_float as as_float
from robostiff.spatial.quantities import as_floats as as_floats
from robostiff.spatial.quantities import check_order as check_order
from robostiff.spatial.quantities import check_whole as check_whole
from robostiff.spatial.quantities import holds_quantities as holds_quantities
from robostiff.spatial.quantities import in_si as in_si
from robostiff.spatial.quantities import refuse_quantities as refuse_quantities
from robostiff.spatial.rotation import Frame as Frame
from robostiff.spatial.screw import CoupledScrew as CoupledScrew
from robostiff.spatial.screw import Screw as Screw
from robostiff.spatial.screw import cross as cross
from robostiff.spatial.screw import full_turn as full_turn
from robostiff.spatial.screw import screw_of_twist as screw_of_twist
from robostiff.spatial.space import Space as Space
from robostiff.spatial.transport import block_rotation as block_rotation
from robostiff.spatial.transport import level_axes as level_axes
from robostiff.spatial.transport import move_compliance as move_compliance
from robostiff.spatial.transport import move_stiffness as move_stiffness
from robostiff.spatial.transport import move_twist as move_twist
from robostiff.spatial.transport import move_wrench as move_wrench
from robostiff.spatial.transport import rotate_stiffness as rotate_stiffness
from robostiff.spatial.transport import skew as skew
from robostiff.spatial.transport import twist_transport as twist_transport
