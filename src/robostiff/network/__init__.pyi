from robostiff.network.condensation import (
    NetworkStiffness,
    compliance_between,
    condense,
)
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
    HeldUnderLoads,
    InternalLoads,
    held_under,
    loads_under,
    motions_under,
)
from robostiff.network.network import Network, network_of_snapshot
from robostiff.network.response import NetworkResponse, SectionForces, network_response

__all__ = [
    "BeamElement",
    "DistributedForce",
    "ForceOnBeam",
    "HeldUnderLoads",
    "InternalLoads",
    "JointElement",
    "Network",
    "NetworkResponse",
    "NetworkStiffness",
    "Node",
    "NodeForce",
    "SectionForces",
    "SpringElement",
    "beam_between",
    "beam_stiffness_12",
    "compliance_between",
    "condense",
    "energy_stiffness",
    "held_under",
    "loads_under",
    "motions_under",
    "network_of_snapshot",
    "network_response",
]
