"""Materials, cross-sections, beams and springs.

Wrenches are (Fx, Fy, Fz, Mx, My, Mz), twists (dx, dy, dz, rx, ry, rz), units SI. A beam is clamped
at its base, its local x along it, y and z the principal axes of its cross-section.
"""

from robostiff.elasticity.beam import (
    BeamSegment,
    BeamTheory,
    EulerBernoulli,
    SlenderBeam,
    Timoshenko,
    UniformBeam,
    beam_compliance,
    beam_stiffness,
    cantilever_compliance,
    cantilever_stiffness,
    tapered_compliance,
    uniform_beam,
)
from robostiff.elasticity.material import MATERIALS, Material, material
from robostiff.elasticity.shapes import (
    CrossSection,
    box,
    circle,
    i_section,
    rectangle,
    section_from_sectionproperties,
    tube,
)
from robostiff.elasticity.spring import Elasticity, rotational_spring, translational_spring
from robostiff.elasticity.spring_from_matrix import (
    elasticity_from_compliance,
    elasticity_from_stiffness,
    moved,
)

__all__ = [
    "MATERIALS",
    "BeamSegment",
    "BeamTheory",
    "CrossSection",
    "Elasticity",
    "EulerBernoulli",
    "Material",
    "SlenderBeam",
    "Timoshenko",
    "UniformBeam",
    "beam_compliance",
    "beam_stiffness",
    "box",
    "cantilever_compliance",
    "cantilever_stiffness",
    "circle",
    "elasticity_from_compliance",
    "elasticity_from_stiffness",
    "i_section",
    "material",
    "moved",
    "rectangle",
    "rotational_spring",
    "section_from_sectionproperties",
    "tapered_compliance",
    "translational_spring",
    "tube",
    "uniform_beam",
]
