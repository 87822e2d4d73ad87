"""Machines of which kernels are recorded: poses and parameters as rows of inputs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from functools import singledispatch
from typing import Any, Generic, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.compiled_answer import InputRows, RecordedRanks
from robostiff.analysis.questions import CHUNK, PosesOfRobot, Question
from robostiff.analysis.result import Stiffness
from robostiff.compiled import Kernel, Output
from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.errors import InputError, OpenAtHomeError, Words
from robostiff.frozen import frozen, replace
from robostiff.kinematics import (
    ActuatorCoordinates,
    JointCoordinates,
    Pose,
    ToolPose,
    posture_finder,
)
from robostiff.kinematics.pose import Given, check_held_sums, coordinate_units, joint_units
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.model.cable import CableRobot
from robostiff.model.entries import OfSymbols
from robostiff.spatial import as_floats, check_order
from robostiff.spatial.rotation import is_rigid_transform


@frozen
class ParameterValues(Generic[OfSymbols]):
    """Values of the symbols of a robot at N poses."""

    robot: OfSymbols  # with symbols; without any, there is one robot for all poses
    rows: np.ndarray  # (parameters, N): sorted by the names of the parameters

    @classmethod
    def of(
        cls, robot: OfSymbols, given: Mapping[str, ArrayLike] | np.ndarray | None, count: int
    ) -> ParameterValues[OfSymbols]:
        """Given values, one for all poses or one a pose, and nominal ones for the rest.

        Rows (parameters, N) of an array are taken as they are.
        """
        names = [symbol.name for symbol in robot.symbols]
        by_name = {} if isinstance(given, np.ndarray) else given or {}
        for name in by_name:
            if name not in names:
                raise InputError(
                    f"parameter of {robot.name!r}",
                    got=name,
                    expected=", ".join(names) or "none, as it was compiled without parameters",
                    hint=f'write rs.compile(robot, parameters=("{name}",))',
                )
        rows, words = np.empty((len(names), count)), f"a finite number, or {count} of them"
        if isinstance(given, np.ndarray):
            expected = f"floats ({len(names)}, {count}), a row a parameter"
            rows = as_floats("parameters", given, expected, None, rows.shape)
        else:
            for row, name in zip(rows, names, strict=True):
                value = as_floats(
                    f"parameter {name}", by_name.get(name, robot.nominal[name]), words
                )
                if value.shape not in {(), (count,)}:
                    got = Words(f"shape {value.shape}")
                    raise InputError(f"parameter {name}", got=got, expected=words)
                row[:] = value
        error = robot.error_at(rows) if names else None
        if error is not None:
            raise error
        return cls(robot, rows)

    def groups(self, chosen: np.ndarray) -> Iterator[tuple[OfSymbols, np.ndarray]]:
        """A robot of numbers for each set of values among chosen poses, and its poses."""
        where = np.flatnonzero(chosen)
        if not (where.size and len(self.rows)):
            if where.size:
                yield self.robot, where
            return
        values, kinds = np.unique(self.rows[:, where], axis=1, return_inverse=True)
        names = [str(symbol) for symbol in self.robot.symbols]
        for k, own in enumerate(values.T):
            robot = self.robot.substituted(dict(zip(names, own.tolist(), strict=True)))
            yield robot, where[kinds.ravel() == k]


def with_parameters(
    robot: OfSymbols, names: Sequence[str], taken: Sequence[str], loads: str = "load"
) -> OfSymbols:
    """The robot or linkage with symbols for some parameters, and nominal values for the others.

    An `InputError` says where there is no such symbol, it has no nominal value, or its name is
    taken, and which function of rs `loads` such a machine with symbols.
    """
    symbols = [str(symbol) for symbol in robot.symbols]
    if isinstance(names, str):
        raise InputError(
            "parameters to compile", got=names, expected="several names", hint=f"write ({names!r},)"
        )
    for name in names:
        expected, hint = "a name that is no coordinate", "rename it in the model file"
        if name not in symbols:
            expected = f"a symbol: {', '.join(symbols) or 'it has none'}"
            hint = f'write rs.{loads}(..., symbols=("{name}",))'
        if name not in symbols or name in taken:
            raise InputError(f"parameter of {robot.name!r}", got=name, expected=expected, hint=hint)
    if not robot.has_formulas:
        return robot
    in_numbers = robot.numeric  # raises where a nominal value is missing
    if not names:
        return in_numbers
    others = {name: robot.nominal[name] for name in symbols if name not in names}
    return robot.substituted(others)


def checked_outputs(outputs: Sequence[Output]) -> tuple[Output, ...]:
    """Outputs to compile, as they were given.

    Raises InputError when there is none, one is no output, or two have the same name.
    """
    subject, kinds = "outputs to compile", "StiffnessMatrix(), PrincipalStiffness()"
    if not isinstance(outputs, Sequence) or not outputs:
        raise InputError(subject, got=outputs, expected="several", hint=f"write [{kinds}]")
    for output in outputs:
        if isinstance(output, type) or not isinstance(output, Output):
            raise InputError("output to compile", got=output, expected=f"such as {kinds}")
    names = [output.name for output in outputs]
    if len(set(names)) < len(names):
        hint = "compile once for each load case"
        raise InputError(subject, got=names, expected="each name once", hint=hint)
    return tuple(outputs)


# Of the length: legs that miss the platform by more are no matter for a record, which takes for
# granted that they meet it; `stiffness` says where the platform is.
_MET = 1e-12
_OTHERWISE = "rs.stiffness takes poses in other ways, all six coordinates among them"
_FOUND = "find_posture(robot, pose).pose has their coordinates"
_BY_DRIVES = {ActuatorCoordinates: "actuator coordinates", ToolPose: "tool poses"}

#: Rank and status at a general pose, whether the record is verified, the kernel, that of joints,
#: and what decides ranks.
RecordedParts = tuple[int, Status, bool, Kernel, Kernel | None, RecordedRanks | None]


class Recordable(ABC):
    """A machine of which kernels are recorded, and how poses become rows of their inputs."""

    subject: Any  # the machine; its symbols are the parameters of its kernels

    def taken_by(self, kernel: Kernel, joint_kernel: Kernel | None) -> Self:
        """The same for kernels, which may take coordinates of legs."""
        del kernel, joint_kernel
        return self

    def read(self, pose: Any) -> Any:
        """Poses; of an arm given by all its drives the coordinates of its joints."""
        return pose

    @abstractmethod
    def numbers_of(self, pose: Any) -> np.ndarray:
        """The numbers of poses (N, n), or of one pose (n,); not copied where they are floats."""

    @abstractmethod
    def rows(self, pose: Any, given: np.ndarray, values: ParameterValues[Any]) -> InputRows:
        """Rows of inputs, and the poses that are known to be out of reach."""

    def question(
        self, machine: Any, pose: Any, given: np.ndarray, tolerance: Tolerance = DEFAULT_TOLERANCE
    ) -> Question:
        """What is asked of a machine of numbers at some coordinates of the kind of `pose`."""
        raise NotImplementedError

    def direct(self, machine: Any, pose: Any, given: np.ndarray) -> Any:
        """The stiffness of a machine of numbers there, by the direct form."""
        return Stiffness.of(self.question(machine, pose, given))

    @abstractmethod
    def samples(self, seed: int, nearer: int) -> tuple[Any, dict[str, np.ndarray]]:
        """A few poses near home, and values of the parameters there by name (N,).

        Those of the record for seed 0; each whole number of `nearer` takes a fifth of the way.
        """


@frozen
class KernelInputs(Recordable):
    """A robot, and rows that a kernel takes, made from poses."""

    subject: Robot
    joints: int = 0  # how many leg coordinates the kernel takes; 0 where it takes pose coordinates

    def taken_by(self, kernel: Kernel, joint_kernel: Kernel | None) -> KernelInputs:
        """Coordinates of legs are taken by the kernel of joints alone."""
        of_joints = len(kernel.inputs) - len(self.subject.symbols)
        return replace(self, joints=of_joints if kernel is joint_kernel else 0)

    def read(self, pose: Pose) -> Pose:
        """A pose; of an arm that is given by all its drives, the coordinates of its joints."""
        if isinstance(pose, ActuatorCoordinates) and self.subject.is_posed_by_joints:
            request = posture_finder(self.subject.numeric).request(pose)
            return JointCoordinates(request.numbers) if request.by is Given.JOINTS else pose
        return pose

    def question(
        self, machine: Any, pose: Any, given: np.ndarray, tolerance: Tolerance = DEFAULT_TOLERANCE
    ) -> Question:
        """Poses, or joint coordinates."""
        some = JointCoordinates(given) if isinstance(pose, JointCoordinates) else given
        return PosesOfRobot(machine, some, tolerance=tolerance)

    def samples(self, seed: int, nearer: int) -> tuple[Pose, dict[str, np.ndarray]]:
        """Poses of the platform, or the joint coordinates of an arm."""
        from robostiff.recorded import parameter_samples, sample_postures

        posture = sample_postures(posture_finder(self.subject.numeric), seed or None, nearer)
        samples = parameter_samples(self.subject, seed or None)
        if self.subject.is_posed_by_joints:
            return JointCoordinates(posture.coordinates[0]), samples
        return posture.pose[:, self.subject.coordinate_places], samples

    def numbers_of(self, pose: Pose) -> np.ndarray:
        """The numbers of poses (N, n), or of one pose (n,)."""
        robot, chain = self.subject, self.subject.legs[0].chain
        # A chain without joints has no coordinates, (N, 0).
        takes_joints = self.joints > 0 or not chain.size
        if not (isinstance(pose, JointCoordinates) and robot.is_serial and takes_joints):
            # nothing but joint coordinates poses a serial arm
            needs_joints = robot.is_posed_by_joints and chain.size > 0
            return numbers_of_poses(robot, pose, self.joints if needs_joints else 0)
        expected = f"joint coordinates (N, {self.joints}), one pose a row"
        order, units = chain.coordinate_names, joint_units(chain)
        given = _rows(f"poses of {robot.name!r}", pose.values, expected, order, units, self.joints)
        check_held_sums(robot, given)
        return given

    def rows(self, pose: Pose, given: np.ndarray, values: ParameterValues[Robot]) -> InputRows:
        """Rows of inputs, and the poses that are known to be out of reach."""
        missed, loose = np.zeros((2, len(given)), dtype=bool)
        by_joints = isinstance(pose, JointCoordinates)
        # A record takes for granted that loops are closed, which given coordinates may leave open.
        loops = any(leg.chain.has_blocks for leg in self.subject.legs)
        if not self.joints or (by_joints and not loops):
            rows = given.T
        else:
            rows = np.empty((self.joints, len(given)))
            for robot, group in values.groups(~missed):
                finder = posture_finder(robot)
                for start in range(0, len(group), CHUNK):
                    own = group[start : start + CHUNK]
                    wanted = JointCoordinates(given[own]) if by_joints else given[own]
                    try:
                        posture = finder.find(wanted)
                    except OpenAtHomeError:
                        rows[:, own], missed[own] = 0.0, True
                        continue
                    rows[:, own] = np.concatenate([q.T for q in posture.coordinates])
                    missed[own] = ~posture.reached
                    loose[own] = posture.reached & (posture.undetermined | ~posture.meets(_MET))
        if len(values.rows):
            rows = np.concatenate([rows, values.rows])
        return InputRows(rows, missed, loose)


def numbers_of_poses(robot: Robot | CableRobot, pose: Pose, joints: int = 0) -> np.ndarray:
    """Free coordinates of poses (N, n), or of one pose (n,); not copied where they are floats.

    An `InputError` says what else is expected: of a robot without free coordinates those of its
    `joints`, where it has any.
    """
    names = [coordinate.value for coordinate in robot.coordinates]
    expected = f"an array (N, {len(names)}): {' '.join(names)}, one pose a row"
    if not names:
        expected = "an array (N, 0): a structure has one pose"
        expected = f"JointCoordinates of an array (N, {joints})" if joints else expected
    subject = f"poses of {robot.name!r}"
    kinds = {**_BY_DRIVES, JointCoordinates: "joint coordinates", type(None): "none"}
    got = "a rigid transform" if is_rigid_transform(pose) else kinds.get(type(pose))
    if got:
        hint = _FOUND if type(pose) in _BY_DRIVES else _OTHERWISE
        raise InputError(subject, got=Words(got), expected=expected, hint=hint)
    count = len(names) or (-1 if joints else 0)
    units = coordinate_units(cast("Robot", robot))
    return _rows(subject, pose, expected, names, units, count)


def _rows(
    subject: str, numbers: Any, expected: str, order: Sequence[str], units: Any, count: int
) -> np.ndarray:
    check_order(subject, numbers, order)
    given = as_floats(subject, numbers, expected, units, copy=False)
    if given.ndim not in (1, 2) or given.shape[-1] != count:
        got = Words(f"shape {given.shape}")
        raise InputError(subject, got=got, expected=expected, hint=_OTHERWISE)
    return given


@singledispatch
def recordable(machine: Any, parameters: Sequence[str], joints: Sequence[str] | None) -> Recordable:
    """A machine as it is recorded, with symbols for some parameters, driven by some joints."""
    del parameters, joints
    raise InputError(
        "robot to compile",
        got=type(machine).__name__,
        expected="a Robot, a Linkage or a CableRobot; a snapshot or network has one pose",
    )


@recordable.register
def _(robot: Robot, parameters: Sequence[str], joints: Sequence[str] | None) -> KernelInputs:
    if joints is not None:
        raise InputError(
            f"driven joints of {robot.name!r}",
            got=joints,
            expected="none: a robot with legs takes poses",
        )
    robot.check_has_no_springs("kernel")
    robot = with_parameters(robot, parameters, [c.value for c in ALL_COORDINATES])
    # Coordinates that leave the plane of a planar robot are those of home.
    inside = [ALL_COORDINATES[row] for row in robot.space.rows]
    own = tuple(c for c in robot.coordinates if c in inside)
    return KernelInputs(robot if own == robot.coordinates else replace(robot, coordinates=own))
