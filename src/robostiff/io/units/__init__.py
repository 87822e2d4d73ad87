"""Quantities with units: ``300 mm``, ``70 GPa``, ``1e5 N m/rad``."""

from robostiff.io.units.dimension import (
    Dimension,
    describe,
    dimension_of,
    is_bare,
    is_number,
    parse_quantities,
    same_dimension,
    to_si,
)
from robostiff.io.units.registry import (
    UNIT_WORDS,
    SIQuantity,
    Unit,
    exact_quantity,
    is_unit_word,
    make_quantity,
    make_unit,
    own_quantity,
    parse_quantity,
    read_unit,
)

__all__ = [
    "UNIT_WORDS",
    "Dimension",
    "SIQuantity",
    "Unit",
    "describe",
    "dimension_of",
    "exact_quantity",
    "is_bare",
    "is_number",
    "is_unit_word",
    "make_quantity",
    "make_unit",
    "own_quantity",
    "parse_quantities",
    "parse_quantity",
    "read_unit",
    "same_dimension",
    "to_si",
]
