"""Maps: stiffness at any number of poses, restartable, on one machine or many."""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
