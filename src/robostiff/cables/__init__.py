"""Cables that only pull: tensions, their limits, and stiffness with its geometric part."""

from robostiff.cables.stiffness_matrix import (
    PlacedCables,
    axial_stiffness,
    elastic_stiffness,
    force_stiffness,
    geometric_stiffness,
    place_cables,
    structure_matrix,
    weight_stiffness,
    weight_wrench,
    wrench_derivative,
)
from robostiff.cables.tension_rules import (
    ClosedFormTensions,
    GivenTensions,
    NearestTensions,
    TensionProblem,
    TensionRule,
    nearest_tensions,
)

__all__ = [
    "ClosedFormTensions",
    "GivenTensions",
    "NearestTensions",
    "PlacedCables",
    "TensionProblem",
    "TensionRule",
    "axial_stiffness",
    "elastic_stiffness",
    "force_stiffness",
    "geometric_stiffness",
    "nearest_tensions",
    "place_cables",
    "structure_matrix",
    "weight_stiffness",
    "weight_wrench",
    "wrench_derivative",
]
