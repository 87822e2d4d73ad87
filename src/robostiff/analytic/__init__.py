"""Stiffness matrices as formulas, in exact arithmetic.

The recursion (15) on polynomials, fraction-free; sines, cosines and square roots with their
defining relations; results in closed form or as named steps. Matrices of SymPy expressions come in
and go out.
"""

from robostiff.analytic.chain import Closed, Steps, derive_chain
from robostiff.analytic.closed import FormulaTooLargeError, canonical
from robostiff.analytic.derivation import Definition, Derivation, Stage
from robostiff.analytic.field import ExactField
from robostiff.analytic.parallel import (
    moved_formula,
    rotated_formula,
    skew_formula,
    sum_of_legs,
)
from robostiff.analytic.questions import (
    RankFormula,
    decoupling_conditions,
    free_motion_formulas,
    rank_formula,
)
from robostiff.analytic.snapshot_formula import SnapshotFormula, snapshot_formula

__all__ = [
    "Closed",
    "Definition",
    "Derivation",
    "ExactField",
    "FormulaTooLargeError",
    "RankFormula",
    "SnapshotFormula",
    "Stage",
    "Steps",
    "canonical",
    "decoupling_conditions",
    "derive_chain",
    "free_motion_formulas",
    "moved_formula",
    "rank_formula",
    "rotated_formula",
    "skew_formula",
    "snapshot_formula",
    "sum_of_legs",
]
