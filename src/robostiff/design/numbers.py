"""Numbers of a robot as functions of its parameters, with all their rates."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from fnmatch import fnmatchcase
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.compiled_stiffness import CompiledStiffness, compile_stiffness
from robostiff.compiled import ComplianceMatrix, EntryOf, Gradient, Output, WorstDeflection
from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen
from robostiff.kept import kept
from robostiff.kinematics import JointCoordinates, find_posture
from robostiff.model import Robot
from robostiff.spatial import as_floats

_POSES = "coordinates (N, n), a pose a row"
#: Poses of a design: coordinates (N, n) or (n,), joint coordinates of an arm, or home.
Poses = ArrayLike | JointCoordinates | None


def parameters_like(robot: Robot, pattern: str) -> tuple[str, ...]:
    """Names of the parameters of a robot that match a pattern such as ``k*``.

    Raises InputError when there is none.
    """
    names = [str(symbol) for symbol in robot.symbols]
    found = tuple(name for name in names if fnmatchcase(name, pattern))
    if not found:
        expected = f"a symbol of it: {', '.join(names) or 'it has none'}"
        hint = 'load it with symbols, rs.load(file, symbols=("R", "k"))'
        raise InputError(f"parameter of {robot.name!r}", got=pattern, expected=expected, hint=hint)
    return found


@kept
def kept_kernel(
    robot: Robot, outputs: tuple[Output, ...], names: tuple[str, ...]
) -> CompiledStiffness:
    """The kernel of outputs with these parameters; it is kept with the robot."""
    return compile_stiffness(robot, outputs, parameters=names)


@frozen
class NumbersOfDesigns:
    """Outputs of one number at some poses, and their rates with parameters."""

    kernels: tuple[CompiledStiffness, ...]
    outputs: tuple[Output, ...]
    names: tuple[str, ...]  # of the parameters that vary
    poses: Any  # (N, n) array or JointCoordinates

    @staticmethod
    def of(
        robot: Robot, outputs: Sequence[Output], names: Sequence[str], poses: Poses
    ) -> NumbersOfDesigns:
        """Compile the outputs and their gradients, those of one name in a kernel for each wrench.

        Raises InputError when an output has several numbers, or a name is no parameter.
        """
        by_name = defaultdict[str, list[Output]](list)
        d = robot.space.translations
        for part in dict.fromkeys(part for one in outputs for part in _smooth(one, d)):
            by_name[part.name].append(part)
        cases = ([*filter(None, case)] for case in zip_longest(*by_name.values()))
        each = ([*parts, *(Gradient(part, names) for part in parts)] for parts in cases)
        kernels = tuple(kept_kernel(robot, tuple(parts), tuple(names)) for parts in each)
        return NumbersOfDesigns(kernels, tuple(outputs), tuple(names), kernel_poses(robot, poses))

    def at(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Numbers (outputs, N), their rates (outputs, N, n), and status codes (N,), at values (n,).

        Not a number where the status says that there is no answer. Where largest eigenvalues meet,
        the rates are those of one of them.
        """
        given = dict(zip(self.names, map(float, values), strict=True))
        answers = [compiled.evaluate(self.poses, parameters=given) for compiled in self.kernels]
        known = {
            output: answer.values[output.name]
            for compiled, answer in zip(self.kernels, answers, strict=True)
            for output in compiled.kernel.outputs
        }
        d = self.kernels[0].kernel.space.translations
        numbers, rates = [], []
        for output in self.outputs:
            parts = _smooth(output, d)
            values = np.array([known[part] for part in parts])
            slopes = np.array([known[Gradient(part, self.names)] for part in parts])
            if isinstance(output, WorstDeflection):
                values, slopes = _largest_eigenvalue(values, slopes, d)
            numbers.append(values.reshape(-1, values.shape[-1])[0])
            rates.append(slopes.reshape(-1, *slopes.shape[-2:])[0])
        codes = np.bitwise_or.reduce([answer.status_codes for answer in answers])
        return np.array(numbers), np.array(rates), codes


def require_answers(subject: str, at: str, numbers: np.ndarray, codes: np.ndarray) -> None:
    """Raise NoAnswerError at the first pose whose numbers (outputs, N) are not all finite."""
    for pose in np.flatnonzero(~np.isfinite(numbers).all(axis=0))[:1]:
        advice = Status(int(codes[pose])).advice or ("an output is no number there",)
        raise NoAnswerError(f"no {subject}: pose {pose + 1} has no answer at {at}: {advice[0]}")


def _smooth(output: Output, d: int) -> list[Output]:
    """What has rates at all poses, and gives the output: of an eigenvalue the entries."""
    if not isinstance(output, WorstDeflection):
        return [output]
    return [EntryOf(ComplianceMatrix(), (i, j)) for i in range(d) for j in range(i, d)]


def _largest_eigenvalue(
    upper: np.ndarray, slopes: np.ndarray, d: int
) -> tuple[np.ndarray, np.ndarray]:
    """Largest eigenvalue (N,) of symmetric matrices, and its rates (N, n): v^T dC v.

    Of the upper triangles (entries, N) and their rates (entries, N, n), row by row.
    """
    i, j = np.triu_indices(d)
    C = np.empty((upper.shape[1], d, d))
    C[:, i, j] = C[:, j, i] = upper.T
    known = np.isfinite(C).all(axis=(1, 2))
    largest, v = np.full(len(C), np.nan), np.full((len(C), d), np.nan)
    values, vectors = np.linalg.eigh(C[known])
    largest[known], v[known] = values[:, -1], vectors[:, :, -1]
    weights = v[:, i] * v[:, j] * np.where(i == j, 1, 2)
    return largest, np.einsum("pk,kpn->pn", weights, slopes)


def kernel_poses(robot: Robot, poses: Poses) -> Any:
    """Poses as kernels take them, one a row; InputError where there are none."""
    if poses is None:
        home = find_posture(robot.numeric)
        if robot.is_posed_by_joints:
            return JointCoordinates(home.coordinates[0].reshape(1, -1))
        return home.pose.reshape(-1, 6)[:, robot.coordinate_places]
    by_joints = isinstance(poses, JointCoordinates)
    rows = np.atleast_2d(as_floats("poses", poses.values if by_joints else poses, _POSES))
    if not len(rows):
        raise InputError("poses", got=Words("none"), expected=_POSES, hint="None is home")
    return JointCoordinates(rows) if by_joints else rows


def value_and_gradient(
    robot: Robot, output: Output, by: Sequence[str], poses: Poses = None
) -> Callable[[ArrayLike], tuple[np.ndarray, np.ndarray]]:
    """A number of a robot and its rates with parameters, as a function for any optimiser.

    Parameters
    ----------
    robot : Robot
        With symbols for the parameters.
    output : Output
        Of one number: `WorstDeflection`, `DisplacementUnder`, `EntryOf`, `TotalMass`.
    by : sequence of str
        Names of the parameters.
    poses : (N, n) array or JointCoordinates, optional
        Free pose coordinates [m, rad]; the home of the nominal robot when left out.

    Returns
    -------
    function
        From values (n,) of the parameters in SI units to the numbers (N,) and rates (N, n); not a
        number where there is no answer.

    Raises
    ------
    InputError
        When the output has several numbers, or a name is no parameter.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("gough-stewart-b", symbols=("R", "k"))
    >>> number = rs.value_and_gradient(robot, rs.WorstDeflection(), ["R", "k"])
    >>> value, rates = number([0.5, 1e7])
    >>> bool(np.isclose(rates[0, 1] * 1e7, -value[0]))  # deflection is proportional to 1 / k
    True
    """
    numbers = NumbersOfDesigns.of(robot, [output], by, poses)

    def found(values: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        expected = f"{len(by)} numbers: {', '.join(by)}"
        given = as_floats("values of parameters", values, expected, shape=(len(by),))
        value, rates, _ = numbers.at(given)
        return value[0], rates[0]

    return found
