"""A robot recorded: closure, placement, elimination and sum, once for all poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.elastostatics import Status
from robostiff.frozen import field, frozen, replace
from robostiff.kinematics import PostureFinder
from robostiff.kinematics.closure.body import tidy_numbers
from robostiff.kinematics.formula import FormulaPose, PlacedFormula, place_leg, place_leg_at_joints
from robostiff.model import ALL_COORDINATES, ParallelBlock, Robot, Telescope
from robostiff.record import Entry, Flag, Operation, Record, as_part
from robostiff.recorded.circulation import legs_on_platform
from robostiff.recorded.closure import RecordedClosure, record_closure
from robostiff.recorded.factor import Factors, factors_of
from robostiff.recorded.guess import axes_behind_balls, following_balls, pose_on_entries
from robostiff.recorded.leg import SHORT, LegRecorder, RecordedLeg, lower_bound, stiffness_entries
from robostiff.recorded.parameters import (
    closed_samples,
    parameter_samples,
    sample_postures,
    with_inputs,
)
from robostiff.spatial import Space

# Squared miss of a leg's end, as a part of its size, beyond which its closure is looked at again.
_CLOSED = SHORT + 1e-15
# A choice is looked at again when it is nearer than 1e-7 of its usual size, a loss of 1e4.
_CHOSEN = 1e-10


@frozen
class RecordedRobot:
    """The stiffness of a robot about its reference point as a record, world axes."""

    name: str
    #: its inputs are pose coordinates, or the coordinates of the legs, and parameters
    record: Record
    space: Space
    length: float  #: characteristic length [m]
    legs: tuple[RecordedLeg, ...]  #: one of all ways to hold the platform, where it is flexible
    #: dict of (row, column) to entries or numbers: upper triangle [N/m, N, N m]
    K: dict[tuple[int, int], Any]
    #: tuple of entries: negative where a leg does not close: what stands below the square roots of
    #: its closure and the lengths of its telescopes, as parts of what they are at the samples, and
    #: what is missed
    reach: tuple[Any, ...]
    #: tuple of entries: of the closure: large where a leg has two ways that are as good, or a drive
    #: is undetermined
    closure_losses: tuple[Any, ...]
    limits: tuple[Any, ...]  #: tuple of entries: negative where an actuator is beyond its limits
    #: inputs that are coordinates of the legs; none where pose coordinates are the inputs
    joints: tuple[str, ...] = ()
    closure: RecordedClosure | None = None  #: from pose coordinates to the coordinates of the legs
    #: entry, number or None: of all parts, as far as it is known [kg]; None of a linkage
    mass: Any = None
    #: tuple of entries: those of `reach` that say what is missed: near zero wherever the legs close
    gaps: tuple[Any, ...] = ()
    tests: tuple[Any, ...] = ()  #: tuple of entries: 1 where the record holds, 0 elsewhere
    #: mapping of Flag to entries or numbers: 1 where they hold, 0 elsewhere; of a cable robot
    flags: Mapping[Flag, Any] = field(default_factory=dict)
    #: mapping of str to entries or numbers: of the cables of a cable robot, by name [N]
    tensions: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def factors(self) -> Factors:
        """Factors of K: its rank at a general pose, and its solution."""
        return factors_of(self.K, self.space.size)

    @cached_property
    def status(self) -> Status:
        """Status at a general pose: free motions, redundant joints."""
        status = Status.OK
        if self.factors.rank < self.space.size:
            status |= Status.FREE_MOTIONS
        if any(any(leg.redundant) for leg in self.legs):
            status |= Status.REDUNDANT_JOINTS
        return status


@frozen
class RobotOnEntries:
    """A robot placed in the world on the entries of a new record."""

    robot: Robot  # inputs in place of its symbols
    record: Record  # its inputs are coordinates of the posture, then the symbols
    # Inputs that are coordinates of all legs, named ``leg/0``, ``leg/1`` and so on, or ``q0``,
    # ``q1`` of a serial arm; none where free pose coordinates are the inputs
    joints: tuple[str, ...]
    pose: FormulaPose  # of the platform
    placed: tuple[PlacedFormula, ...]
    length: float  # characteristic length [m]

    @classmethod
    def of(
        cls,
        robot: Robot,
        finder: PostureFinder,
        *,
        by_pose: bool,
        closure: RecordedClosure | None = None,
        most: int | None = None,
        weighs: bool = False,
    ) -> RobotOnEntries:
        """A robot whose legs close in closed form, by its pose; any robot by its joints.

        Its symbols, which have nominal values, are inputs as well; the finder is of the same robot
        in numbers. With the closure of a robot by its joints the platform is at its pose, and
        joints that follow from others or from the pose are no inputs. The record has no more than
        `most` operations. `weighs`: whether masses of the legs are placed, see `place_leg`.

        Raises InputError when a leg has no closed form, or home has no room around it, and
        NoAnswerError when the record would be longer.
        """
        if by_pose:
            samples = sample_postures(finder).pose
            pairs = zip(robot.coordinates, robot.coordinate_places, strict=True)
            given = {coordinate.value: samples[:, k] for coordinate, k in pairs}
        else:
            given = _joint_samples(robot, finder)
        same = {} if closure is None else closure.same
        inputs = {name: samples for name, samples in given.items() if name not in same}
        inputs |= parameter_samples(robot)
        if closure is not None:
            poses, names = closed_samples(robot, finder)[0], (*closure.inputs, *closure.start)
            columns = zip(ALL_COORDINATES, poses.T, strict=True)
            inputs |= {c.value: samples for c, samples in columns if c.value in names}
        record = Record(inputs, most)
        robot = with_inputs(robot, record)
        legs = robot.legs
        if by_pose:
            pose = FormulaPose.of_coordinates(pose_on_entries(robot, finder, record, [*given]))
            pairs = zip(legs, finder.solvers, strict=True)
            placed = tuple(place_leg(leg, pose, solver, weighs=weighs) for leg, solver in pairs)
        else:
            q: list[Any] = []
            for joint in given:
                other, factor = same.get(joint, (joint, 1.0))
                q.append(factor if other is None else record.input(other) * factor)
            ends = np.cumsum([leg.chain.size for leg in legs])[:-1]
            columns = np.split(np.array(q, dtype=object), ends)
            if closure is None:
                pairs = zip(legs, columns, strict=True)
                placed = tuple(place_leg_at_joints(leg, x, weighs=weighs) for leg, x in pairs)
                pose = placed[0].platform
            else:
                six = pose_on_entries(robot, finder, record, (*closure.inputs, *closure.start))
                pose = FormulaPose.of_coordinates(six)
                below = []  # but for the bodies that the platform holds by ball joints
                for leg, twin, x in zip(legs, finder.robot.legs, columns, strict=True):
                    frames = tidy_numbers(leg.base.R), pose.R @ tidy_numbers(leg.attachment.R)
                    turned = axes_behind_balls(leg, x, following_balls(twin), *frames)
                    turned = {ball: tidy_numbers(R) for ball, R in turned.items()}
                    below.append(place_leg_at_joints(leg, x, turned))
                placed = tuple(below)
        joints = () if by_pose else tuple(given)
        return cls(robot, record, joints, pose, placed, finder.length)

    @property
    def reference(self) -> np.ndarray:
        """Reference point (3,) in the world."""
        return self.pose.p + self.pose.R @ np.array(self.robot.reference_point, dtype=object)

    @cached_property
    def stiffness(self) -> RecordedRobot:
        """Its stiffness, as one of these coordinates."""
        found = robot_stiffness(self.robot, self.record, self.pose, self.placed, self.length)
        return replace(found, joints=self.joints)


def _joint_samples(robot: Robot, finder: PostureFinder) -> dict[str, np.ndarray]:
    samples = closed_samples(robot, finder)[1]
    found = {}
    for leg, q in zip(robot.legs, samples, strict=True):
        start = "q" if robot.is_serial else f"{leg.name}/"
        found |= {f"{start}{i}": q[:, i] for i in range(leg.chain.size)}
    return found


def robot_stiffness(
    robot: Robot, record: Record, pose: FormulaPose, placed: Sequence[PlacedFormula], length: float
) -> RecordedRobot:
    """The stiffness of placed legs; those on a flexible platform are recorded as one."""
    reference = pose.p + pose.R @ np.array(robot.reference_point, dtype=object)
    recorder = LegRecorder(record, reference, robot.space, length)
    if robot.platform is not None:
        legs = [legs_on_platform(robot, robot.platform, recorder, pose, placed)]
    else:  # equal legs are recorded in the same working frame
        frames: dict[Any, int] = {}
        legs = []
        for model, formula in zip(robot.legs, placed, strict=True):
            chain = model.chain
            joints = zip(chain.freedoms, chain.roles, strict=True)
            moved = ((screw.turns, screw.slides, type(role)) for screw, role in joints)
            shape = tuple(map(type, chain.elements)), tuple(moved)
            leg = recorder.leg(formula.leg, frames.get(shape))
            frames[shape] = leg.frame
            legs.append(leg)
    gaps = [_CLOSED - gap for p in placed for gap in p.gap]
    softest = [e.stiffness for p in placed for e in p.leg.freedoms if e.coordinate is not None]
    positive = (*softest, *(x for p in placed for x in p.lengths))
    lengths = [as_part(x) for x in positive if isinstance(x, Entry)]
    limits: list[Any] = []  # distances from them, as parts of their range
    for leg, formula in zip(robot.legs, placed, strict=True):
        for i, (low, high) in enumerate(leg.chain.limits.T.tolist()):
            if np.isfinite(low):
                q, by_range = formula.coordinate(i), 1 / (high - low)
                limits += [(q - low) * by_range, (high - q) * by_range]
    K = stiffness_entries(legs, robot.space.size)
    # Radicands that can become negative, as parts of what they are at the samples; and losses, of
    # the comparisons by which the legs choose a branch
    radicands, losses = dict[int, Any](), []
    for step in record.steps_needed(x.step for x in K.values() if isinstance(x, Entry)):
        operation, a, b = record.operation(step)
        if operation is Operation.SQUARE_ROOT and lower_bound(record, a) < 0:
            radicands[a] = as_part(Entry(record, a))
        elif operation is Operation.GREATER:
            apart = record.at(a) - record.at(b)
            by = apart.reciprocal()
            losses.append(by * by * (_CHOSEN * float(np.mean(apart.sample**2))))
    return RecordedRobot(
        name=robot.name,
        record=record,
        space=robot.space,
        length=length,
        legs=tuple(legs),
        K=K,
        reach=(*lengths, *gaps, *radicands.values()),
        closure_losses=(*losses, *(loss for p in placed for loss in p.losses)),
        limits=tuple(limits),
        mass=_mass(robot, placed),
        gaps=tuple(gaps),
    )


def _mass(robot: Robot, placed: Sequence[PlacedFormula]) -> Any:
    """Mass of all parts [kg], that of telescopes as long as they are."""
    parts: list[Any] = [] if robot.platform is None else [*robot.platform.parts]
    waiting: list[Any] = [element for leg in robot.legs for element in leg.chain.elements]
    while waiting:
        parts.append(part := waiting.pop(0))
        if isinstance(part, ParallelBlock):
            waiting += [inner for branch in part.branches for inner in branch.chain.elements]
    values: list[Any] = [mass.value for mass in robot.platform_masses]
    values += [mass.value for part in parts for mass in getattr(part, "masses", ())]
    for leg, formula in zip(robot.legs, placed, strict=True):
        for element, where in leg.chain.moving:
            for beam in element.beams if isinstance(element, Telescope) else ():
                length = beam.fixed + beam.share * formula.coordinate(where.start)
                values.append(beam.mass_at(np.asarray(length, dtype=object)))
    known = (np.asarray(value, dtype=object).item() for value in values if value is not None)
    return sum(known, 0)


def place_robot(
    robot: Robot,
    finder: PostureFinder,
    most: int | None = None,
    *,
    weighs: bool = False,
    all_joints: bool = False,
) -> tuple[RobotOnEntries, RecordedClosure | None]:
    """A robot on entries at its poses, where its legs have closed forms; else at its joints.

    Of the latter there is a closure from pose coordinates, where one serves. The platform is at its
    pose then, and joints that follow are no inputs; or all are (`all_joints`), as under load. For
    the rest see `RobotOnEntries.of`.
    """
    by_joints = robot.is_posed_by_joints
    if not by_joints and all(s.recorded_form is not None for s in finder.solvers):
        here = RobotOnEntries.of(robot, finder, by_pose=True, most=most, weighs=weighs)
        # Where a leg misses the platform at generic poses, the other coordinates must follow.
        parts = [part for part in here.stiffness.reach if isinstance(part, Entry)]
        if all(np.all(part.sample >= 0) for part in parts):
            return here, None
    closure = None
    if not by_joints:
        closure = record_closure(robot, finder, tuple(_joint_samples(robot, finder)), most)
    by = None if all_joints else closure
    here = RobotOnEntries.of(robot, finder, by_pose=False, closure=by, most=most, weighs=weighs)
    return here, closure


def record_robot(robot: Robot, finder: PostureFinder, most: int | None = None) -> RecordedRobot:
    """Record a robot at its poses: legs in closed form, or closed by Newton steps.

    An arm that is posed by its joints is recorded at joint coordinates. A record of more than
    `most` operations is given up, a `NoAnswerError`.
    """
    here, closure = place_robot(robot, finder, most)
    return replace(here.stiffness, closure=closure)


def record_at_joints(robot: Robot, finder: PostureFinder, most: int | None = None) -> RecordedRobot:
    """Record a robot at coordinates of all its legs, a serial arm at those of its joints."""
    return RobotOnEntries.of(robot, finder, by_pose=False, most=most).stiffness
