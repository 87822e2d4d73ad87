"""Cables that only pull: tensions, their limits, and stiffness with its geometric part."""

from robostiff.cables.recorded_cables import record_cables as record_cables
from robostiff.cables.stiffness_matrix import PlacedCables as PlacedCables
from robostiff.cables.stiffness_matrix import axial_stiffness as axial_stiffness
from robostiff.cables.stiffness_matrix import elastic_stiffness as elastic_stiffness
from robostiff.cables.stiffness_matrix import force_stiffness as force_stiffness
from robostiff.cables.stiffness_matrix import geometric_stiffness as geometric_stiffness
from robostiff.cables.stiffness_matrix import place_cables as place_cables
from robostiff.cables.stiffness_matrix import structure_matrix as structure_matrix
from robostiff.cables.stiffness_matrix import weight_stiffness as weight_stiffness
from robostiff.cables.stiffness_matrix import weight_wrench as weight_wrench
from robostiff.cables.stiffness_matrix import wrench_derivative as wrench_derivative
from robostiff.cables.tension_rules import ClosedFormTensions as ClosedFormTensions
from robostiff.cables.tension_rules import GivenTensions as GivenTensions
from robostiff.cables.tension_rules import NearestTensions as NearestTensions
from robostiff.cables.tension_rules import TensionProblem as TensionProblem
from robostiff.cables.tension_rules import TensionRule as TensionRule
from robostiff.cables.tension_rules import nearest_tensions as nearest_tensions
