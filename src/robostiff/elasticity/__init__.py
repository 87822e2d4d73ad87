"""Materials, cross-sections, beams and springs.

Wrenches are (Fx, Fy, Fz, Mx, My, Mz), twists (dx, dy, dz, rx, ry, rz), units SI. A beam is clamped
at its base, its local x along it, y and z the principal axes of its cross-section.
"""

from robostiff.elasticity.beam import BeamSegment as BeamSegment
from robostiff.elasticity.beam import BeamTheory as BeamTheory
from robostiff.elasticity.beam import EulerBernoulli as EulerBernoulli
from robostiff.elasticity.beam import SlenderBeam as SlenderBeam
from robostiff.elasticity.beam import Timoshenko as Timoshenko
from robostiff.elasticity.beam import UniformBeam as UniformBeam
from robostiff.elasticity.beam import beam_compliance as beam_compliance
from robostiff.elasticity.beam import beam_stiffness as beam_stiffness
from robostiff.elasticity.beam import cantilever_compliance as cantilever_compliance
from robostiff.elasticity.beam import cantilever_stiffness as cantilever_stiffness
from robostiff.elasticity.beam import shear_compliance as shear_compliance
from robostiff.elasticity.beam import tapered_compliance as tapered_compliance
from robostiff.elasticity.beam import uniform_beam as uniform_beam
from robostiff.elasticity.material import MATERIALS as MATERIALS
from robostiff.elasticity.material import Material as Material
from robostiff.elasticity.material import material as material
from robostiff.elasticity.shapes import CrossSection as CrossSection
from robostiff.elasticity.shapes import box as box
from robostiff.elasticity.shapes import circle as circle
from robostiff.elasticity.shapes import i_section as i_section
from robostiff.elasticity.shapes import rectangle as rectangle
from robostiff.elasticity.shapes import (
    section_from_sectionproperties as section_from_sectionproperties,
)
from robostiff.elasticity.shapes import tube as tube
from robostiff.elasticity.spring import Elasticity as Elasticity
from robostiff.elasticity.spring import rotational_spring as rotational_spring
from robostiff.elasticity.spring import translational_spring as translational_spring
from robostiff.elasticity.spring_from_matrix import (
    elasticity_from_compliance as elasticity_from_compliance,
)
from robostiff.elasticity.spring_from_matrix import (
    elasticity_from_stiffness as elasticity_from_stiffness,
)
from robostiff.elasticity.spring_from_matrix import in_element_axes as in_element_axes
from robostiff.elasticity.spring_from_matrix import with_segments as with_segments
