"""Rates of outputs with inputs of their kernel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.compiled.outputs import Output, gaps_of
from robostiff.errors import InputError, NoAnswerError
from robostiff.record import Entry, derivatives_along, gradient
from robostiff.spatial import Space

if TYPE_CHECKING:
    from robostiff.recorded import RecordedRobot

_MEET = 1e-9  # a gap at which eigenvalues are the same


class Rates:
    """Rates of another output with inputs of its kernel: `Derivative` or `Gradient`."""

    of: Output
    by: Any

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return (self.by,) if isinstance(self.by, str) else self.by

    def gaps(self, robot: RecordedRobot) -> list[Any]:
        """Relative distances between eigenvalues, which have no rates where they meet."""
        return gaps_of(self.of, robot)

    def _check_gaps(self, robot: RecordedRobot) -> None:
        for gap in self.gaps(robot):
            size = gap.sample if isinstance(gap, Entry) else float(gap)
            if np.all(np.abs(size) < _MEET):
                name = f"d{self.of.name}/d{', '.join(self.inputs)}"
                raise NoAnswerError(f"no {name} of {robot.name!r}: eigenvalues meet at every pose")


@dataclass(frozen=True)
class Derivative(Rates):
    """Derivative of another output with respect to a pose coordinate or a parameter.

    Attributes
    ----------
    of : Output
    by : str
        Name of the input: a coordinate such as ``x``, or a parameter kept as an input.
    """

    of: Output
    by: str

    @property
    def name(self) -> str:
        """Such as ``dK/dx``."""
        return f"d{self.of.name}/d{self.by}"

    def shape(self, space: Space) -> tuple[int, ...]:
        """As that of the output."""
        return self.of.shape(space)

    def recorded(self, robot: RecordedRobot) -> list[Any]:
        """Rates of the entries.

        Raises
        ------
        InputError
            When there is no such input.
        NoAnswerError
            When eigenvalues meet at every pose: they have no derivatives there.
        """
        self._check_gaps(robot)
        entries = self.of.recorded(robot)
        direction: Any = {self.by: 1}
        if robot.closure is not None:
            direction = robot.closure.direction(robot.record, self.by)
        return derivatives_along(robot.record, entries, direction)


@dataclass(frozen=True)
class Gradient(Rates):
    """Rates of one number with many inputs at once, by a sweep back through the record.

    It takes some three times as many operations as the number, for any number of inputs.

    Attributes
    ----------
    of : Output
        One number a pose: `WorstDeflection`, `DisplacementUnder`, or an entry (`EntryOf`).
    by : tuple of str
        Names of the inputs, pose coordinates or parameters kept as inputs.
    """

    of: Output
    by: tuple[str, ...]

    def __init__(self, of: Output, by: Sequence[str]) -> None:
        if isinstance(by, str) or not by or len(set(by)) < len(by):
            raise InputError(
                "inputs of a gradient", got=by, expected='names, each once, such as ("R", "k")'
            )
        object.__setattr__(self, "of", of)
        object.__setattr__(self, "by", tuple(by))

    @property
    def name(self) -> str:
        """Such as ``dworst_deflection``."""
        return f"d{self.of.name}"

    def shape(self, space: Space) -> tuple[int, ...]:
        """(inputs,).

        Raises InputError when the output has several entries.
        """
        shape = self.of.shape(space)
        if shape:
            raise InputError(
                f"gradient of {self.of.name}",
                got=f"{math.prod(shape)} numbers a pose",
                expected="one, such as WorstDeflection() or EntryOf(output, place)",
                hint="write Derivative(output, name) for one input after the other",
            )
        return (len(self.by),)

    def recorded(self, robot: RecordedRobot) -> list[Any]:
        """Rates with each input.

        Raises
        ------
        InputError
            When there is no such input, or the output has several entries.
        NoAnswerError
            When eigenvalues meet at every pose: they have no derivatives there.
        """
        self.shape(robot.space)
        self._check_gaps(robot)
        record, (entry,) = robot.record, self.of.recorded(robot)
        if robot.closure is None:
            return gradient(record, entry, self.by)
        # What follows from the closure moves at rates that the closure provides.
        directions = [robot.closure.direction(record, name) for name in self.by]
        moving = sorted(set().union(*directions))
        slopes = dict(zip(moving, gradient(record, entry, moving), strict=True))
        return [
            sum((slopes[name] * rate for name, rate in along.items()), 0) for along in directions
        ]
