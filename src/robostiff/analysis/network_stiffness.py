"""Stiffness of a network, as a result like that of a robot of legs."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.result import RobotStiffness, StructuralAnalysis
from robostiff.elastostatics import Status, Tolerance
from robostiff.errors import NoAnswerError
from robostiff.network import Network, NetworkStiffness, compliance_between, condense


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
        serial_compliance=_where_rigid(network, solved, tolerance),
        origin=solved.origin,
    )


def _where_rigid(
    network: Network, solved: NetworkStiffness, tolerance: Tolerance
) -> np.ndarray | None:
    """Compliance about the origin where a direction is rigid, and there is no K to invert."""
    whole = solved.whole
    if Status.RIGID_DIRECTION not in whole.status or int(whole.rank) < whole.space.size:
        return None
    try:
        return compliance_between(network, [(network.platform, solved.origin)], tolerance=tolerance)
    except NoAnswerError:
        return None
