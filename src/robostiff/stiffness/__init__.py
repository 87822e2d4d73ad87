"""The stiffness matrix K_C of a chain with passive joints, and of chains in parallel.

Matrices in, matrices out: nothing here knows what a robot is, so the forms can be read beside the
paper and used with anybody's Jacobians. One file a form: eq. (7) ``saddle_point``, (9) ``block``,
(10) and (15) ``recursive``, (18)-(20) ``index_rules``, and ``wrench_basis``, the default. Legs are
summed by ``aggregation``, eq. (12). Ranks are decided in ``tolerance`` alone.
"""

from robostiff.stiffness.aggregation import aggregate, aggregate_matrices
from robostiff.stiffness.block import Block, eliminate_block
from robostiff.stiffness.chain import chain_stiffness
from robostiff.stiffness.chain_problem import Form
from robostiff.stiffness.index_rules import IndexRules, eliminate_index, eliminate_quasi_trivial
from robostiff.stiffness.recursive import Recursive, eliminate_joint
from robostiff.stiffness.result import CartesianStiffness
from robostiff.stiffness.saddle_point import (
    SaddlePoint,
    saddle_point_matrix,
    saddle_point_stiffness,
)
from robostiff.stiffness.status import Status
from robostiff.stiffness.tolerance import RankDecision, Tolerance
from robostiff.stiffness.transmitted_wrenches import transmitted_wrenches
from robostiff.stiffness.wrench_basis import WrenchBasis, wrench_basis_stiffness

__all__ = [
    "Block",
    "CartesianStiffness",
    "Form",
    "IndexRules",
    "RankDecision",
    "Recursive",
    "SaddlePoint",
    "Status",
    "Tolerance",
    "WrenchBasis",
    "aggregate",
    "aggregate_matrices",
    "chain_stiffness",
    "eliminate_block",
    "eliminate_index",
    "eliminate_joint",
    "eliminate_quasi_trivial",
    "saddle_point_matrix",
    "saddle_point_stiffness",
    "transmitted_wrenches",
    "wrench_basis_stiffness",
]
