"""Stiffness of a network, told like that of a robot of legs."""

from __future__ import annotations

from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.structural_analysis import StructuralAnalysis
from robostiff.elastostatics import Tolerance
from robostiff.network import Network, condense


def network_stiffness(network: Network, tolerance: Tolerance) -> RobotStiffness:
    """Stiffness of the platform of a network about its reference point.

    Examples
    --------
    >>> import numpy as np
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02))
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> network_stiffness(network, Tolerance())
    <RobotStiffness of 'rod' about (1, 0, 0) m, rank 6 of 6, status ok>
    """
    solved = condense(network, tolerance)
    return RobotStiffness(
        name=network.name,
        pose=None,
        reference_point=network.reference_point,
        about_reference=solved.whole,
        legs=(),
        passive_joint_names=solved.freedom_names,
        method=StructuralAnalysis(),
        complaints=(),
        serial_compliance=None,
        origin=solved.origin,
    )
