"""Stiffness matrices as formulas, in exact arithmetic.

The recursion (15) on polynomials, fraction-free; sines, cosines and square roots with their
defining relations; results in closed form or as named steps. Matrices of SymPy expressions come in
and go out.
"""

from functools import partialmethod

from robostiff.analytic.budget import FormulaTooLargeError as FormulaTooLargeError
from robostiff.analytic.cable_formula import CableFormula as CableFormula
from robostiff.analytic.cable_formula import derive_cables as derive_cables
from robostiff.analytic.calculus import ComplianceSteps as ComplianceSteps
from robostiff.analytic.calculus import FormulaDerivative as FormulaDerivative
from robostiff.analytic.calculus import compliance_formula as compliance_formula
from robostiff.analytic.calculus import compliance_steps as compliance_steps
from robostiff.analytic.calculus import derivative_formula as derivative_formula
from robostiff.analytic.calculus import differentiate as differentiate
from robostiff.analytic.chain import Closed as Closed
from robostiff.analytic.chain import Steps as Steps
from robostiff.analytic.chain import derive_chain as derive_chain
from robostiff.analytic.derivation import Derivation as Derivation
from robostiff.analytic.derivation import Formula
from robostiff.analytic.derivation import LegDerivation as LegDerivation
from robostiff.analytic.derivation import RobotDerivation as RobotDerivation
from robostiff.analytic.derivation import SnapshotFormula as SnapshotFormula
from robostiff.analytic.derivation import Stage as Stage
from robostiff.analytic.exact.closed import canonical as canonical
from robostiff.analytic.exact.closed import sum_of_legs as sum_of_legs
from robostiff.analytic.exact.definition import Condition as Condition
from robostiff.analytic.exact.definition import Definition as Definition
from robostiff.analytic.exact.field import ExactField as ExactField
from robostiff.analytic.export.documents import derivation_html, latex_snippet
from robostiff.analytic.formula_function import FormulaFunction as FormulaFunction
from robostiff.analytic.formula_function import formula_function
from robostiff.analytic.legs import LegElimination as LegElimination
from robostiff.analytic.legs import derive_leg as derive_leg
from robostiff.analytic.placement.robot_pose import AtCoordinates as AtCoordinates
from robostiff.analytic.placement.robot_pose import AtHome as AtHome
from robostiff.analytic.placement.robot_pose import AtJoints as AtJoints
from robostiff.analytic.placement.robot_pose import AtSymbols as AtSymbols
from robostiff.analytic.placement.robot_pose import EulerAngles as EulerAngles
from robostiff.analytic.placement.robot_pose import UnitQuaternion as UnitQuaternion
from robostiff.analytic.placement.robot_pose import roll_pitch_yaw as roll_pitch_yaw
from robostiff.analytic.rank import RankFormula as RankFormula
from robostiff.analytic.rank import decoupling_conditions as decoupling_conditions
from robostiff.analytic.rank import fixed_point_formula as fixed_point_formula
from robostiff.analytic.rank import free_motion_formulas as free_motion_formulas
from robostiff.analytic.rank import rank_formula as rank_formula
from robostiff.analytic.reading.combinations import NamedCombinations as NamedCombinations
from robostiff.analytic.reading.combinations import name_combinations as name_combinations
from robostiff.analytic.robot_formula import derive_robot as derive_robot
from robostiff.analytic.robot_formula import snapshot_formula as snapshot_formula

# Methods of formulas that write them, or make functions of them: of modules above theirs.
Formula.lambdify, Formula.latex = formula_function, latex_snippet
Formula._repr_html_ = partialmethod(derivation_html, first_heading=3)  # below those of a notebook
