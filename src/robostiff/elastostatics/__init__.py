"""The stiffness matrix K_C of a chain with passive joints, and of chains in parallel.

Functions of matrices, independent of robots, so that the forms can be read beside the
paper and used with anybody's Jacobians. ``forms`` has the wrench basis form, which is the default,
and eq. (7), (9), (10), (15), (18)-(20). Legs are summed by ``aggregation``, eq. (12). Ranks are
decided in ``tolerance`` alone.
"""

from robostiff.elastostatics.chain import chain_stiffness, solve_chain
from robostiff.elastostatics.chain_problem import Form
from robostiff.elastostatics.conjugate_wrenches import ConjugateWrenches, LeastEnergy, least_energy
from robostiff.elastostatics.forms import (
    Block,
    IndexRules,
    Recursive,
    SaddlePoint,
    WrenchBasis,
    eliminate_block,
    eliminate_index,
    eliminate_joint,
    eliminate_quasi_trivial,
    saddle_point_matrix,
    saddle_point_stiffness,
    wrench_basis_stiffness,
)
from robostiff.elastostatics.leg import (
    LegWrenches,
    aggregate,
    aggregate_matrices,
    leg_wrenches,
    solved_leg,
    transmitted_wrenches,
)
from robostiff.elastostatics.parallel_block import BlockCompliance, Details, block_compliance
from robostiff.elastostatics.result import CartesianStiffness, StiffnessOfPoses
from robostiff.elastostatics.status import Status
from robostiff.elastostatics.tolerance import (
    DEFAULT_TOLERANCE,
    RankDecision,
    Tolerance,
    matrix_length,
    scaling,
)

__all__ = [
    "DEFAULT_TOLERANCE",
    "Block",
    "BlockCompliance",
    "CartesianStiffness",
    "ConjugateWrenches",
    "Details",
    "Form",
    "IndexRules",
    "LeastEnergy",
    "LegWrenches",
    "RankDecision",
    "Recursive",
    "SaddlePoint",
    "Status",
    "StiffnessOfPoses",
    "Tolerance",
    "WrenchBasis",
    "aggregate",
    "aggregate_matrices",
    "block_compliance",
    "chain_stiffness",
    "eliminate_block",
    "eliminate_index",
    "eliminate_joint",
    "eliminate_quasi_trivial",
    "least_energy",
    "leg_wrenches",
    "matrix_length",
    "saddle_point_matrix",
    "saddle_point_stiffness",
    "scaling",
    "solve_chain",
    "solved_leg",
    "transmitted_wrenches",
    "wrench_basis_stiffness",
]
