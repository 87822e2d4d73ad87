"""Networks: bodies, beams, springs and joints connected in any way, solved as one system.

Matrix structural analysis: loops inside legs, flexible platforms, connections between legs.
Nothing is taken from the forms of K_C, so that a network is also a check of them
(`network_of_snapshot`).
"""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
