"""Linkages: rigid bodies and their connections, in any arrangement, at any joint coordinates.

A tree of bodies whose loops are closed by further joints, as in robot description files. One
whose bodies form legs between base and platform becomes a `model.Robot`; any other a
`network.Network` at given joint coordinates.
"""

from robostiff.linkage.closure import Configuration, close
from robostiff.linkage.essential import essential, welded_places
from robostiff.linkage.legs import robot_of
from robostiff.linkage.linkage import Connection, Linkage
from robostiff.linkage.network_at import network_at

__all__ = [
    "Configuration",
    "Connection",
    "Linkage",
    "close",
    "essential",
    "network_at",
    "robot_of",
    "welded_places",
]
