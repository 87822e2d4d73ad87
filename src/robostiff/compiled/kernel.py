"""A robot turned into a kernel: from rows of coordinates to rows of results."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import reduce

import numpy as np

from robostiff.compiled.closed import ClosedCode
from robostiff.compiled.codes import ArrayCode, MachineCode
from robostiff.compiled.machine_code import machine_code_is_available
from robostiff.compiled.outputs import Output
from robostiff.compiled.rates import Rates
from robostiff.errors import InputError
from robostiff.record import Entry, Program, least
from robostiff.recorded import RecordedRobot
from robostiff.spatial import Space


class Backend(Enum):
    """How a record is run: by ``MACHINE`` code, by NumPy on ``ARRAYS``, or the ``BEST`` available.

    Machine code is some ten times faster, and needs llvmlite, of the extra ``fast``.
    """

    BEST = "best"
    MACHINE = "machine"
    ARRAYS = "arrays"


class NoMachineCodeWarning(RuntimeWarning):
    """The compiler of machine code is not installed: NumPy is used, some ten times slower."""


class Checks(Enum):
    """Checks that a kernel computes at every pose beside its outputs.

    ``RANK``: matrix and rank. ``MATRIX``: the matrix alone; it is as right without its rank.
    ``NONE``: nothing, for poses that are known to be harmless.
    """

    NONE = "none"
    MATRIX = "matrix"
    RANK = "rank"

    def cover(self, name: str) -> bool:
        """Whether a check of a record is among them."""
        return self is Checks.RANK or (self is Checks.MATRIX and name != "rank")


@dataclass(frozen=True)
class Kernel:
    """Computes outputs at many poses from the record of one robot; picklable.

    Its answers hold where its `checks` say so; elsewhere they must be computed by another way, as
    the compiled robots of `robostiff.compile` do by themselves.

    Attributes
    ----------
    inputs : tuple of str
        What its rows of inputs are: coordinates [m, rad], then parameters.
    outputs : tuple of Output
    checks : tuple of str
        See `RecordedRobot.checks`; and ``gap``, the smallest part by which eigenvalues are apart,
        where their derivatives are asked for. With a closure also ``open``, the square of what the
        legs leave open, and ``mode``, positive in the assembly mode of home.
    space : Space
    code : MachineCode, ArrayCode or ClosedCode
        Its results are the rows of all outputs one after the other, then a row for each check.
    """

    inputs: tuple[str, ...]
    outputs: tuple[Output, ...]
    checks: tuple[str, ...]
    space: Space
    code: MachineCode | ArrayCode | ClosedCode = field(repr=False)

    @property
    def operations(self) -> int:
        """Number of operations a pose takes."""
        return self.code.operations

    @property
    def rows(self) -> int:
        """Number of rows of results, checks included."""
        return self.code.rows

    def evaluate(
        self, inputs: np.ndarray, out: np.ndarray | None = None, *, threads: int = 1
    ) -> np.ndarray:
        """Rows of results at rows of inputs.

        Parameters
        ----------
        inputs : (n_inputs, N) array
            Equal coordinates of all poses side by side [m, rad]; rows of C-contiguous float64 are
            read where they are.
        out : (rows, N) array, optional
            Filled and returned when given; C-contiguous float64.
        threads : int

        Raises
        ------
        InputError
            When an array has another shape, order or type.
        """
        threads = whole_threads(threads)
        inputs = self._checked("coordinates of the kernel", inputs, len(self.inputs))
        if out is None:
            out = np.empty((self.rows, inputs.shape[1]))
        elif self._checked("results of the kernel", out, self.rows) is not out:
            raise InputError(
                "results of the kernel", got=out.strides, expected="a C-contiguous float64 array"
            )
        if inputs.shape[1] != out.shape[1]:
            raise InputError(
                "results of the kernel", got=out.shape, expected=f"({self.rows}, {inputs.shape[1]})"
            )
        self.code.evaluate(inputs, out, threads)
        return out

    def _checked(self, subject: str, rows: np.ndarray, count: int) -> np.ndarray:
        if not isinstance(rows, np.ndarray) or rows.ndim != 2 or rows.shape[0] != count:
            got = rows.shape if isinstance(rows, np.ndarray) else type(rows).__name__
            raise InputError(subject, got=got, expected=f"an array ({count}, N)")
        return np.ascontiguousarray(rows, dtype=np.float64)

    def in_machine_code(self) -> Kernel:
        """The same kernel in machine code."""
        return replace(self, code=self.code.in_machine_code())


def whole_threads(threads: int) -> int:
    """A number of threads as it was given.

    Raises
    ------
    InputError
        When it is none.
    """
    if not isinstance(threads, int) or isinstance(threads, bool) or threads < 1:
        raise InputError("threads", got=threads, expected="a whole number from 1")
    return threads


def kernel_of(
    recorded: RecordedRobot,
    outputs: Sequence[Output],
    backend: Backend = Backend.BEST,
    *,
    checks: Checks = Checks.RANK,
) -> Kernel:
    """The kernel of a recorded robot.

    Parameters
    ----------
    recorded : RecordedRobot
    outputs : sequence of Output
    backend : Backend
    checks : Checks
        What the kernel checks beside its outputs.

    Raises
    ------
    InputError
        When machine code is selected and its compiler is not installed.
    NoAnswerError
        When an output has no answer at any pose.
    """
    entries = [entry for output in outputs for entry in output.recorded(recorded)]
    checked = {name: x for name, x in recorded.checks.items() if checks.cover(name)}
    gaps = [gap for x in outputs if isinstance(x, Rates) for gap in x.gaps(recorded)]
    gaps = [gap for gap in gaps if isinstance(gap, Entry)]
    if gaps:
        checked["gap"] = reduce(least, gaps)
    program = Program.of(recorded.record, [*entries, *checked.values()])
    closure, code = recorded.closure, code_of(backend)
    if closure is None:
        return Kernel(
            recorded.record.inputs, tuple(outputs), tuple(checked), recorded.space, code(program)
        )
    return Kernel(
        inputs=closure.inputs,
        outputs=tuple(outputs),
        checks=(*checked, "open", "mode"),
        space=recorded.space,
        code=ClosedCode.of(closure, program, code),
    )


def code_of(backend: Backend) -> type[MachineCode] | type[ArrayCode]:
    """What runs the programs of a backend.

    Raises InputError when it is none, or machine code without its compiler.
    """
    if not isinstance(backend, Backend):
        raise InputError(
            "backend", got=backend, expected=", ".join(str(member) for member in Backend)
        )
    if backend is Backend.ARRAYS:
        return ArrayCode
    if machine_code_is_available():
        return MachineCode
    if backend is Backend.MACHINE:
        raise InputError(
            "backend of the kernel",
            got="machine code",
            expected="llvmlite, and a processor that multiplies and adds in one operation",
            hint="write pip install 'robostiff[fast]', or Backend.ARRAYS",
        )
    # Warnings of one line of code are shown once.
    warnings.warn(
        "llvmlite is not installed, or has no code for this processor: NumPy runs the record, some "
        "ten times slower than machine code; "
        "write pip install 'robostiff[fast]', or backend=Backend.ARRAYS",
        NoMachineCodeWarning,
        stacklevel=1,
    )
    return ArrayCode
