"""Records: formulas recorded operation by operation, to be evaluated elsewhere.

The formulas of the library work on arrays of any entries. Filled with `Entry` they leave a
`Record`: a list of operations without branches, each written once. It can be evaluated on arrays of
poses, compiled, differentiated, or read as named steps.
"""

from robostiff.record.exact import shortened as shortened
from robostiff.record.functions import ENTRY_FUNCTIONS as ENTRY_FUNCTIONS
from robostiff.record.functions import angle_of as angle_of
from robostiff.record.functions import arc_cosine as arc_cosine
from robostiff.record.functions import arc_tangent as arc_tangent
from robostiff.record.functions import as_part as as_part
from robostiff.record.functions import cosine as cosine
from robostiff.record.functions import derivatives_along as derivatives_along
from robostiff.record.functions import gradient as gradient
from robostiff.record.functions import greater as greater
from robostiff.record.functions import hyperbolic_tangent as hyperbolic_tangent
from robostiff.record.functions import least as least
from robostiff.record.functions import least_size as least_size
from robostiff.record.functions import most_size as most_size
from robostiff.record.functions import plain_root as plain_root
from robostiff.record.functions import reciprocal as reciprocal
from robostiff.record.functions import sine as sine
from robostiff.record.functions import square_root as square_root
from robostiff.record.functions import usual_size as usual_size
from robostiff.record.functions import with_turn as with_turn
from robostiff.record.program import CLOSED as CLOSED
from robostiff.record.program import WATCHED as WATCHED
from robostiff.record.program import Flag as Flag
from robostiff.record.program import Program as Program
from robostiff.record.record import NUMPY_FUNCTIONS as NUMPY_FUNCTIONS
from robostiff.record.record import OPERATORS as OPERATORS
from robostiff.record.record import Entry as Entry
from robostiff.record.record import Operation as Operation
from robostiff.record.record import Record as Record
from robostiff.record.record import is_number as is_number
from robostiff.record.record import is_one as is_one
from robostiff.record.record import is_zero as is_zero
