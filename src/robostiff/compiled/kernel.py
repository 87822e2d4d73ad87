"""A robot turned into a kernel: from rows of coordinates to rows of results."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.compiled.closed import ClosedCode
from robostiff.compiled.codes import (
    POSES_A_CHUNK,
    ArrayCode,
    MachineCode,
    machine_code_is_available,
    room_for,
)
from robostiff.compiled.outputs import Output, Rates, gaps_of
from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen, replace
from robostiff.record import Program
from robostiff.spatial import Space, check_whole

if TYPE_CHECKING:
    from robostiff.recorded import RecordedRobot

_POSES_A_THREAD = 100_000  # below, starting a thread takes as long as what it saves
_CHUNKS_OF_STEPS = 16
_ROWS = 32  # of so many, a chunk of `POSES_A_CHUNK` stays in the cache


class Backend(Enum):
    """How a record is run: by ``MACHINE`` code, by NumPy on ``ARRAYS``, or the ``BEST`` available.

    Machine code is some ten times faster, and needs llvmlite, of the extra ``fast``.
    """

    BEST = "best"
    MACHINE = "machine"
    ARRAYS = "arrays"


class NoMachineCodeWarning(RuntimeWarning):
    """The compiler of machine code is not installed: NumPy is used, some ten times slower."""


@frozen
class Kernel:
    """Computes outputs at many poses from the record of one robot; picklable.

    Its answers hold where its `checks` say so; elsewhere they must be computed by another way, as
    the compiled robots of `robostiff.compile` do by themselves.
    """

    inputs: tuple[str, ...]  #: what its rows of inputs are: coordinates [m, rad], then parameters
    outputs: tuple[Output, ...]
    #: ``flags``, a sum of flags, see `robostiff.record.Flag`. With a closure also ``open``, the
    #: square of what the legs leave open, and ``mode``, positive in the assembly mode of home.
    checks: tuple[str, ...]
    space: Space
    #: its results are the rows of all outputs one after the other, a row for each entry, then a row
    #: for each check
    code: MachineCode | ArrayCode | ClosedCode = field(repr=False)

    @property
    def operations(self) -> int:
        """Number of operations a pose takes."""
        return self.code.operations

    @property
    def rows(self) -> int:
        """Number of rows of results, checks included."""
        return self.code.rows

    @property
    def chunk(self) -> int:
        """Poses at once whose rows stay in the cache; many, of which some need more steps."""
        if isinstance(self.code, ClosedCode):
            return POSES_A_CHUNK * _CHUNKS_OF_STEPS
        return POSES_A_CHUNK * max(1, _ROWS // (self.rows + len(self.inputs)))

    def evaluate(self, inputs: np.ndarray, out: Any = None, *, threads: int | None = 1) -> Any:
        """Rows of results at rows of inputs.

        Parameters
        ----------
        inputs : (n_inputs, N) array
            Equal coordinates of all poses side by side [m, rad]; rows of float64 are read where
            they are.
        out : (rows, N) array, or rows of (N,) arrays, optional
            Filled and returned when given: float64, poses side by side in each row. Rows a power of
            two apart are slow.
        threads : int or None
            None for one for each 10^5 poses, at most as many as processors.

        Raises
        ------
        InputError
            When an array has another shape, order or type.
        """
        is_array = isinstance(inputs, np.ndarray)
        if not is_array or inputs.ndim != 2 or len(inputs) != len(self.inputs):
            got = inputs.shape if is_array else type(inputs).__name__
            expected = f"an array ({len(self.inputs)}, N)"
            raise InputError("coordinates of the kernel", got=got, expected=expected)
        if inputs.dtype != np.float64 or (inputs.size and inputs.strides[1] != inputs.itemsize):
            inputs = np.ascontiguousarray(inputs, dtype=np.float64)
        count = inputs.shape[1]
        out = room_for(self.rows, count) if out is None else out
        fits = len(out) == self.rows and all(
            row.shape == (count,)
            and row.dtype == np.float64
            and (count < 2 or row.strides == (8,))
            and row.flags.writeable
            for row in (out[:1] if isinstance(out, np.ndarray) else out)
        )
        if not fits:
            got = [(row.shape, row.strides, str(row.dtype)) for row in out[:1]]
            raise InputError(
                "results of the kernel",
                got=Words(f"{len(out)} rows, of shape, strides and type {got}"),
                expected=f"{self.rows} rows ({count},) of float64, poses side by side",
            )
        self.code.evaluate(inputs, out, whole_threads(threads, count))
        return out

    def at_one(self, inputs: list[float]) -> Sequence[float]:
        """Results at one pose, as of `evaluate`."""
        found = None if isinstance(self.code, MachineCode) else self.code.at_one(inputs)
        return self.evaluate(np.array(inputs)[:, None])[:, 0] if found is None else found

    def by(self, code: Callable[[Program], MachineCode | ArrayCode]) -> Kernel:
        """The same kernel, run by another code."""
        return replace(self, code=self.code.by(code))


def processors() -> int:
    """How many this process may use."""
    are_told = hasattr(os, "sched_getaffinity")
    return len(os.sched_getaffinity(0)) if are_told else os.cpu_count() or 1


def whole_threads(threads: int | None, poses: int = 0) -> int:
    """A number of threads as it was given; of None, one for each 10^5 poses.

    Raises InputError when it is none.
    """
    if threads is None:
        return max(1, min(processors(), poses // _POSES_A_THREAD))
    check_whole("threads", threads)
    return threads


def kernel_of(
    recorded: RecordedRobot,
    outputs: Sequence[Output],
    backend: Backend = Backend.BEST,
    *,
    has_flags: bool = True,
) -> Kernel:
    """The kernel of a recorded robot.

    Parameters
    ----------
    recorded : RecordedRobot
    outputs : sequence of Output
    backend : Backend
    has_flags : bool
        Whether it also says where its results are right; False for poses known to be harmless.

    Raises
    ------
    InputError
        When machine code is selected and its compiler is not installed.
    NoAnswerError
        When an output has no answer at any pose.
    """
    entries = [entry for output in outputs for entry in output.entries(recorded)]
    names: tuple[str, ...] = ()
    if has_flags:
        from robostiff.recorded import flags_of

        gaps = [gap for x in outputs if isinstance(x, Rates) for gap in gaps_of(x, recorded)]
        entries.append(flags_of(recorded, gaps))
        names = ("flags",)
    program = Program.of(recorded.record, entries)
    inputs, closure, code = recorded.record.inputs, recorded.closure, code_of(backend)
    if closure is None:
        return Kernel(inputs, tuple(outputs), names, recorded.space, code(program))
    made = ClosedCode.of(closure, program, code)
    names = (*names, "open", "mode")
    return Kernel(closure.inputs, tuple(outputs), names, recorded.space, made)


def code_of(backend: Backend) -> type[MachineCode] | type[ArrayCode]:
    """What runs the programs of a backend.

    Raises InputError when it is none, or machine code without its compiler.
    """
    if not isinstance(backend, Backend):
        expected = ", ".join(str(member) for member in Backend)
        raise InputError("backend", got=backend, expected=expected)
    if backend is Backend.ARRAYS:
        return ArrayCode
    if machine_code_is_available():
        return MachineCode
    if backend is Backend.MACHINE:
        raise InputError(
            "backend of the kernel",
            got=Words("machine code"),
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
