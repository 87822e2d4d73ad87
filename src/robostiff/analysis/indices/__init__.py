"""Stiffness indices, each with its unit and, where it needs one, its characteristic length.

All take the result of `stiffness` at a single pose, and return a small object with values,
directions and a status; `indices` computes them all, of a batch as well. Free motions show as zeros
or as None, never as a number without meaning. A batch raises an `InputError`, and a pose without a
matrix a `NoAnswerError`.
"""

from robostiff.analysis.indices.metric import ConditionNumber as ConditionNumber
from robostiff.analysis.indices.metric import Eigenstiffness as Eigenstiffness
from robostiff.analysis.indices.metric import VirtualWork as VirtualWork
from robostiff.analysis.indices.metric import condition_number as condition_number
from robostiff.analysis.indices.metric import eigenstiffness as eigenstiffness
from robostiff.analysis.indices.metric import virtual_work as virtual_work
from robostiff.analysis.indices.overview import IndicesOfPoses as IndicesOfPoses
from robostiff.analysis.indices.overview import StiffnessIndices as StiffnessIndices
from robostiff.analysis.indices.overview import indices as indices
from robostiff.analysis.indices.principal import Anisotropy as Anisotropy
from robostiff.analysis.indices.principal import CollinearStiffness as CollinearStiffness
from robostiff.analysis.indices.principal import DirectionalStiffness as DirectionalStiffness
from robostiff.analysis.indices.principal import PrincipalStiffnesses as PrincipalStiffnesses
from robostiff.analysis.indices.principal import WorstDeflections as WorstDeflections
from robostiff.analysis.indices.principal import anisotropy as anisotropy
from robostiff.analysis.indices.principal import collinear_stiffness as collinear_stiffness
from robostiff.analysis.indices.principal import directional_stiffness as directional_stiffness
from robostiff.analysis.indices.principal import principal_stiffness as principal_stiffness
from robostiff.analysis.indices.principal import stiffness_about_axis as stiffness_about_axis
from robostiff.analysis.indices.principal import worst_deflection as worst_deflection
from robostiff.analysis.indices.screws import Centre as Centre
from robostiff.analysis.indices.screws import CompliantAxis as CompliantAxis
from robostiff.analysis.indices.screws import Eigenscrews as Eigenscrews
from robostiff.analysis.indices.screws import Eigentwist as Eigentwist
from robostiff.analysis.indices.screws import Eigenwrench as Eigenwrench
from robostiff.analysis.indices.screws import centre_of_compliance as centre_of_compliance
from robostiff.analysis.indices.screws import centre_of_stiffness as centre_of_stiffness
from robostiff.analysis.indices.screws import eigenscrews as eigenscrews
