"""Other programs: MuJoCo and Pinocchio are read, models for OpenSees and CalculiX are written."""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
