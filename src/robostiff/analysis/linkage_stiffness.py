"""Stiffness of a linkage at many values of its driven joints, configuration by configuration."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.network_stiffness import network_stiffness
from robostiff.analysis.result import RobotStiffness, StructuralAnalysis
from robostiff.elastostatics import DEFAULT_TOLERANCE, CartesianStiffness, Status, Tolerance
from robostiff.errors import NoAnswerError
from robostiff.kinematics.turn import vector_of_turn
from robostiff.linkage.driven import DrivenLinkage
from robostiff.linkage.network_at import network_of


def linkage_stiffness(
    driven: DrivenLinkage, rows: np.ndarray, tolerance: Tolerance = DEFAULT_TOLERANCE
) -> RobotStiffness:
    """Stiffness as networks at coordinates of the drives (N, n), a batch of N poses.

    Where the loops do not close, or close in another assembly mode only, the status says that the
    pose is out of reach.

    Parameters
    ----------
    driven : DrivenLinkage
    rows : (N, n) array
        In the order of ``driven.inputs`` [m, rad].
    tolerance : Tolerance
    """
    at_home = network_stiffness(network_of(driven.part, driven.home), tolerance)
    parts, poses, points, origins, reasons = [], [], [], [], []
    for found in driven.at(rows):
        own, lost = at_home, Status.UNREACHABLE
        network = network_of(driven.part, found)
        if found.is_closed:
            try:
                own, lost = network_stiffness(network, tolerance), Status.OK
            except NoAnswerError as error:
                lost = Status.FORM_DOES_NOT_HOLD | Status.ILL_CONDITIONED
                reasons.append(str(error))
        whole = own.about_reference
        if lost:
            whole = whole.with_status(np.array(int(lost), dtype=np.uint8))
        frame = found.frames[driven.part.platform]
        parts.append(whole.reshaped((1,)))
        poses.append(np.concatenate([frame.p, vector_of_turn(frame.R)]))
        points.append(network.reference_point)
        origins.append(own.origin)
    return RobotStiffness(
        name=driven.part.name,
        pose=np.array(poses),
        reference_point=np.array(points),
        about_reference=CartesianStiffness.joined(parts),
        legs=(),
        passive_joint_names=at_home.passive_joint_names,
        method=StructuralAnalysis(),
        complaints=tuple(dict.fromkeys(reasons)),
        serial_compliance=None,
        origin=np.array(origins),
    )
