"""Quantities with units: ``300 mm``, ``70 GPa``, ``1e5 N m/rad``."""

from robostiff.io.units.quantity import Dimension as Dimension
from robostiff.io.units.quantity import SIQuantity as SIQuantity
from robostiff.io.units.quantity import exact_quantity as exact_quantity
from robostiff.io.units.quantity import make_quantity as make_quantity
from robostiff.io.units.quantity import own_quantity as own_quantity
from robostiff.io.units.quantity import parse_quantities as parse_quantities
from robostiff.io.units.quantity import parse_quantity as parse_quantity
from robostiff.io.units.quantity import question as question
from robostiff.io.units.quantity import to_si as to_si
from robostiff.io.units.unit import UNIT_WORDS as UNIT_WORDS
from robostiff.io.units.unit import Unit as Unit
from robostiff.io.units.unit import is_unit_word as is_unit_word
from robostiff.io.units.unit import make_unit as make_unit
from robostiff.io.units.unit import read_unit as read_unit
