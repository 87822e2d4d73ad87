from robostiff.network.assembly import network_of_snapshot
from robostiff.network.elements import (
    BeamElement,
    CouplingElement,
    DistributedForce,
    ForceOnBeam,
    JointElement,
    Node,
    NodeForce,
    SpringElement,
    beam_between,
    beam_stiffness_12,
)
from robostiff.network.energy import energy_stiffness
from robostiff.network.equations import Equations, Motion, equations_of
from robostiff.network.mobility import held_coordinates
from robostiff.network.network import Network
from robostiff.network.response import NetworkResponse, SectionForces, network_response
from robostiff.network.saddle_point import redundancy
from robostiff.network.solution import (
    InternalLoads,
    LoadedNetwork,
    compliance_between,
    condense,
    network_under_loads,
)

__all__ = [
    "BeamElement",
    "CouplingElement",
    "DistributedForce",
    "Equations",
    "ForceOnBeam",
    "InternalLoads",
    "JointElement",
    "LoadedNetwork",
    "Motion",
    "Network",
    "NetworkResponse",
    "Node",
    "NodeForce",
    "SectionForces",
    "SpringElement",
    "beam_between",
    "beam_stiffness_12",
    "compliance_between",
    "condense",
    "energy_stiffness",
    "equations_of",
    "held_coordinates",
    "network_of_snapshot",
    "network_response",
    "network_under_loads",
    "redundancy",
]
