from robostiff.network.compliance import compliance_between
from robostiff.network.condensation import NetworkStiffness, condense
from robostiff.network.elements import (
    BeamElement,
    JointElement,
    Node,
    SpringElement,
    beam_between,
    beam_stiffness_12,
)
from robostiff.network.energy import energy_stiffness
from robostiff.network.internal_loads import InternalLoads, internal_loads, loads_under
from robostiff.network.network import Network
from robostiff.network.platform_flexibility import PlatformFlexibility, platform_flexibility
from robostiff.network.snapshot_network import network_of_snapshot

__all__ = [
    "BeamElement",
    "InternalLoads",
    "JointElement",
    "Network",
    "NetworkStiffness",
    "Node",
    "PlatformFlexibility",
    "SpringElement",
    "beam_between",
    "beam_stiffness_12",
    "compliance_between",
    "condense",
    "energy_stiffness",
    "internal_loads",
    "loads_under",
    "network_of_snapshot",
    "platform_flexibility",
]
