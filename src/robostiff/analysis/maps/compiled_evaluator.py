"""Blocks of poses by the kernel of the robot; unsafe ones by the batched numeric form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robostiff.analysis.compiled_linkage import CompiledLinkage, compile_linkage
from robostiff.analysis.compiled_robot import CompiledRobot, compile_robot
from robostiff.analysis.guarded_values import CheckedResults
from robostiff.analysis.maps.evaluator import BatchedEvaluator, room_for
from robostiff.analysis.maps.variables import Quantity, Variable
from robostiff.analysis.measures import stiffness_indices
from robostiff.compiled import (
    Backend,
    DeflectionUnder,
    Output,
    PrincipalStiffness,
    StiffnessMatrix,
    WorstDeflection,
    unpack,
)
from robostiff.errors import InputError
from robostiff.linkage import Linkage
from robostiff.spatial.batch import empty_batch

# Poses at once, at most: their rows of inputs and results take some 30 MB.
_MOST = 2**18

_STIFFNESS, _PRINCIPAL = StiffnessMatrix(), PrincipalStiffness()
_WORST = WorstDeflection()


@dataclass(frozen=True)
class CompiledEvaluator:
    """The kernel of a robot, guarded by the batched form of the same quantities.

    Attributes
    ----------
    compiled : CompiledRobot or CompiledLinkage
    batched : BatchedEvaluator
    """

    compiled: CompiledRobot | CompiledLinkage
    batched: BatchedEvaluator

    @classmethod
    def of(cls, batched: BatchedEvaluator, backend: Backend) -> CompiledEvaluator:
        """The kernel for the quantities of a batched evaluator."""
        robot, columns = batched.robot, batched.columns
        subject = f"map of {robot.name!r} by a kernel"
        if Quantity.ACTUATOR_FORCES in batched.quantities:
            raise InputError(
                subject, got="actuator forces", expected="other quantities", hint=_OTHERWISE
            )
        if isinstance(robot, Linkage):
            joints = [name for name, _ in columns.drives]
            return cls(
                compile_linkage(robot, _outputs(batched), joints=joints, backend=backend), batched
            )
        free = tuple(coordinate.value for coordinate in robot.coordinates)
        if not columns.of_joints and columns.names != free:
            raise InputError(
                subject,
                got=" ".join(columns.names),
                expected=f"coordinates that are free: {' '.join(free)}",
                hint=_OTHERWISE,
            )
        compiled = compile_robot(robot, _outputs(batched), backend=backend)
        if columns.of_joints and not compiled.takes_joints:
            raise InputError(
                subject, got="joint coordinates", expected=" ".join(free), hint=_OTHERWISE
            )
        return cls(compiled, batched)

    @property
    def method(self) -> str:
        """Name of the method."""
        careful = "networks" if self.batched.columns.drives else "wrench-basis"
        return f"compiled record, {careful} where it is unsafe"

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The variables that `evaluate` returns."""
        return self.batched.variables

    @property
    def most_poses(self) -> int:
        """Enough to hide the cost of a block."""
        return _MOST

    def evaluate(
        self, poses: np.ndarray, out: Mapping[str, np.ndarray] | None = None
    ) -> Mapping[str, np.ndarray]:
        """The variables at poses (N, n_coordinates), and which were ``guarded``."""
        out = room_for(self.variables, len(poses)) if out is None else out
        guarded = np.empty(len(poses), dtype=bool)
        for where, found in self.compiled.results(self.batched.columns.as_pose(poses)):
            self._fill({name: array[where] for name, array in out.items()}, found)
            guarded[where] = found.guarded
        rows = np.flatnonzero(guarded)
        if rows.size:
            again = np.ascontiguousarray(poses.T[:, rows]).T
            for name, values in self.batched.evaluate(again).items():
                out[name][rows] = values
        return {**out, "guarded": guarded}

    def _fill(self, out: Mapping[str, np.ndarray], found: CheckedResults) -> None:
        """Put the results of a chunk into their places."""
        quantities, rows = self.batched.quantities, found.rows
        d = self.batched.robot.space.translations
        out["rank"][...], out["status"][...] = found.rank, found.status_codes
        if Quantity.STIFFNESS in quantities:
            unpack(rows[_STIFFNESS.name], out["K"])
        if Quantity.PRINCIPAL_STIFFNESS in quantities:
            principal = rows[_PRINCIPAL.name]
            # K is positive semidefinite; what is below zero is rounding.
            np.maximum(principal, 0.0, out=principal)
            unpack(principal[:d], out["translational_stiffness"])
            unpack(principal[d:], out["rotational_stiffness"])
        if Quantity.WORST_DEFLECTION in quantities:
            unpack(rows[_WORST.name], out["worst_deflection"])
        if Quantity.INDICES in quantities:
            n = self.batched.robot.space.size
            K = empty_batch(found.rank.shape, (n, n))
            unpack(rows[_STIFFNESS.name], K)
            K[found.guarded] = np.nan
            for name, values in stiffness_indices(K, found.rank, self.batched.length).items():
                out[name][...] = values
        if Quantity.DEFLECTION in quantities:
            twist = rows[DeflectionUnder.name]
            unpack(twist[:d], out["displacement"])
            unpack(twist[d:], out["rotation"])


_OTHERWISE = "leave the method out, or write method=Batched()"


def _outputs(batched: BatchedEvaluator) -> list[Output]:
    quantities = batched.quantities
    found: list[Output] = []
    if {Quantity.STIFFNESS, Quantity.INDICES} & set(quantities):
        found.append(_STIFFNESS)
    if Quantity.PRINCIPAL_STIFFNESS in quantities:
        found.append(_PRINCIPAL)
    if Quantity.WORST_DEFLECTION in quantities:
        found.append(_WORST)
    if Quantity.DEFLECTION in quantities:
        found.append(DeflectionUnder(batched.wrench))
    return found
