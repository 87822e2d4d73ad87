"""Legs in the world as formulas on recorded entries: all elements on the bodies of a closed leg."""

from robostiff.kinematics.formula.mode import other_modes
from robostiff.kinematics.formula.place import (
    FormulaPose,
    PlacedFormula,
    place_leg,
    place_leg_at_joints,
)

__all__ = ["FormulaPose", "PlacedFormula", "other_modes", "place_leg", "place_leg_at_joints"]
