"""Analysis of robots: stiffness, compliance, deflection, indices, maps, verification."""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
