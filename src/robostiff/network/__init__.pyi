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
from robostiff.network.internal_loads import (
    InternalLoads,
    NetworkUnderLoads,
    motions_under,
    network_under_loads,
)
from robostiff.network.network import Network, network_of_snapshot
from robostiff.network.response import NetworkResponse, SectionForces, network_response

__all__ = [
    "BeamElement",
    "DistributedForce",
    "ForceOnBeam",
    "InternalLoads",
    "JointElement",
    "Network",
    "NetworkResponse",
    "NetworkUnderLoads",
    "Node",
    "NodeForce",
    "SectionForces",
    "SpringElement",
    "beam_between",
    "beam_stiffness_12",
    "compliance_between",
    "condense",
    "energy_stiffness",
    "motions_under",
    "network_of_snapshot",
    "network_response",
    "network_under_loads",
]
