"""Stiffness indices, each with its unit and, where it needs one, its characteristic length.

All take the result of `stiffness` at a single pose, and return a small object with values,
directions and a status. Free motions show as zeros or as None, never as a number without meaning.
"""

from robostiff.analysis.indices.centres import Centre, centre_of_compliance, centre_of_stiffness
from robostiff.analysis.indices.directional import (
    DirectionalStiffness,
    WorstDeflections,
    directional_stiffness,
    stiffness_about_axis,
    worst_deflection,
)
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
    PrincipalStiffnesses,
    anisotropy,
    collinear_stiffness,
    principal_stiffness,
)
from robostiff.analysis.indices.screws import (
    CompliantAxis,
    Eigenscrews,
    Eigentwist,
    Eigenwrench,
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
