"""What a robot is: frozen data, no mathematics."""

from robostiff.model.beam_link import beam_axes, beam_link
from robostiff.model.chain import Chain, Element
from robostiff.model.entries import with_entries
from robostiff.model.joint import (
    Actuated,
    Freedom,
    Joint,
    JointKind,
    Locked,
    Motion,
    Passive,
    Role,
    cylindrical,
    planar,
    prismatic,
    revolute,
    spherical,
    universal,
)
from robostiff.model.link import Link, Rigid, Telescope, TelescopicBeam
from robostiff.model.robot import ALL_COORDINATES, Coordinate, Elbow, Leg, Robot
from robostiff.model.snapshot import PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot

__all__ = [
    "ALL_COORDINATES",
    "Actuated",
    "Chain",
    "Coordinate",
    "Elbow",
    "Element",
    "Freedom",
    "Joint",
    "JointKind",
    "Leg",
    "Link",
    "Locked",
    "Motion",
    "Passive",
    "PlacedFreedom",
    "PlacedLeg",
    "PlacedSpring",
    "Rigid",
    "Robot",
    "Role",
    "Snapshot",
    "Telescope",
    "TelescopicBeam",
    "beam_axes",
    "beam_link",
    "cylindrical",
    "planar",
    "prismatic",
    "revolute",
    "spherical",
    "universal",
    "with_entries",
]
