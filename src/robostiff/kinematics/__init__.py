"""Kinematics at a pose: frames, Jacobians and closure."""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
