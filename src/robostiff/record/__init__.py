"""Records: formulas recorded operation by operation, to be evaluated elsewhere.

The formulas of the library work on arrays of any entries. Filled with `Entry` they leave a
`Record`: a list of operations without branches, each written once. It can be evaluated on arrays of
poses, compiled, differentiated, or read as named steps.
"""

from robostiff.record.exact import shortened
from robostiff.record.functions import (
    ENTRY_FUNCTIONS,
    angle_of,
    arc_cosine,
    arc_tangent,
    cosine,
    derivatives_along,
    gradient,
    greater,
    hyperbolic_tangent,
    least,
    least_size,
    most_size,
    plain_root,
    reciprocal,
    sine,
    square_root,
    usual_size,
    with_turn,
)
from robostiff.record.program import Program, Step
from robostiff.record.record import (
    NUMPY_FUNCTIONS,
    OPERATORS,
    Entry,
    Number,
    Operation,
    Record,
    is_number,
    is_one,
    is_zero,
)

__all__ = [
    "ENTRY_FUNCTIONS",
    "NUMPY_FUNCTIONS",
    "OPERATORS",
    "Entry",
    "Number",
    "Operation",
    "Program",
    "Record",
    "Step",
    "angle_of",
    "arc_cosine",
    "arc_tangent",
    "cosine",
    "derivatives_along",
    "gradient",
    "greater",
    "hyperbolic_tangent",
    "is_number",
    "is_one",
    "is_zero",
    "least",
    "least_size",
    "most_size",
    "plain_root",
    "reciprocal",
    "shortened",
    "sine",
    "square_root",
    "usual_size",
    "with_turn",
]
