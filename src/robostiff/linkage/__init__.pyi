from robostiff.linkage.closure import Configuration, close
from robostiff.linkage.connections import Connection, DriveValues
from robostiff.linkage.driven import DrivenLinkage
from robostiff.linkage.essential import essential, robot_of, welded_places, with_roles
from robostiff.linkage.linkage import Linkage

__all__ = [
    "Configuration",
    "Connection",
    "DriveValues",
    "DrivenLinkage",
    "Linkage",
    "close",
    "essential",
    "robot_of",
    "welded_places",
    "with_roles",
]
