"""Stiffness of networks, and of linkages at values of their driven joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from robostiff.analysis.details import Details, Matrices, Question, StructuralAnalysis
from robostiff.analysis.robot_record import Costs, KeptRecord
from robostiff.elastostatics import (
    DEFAULT_TOLERANCE,
    CartesianStiffness,
    ConjugateWrenches,
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
from robostiff.linkage.linkage import driven_by
from robostiff.model import Joint
from robostiff.network import Network, condense
from robostiff.spatial import Space, as_floats

if TYPE_CHECKING:
    from robostiff.analysis.compiled_stiffness import CompiledStiffness


def network_details(network: Network, tolerance: Tolerance) -> Details:
    """Stiffness of the platform of a network.

    Examples
    --------
    >>> import numpy as np
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02))
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> int(network_details(network, Tolerance()).whole.rank)
    6
    """
    solved = condense(network, tolerance)
    return Details(
        whole=solved.whole,
        origin=solved.origin,
        reference_point=network.reference_point,
        passive_joint_names=solved.freedom_names,
    )


# Recording takes as long as some 30 networks (double pantograph: 28), and machine code as long to
# make as NumPy at some 10^5 poses.
_COSTS = Costs(a_call=0, pays=40, machine_code_pays=2**17)


@kept
def record_of_linkage(linkage: Linkage, joints: tuple[str, ...] | None) -> KeptRecord:
    """The record of a linkage that some joints drive, made once it pays."""
    return KeptRecord(partial(_compiled, driven_by(linkage, joints)), _COSTS)


def _compiled(driven: DrivenLinkage) -> CompiledStiffness | None:
    from robostiff.analysis.compiled_stiffness import compile_linkage
    from robostiff.compiled import Backend

    if not (driven.drives and driven.home.is_closed):
        return None
    return compile_linkage(driven, backend=Backend.ARRAYS)


class ConfigurationsOfLinkage(Question):
    """Configurations of a linkage at values of its driven joints.

    Parameters
    ----------
    driven : DrivenLinkage
    given : (..., n) array
        Coordinates of the drives [m, rad].
    tolerance : Tolerance
    record : KeptRecord or None
    """

    driven: DrivenLinkage
    record: KeptRecord | None
    numbers: np.ndarray
    opinions: ClassVar[str] = "the record of a linkage and its network"
    free: ClassVar[float] = 1e-4  # what rounding leaves of zero, with all wrenches at once

    def __init__(
        self,
        driven: DrivenLinkage,
        given: np.ndarray,
        tolerance: Tolerance = DEFAULT_TOLERANCE,
        record: KeptRecord | None = None,
    ) -> None:
        name, batch = driven.part.name, given.shape[:-1]
        super().__init__(name, Space.SPATIAL, StructuralAnalysis(), tolerance, batch)
        self.driven, self.record = driven, record
        # (N, n): one configuration a row
        self.numbers = given.reshape(self.rows.size, given.shape[-1])

    @classmethod
    def of(
        cls, linkage: Linkage, values: Any = None, tolerance: Tolerance = DEFAULT_TOLERANCE
    ) -> ConfigurationsOfLinkage:
        """Values as `stiffness` takes them: of joints by name, of all actuated ones, or home.

        Raises InputError when they do not fit the joints.
        """
        values = values.values if isinstance(values, ActuatorCoordinates) else values
        values = {} if values is None else values
        if not isinstance(values, Mapping):
            driven = driven_by(linkage, None)
            if not driven.drives:
                raise InputError(
                    f"values of linkage {linkage.name!r}",
                    got=values,
                    expected="values of joints by their names: it has no actuated joint",
                    hint='write {"crank": 0.1}',
                )
            return cls(driven, driven.rows(values), tolerance, record_of_linkage(linkage, None))
        driven = driven_by(linkage, tuple(values))
        drives, record = driven.drives, record_of_linkage(linkage, tuple(values))
        rows = driven.rows({name: values[name] for name in drives})
        others = [j for j in linkage.joints if j.name in values and j.name not in drives]
        batch = np.broadcast_shapes(rows.shape[:-1], *(_batch(j, values[j.name]) for j in others))
        return cls(driven, np.broadcast_to(rows, (*batch, rows.shape[-1])), tolerance, record)

    def place(self, row: int) -> list[float]:
        """Coordinates of the drives of one configuration [m, rad]."""
        return self.numbers[row].tolist()

    def reference_points(self, rows: np.ndarray) -> np.ndarray:
        """Of the platform in the world (..., 3) [m]."""
        part = self.driven.part
        frames = [found.frames[part.platform] for found in self._at(rows)]
        points = [frame.p + frame.R @ part.reference_point for frame in frames]
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

    def from_record(self) -> Matrices | None:
        """What the record gives; None where there is none, or it does not pay yet."""
        if self.record is None or not self.numbers.size or self.tolerance != DEFAULT_TOLERANCE:
            return None
        answer = self.record.answer(self.numbers)
        return None if answer is None else answer.reshaped(self.rows.shape)

    def _at(self, rows: np.ndarray) -> list[Configuration]:
        return self.driven.at(self.numbers[rows.reshape(-1)])

    def solved(self, rows: np.ndarray) -> Details:
        """As networks at N of the configurations.

        Where the loops do not close, or close in another assembly mode only, the status says that
        the configuration is out of reach.
        """
        driven, part = self.driven, self.driven.part
        names: tuple[str, ...] = ()
        found, reasons = [], []
        for one in self._at(rows) or [driven.home]:
            network, lost = network_of(part, one), int(Status.UNREACHABLE)
            point, frame = network.reference_point, one.frames[part.platform]
            own = Details(_without_answer(driven.home.length, self.tolerance), point, point, ())
            if one.is_closed:
                try:
                    own = network_details(network, self.tolerance)
                    lost = self._lost_digits(one, own)
                except NoAnswerError as error:
                    lost = int(Status.FORM_DOES_NOT_HOLD | Status.ILL_CONDITIONED)
                    reasons.append(str(error))
            names = own.passive_joint_names or names
            at_one = replace(
                own,
                passive_joint_names=(),
                whole=replace(own.whole, status_codes=own.whole.status_codes | np.uint16(lost)),
                pose=six_coordinates(frame.R, frame.p),
                joint_coordinates={
                    joint.name: np.asarray(one.coordinates[joint.name]) for joint in part.joints
                },
            )
            found.append(at_one.reshaped((1,)))
        whole = replace(
            Details.joined(found),
            passive_joint_names=names,
            reasons=tuple(dict.fromkeys(reasons)),
        )
        return whole[: rows.size]

    def _lost_digits(self, found: Configuration, own: Details) -> int:
        """``ILL_CONDITIONED`` where loops near a singular configuration leave K too few digits."""
        part = self.driven.part
        near = as_rounded(part, found, frozenset(self.driven.drives))
        if near is found:
            return 0
        other = network_details(network_of(part, near), self.tolerance)
        K = other.whole.moved(own.reference_point - other.origin)
        moved = Matrices(K, other.matrices.rank, other.whole.status_codes)
        full = int(own.whole.rank) == self.space.size  # what is soft is not free
        differ = moved[None].differences(own[None], 0.0 if full else self.free)
        return int(Status.ILL_CONDITIONED) if differ else 0


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


def _without_answer(length: float, tolerance: Tolerance) -> CartesianStiffness:
    """In place of a configuration that has none."""
    none = np.zeros((6, 0))
    return CartesianStiffness(
        matrix=np.zeros((6, 6)),
        status_codes=np.array(0, dtype=np.uint16),
        rank=np.array(0),
        held=none,
        redundant=np.zeros(0, dtype=bool),
        length=np.array(length),
        rigid=none,
        tolerance=tolerance,
        carried=ConjugateWrenches.none(6),
    )
