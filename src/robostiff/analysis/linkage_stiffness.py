"""Stiffness of networks, and of linkages at values of their driven joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from robostiff.analysis.details import Details, Question
from robostiff.analysis.robot_record import KeptRecord
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD, solve_snapshot
from robostiff.elastostatics import DEFAULT_TOLERANCE, Status, Tolerance
from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics import ActuatorCoordinates
from robostiff.kinematics.pose import six_coordinates
from robostiff.linkage import Configuration, DrivenLinkage, Linkage
from robostiff.linkage.closure import as_rounded
from robostiff.linkage.driven import driven_by
from robostiff.linkage.essential import branches_of_linkage, network_of
from robostiff.model import Joint
from robostiff.network import Network, condense
from robostiff.spatial import Space, as_floats

if TYPE_CHECKING:
    from robostiff.analysis.compiled_answer import CompiledAnswer
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


# Recording takes as long as the direct form at some 340 configurations of a batch, or in 20 calls
# (double pantograph), and machine code as long to make as NumPy at some 10^5 poses.
_COSTS = 17, 340, 2**17


@kept
def record_of_linkage(linkage: Linkage, joints: tuple[str, ...] | None) -> KeptRecord:
    """The record of a linkage that some joints drive, made once it pays."""
    return KeptRecord(partial(_compiled, driven_by(linkage, joints)), *_COSTS)


def _compiled(driven: DrivenLinkage, may_record: bool) -> CompiledStiffness | None:
    from robostiff.analysis.compiled_stiffness import compile_linkage
    from robostiff.compiled import Backend

    if not (may_record and driven.drives and driven.home.is_closed):
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
    opinions: ClassVar[str] = "the record of a linkage and the wrench basis form"
    free: ClassVar[float] = 1e-4  # what rounding leaves of zero, with all wrenches at once

    def __init__(
        self,
        driven: DrivenLinkage,
        given: np.ndarray,
        tolerance: Tolerance = DEFAULT_TOLERANCE,
        record: KeptRecord | None = None,
    ) -> None:
        name, batch = driven.part.name, given.shape[:-1]
        super().__init__(name, Space.SPATIAL, DEFAULT_METHOD, tolerance, batch)
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

    def from_record(self) -> CompiledAnswer | None:
        """What the record gives; None where there is none, or it does not pay yet."""
        if self.record is None or not self.numbers.size or self.tolerance != DEFAULT_TOLERANCE:
            return None
        answer = self.record.answer(self.numbers)
        return None if answer is None else answer.reshaped(self.rows.shape)

    def _at(self, rows: np.ndarray) -> list[Configuration]:
        return self.driven.at(self.numbers[rows.reshape(-1)])

    def solved(self, rows: np.ndarray) -> Details:
        """What series paths between the bodies give at N of the configurations.

        Where the loops do not close, or close in another assembly mode only, the status says that
        the configuration is out of reach.
        """
        part, every = self.driven.part, self._at(rows) or [self.driven.home]
        found = self._of_branches(every)
        closed = np.array([one.is_closed for one in every], dtype=bool)
        lost = self._lost_digits(every, found) * np.uint16(Status.ILL_CONDITIONED)
        status = np.where(closed, found.status_codes | lost, np.uint16(Status.UNREACHABLE))
        R, p = map(np.array, zip(*(one.places[part.platform] for one in every), strict=True))
        whole = replace(
            found,
            whole=replace(found.whole, status_codes=np.asarray(status, dtype=np.uint16)),
            pose=six_coordinates(R, p),
            joint_coordinates={
                joint.name: np.array([one.coordinates[joint.name] for one in every]).reshape(
                    len(every), joint.size
                )
                for joint in part.joints
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
        drives, part = frozenset(self.driven.drives), self.driven.part
        closed = [i for i, one in enumerate(every) if one.is_closed]
        near = as_rounded(part, [every[i] for i in closed], drives)
        moved, lost = [closed[k] for k in near], np.zeros(len(every), dtype=bool)
        if not moved:
            return lost
        here, there = found[moved], self._of_branches([*near.values()])
        there = replace(there, reference_point=here.reference_point)
        for k, i in enumerate(moved):  # what is soft is not free
            free = 0.0 if int(here.whole.rank[k]) == self.space.size else self.free
            lost[i] = bool(here[[k]].differences(there[[k]], free))
        return lost


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
