"""The command line interface, and what commands of other distributions are made of."""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
