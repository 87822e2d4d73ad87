"""Outputs that a kernel can compute at every pose, and their rates with its inputs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen
from robostiff.record import Entry, derivatives_along, gradient, is_zero, plain_root
from robostiff.spatial import Space, as_floats

if TYPE_CHECKING:  # a kernel that was read from disk is run without what makes records
    from robostiff.recorded import RecordedRobot
    from robostiff.recorded.factor import Upper


@runtime_checkable
class Output(Protocol):
    """A quantity that a kernel computes, one row of numbers for each of its entries."""

    @property
    def name(self) -> str:
        """Its name in the result."""
        ...

    def shape(self, space: Space) -> tuple[int, ...]:
        """Of its array at one pose."""
        ...

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """Its entries, row by row."""
        ...


class _OfTwists:
    """An output with as many dimensions of the size of a twist: a matrix, a vector, or a number."""

    dims: ClassVar[int] = 0

    def shape(self, space: Space) -> tuple[int, ...]:
        """(n, n), (n,) or ()."""
        return (space.size,) * self.dims


@frozen
class StiffnessMatrix(_OfTwists):
    """K about the reference point, world axes [N/m, N, N m]."""

    name = "K"
    dims = 2

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """Entries of K; those below the diagonal are those above it."""
        return _both_triangles(robot.K, robot.space.size)


@frozen
class ComplianceMatrix(_OfTwists):
    """K^-1 about the reference point, world axes [m/N, 1/N, rad/(N m)]."""

    name = "compliance"
    dims = 2

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """Entries of K^-1.

        Raises
        ------
        NoAnswerError
            When the platform has free motions at every pose.
        """
        from robostiff.recorded import inverse_entries

        _require_full_rank(robot, "compliance matrix")
        return _both_triangles(inverse_entries(robot.factors), robot.space.size)


@frozen
class _UnderWrench(_OfTwists):
    wrench: tuple[float, ...]

    def __init__(self, wrench: ArrayLike) -> None:
        units = {space.size: space.wrench_units for space in Space}
        numbers = as_floats("wrench", wrench, "6 numbers, or 3 in the plane", units)
        if numbers.ndim != 1:
            raise InputError("wrench", got=wrench, expected="6 numbers, or 3 in the plane")
        object.__setattr__(self, "wrench", tuple(numbers.tolist()))

    def shape(self, space: Space) -> tuple[int, ...]:
        """InputError when the wrench has not as many entries as K."""
        if len(self.wrench) != space.size:
            raise InputError("wrench", got=self.wrench, expected=f"{space.size} numbers")
        return super().shape(space)

    def _twist(self, robot: RecordedRobot) -> list[Any]:
        """The twist x with K x = F."""
        self.shape(robot.space)
        _require_full_rank(robot, "deflection")
        return robot.factors.solution(list(self.wrench))


@frozen(init=False)
class DeflectionUnder(_UnderWrench):
    """Twist of the reference point under a wrench about it, world axes [m, rad].

    Attributes
    ----------
    wrench : tuple of float
        Fx, Fy, Fz, Mx, My, Mz, or Fx, Fy, Mz in the plane [N, N m].
    """

    name = "deflection"
    dims = 1

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """The twist.

        Raises
        ------
        InputError
            When the wrench has not as many entries as K.
        NoAnswerError
            When the platform has free motions at every pose.
        """
        return self._twist(robot)


@frozen(init=False)
class DisplacementUnder(_UnderWrench):
    """Size of the displacement of the reference point under a wrench about it [m].

    Attributes
    ----------
    wrench : tuple of float
        As of `DeflectionUnder`.
    """

    name = "displacement"

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """Root of the sum of squares of the first entries of the twist."""
        return [plain_root(sum(x * x for x in self._twist(robot)[: robot.space.translations]))]


@frozen
class WorstDeflection(_OfTwists):
    """Largest displacement of the reference point per unit force, over all directions [m/N].

    The largest eigenvalue of the displacement-force block of K^-1: no moment acts, and the platform
    may turn.
    """

    name = "worst_deflection"

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """The largest eigenvalue.

        Raises
        ------
        NoAnswerError
            When the platform has free motions at every pose.
        """
        return self._all(robot)[-1:]

    def gaps(self, robot: RecordedRobot) -> list[Any]:
        """Between the largest two eigenvalues, as a part of them all."""
        values = self._all(robot)
        return [_part(values[-1] - values[-2], values)]

    def _all(self, robot: RecordedRobot) -> list[Any]:
        from robostiff.recorded import eigenvalues, inverse_entries

        _require_full_rank(robot, "worst deflection")
        inverse = inverse_entries(robot.factors)
        d = range(robot.space.translations)
        return eigenvalues([[inverse[min(i, j), max(i, j)] for j in d] for i in d])


@frozen
class PrincipalStiffness(_OfTwists):
    """Eigenvalues of the force-displacement and the moment-rotation block of K, ascending.

    The first are stiffnesses against forces with rotations held [N/m], the second against moments
    with displacements held [N m/rad].
    """

    name = "principal_stiffness"
    dims = 1

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """Eigenvalues of both blocks."""
        return [value for block in self._blocks(robot) for value in block]

    def gaps(self, robot: RecordedRobot) -> list[Any]:
        """Between neighbours in a block, as a part of all eigenvalues of the block."""
        return [
            _part(high - low, block)
            for block in self._blocks(robot)
            for low, high in pairwise(block)
        ]

    def _blocks(self, robot: RecordedRobot) -> list[list[Any]]:
        from robostiff.recorded import eigenvalues

        n, d = robot.space.size, robot.space.translations
        return [
            eigenvalues([[robot.K[min(i, j), max(i, j)] for j in block] for i in block])
            for block in (range(d), range(d, n))
        ]


@frozen
class EntryOf:
    """One entry of another output, such as ``EntryOf(StiffnessMatrix(), (2, 2))``.

    Attributes
    ----------
    of : Output
    place : tuple of int
        From 0; of a matrix row and column.
    """

    of: Output
    place: tuple[int, ...]

    @property
    def name(self) -> str:
        """Such as ``K[2, 2]``."""
        return f"{self.of.name}[{', '.join(map(str, self.place))}]"

    def shape(self, space: Space) -> tuple[int, ...]:
        """().

        Raises InputError when the output has no such entry.
        """
        shape = self.of.shape(space)
        inside = len(shape) == len(self.place) and all(
            0 <= i < n for i, n in zip(self.place, shape, strict=True)
        )
        if not inside:
            subject = f"entry of {self.of.name}"
            raise InputError(subject, got=self.place, expected=f"places in an array {shape}")
        return ()

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """The entry."""
        self.shape(robot.space)
        places = list(np.ndindex(self.of.shape(robot.space)))
        return [self.of.entries(robot)[places.index(self.place)]]


@frozen
class TotalMass(_OfTwists):
    """Mass of all parts of the robot, as far as it is known [kg].

    Beams have the mass of their density and size; telescopes are as long as they are at the pose.
    """

    name = "mass"

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """The sum.

        Raises
        ------
        NoAnswerError
            Of a robot whose parts have no mass, and of a linkage or cable robot, whose record has
            no masses.
        """
        if robot.mass is None or is_zero(robot.mass):
            of = "its record has" if robot.mass is None else "its parts have"
            raise NoAnswerError(f"no mass of {robot.name!r}: {of} none")
        return [robot.mass]


@frozen
class TensionsOf(_OfTwists):
    """Tensions of cables of a cable robot [N].

    Attributes
    ----------
    names : tuple of str
        Of the cables.
    """

    names: tuple[str, ...]
    name = "tensions"

    def __init__(self, names: Sequence[str]) -> None:
        object.__setattr__(self, "names", tuple(names))

    def shape(self, space: Space) -> tuple[int, ...]:
        """(cables,)."""
        return (len(self.names),)

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """The tensions.

        Raises
        ------
        InputError
            When the robot has no cable of such a name.
        """
        for name in self.names:
            if name not in robot.tensions:
                expected = ", ".join(robot.tensions) or "none: it has no cables"
                raise InputError(f"cable of {robot.name!r}", got=name, expected=expected)
        return [robot.tensions[name] for name in self.names]


def gaps_of(output: Output | Rates, robot: RecordedRobot) -> list[Any]:
    """Relative distances between eigenvalues of which an output is made, or what it is of."""
    while isinstance(output, EntryOf | Rates):
        output = output.of
    gaps = getattr(output, "gaps", None)
    return [] if gaps is None else gaps(robot)


def _both_triangles(upper: Upper, size: int) -> list[Any]:
    return [upper[min(place), max(place)] for place in np.ndindex(size, size)]


def _part(gap: Any, values: list[Any]) -> Any:
    """A gap between values of one sign against their sum."""
    total = sum(values[1:], values[0])
    return 0 if is_zero(total) else gap / total


def _require_full_rank(robot: RecordedRobot, what: str) -> None:
    if robot.factors.rank < robot.space.size:
        raise NoAnswerError(
            f"no {what} of {robot.name!r}: its platform has free motions at every pose"
        )


_MEET = 1e-9  # a gap at which eigenvalues are the same


class Rates:
    """Rates of another output with inputs of its kernel: `Derivative` or `Gradient`."""

    of: Output
    by: Any

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return (self.by,) if isinstance(self.by, str) else self.by

    def _check_gaps(self, robot: RecordedRobot) -> None:
        """Raise where eigenvalues meet, which have no rates there."""
        for gap in gaps_of(self, robot):
            size = gap.sample if isinstance(gap, Entry) else float(gap)
            if np.all(np.abs(size) < _MEET):
                name = f"d{self.of.name}/d{', '.join(self.inputs)}"
                raise NoAnswerError(f"no {name} of {robot.name!r}: eigenvalues meet at every pose")


@frozen
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

    def entries(self, robot: RecordedRobot) -> list[Any]:
        """Rates of the entries.

        Raises
        ------
        InputError
            When there is no such input.
        NoAnswerError
            When eigenvalues meet at every pose: they have no derivatives there.
        """
        self._check_gaps(robot)
        entries = self.of.entries(robot)
        direction: Any = {self.by: 1}
        if robot.closure is not None:
            direction = robot.closure.direction(robot.record, self.by)
        return derivatives_along(robot.record, entries, direction)


@frozen
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
            subject = "inputs of a gradient"
            raise InputError(subject, got=by, expected='names, each once, such as ("R", "k")')
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
                got=Words(f"{math.prod(shape)} numbers a pose"),
                expected="one, such as WorstDeflection() or EntryOf(output, place)",
                hint="write Derivative(output, name) for one input after the other",
            )
        return (len(self.by),)

    def entries(self, robot: RecordedRobot) -> list[Any]:
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
        record, (entry,) = robot.record, self.of.entries(robot)
        if robot.closure is None:
            return gradient(record, entry, self.by)
        # What follows from the closure moves at rates that the closure provides.
        directions = [robot.closure.direction(record, name) for name in self.by]
        moving = sorted(set().union(*directions))
        slopes = dict(zip(moving, gradient(record, entry, moving), strict=True))
        return [
            sum((slopes[name] * rate for name, rate in along.items()), 0) for along in directions
        ]
