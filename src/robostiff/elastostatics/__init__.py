"""The stiffness matrix K_C of a chain with passive joints, and of chains in parallel.

Functions of matrices, independent of robots, so that the forms can be read beside the
paper and used with anybody's Jacobians. ``forms`` has the wrench basis form, which is the default,
and eq. (7), (9), (10), (15), (18)-(20). Legs are summed by ``aggregation``, eq. (12). Ranks are
decided in ``tolerance`` alone.
"""

from robostiff.elastostatics.chain import chain_stiffness as chain_stiffness
from robostiff.elastostatics.chain import solve_chain as solve_chain
from robostiff.elastostatics.chain_problem import Form as Form
from robostiff.elastostatics.conjugate_wrenches import ConjugateWrenches as ConjugateWrenches
from robostiff.elastostatics.conjugate_wrenches import LeastEnergy as LeastEnergy
from robostiff.elastostatics.conjugate_wrenches import least_energy as least_energy
from robostiff.elastostatics.forms import Block as Block
from robostiff.elastostatics.forms import IndexRules as IndexRules
from robostiff.elastostatics.forms import Recursive as Recursive
from robostiff.elastostatics.forms import SaddlePoint as SaddlePoint
from robostiff.elastostatics.forms import WrenchBasis as WrenchBasis
from robostiff.elastostatics.forms import eliminate_block as eliminate_block
from robostiff.elastostatics.forms import eliminate_index as eliminate_index
from robostiff.elastostatics.forms import eliminate_joint as eliminate_joint
from robostiff.elastostatics.forms import eliminate_quasi_trivial as eliminate_quasi_trivial
from robostiff.elastostatics.forms import saddle_point_matrix as saddle_point_matrix
from robostiff.elastostatics.forms import saddle_point_stiffness as saddle_point_stiffness
from robostiff.elastostatics.forms import wrench_basis_stiffness as wrench_basis_stiffness
from robostiff.elastostatics.leg import LegWrenches as LegWrenches
from robostiff.elastostatics.leg import aggregate as aggregate
from robostiff.elastostatics.leg import aggregate_matrices as aggregate_matrices
from robostiff.elastostatics.leg import leg_wrenches as leg_wrenches
from robostiff.elastostatics.leg import solved_leg as solved_leg
from robostiff.elastostatics.leg import transmitted_wrenches as transmitted_wrenches
from robostiff.elastostatics.parallel_block import BlockCompliance as BlockCompliance
from robostiff.elastostatics.parallel_block import Details as Details
from robostiff.elastostatics.parallel_block import block_compliance as block_compliance
from robostiff.elastostatics.result import CartesianStiffness as CartesianStiffness
from robostiff.elastostatics.result import StiffnessOfPoses as StiffnessOfPoses
from robostiff.elastostatics.status import Status as Status
from robostiff.elastostatics.tolerance import DEFAULT_TOLERANCE as DEFAULT_TOLERANCE
from robostiff.elastostatics.tolerance import RankDecision as RankDecision
from robostiff.elastostatics.tolerance import Tolerance as Tolerance
from robostiff.elastostatics.tolerance import matrix_distance as matrix_distance
from robostiff.elastostatics.tolerance import matrix_length as matrix_length
from robostiff.elastostatics.tolerance import scaling as scaling
