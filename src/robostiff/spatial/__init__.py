"""Twists, wrenches and stiffness between points and frames, eq. (11)-(14) and (17).

A twist is ``(dx, dy, dz, rx, ry, rz)``: translation of the reference point, then rotation. A wrench
is ``(Fx, Fy, Fz, Mx, My, Mz)``: force, then moment about the reference point. World-aligned axes
unless a name says otherwise; SI units.
"""

from robostiff.spatial.compliance_modes import compliance_modes
from robostiff.spatial.formula import exact_number, is_formula
from robostiff.spatial.quantities import (
    as_float,
    as_floats,
    holds_quantities,
    in_si,
    refuse_quantities,
)
from robostiff.spatial.rotation import Frame
from robostiff.spatial.screw import CoupledScrew, Screw, cross, full_turn, screw_of_twist
from robostiff.spatial.space import Space
from robostiff.spatial.transport import (
    block_rotation,
    move_compliance,
    move_stiffness,
    move_twist,
    move_wrench,
    rotate_stiffness,
    skew,
    twist_transport,
)

__all__ = [
    "CoupledScrew",
    "Frame",
    "Screw",
    "Space",
    "as_float",
    "as_floats",
    "block_rotation",
    "compliance_modes",
    "cross",
    "exact_number",
    "full_turn",
    "holds_quantities",
    "in_si",
    "is_formula",
    "move_compliance",
    "move_stiffness",
    "move_twist",
    "move_wrench",
    "refuse_quantities",
    "rotate_stiffness",
    "screw_of_twist",
    "skew",
    "twist_transport",
]
