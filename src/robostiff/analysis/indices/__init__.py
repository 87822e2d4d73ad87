"""Stiffness indices, each with its unit and, where it needs one, its characteristic length.

All take the result of `stiffness` at a single pose, and return a small object with values,
directions and a status; `indices` computes them all, of a batch as well. Free motions show as zeros
or as None, never as a number without meaning. A batch raises an `InputError`, and a pose without a
matrix a `NoAnswerError`.
"""

from robostiff.analysis.indices.metric import (
    ConditionNumber,
    Eigenstiffness,
    VirtualWork,
    condition_number,
    eigenstiffness,
    virtual_work,
)
from robostiff.analysis.indices.overview import IndicesOfPoses, StiffnessIndices, indices
from robostiff.analysis.indices.principal import (
    Anisotropy,
    CollinearStiffness,
    DirectionalStiffness,
    PrincipalStiffnesses,
    WorstDeflections,
    anisotropy,
    collinear_stiffness,
    directional_stiffness,
    principal_stiffness,
    stiffness_about_axis,
    worst_deflection,
)
from robostiff.analysis.indices.screws import (
    Centre,
    CompliantAxis,
    Eigenscrews,
    Eigentwist,
    Eigenwrench,
    centre_of_compliance,
    centre_of_stiffness,
    eigenscrews,
)

__all__ = [
    "Anisotropy",
    "Centre",
    "CollinearStiffness",
    "CompliantAxis",
    "ConditionNumber",
    "DirectionalStiffness",
    "Eigenscrews",
    "Eigenstiffness",
    "Eigentwist",
    "Eigenwrench",
    "IndicesOfPoses",
    "PrincipalStiffnesses",
    "StiffnessIndices",
    "VirtualWork",
    "WorstDeflections",
    "anisotropy",
    "centre_of_compliance",
    "centre_of_stiffness",
    "collinear_stiffness",
    "condition_number",
    "directional_stiffness",
    "eigenscrews",
    "eigenstiffness",
    "indices",
    "principal_stiffness",
    "stiffness_about_axis",
    "virtual_work",
    "worst_deflection",
]
