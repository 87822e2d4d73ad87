"""Robots as frozen data: joints, links, legs, snapshots."""

from robostiff.model.body_spring import BodyPoint, BodySpring
from robostiff.model.chain import Branch, Chain, Element, ParallelBlock, parallelogram
from robostiff.model.coupled_joints import Coupling, coupling
from robostiff.model.entries import with_entries
from robostiff.model.flexible_platform import (
    FlexiblePlatform,
    PlacedPlatform,
    PlatformNode,
    PlatformPart,
    platform_beam,
    rigid_member,
)
from robostiff.model.joint import (
    Actuated,
    Joint,
    JointKind,
    Locked,
    Passive,
    Role,
    cylindrical,
    helical,
    planar,
    prismatic,
    revolute,
    spherical,
    universal,
)
from robostiff.model.link import Link, Rigid, Telescope, TelescopicBeam, beam_axes, beam_link
from robostiff.model.mass import STANDARD_GRAVITY, Mass, PlacedMass, gravity_vector
from robostiff.model.robot import Elbow, Leg, Robot
from robostiff.model.serial_arm import DHConvention, DHRow, serial_arm
from robostiff.model.snapshot import (
    CoupledFreedom,
    PlacedBlock,
    PlacedBodySpring,
    PlacedElement,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    Snapshot,
)
from robostiff.model.stiffness_law import ForceLaw, StiffnessLaw
from robostiff.model.subject import ALL_COORDINATES, Coordinate, pose_coordinates

__all__ = [
    "ALL_COORDINATES",
    "STANDARD_GRAVITY",
    "Actuated",
    "BodyPoint",
    "BodySpring",
    "Branch",
    "Chain",
    "Coordinate",
    "CoupledFreedom",
    "Coupling",
    "DHConvention",
    "DHRow",
    "Elbow",
    "Element",
    "FlexiblePlatform",
    "ForceLaw",
    "Joint",
    "JointKind",
    "Leg",
    "Link",
    "Locked",
    "Mass",
    "ParallelBlock",
    "Passive",
    "PlacedBlock",
    "PlacedBodySpring",
    "PlacedElement",
    "PlacedFreedom",
    "PlacedLeg",
    "PlacedMass",
    "PlacedPlatform",
    "PlacedSpring",
    "PlatformNode",
    "PlatformPart",
    "Rigid",
    "Robot",
    "Role",
    "Snapshot",
    "StiffnessLaw",
    "Telescope",
    "TelescopicBeam",
    "beam_axes",
    "beam_link",
    "coupling",
    "cylindrical",
    "gravity_vector",
    "helical",
    "parallelogram",
    "planar",
    "platform_beam",
    "pose_coordinates",
    "prismatic",
    "revolute",
    "rigid_member",
    "serial_arm",
    "spherical",
    "universal",
    "with_entries",
]
