"""Blocks of poses by the kernel of the robot; unsafe ones by the batched numeric form."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from robostiff.analysis.compiled_robot import CompiledAnswer, CompiledRobot, compile_robot
from robostiff.analysis.maps.evaluator import BatchedEvaluator
from robostiff.analysis.maps.quantities import Quantity
from robostiff.analysis.maps.variables import Variable
from robostiff.analysis.measures import stiffness_indices
from robostiff.compiled import (
    Backend,
    DeflectionUnder,
    Output,
    PrincipalStiffness,
    StiffnessMatrix,
    WorstDeflection,
)
from robostiff.errors import InputError

# Poses at once, at most: their rows of inputs and results take some 30 MB.
_MOST = 2**18

_STIFFNESS, _PRINCIPAL = StiffnessMatrix(), PrincipalStiffness()
_WORST = WorstDeflection()


@dataclass(frozen=True)
class CompiledEvaluator:
    """The kernel of a robot, guarded by the batched form of the same quantities.

    Attributes
    ----------
    compiled : CompiledRobot
    batched : BatchedEvaluator
    """

    compiled: CompiledRobot
    batched: BatchedEvaluator

    @classmethod
    def of(cls, batched: BatchedEvaluator, backend: Backend) -> CompiledEvaluator:
        """What computes the same as a batched evaluator.

        Raises
        ------
        InputError
            When a kernel does not compute one of the quantities, or takes other coordinates.
        NoAnswerError
            When a quantity has no answer at any pose.
        """
        robot, columns = batched.robot, batched.columns
        subject = f"map of {robot.name!r} by a kernel"
        if Quantity.ACTUATOR_FORCES in batched.quantities:
            raise InputError(
                subject, got="actuator forces", expected="other quantities", hint=_OTHERWISE
            )
        told = tuple(coordinate.value for coordinate in robot.coordinates)
        if not columns.of_joints and columns.names != told:
            raise InputError(
                subject,
                got=" ".join(columns.names),
                expected=f"coordinates that are free: {' '.join(told)}",
                hint=_OTHERWISE,
            )
        compiled = compile_robot(robot, _outputs(batched), backend=backend)
        if columns.of_joints and not compiled.takes_joints:
            raise InputError(
                subject, got="joint coordinates", expected=" ".join(told), hint=_OTHERWISE
            )
        return cls(compiled, batched)

    @property
    def method(self) -> str:
        """How."""
        return "compiled record, wrench-basis where it is unsafe"

    @property
    def variables(self) -> tuple[Variable, ...]:
        """What `evaluate` returns."""
        return self.batched.variables

    @property
    def most_poses(self) -> int:
        """Enough to hide the cost of a block."""
        return _MOST

    def evaluate(self, poses: np.ndarray) -> Mapping[str, np.ndarray]:
        """The variables at poses (N, n_coordinates), and which were ``guarded``."""
        answer = self.compiled.attempt(self.batched.columns.as_pose(poses))
        found = dict(self._variables(answer))
        found |= {"rank": answer.rank, "status": answer.status_codes}
        rows = np.flatnonzero(answer.guarded)
        if rows.size:
            again = np.ascontiguousarray(poses.T[:, rows]).T
            for name, values in self.batched.evaluate(again).items():
                if values.dtype.itemsize > found[name].dtype.itemsize:  # status: as in the map
                    found[name] = found[name].astype(values.dtype)
                found[name][rows] = values
        return {**found, "guarded": answer.guarded}

    def _variables(self, answer: CompiledAnswer) -> Iterator[tuple[str, np.ndarray]]:
        quantities, values = self.batched.quantities, answer.values
        d = self.batched.robot.space.translations
        if Quantity.STIFFNESS in quantities:
            yield "K", values[_STIFFNESS.name]
        if Quantity.PRINCIPAL_STIFFNESS in quantities:
            principal = values[_PRINCIPAL.name]
            # K is positive semidefinite; what is below zero is rounding.
            np.maximum(principal, 0.0, out=principal)
            yield "translational_stiffness", principal[:, :d]
            yield "rotational_stiffness", principal[:, d:]
        if Quantity.WORST_DEFLECTION in quantities:
            yield "worst_deflection", values[_WORST.name]
        if Quantity.INDICES in quantities:
            safe = np.where(answer.guarded[:, None, None], np.nan, values[_STIFFNESS.name])
            yield from stiffness_indices(safe, answer.rank, self.batched.length).items()
        if Quantity.DEFLECTION in quantities:
            twist = values[DeflectionUnder.name]
            yield "displacement", twist[:, :d]
            yield "rotation", twist[:, d:]


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
