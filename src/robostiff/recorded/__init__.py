"""The stiffness of a robot as a record: the same derivation, once for all poses.

Closure, placement, elimination of the passive joints in the working frame where they are trivial,
and the sum over the legs, on recorded entries.
"""

from robostiff.recorded.closure import RecordedClosure as RecordedClosure
from robostiff.recorded.closure import record_closure as record_closure
from robostiff.recorded.factor import Factors as Factors
from robostiff.recorded.factor import eigenvalues as eigenvalues
from robostiff.recorded.factor import factors_of as factors_of
from robostiff.recorded.factor import inverse_entries as inverse_entries
from robostiff.recorded.flags import flags_of as flags_of
from robostiff.recorded.leg import LegRecorder as LegRecorder
from robostiff.recorded.leg import RecordedLeg as RecordedLeg
from robostiff.recorded.parameters import entry_reader as entry_reader
from robostiff.recorded.parameters import parameter_samples as parameter_samples
from robostiff.recorded.parameters import sample_postures as sample_postures
from robostiff.recorded.robot import RecordedRobot as RecordedRobot
from robostiff.recorded.robot import record_at_joints as record_at_joints
from robostiff.recorded.robot import record_robot as record_robot
from robostiff.recorded.robot import robot_stiffness as robot_stiffness
