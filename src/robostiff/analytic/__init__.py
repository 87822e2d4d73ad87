"""Stiffness matrices as formulas, in exact arithmetic.

The recursion (15) on polynomials, fraction-free; sines, cosines and square roots with their
defining relations; results in closed form or as named steps. Matrices of SymPy expressions come in
and go out.
"""

from functools import partialmethod

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.calculus import (
    ComplianceSteps,
    FormulaDerivative,
    compliance_formula,
    compliance_steps,
    derivative_formula,
    differentiate,
)
from robostiff.analytic.chain import Closed, Steps, derive_chain
from robostiff.analytic.derivation import (
    Derivation,
    Formula,
    LegDerivation,
    RobotDerivation,
    SnapshotFormula,
    Stage,
)
from robostiff.analytic.exact.closed import canonical, sum_of_legs
from robostiff.analytic.exact.definition import Condition, Definition
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.export.documents import derivation_html, latex_snippet
from robostiff.analytic.formula_function import FormulaFunction, formula_function
from robostiff.analytic.legs import LegElimination, derive_leg
from robostiff.analytic.placement.robot_pose import (
    AtCoordinates,
    AtHome,
    AtJoints,
    AtSymbols,
    EulerAngles,
    UnitQuaternion,
    roll_pitch_yaw,
)
from robostiff.analytic.questions.rank import (
    RankFormula,
    decoupling_conditions,
    fixed_point_formula,
    free_motion_formulas,
    rank_formula,
)
from robostiff.analytic.reading.combinations import NamedCombinations, name_combinations
from robostiff.analytic.robot_formula import derive_robot, snapshot_formula

# Methods of formulas that write them, or make functions of them: of modules above theirs.
Formula.lambdify, Formula.latex = formula_function, latex_snippet
Formula._repr_html_ = partialmethod(derivation_html, first_heading=3)  # below those of a notebook

__all__ = [
    "AtCoordinates",
    "AtHome",
    "AtJoints",
    "AtSymbols",
    "Closed",
    "ComplianceSteps",
    "Condition",
    "Definition",
    "Derivation",
    "EulerAngles",
    "ExactField",
    "FormulaDerivative",
    "FormulaFunction",
    "FormulaTooLargeError",
    "LegDerivation",
    "LegElimination",
    "NamedCombinations",
    "RankFormula",
    "RobotDerivation",
    "SnapshotFormula",
    "Stage",
    "Steps",
    "UnitQuaternion",
    "canonical",
    "compliance_formula",
    "compliance_steps",
    "decoupling_conditions",
    "derivative_formula",
    "derive_chain",
    "derive_leg",
    "derive_robot",
    "differentiate",
    "fixed_point_formula",
    "free_motion_formulas",
    "name_combinations",
    "rank_formula",
    "roll_pitch_yaw",
    "snapshot_formula",
    "sum_of_legs",
]
