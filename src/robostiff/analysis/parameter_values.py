"""Values of the parameters of a compiled robot, one a pose, and the robots that have them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError
from robostiff.model import Robot
from robostiff.spatial import as_floats


@dataclass(frozen=True)
class ParameterValues:
    """Values of the symbols of a robot at N poses.

    Attributes
    ----------
    robot : Robot
        With symbols; without any, there is one robot for all poses.
    rows : (parameters, N) array
        Sorted by the names of the parameters.
    """

    robot: Robot
    rows: np.ndarray

    @classmethod
    def of(cls, robot: Robot, given: Mapping[str, ArrayLike] | None, count: int) -> ParameterValues:
        """Given values, one for all poses or one a pose, and nominal ones for the rest.

        Raises
        ------
        InputError
            When a name is no parameter, or values are not as many as poses.
        """
        names = [str(symbol) for symbol in robot.symbols]
        given = given or {}
        for name in given:
            if name not in names:
                raise InputError(
                    f"parameter of {robot.name!r}",
                    got=name,
                    expected=", ".join(names) or "none, as it was compiled without parameters",
                    hint=f'write rs.compile(robot, parameters=("{name}",))',
                )
        rows = np.empty((len(names), count))
        for row, name in zip(rows, names, strict=True):
            words = f"a finite number, or {count} of them"
            value = as_floats(f"parameter {name}", given.get(name, robot.nominal[name]), words)
            if value.shape not in {(), (count,)}:
                raise InputError(f"parameter {name}", got=f"shape {value.shape}", expected=words)
            row[:] = value
        for row, symbol in zip(rows, robot.symbols, strict=True):
            if symbol.is_positive and np.any(row <= 0):
                raise InputError(
                    f"parameter {symbol}", got=float(row.min()), expected="positive numbers"
                )
        return cls(robot, rows)

    def groups(self, chosen: np.ndarray) -> Iterator[tuple[Robot, np.ndarray]]:
        """A robot of numbers for each set of values among chosen poses, and its poses."""
        where = np.flatnonzero(chosen)
        if not len(self.rows):
            if where.size:
                yield self.robot, where
            return
        values, kinds = np.unique(self.rows[:, where], axis=1, return_inverse=True)
        names = [str(symbol) for symbol in self.robot.symbols]
        for k, own in enumerate(values.T):
            robot = self.robot.substituted(dict(zip(names, own.tolist(), strict=True)))
            yield robot, where[kinds.ravel() == k]


def with_parameters(robot: Robot, names: Sequence[str], taken: Sequence[str]) -> Robot:
    """The robot with symbols for some of its parameters, and nominal values for the others.

    Parameters
    ----------
    robot : Robot
    names : sequence of str
    taken : sequence of str
        Names that parameters may not have.

    Raises
    ------
    InputError
        When the robot has no such symbol, or a symbol has no nominal value.
    """
    symbols = [str(symbol) for symbol in robot.symbols]
    if isinstance(names, str):
        raise InputError(
            "parameters to compile", got=names, expected="several names", hint=f"write ({names!r},)"
        )
    for name in names:
        if name not in symbols:
            raise InputError(
                f"parameter of {robot.name!r}",
                got=name,
                expected=f"a symbol: {', '.join(symbols) or 'it has none'}",
                hint=f'write rs.load(..., symbols=("{name}",))',
            )
        if name in taken:
            raise InputError(
                f"parameter of {robot.name!r}",
                got=name,
                expected="a name that is no coordinate",
                hint="rename it in the model file",
            )
    robot.numeric  # noqa: B018  raises where a nominal value is missing
    if not names:
        return robot.numeric
    others = {name: robot.nominal[name] for name in symbols if name not in names}
    return robot.substituted(others)
