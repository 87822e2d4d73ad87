"""The stiffness of a robot as a record: the same derivation, once for all poses.

Closure, placement, elimination of the passive joints in the working frame where they are trivial,
and the sum over the legs, on recorded entries.
"""

from robostiff.recorded.closure import CLOSED, RecordedClosure, record_closure
from robostiff.recorded.factor import Factors, eigenvalues, factors_of, inverse_entries
from robostiff.recorded.flags import Flag, flags_of
from robostiff.recorded.leg import LegRecorder, RecordedLeg, stiffness_entries
from robostiff.recorded.parameters import entry_reader, parameter_samples, sample_postures
from robostiff.recorded.robot import (
    RecordedRobot,
    assembled,
    record_at_joints,
    record_at_pose,
    record_robot,
)

__all__ = [
    "CLOSED",
    "Factors",
    "Flag",
    "LegRecorder",
    "RecordedClosure",
    "RecordedLeg",
    "RecordedRobot",
    "assembled",
    "eigenvalues",
    "entry_reader",
    "factors_of",
    "flags_of",
    "inverse_entries",
    "parameter_samples",
    "record_at_joints",
    "record_at_pose",
    "record_closure",
    "record_robot",
    "sample_postures",
    "stiffness_entries",
]
