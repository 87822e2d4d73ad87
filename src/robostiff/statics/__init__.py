"""Robots under finite loads: equilibrium, loaded stiffness, stability."""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
