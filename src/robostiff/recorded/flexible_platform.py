"""Legs on a flexible platform, recorded: wrenches of legs, summed along the platform's parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.kinematics.formula import FormulaPose, PlacedFormula
from robostiff.model import FlexiblePlatform, PlacedLeg, PlacedSpring, PlatformPart, Robot
from robostiff.recorded.circulation import BodyChain, Circulation
from robostiff.recorded.leg import LegRecorder, RecordedLeg
from robostiff.recorded.working_frame import LocalLeg, WorkingFrame, local_leg

_BASE = "base"


def legs_on_platform(
    robot: Robot,
    platform: FlexiblePlatform,
    recorder: LegRecorder,
    pose: FormulaPose,
    placed: Sequence[PlacedFormula],
) -> RecordedLeg:
    """All ways to hold the tool, as those of one leg, K = H (diag(c) + p)^-1 H^T.

    Every leg has its wrenches, and each part of the platform carries the sum of those that come in
    beyond it; parts that close loops have wrenches of their own. The energy of the parts is written
    down in platform axes, in which they are the same at all poses.

    Raises InputError when a transmitted wrench meets no compliance.
    """
    parts = (
        BodyChain(f"part {part.name}", _node(part.a), _node(part.b), _local(part, recorder))
        for part in platform.parts
    )
    legs = (
        BodyChain(f"leg {leg.name}", _BASE, _node(name), own.leg)
        for leg, name, own in zip(robot.legs, robot.holds, placed, strict=True)
    )
    frame = WorkingFrame(pose.R, pose.p)
    tool = _node(platform.tool)
    return Circulation(robot.name, (*parts, *legs), _BASE, tool, recorder, frame).leg


def _local(part: PlatformPart, recorder: LegRecorder) -> LocalLeg:
    """A part in platform axes, about the platform's origin."""
    origin = WorkingFrame(np.eye(3, dtype=int).astype(object), np.zeros(3, dtype=int))
    spring = PlacedSpring(part.name, part.point, part.axes, part.elasticity)
    leg = PlacedLeg(part.name, (spring,), part.point)
    return local_leg(leg, origin, recorder.record, recorder.length)


def _node(name: str) -> str:
    return f"node {name}"
