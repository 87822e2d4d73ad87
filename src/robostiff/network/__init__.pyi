from robostiff.network.condensation import compliance_between, condense
from robostiff.network.elements import (
    BeamElement,
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
from robostiff.network.loaded_network import InternalLoads, LoadedNetwork, network_under_loads
from robostiff.network.mobility import held_coordinates
from robostiff.network.network import Network, network_of_snapshot
from robostiff.network.response import NetworkResponse, SectionForces, network_response
from robostiff.network.saddle_point import redundancy

__all__ = [
    "BeamElement",
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
