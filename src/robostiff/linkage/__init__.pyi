from robostiff.linkage.driven import DrivenLinkage, close, closed_at, network_at
from robostiff.linkage.essential import essential, robot_of, welded_places, with_roles
from robostiff.linkage.linkage import Configuration, Connection, DriveValues, Linkage

__all__ = [
    "Configuration",
    "Connection",
    "DriveValues",
    "DrivenLinkage",
    "Linkage",
    "close",
    "closed_at",
    "essential",
    "network_at",
    "robot_of",
    "welded_places",
    "with_roles",
]
