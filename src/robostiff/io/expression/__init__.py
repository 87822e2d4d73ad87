"""Arithmetic over named parameters with units: ``R*cos(phi) + 10 mm``.

An expression is split, parsed and evaluated by the few modules of this folder. Python's own parser
and evaluator are not involved, so a model file can only compute numbers.
"""

from robostiff.io.expression.expression import Expression, parse
from robostiff.io.expression.functions import FLOATS, Mathematics, exact_mathematics
from robostiff.io.expression.parameters import ParameterError, parameter_values

__all__ = [
    "FLOATS",
    "Expression",
    "Mathematics",
    "ParameterError",
    "exact_mathematics",
    "parameter_values",
    "parse",
]
