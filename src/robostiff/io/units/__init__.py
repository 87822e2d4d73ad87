"""Quantities with units: ``300 mm``, ``70 GPa``, ``1e5 N m/rad``."""

from robostiff.io.units.quantity import (
    Dimension,
    SIQuantity,
    exact_quantity,
    make_quantity,
    own_quantity,
    parse_quantities,
    parse_quantity,
    question,
    to_si,
)
from robostiff.io.units.unit import UNIT_WORDS, Unit, is_unit_word, make_unit, read_unit

__all__ = [
    "UNIT_WORDS",
    "Dimension",
    "SIQuantity",
    "Unit",
    "exact_quantity",
    "is_unit_word",
    "make_quantity",
    "make_unit",
    "own_quantity",
    "parse_quantities",
    "parse_quantity",
    "question",
    "read_unit",
    "to_si",
]
