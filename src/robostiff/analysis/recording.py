"""Robots recorded, and records of robots and linkages confirmed by the direct form."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from typing import Any

import numpy as np

from robostiff.analysis.compiled_answer import (
    AtGeneralPoses,
    RecordedRanks,
    answer_of_kernel,
    closes,
)
from robostiff.analysis.kernel_inputs import (
    KernelInputs,
    ParameterValues,
    Recordable,
    RecordedParts,
)
from robostiff.analysis.questions import PosesOfRobot, differences
from robostiff.analysis.result import Stiffness
from robostiff.compiled import Backend, Kernel, Output, Rates, StiffnessMatrix, kernel_of
from robostiff.elastostatics import Status, Tolerance
from robostiff.errors import DisagreementError, InputError, Words
from robostiff.kinematics import JointCoordinates, PostureFinder, posture_finder
from robostiff.model import ALL_COORDINATES
from robostiff.recorded import RecordedRobot, record_at_joints, record_robot, sample_postures
from robostiff.recorded.closure import RecordedClosure

# Generic poses must keep away from the tolerances that decide, by what poses may differ.
_STRICT = Tolerance(near_independence=1e-4, near_rigidity=1e-8)
_OTHER_SEED = 47
# How often poses are drawn nearer to home.
_NEARER = 4
_SPUN = 0.2  # what coordinates that nothing determines are changed by [m, rad]
# Ranks are decided about a reference point that is nearer to the robot than so many lengths.
_NEAR = 5.0


@singledispatch
def recorded_parts(
    taken: Any, outputs: tuple[Output, ...], backend: Backend, most: int | None
) -> RecordedParts:
    """Record kernels of a machine; a NoAnswerError where they take more than `most` operations."""
    del outputs, backend, most
    raise TypeError(f"no record of {type(taken).__name__}")


@recorded_parts.register
def _(
    taken: KernelInputs, outputs: tuple[Output, ...], backend: Backend, most: int | None
) -> RecordedParts:
    robot = taken.subject
    finder = posture_finder(robot.numeric)
    recorded = record_robot(robot, finder, most)
    if depends_on_posture(recorded.joints, recorded.closure, finder):
        recorded = record_at_joints(robot, finder, most)
    # A derivative may need more of the closure than its Newton steps give.
    if recorded.joints and not robot.is_posed_by_joints:
        check_derivatives(robot.name, recorded, outputs)
    joint_kernel = None
    names = {coordinate.value for coordinate in ALL_COORDINATES}
    by_pose = any(isinstance(x, Rates) and not names.isdisjoint(x.inputs) for x in outputs)
    if recorded.closure is not None and robot.is_serial and not by_pose:
        joint_kernel = kernel_of(record_at_joints(robot, finder), outputs, backend)
    kernel = kernel_of(recorded, outputs, backend)
    if recorded.joints and recorded.closure is None:
        joint_kernel = kernel
    verified = is_trusted(recorded, kernel, taken.taken_by(kernel, joint_kernel))
    ranks = None
    if outputs == (StiffnessMatrix(),) and recorded.closure is None:
        at = sample_postures(finder).snapshot
        away = np.linalg.norm(at.reference_point - at.centre, axis=-1)
        if np.all(away < _NEAR * at.characteristic_length):  # ranks are decided about this point
            ranks = RecordedRanks.of(recorded)
    return recorded.factors.rank, recorded.status, verified, kernel, joint_kernel, ranks


def is_trusted(recorded: RecordedRobot, kernel: Kernel, taken: Recordable, nearer: int = 0) -> bool:
    """Whether generic poses are regular, and a record has been confirmed at them.

    Once at the poses at which it was recorded, and once at others: what a record takes for zero or
    for the same at its own samples must be so elsewhere. Both forms decide for themselves where
    they hold; where both do, they must give the same K, rank and status, else it is a
    `DisagreementError`. Where the recorded closure arrives at no pose, nearer ones are drawn.

    Without trust no pose is left to the record.
    """
    general = AtGeneralPoses(recorded.factors.rank, recorded.status, verified=True)
    if kernel.outputs != (StiffnessMatrix(),):
        kernel = kernel_of(recorded, (StiffnessMatrix(),), Backend.ARRAYS)
    at = [_agrees(kernel, general, taken, seed, nearer) for seed in (0, _OTHER_SEED)]
    return all(at)


def _agrees(
    kernel: Kernel, general: AtGeneralPoses, taken: Recordable, seed: int, first: int
) -> bool:
    """Whether a kernel gives what the direct form gives, and nothing is in doubt."""
    subject = taken.subject
    for nearer in range(first, _NEARER):
        pose, samples = taken.samples(seed, nearer)
        given = np.asarray(pose.values if isinstance(pose, JointCoordinates) else pose)
        values = ParameterValues.of(subject, samples, len(given))
        rows = taken.rows(pose, given, values)
        met = closes(kernel, kernel.evaluate(rows.rows)) & ~rows.missed
        if met.any():
            break
    else:
        return False
    answer = answer_of_kernel(kernel, rows, general, 1)
    regular = np.zeros(len(given), dtype=bool)
    trusted = True
    for other, own in values.groups(met):
        question = taken.question(other, pose, given[own], _STRICT)
        direct = Stiffness.of(question)
        regular[own] = ~_doubtful(direct)
        if not regular[own].all():
            question = taken.question(other, pose, given[own])
            direct = Stiffness.of(question)
        decided = ~(answer.guarded[own] | _doubtful(direct))
        answers = answer.status_codes[own], answer.rank[own], answer.matrix[own]
        for k, distance in differences(direct.details(), *answers, question.free):
            if decided[k]:
                place = f"{subject.name!r} at {question.place(k)}"
                for name, x in zip(samples, values.rows[:, own[k]].tolist(), strict=True):
                    place += f", {name} = {x!r}"
                raise DisagreementError(question.opinions, distance, place)
            trusted = False
    # One of them may be singular by chance: of an arm that is stretched out at home.
    return trusted and bool(2 * np.count_nonzero(met & ~regular) < np.count_nonzero(met))


def _doubtful(result: Stiffness) -> np.ndarray:
    return (result.status_codes & int(Status.ILL_CONDITIONED)) != 0


def depends_on_posture(
    joints: Sequence[str], closure: RecordedClosure | None, finder: PostureFinder
) -> bool:
    """Whether K differs between postures of one pose that differ in coordinates that are held.

    A rod that spins between spherical joints is held by nothing, and transmits the same. A passive
    joint that folds a chain of beams is held by nothing either, but K depends on the fold: there
    the record and the direct form may be at different postures.
    """
    held = () if closure is None else closure.held
    if not held:
        return False
    posture = sample_postures(finder)
    moved = np.isin(joints, held) * _SPUN
    ends = np.cumsum([leg.chain.size for leg in finder.robot.legs])[:-1]
    for row, pose in enumerate(posture.pose):
        q = [own[row] for own in posture.coordinates]
        here, there = (
            Stiffness.of(PosesOfRobot(finder.robot, pose, near=near))
            for near in (q, np.split(np.concatenate(q) + moved, ends))
        )
        if not (here.answered and there.answered):
            return True
        own = here.status_codes[None], here.rank[None], here.matrix[None]
        if differences(there.details()[None], *own, PosesOfRobot.free):
            return True
    return False


def check_derivatives(name: str, recorded: RecordedRobot, outputs: Sequence[Output]) -> None:
    """Raise for derivatives that recorded Newton steps do not give."""
    for output in outputs:
        if not isinstance(output, Rates):
            continue
        if recorded.closure is None or isinstance(output.of, Rates):
            raise InputError(
                f"derivative {output.name}",
                got=Words(f"{name!r}, which is closed by iteration"),
                expected="first derivatives, of what has a kernel from pose to matrix",
                hint="take differences of rs.stiffness at two poses instead",
            )
