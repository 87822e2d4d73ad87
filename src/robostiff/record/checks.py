"""What the checks of a record mean."""

from __future__ import annotations

from enum import IntFlag

#: Square of the gap, as a part of the length and radians, at which legs meet to the last digits.
CLOSED = 1e-12**2


class Flag(IntFlag):
    """What holds at a pose; 0 where the answer of the record is right as it is."""

    BEYOND_LIMITS = 1
    OUT_OF_REACH = 2
    DOUBTFUL = 4  # an assumption is close to failing
    RANK_DOUBTFUL = 8  # the pivots of K do not decide its rank
    MEETING = 16  # eigenvalues meet, which have no derivatives there
