"""A leg whose coordinates are inputs: a serial arm, or one closed elsewhere."""

from __future__ import annotations

import numpy as np

from robostiff.kinematics.formula.placed import PlacedFormula
from robostiff.kinematics.formula.pose import FormulaPose
from robostiff.kinematics.formula.tidy import tidied, tidied_point
from robostiff.kinematics.frames import place_chain
from robostiff.model import Leg, PlacedLeg, Telescope
from robostiff.record import Entry


def place_leg_at_joints(leg: Leg, q: np.ndarray) -> PlacedFormula:
    """Record a leg at recorded coordinates, eq. (5); it has no gap.

    Parameters
    ----------
    leg : Leg
        Of floats or recorded entries.
    q : (size,) array of entries and numbers
        Leg coordinates [m, rad].
    """
    q = np.array(q, dtype=object)
    placed = place_chain(leg.chain, q, tidied(leg.base.R), tidied_point(leg.base.p))
    R = placed.R @ np.array(leg.attachment.R, dtype=object).T
    lengths = [
        beam.fixed + beam.share * q[where.start]
        for element, where in leg.chain.moving
        if isinstance(element, Telescope)
        for beam in element.beams
    ]
    return PlacedFormula(
        leg=PlacedLeg(leg.name, placed.elements, placed.p),
        gap=(),
        lengths=tuple(length for length in lengths if isinstance(length, Entry)),
        coordinate=lambda place: q[place],
        platform=FormulaPose(R, placed.p - R @ np.array(leg.attachment.p, dtype=object)),
    )
