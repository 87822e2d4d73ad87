"""Linkages: rigid bodies and their connections, in any arrangement, at any joint coordinates.

A tree of bodies whose loops are closed by further joints, as in robot description files. One
whose bodies form legs between base and platform becomes a `model.Robot`; any other a
`network.Network` at given joint coordinates.
"""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
