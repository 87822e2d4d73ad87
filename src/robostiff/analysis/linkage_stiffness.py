"""Stiffness of networks, and of linkages at values of their driven joints; records of linkages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from robostiff.analysis.compiled_answer import InputRows
from robostiff.analysis.kernel_inputs import (
    ParameterValues,
    Recordable,
    RecordedParts,
    recordable,
    with_parameters,
)
from robostiff.analysis.questions import (
    OwnPose,
    Question,
    StructuralAnalysis,
    differences,
    question_of,
)
from robostiff.analysis.recording import check_derivatives, is_trusted, recorded_parts
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD, solve_snapshot
from robostiff.compiled import Backend, Output, kernel_of
from robostiff.elastostatics import DEFAULT_TOLERANCE, Details, Form, Status, Tolerance
from robostiff.errors import DisagreementError, InputError, NoAnswerError, Words
from robostiff.frozen import frozen, replace
from robostiff.kinematics import ActuatorCoordinates, Near
from robostiff.kinematics.pose import check_is_not_posed, six_coordinates
from robostiff.linkage import Configuration, DrivenLinkage, DriveValues, Linkage
from robostiff.linkage.driven import driven_by
from robostiff.linkage.essential import branches_of_linkage, network_of
from robostiff.linkage.record import record_linkage
from robostiff.network import Network, condense
from robostiff.spatial import Space, as_floats

#: How often configurations are drawn nearer to home.
_NEARER = 4


class PoseOfNetwork(OwnPose):
    """A network, solved as a whole."""

    has_legs: ClassVar[bool] = False


@question_of.register
def _(machine: Network, pose: Any, method: Form, near: Near, tolerance: Tolerance) -> Question:
    del method, near
    check_is_not_posed(machine, pose)
    return PoseOfNetwork(machine, StructuralAnalysis(), tolerance, condense(machine, tolerance))


class ConfigurationsOfLinkage(Question):
    """Configurations of a linkage at coordinates of its drives (..., n) [m, rad]."""

    driven: DrivenLinkage
    has_legs: ClassVar[bool] = False
    opinions: ClassVar[str] = "the record of a linkage and the wrench basis form"
    free: ClassVar[float] = 1e-4  # what rounding leaves of zero, with all wrenches at once
    # Some 340 configurations of a batch, or 20 calls (double pantograph), and 10^5 poses.
    pays: ClassVar[tuple[int, int, int]] = 17, 340, 2**17

    def __init__(
        self, driven: DrivenLinkage, given: np.ndarray, tolerance: Tolerance = DEFAULT_TOLERANCE
    ) -> None:
        name, batch = driven.part.name, given.shape[:-1]
        super().__init__(name, Space.SPATIAL, DEFAULT_METHOD, tolerance, batch, given)
        self.driven = driven
        self.asked: tuple[Any, ...] = (driven.part, given)

    def reference_points(self, rows: np.ndarray) -> np.ndarray:
        """Of the platform in the world (..., 3) [m]."""
        part = self.driven.part
        places = [found.places[part.platform] for found in self._at(rows)]
        points = [p + R @ part.reference_point for R, p in places]
        return np.array(points).reshape(*rows.shape, 3)

    def complaints(self, rows: np.ndarray, status: Status) -> tuple[str, ...]:
        """Why a single configuration is out of reach."""
        if rows.shape or not status & Status.UNREACHABLE:
            return ()
        (found,) = self._at(rows)
        return (f"its loops do not close: {found.complaint}; {found.advice}",)

    def placed(self, row: np.ndarray) -> Network:
        """The network of one configuration."""
        (found,) = self._at(row)
        return network_of(self.driven.part, found)

    def recordable(self) -> tuple[Any, np.ndarray] | None:
        """The driven linkage and coordinates of its drives."""
        if not self.numbers.size or self.tolerance != DEFAULT_TOLERANCE:
            return None
        return self.driven, self.numbers

    def _at(self, rows: np.ndarray) -> list[Configuration]:
        return self.driven.at(self.numbers[rows.reshape(-1)])

    def direct_answer(self, rows: np.ndarray) -> Details:
        """What series paths between the bodies give at N of the configurations.

        Where the loops do not close, or close in another assembly mode only, the status says that
        the configuration is out of reach.
        """
        part, every = self.driven.part, self._at(rows) or [self.driven.home]
        found = self._of_branches(every)
        closed, n = np.array([one.is_closed for one in every], dtype=bool), len(every)
        lost = self._lost_digits(every, found) * np.uint16(Status.ILL_CONDITIONED)
        status = np.where(closed, found.status_codes | lost, np.uint16(Status.UNREACHABLE))
        R, p = map(np.array, zip(*(one.places[part.platform] for one in every), strict=True))
        whole = replace(
            found,
            status_codes=np.asarray(status, dtype=np.uint16),
            rank=np.where(closed, found.rank, -1),
            pose=six_coordinates(R, p),
            joint_coordinates={
                own.name: np.reshape([one.coordinates[own.name] for one in every], (n, own.size))
                for own in part.joints
            },
        )
        return whole[: rows.size]

    def _of_branches(self, every: Sequence[Configuration]) -> Details:
        """The details at N configurations, by series paths between bodies."""
        snapshot, ends = branches_of_linkage(self.driven.part, every)
        found = solve_snapshot(snapshot, DEFAULT_METHOD, self.tolerance, ends)
        names = tuple(name.partition("/")[2] for name in found.passive_joint_names)
        return replace(found, legs=(), leg_blocks=(), shares=None, passive_joint_names=names)

    def _lost_digits(self, every: Sequence[Configuration], found: Details) -> np.ndarray:
        """Where loops near a singular configuration leave K too few digits (N,)."""
        closed = [i for i, one in enumerate(every) if one.is_closed]
        near = self.driven.after_rounding([every[i] for i in closed])
        moved, lost = [closed[k] for k in near], np.zeros(len(every), dtype=bool)
        if not moved:
            return lost
        here, there = found[moved], self._of_branches([*near.values()])
        there = replace(there, reference_point=here.reference_point)
        for k, i in enumerate(moved):  # what is soft is not free
            free = 0.0 if int(here.rank[k]) == self.space.size else self.free
            one = there[[k]]
            apart = differences(here[[k]], one.status_codes, one.rank, one.at_reference, free)
            lost[i] = bool(apart)
        return lost


@question_of.register
def _(machine: Linkage, pose: Any, method: Form, near: Near, tolerance: Tolerance) -> Question:
    """At values of joints by name, of all actuated ones, or home."""
    del method, near
    values = pose.values if isinstance(pose, ActuatorCoordinates) else pose
    values = {} if values is None else values
    if not isinstance(values, Mapping):
        driven = driven_by(machine.in_floats, None)
        if not driven.drives:
            raise InputError(
                f"values of linkage {machine.name!r}",
                got=values,
                expected="values of joints by their names: it has no actuated joint",
                hint='write {"crank": 0.1}',
            )
        return ConfigurationsOfLinkage(driven, driven.rows(values), tolerance)
    driven = driven_by(machine.in_floats, tuple(values))
    drives = driven.drives
    rows = driven.rows({name: values[name] for name in drives})
    others = [j for j in machine.joints if j.name in values and j.name not in drives]
    batch = rows.shape[:-1]
    for joint in others:  # the platform does not feel these
        subject, value = f"coordinates of {joint.name!r}", values[joint.name]
        units = [screw.unit for screw in joint.freedoms]
        words = "finite numbers" if joint.size == 1 else f"finite numbers (..., {joint.size})"
        numbers = as_floats(subject, value, words, units if joint.size > 1 else units[0])
        if joint.size > 1 and numbers.shape[-1:] != (joint.size,):
            raise InputError(subject, got=value, expected=words)
        own = numbers.shape if joint.size == 1 else numbers.shape[:-1]
        batch = np.broadcast_shapes(batch, own)
    return ConfigurationsOfLinkage(
        driven, np.broadcast_to(rows, (*batch, rows.shape[-1])), tolerance
    )


@frozen
class LinkageInputs(Recordable):
    """A linkage that some joints drive; its kernel takes their coordinates.

    Wrenches that circulate in its loops are eliminated by the passive joints, and K follows from
    the energy of the rest.
    """

    driven: DrivenLinkage

    @property
    def subject(self) -> Linkage:
        """The part between base and platform; its symbols are the parameters."""
        return self.driven.part

    def numbers_of(self, pose: DriveValues) -> np.ndarray:
        """Coordinates of the drives (N, n), or of one pose (n,)."""
        driven, rows = self.driven, self.driven.rows(pose)
        if rows.ndim == 3 and rows.shape[1] == 1:  # a column (N, 1) of a joint with one coordinate
            rows = rows[:, 0]
        if rows.ndim not in (1, 2):
            n = len(driven.inputs)
            raise InputError(
                f"driven joints of {driven.part.name!r}",
                got=Words(f"shape {rows.shape[:-1]} of poses"),
                expected=f"numbers (N,) of each joint, or an array (N, {n}), one pose a row",
            )
        return rows

    def rows(
        self, pose: DriveValues, given: np.ndarray, values: ParameterValues[Linkage]
    ) -> InputRows:
        """Rows of inputs; steps from home do not count the turns of screws."""
        inputs = np.concatenate([given.T, values.rows]) if len(values.rows) else given.T
        return InputRows(inputs, np.zeros(len(given), dtype=bool), self.driven.turned_far(given))

    def question(
        self, machine: Any, pose: Any, given: np.ndarray, tolerance: Tolerance = DEFAULT_TOLERANCE
    ) -> Question:
        """Configurations at coordinates of the drives."""
        del pose
        return ConfigurationsOfLinkage(replace(self.driven, part=machine), given, tolerance)

    def samples(self, seed: int, nearer: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Configurations near home.

        Loops are closed at home once for all configurations, which share the parameters.
        """
        from robostiff.recorded import parameter_samples

        given = np.array([self.driven.given_in(one) for one in self.driven.samples(seed, nearer)])
        samples = parameter_samples(self.subject)
        return given, {name: values[int(seed > 0)] for name, values in samples.items()}


@recordable.register
def _(linkage: Linkage, parameters: Sequence[str], joints: Sequence[str] | None) -> LinkageInputs:
    names = [name for own in linkage.connections for name in own.coordinate_names]
    own = with_parameters(linkage, parameters, names, "load_linkage")
    return LinkageInputs(DrivenLinkage.of(own, joints))


@recordable.register
def _(driven: DrivenLinkage, parameters: Sequence[str], joints: Any) -> LinkageInputs:
    del parameters, joints
    if not driven.home.is_closed:
        raise NoAnswerError(f"no record of {driven.part.name!r}: its loops are open at home")
    return LinkageInputs(driven)


@recorded_parts.register
def _(
    taken: LinkageInputs, outputs: tuple[Output, ...], backend: Backend, most: int | None
) -> RecordedParts:
    # At samples as near to home as its surroundings are regular.
    del most
    driven, name = taken.driven, taken.subject.name
    otherwise = "network_at(linkage, ...) pose by pose"
    recorded, undetermined, nearer = None, (), 0
    for nearer in range(_NEARER):
        recorded, undetermined = record_linkage(driven, driven.samples(nearer=nearer))
        if recorded is not None or undetermined:
            break
    wrong = InputError(
        f"driven joints of {name!r}",
        got=Words(
            f"{', '.join(driven.drives)}, which leave {', '.join(undetermined)} undetermined"
        ),
        expected="joints that decide the configuration",
        hint=f"add them, joints=(...), or use {otherwise}",
    )
    if recorded is None:
        if undetermined:
            raise wrong
        raise InputError(
            f"home of {name!r}",
            got=Words("a configuration in which assembly modes meet"),
            expected="a regular home for a kernel",
            hint=f"give another home, or use {otherwise}",
        )
    check_derivatives(name, recorded, outputs)
    kernel = kernel_of(recorded, outputs, backend)
    try:
        verified = is_trusted(recorded, kernel, taken, nearer)
    except DisagreementError:
        if undetermined:
            raise wrong from None
        raise
    return recorded.factors.rank, recorded.status, verified, kernel, None, None
