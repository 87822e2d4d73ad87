"""Arithmetic over named parameters with units: ``R*cos(phi) + 10 mm``.

An expression is split, parsed and evaluated by the few modules of this folder. Python's own parser
and evaluator are not involved, so a model file can only compute numbers.
"""

from robostiff.io.expression.expression import Expression as Expression
from robostiff.io.expression.expression import parse as parse
from robostiff.io.expression.functions import FLOATS as FLOATS
from robostiff.io.expression.functions import Mathematics as Mathematics
from robostiff.io.expression.functions import exact_mathematics as exact_mathematics
from robostiff.io.expression.parameters import ParameterError as ParameterError
from robostiff.io.expression.parameters import parameter_values as parameter_values
