"""Stiffness of networks, and of linkages at values of their driven joints."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from robostiff.analysis.careful_form import check_is_default
from robostiff.analysis.measures import differences
from robostiff.analysis.result import RobotStiffness, StructuralAnalysis
from robostiff.analysis.robot_record import Costs, KeptRecord, RecordedAnswer
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD
from robostiff.elastostatics import (
    DEFAULT_TOLERANCE,
    CartesianStiffness,
    Form,
    Status,
    Tolerance,
)
from robostiff.errors import InputError, NoAnswerError
from robostiff.kept import kept
from robostiff.kinematics import ActuatorCoordinates
from robostiff.kinematics.pose import six_coordinates
from robostiff.linkage import Configuration, DrivenLinkage, Linkage
from robostiff.linkage.closure import as_rounded
from robostiff.linkage.essential import network_of
from robostiff.model import Joint
from robostiff.network import Network, compliance_between, condense
from robostiff.spatial import Space, as_floats


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
    solved, compliance = condense(network, tolerance), None
    whole, tool = solved.whole, (network.platform, solved.origin)
    if Status.RIGID_DIRECTION in whole.status and int(whole.rank) == whole.space.size:
        with suppress(NoAnswerError):  # there is no K to invert
            compliance = compliance_between(network, [tool], tolerance=tolerance)
    return RobotStiffness(
        name=network.name,
        pose=None,
        reference_point=network.reference_point,
        about_reference=whole,
        legs=(),
        passive_joint_names=solved.freedom_names,
        method=StructuralAnalysis(),
        complaints=(),
        serial_compliance=compliance,
        origin=solved.origin,
    )


#: What a difference between the two is between.
SUBJECT = "the record of a linkage and its network"
# Of the largest size: what rounding of a network leaves of zero, with all its wrenches at once.
FREE = 1e-4
# Recording takes as long as some 30 networks (double pantograph: 28), and machine code as long to
# make as NumPy at some 10^5 poses.
_COSTS = Costs(a_call=0, pays=40, machine_code_pays=2**17)


class DrivenBy:
    """What a linkage keeps of one choice of driven joints: its closed home, and its record."""

    def __init__(self, linkage: Linkage, joints: tuple[str, ...] | None) -> None:
        self.driven = DrivenLinkage.moved_by(linkage, joints)
        self.record = KeptRecord(self._compiled, _COSTS)

    def _compiled(self) -> Any:
        from robostiff.analysis.compiled_linkage import compile_driven
        from robostiff.compiled import Backend

        if not (self.driven.drives and self.driven.home.is_closed):
            return None
        return compile_driven(self.driven, backend=Backend.ARRAYS)


@kept
def driven_by(linkage: Linkage, joints: tuple[str, ...] | None) -> DrivenBy:
    """What a linkage keeps of the joints that drive it."""
    return DrivenBy(linkage, joints)


@dataclass(frozen=True)
class AskedConfigurations:
    """Configurations of a linkage, and the tolerance with which its stiffness is wanted."""

    by: DrivenBy
    given: np.ndarray  # (..., n): coordinates of the drives [m, rad]
    tolerance: Tolerance = DEFAULT_TOLERANCE
    method: ClassVar = StructuralAnalysis()
    space: ClassVar = Space.SPATIAL
    opinions: ClassVar = SUBJECT
    free: ClassVar = FREE

    @classmethod
    def of(
        cls,
        linkage: Linkage,
        values: Any = None,
        tolerance: Tolerance = DEFAULT_TOLERANCE,
        method: Form = DEFAULT_METHOD,
    ) -> AskedConfigurations:
        """Values as `stiffness` takes them: of joints by name, of all actuated ones, or home.

        Raises InputError when they do not fit the joints, or a form of K_C is asked for.
        """
        check_is_default(method, "linkage", linkage.name)
        values = values.values if isinstance(values, ActuatorCoordinates) else values
        values = {} if values is None else values
        if not isinstance(values, Mapping):
            moved = driven_by(linkage, None)
            if not moved.driven.drives:
                raise InputError(
                    f"values of linkage {linkage.name!r}",
                    got=values,
                    expected="values of joints by their names: it has no actuated joint",
                    hint='write {"crank": 0.1}',
                )
            return cls(moved, moved.driven.rows(values), tolerance)
        moved = driven_by(linkage, tuple(values))
        drives = moved.driven.drives
        rows = moved.driven.rows({name: values[name] for name in drives})
        others = [j for j in linkage.joints if j.name in values and j.name not in drives]
        batch = np.broadcast_shapes(rows.shape[:-1], *(_batch(j, values[j.name]) for j in others))
        return cls(moved, np.broadcast_to(rows, (*batch, rows.shape[-1])), tolerance)

    @property
    def name(self) -> str:
        """Of the linkage."""
        return self.by.driven.part.name

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch, () for one configuration."""
        return self.given.shape[:-1]

    @property
    def numbers(self) -> np.ndarray:
        """Coordinates of the drives (N, n), one configuration a row."""
        return self.given.reshape(int(np.prod(self.batch, dtype=int)), self.given.shape[-1])

    def pose_at(self, rows: np.ndarray) -> None:
        """None: the pose of the platform follows from the loops."""

    def reference_points(self, rows: np.ndarray) -> np.ndarray:
        """Of the platform in the world (..., 3) [m]."""
        part = self.by.driven.part
        frames = [found.frames[part.platform] for found in self._at(rows)]
        points = [frame.p + frame.R @ part.reference_point for frame in frames]
        return np.array(points).reshape(*rows.shape, 3)

    def solved(self, rows: np.ndarray) -> RobotStiffness:
        """As networks at some of the configurations, with the shape of the rows."""
        flat = rows.reshape(-1)
        found = linkage_stiffness(self.by.driven, self.numbers[flat], self.tolerance)
        return found if rows.ndim == 1 else found[np.arange(flat.size).reshape(rows.shape)]

    def complaints(self, rows: np.ndarray, status: Status) -> tuple[str, ...]:
        """Why a single configuration is out of reach."""
        if rows.shape or not status & Status.UNREACHABLE:
            return ()
        (found,) = self._at(rows)
        return (f"its loops do not close: {found.complaint}; {found.advice}",)

    def placed(self, row: np.ndarray) -> Network:
        """The network of one configuration."""
        (found,) = self._at(row)
        return network_of(self.by.driven.part, found)

    def recorded(self) -> RecordedAnswer | None:
        """What the record gives; None where there is none, or it does not pay yet."""
        if not self.given.size or self.tolerance != DEFAULT_TOLERANCE:
            return None
        compiled = self.by.record.for_poses(len(self.numbers))
        if compiled is None:
            return None
        return RecordedAnswer.of(compiled.evaluate(self.numbers)).reshaped(self.batch)

    def _at(self, rows: np.ndarray) -> list[Configuration]:
        return self.by.driven.at(self.numbers[rows.reshape(-1)])


def _batch(joint: Joint, value: Any) -> tuple[int, ...]:
    """Shape of a batch of coordinates of a joint that the platform does not feel."""
    words = "finite numbers" if joint.size == 1 else f"finite numbers (..., {joint.size})"
    units = [screw.unit for screw in joint.freedoms]
    numbers = as_floats(
        f"coordinates of {joint.name!r}", value, words, units if joint.size > 1 else units[0]
    )
    if joint.size > 1 and numbers.shape[-1:] != (joint.size,):
        raise InputError(f"coordinates of {joint.name!r}", got=value, expected=words)
    return numbers.shape if joint.size == 1 else numbers.shape[:-1]


def linkage_stiffness(
    driven: DrivenLinkage, rows: np.ndarray, tolerance: Tolerance = DEFAULT_TOLERANCE
) -> RobotStiffness:
    """Stiffness as networks at coordinates of the drives (N, n), a batch of N poses.

    Where the loops do not close, or close in another assembly mode only, the status says that the
    pose is out of reach.
    """
    part, found = driven.part, driven.at(rows)
    networks = [network_of(part, one) for one in found]
    solved: list[RobotStiffness | None] = []
    reasons, lost = [], np.zeros(len(found), dtype=np.uint16)
    for i, (one, network) in enumerate(zip(found, networks, strict=True)):
        own = None
        lost[i] = int(Status.UNREACHABLE)
        if one.is_closed:
            try:
                own = network_stiffness(network, tolerance)
                lost[i] = _lost_digits(driven, one, own)
            except NoAnswerError as error:
                lost[i] = int(Status.FORM_DOES_NOT_HOLD | Status.ILL_CONDITIONED)
                reasons.append(str(error))
        solved.append(own)
    known = [own for own in solved if own is not None]
    names = known[0].passive_joint_names if known else ()
    wholes = [
        _without_answer(len(names), driven.home.length, int(status), tolerance)
        if own is None
        else replace(own.about_reference, status_codes=own.status_codes | status).reshaped((1,))
        for own, status in zip(solved, lost, strict=True)
    ]
    points = np.array([network.reference_point for network in networks]).reshape(-1, 3)
    frames = [one.frames[part.platform] for one in found]
    pose = [six_coordinates(frame.R, frame.p) for frame in frames]
    origins = [p if own is None else own.origin for p, own in zip(points, solved, strict=True)]
    nothing = _without_answer(0, driven.home.length, 0, tolerance)
    compliance = None
    if any(own is not None and own.serial_compliance is not None for own in solved):
        compliance = np.full((len(solved), 6, 6), np.nan)
        for C, own in zip(compliance, solved, strict=True):
            if own is not None:
                serial = own.serial_compliance
                C[...] = own.about_reference.compliance if serial is None else serial
    return RobotStiffness(
        name=part.name,
        pose=np.array(pose).reshape(-1, 6),
        reference_point=points,
        about_reference=CartesianStiffness.joined(wholes) if wholes else nothing[:0],
        legs=(),
        passive_joint_names=names,
        method=StructuralAnalysis(),
        complaints=tuple(dict.fromkeys(reasons)),
        serial_compliance=compliance,
        origin=np.array(origins).reshape(-1, 3),
        joint_coordinates={
            joint.name: np.array([one.coordinates[joint.name] for one in found])
            for joint in part.joints
            if found
        },
    )


def _lost_digits(driven: DrivenLinkage, found: Configuration, own: RobotStiffness) -> int:
    """``ILL_CONDITIONED`` where loops near a singular configuration leave K too few digits."""
    near = as_rounded(driven.part, found, frozenset(driven.drives))
    if near is found:
        return 0
    other = network_stiffness(network_of(driven.part, near), own.about_reference.tolerance)
    other = other.about(own.reference_point)
    rank, codes = np.atleast_1d(other.rank), np.atleast_1d(other.status_codes)
    free = 0.0 if int(own.rank) == own.space.size else FREE  # what is soft is not free
    differ = any(differences(other.matrix[None], rank, codes, own, free=free))
    return int(Status.ILL_CONDITIONED) if differ else 0


def _without_answer(
    freedoms: int, length: float, status: int, tolerance: Tolerance
) -> CartesianStiffness:
    """The place of a configuration that has none, a batch of one."""
    return CartesianStiffness(
        matrix=np.zeros((1, 6, 6)),
        status_codes=np.array([status], dtype=np.uint16),
        rank=np.zeros(1, dtype=int),
        held=np.zeros((1, 6, 0)),
        redundant=np.zeros((1, freedoms), dtype=bool),
        length=np.array([length]),
        rigid=np.zeros((1, 6, 0)),
        tolerance=tolerance,
    )
