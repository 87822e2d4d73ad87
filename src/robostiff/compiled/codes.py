"""Programs run at poses: as machine code by llvmlite, or by NumPy in chunks that fit the cache."""

from __future__ import annotations

import ctypes
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, cached_property, partial
from itertools import islice
from typing import Any, TypeAlias, TypeVar

import numpy as np

from robostiff.compiled.one_pose import OnePose
from robostiff.compiled.program_text import LONG, text_of
from robostiff.frozen import frozen
from robostiff.record import NUMPY_FUNCTIONS, Program

#: Numbers at poses: an array (rows, N), or rows (N,) each at a place of its own.
Rows: TypeAlias = np.ndarray | Sequence[np.ndarray]


@frozen
class Processor:
    """What code is compiled for."""

    name: str  # as LLVM calls it
    features: str
    width: int  # how many poses an operation takes
    part: int | None  # how many steps a part of a program has, where loops are to be short


# Intel's processors with AVX-512 look ahead over several turns of so short a loop. Narrower vectors
# have half the registers, and are not worth what parts hand on; AMD's (Zen) are quicker without.
_PART = 75
# Of long programs for as many poses an operation code is made quickly: LLVM does it in another way
# for ARM.
_WIDE = 4


@cache
def this_processor() -> Processor | None:
    """The processor at hand, or None where no machine code is made.

    That is where llvmlite is not installed, or the processor multiplies and adds in two steps. The
    width is eight on processors that lose no speed by that. The first processors with AVX-512
    slow down when they use it; those with its later parts do not.
    """
    try:
        import llvmlite.binding as llvm
    except ImportError:
        return None
    features = llvm.get_host_cpu_features()
    if platform.machine().lower() in ("arm64", "aarch64"):
        width = 2
    elif not features.get("fma", False):
        return None
    else:
        width = 8 if features.get("avx512vbmi2", False) else 4
    name = llvm.get_host_cpu_name()
    part = _PART if width == 8 and not name.startswith("znver") else None
    return Processor(name, features.flatten(), width, part)


def machine_code_is_available() -> bool:
    """Whether programs can be compiled here."""
    return this_processor() is not None


#: A compiled function: addresses of two tables, which have the addresses of the rows of inputs and
#: of results, the first pose, and the first after the last (they are apart by a multiple of the
#: width).
_Compiled = Callable[[int, int, int, int], None]


def functions_of(
    text: str, processor: Processor, kinds: Mapping[str, tuple[Any, ...]], *, quickly: bool = False
) -> dict[str, Any]:
    """Functions that are written in the language of LLVM, by name, with the types they take.

    `quickly`: a quarter of the time, for code that takes a tenth to a half longer to run.
    """
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu=processor.name, features=processor.features, opt=0 if quickly else 2, jit=True
    )
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
    engine.finalize_object()
    found = {}
    for name, kind in kinds.items():
        found[name] = ctypes.CFUNCTYPE(None, *kind)(engine.get_function_address(name))
        found[name].engine = engine  # owns the machine code, and lives as long as its functions
    return found


@frozen
class VectorFunction:
    """A program as machine code for one processor."""

    address: _Compiled
    width: int  # how many poses an operation takes

    @staticmethod
    def of(program: Program, processor: Processor) -> VectorFunction:
        """Compile a program."""
        pointer, count = ctypes.c_void_p, ctypes.c_int64
        kinds = {"program": (pointer, pointer, count, count)}
        quickly = processor.width >= _WIDE and program.operations > LONG
        text = text_of(program, processor.width, _PART if quickly else processor.part)
        functions = functions_of(text, processor, kinds, quickly=quickly)
        return VectorFunction(functions["program"], processor.width)

    def fill(self, inputs: Rows, outputs: Rows, part: slice) -> None:
        """Fill rows of results at a part of the poses, float64, poses side by side in each row."""
        start, stop, width = part.start, part.stop, self.width
        if stop - start >= width:
            tables = _addresses(inputs), _addresses(outputs)
            a, b = (table.ctypes.data for table in tables)
            whole = stop - (stop - start) % width
            self.address(a, b, start, whole)
            if whole < stop:  # the last poses, together with some of those before
                self.address(a, b, stop - width, stop)
        elif start < stop:
            # Fewer poses than an operation takes are filled up by the last one.
            last = np.minimum(np.arange(start, start + width), stop - 1)
            found = np.empty((len(outputs), width))
            self.fill(np.array([row[last] for row in inputs]), found, slice(0, width))
            for row, values in zip(outputs, found, strict=True):
                row[start:stop] = values[: stop - start]


def _addresses(rows: Rows) -> np.ndarray:
    """Where each row begins (rows,)."""
    if isinstance(rows, np.ndarray):
        return rows.ctypes.data + rows.strides[0] * np.arange(len(rows))
    return np.array([row.__array_interface__["data"][0] for row in rows], dtype=np.int64)


# Poses at once: the arrays in use at a time should stay in the second-level cache.
_CHUNK = 8192
# Poses whose intermediate results need no plan of the places that they share.
_FEW = 16
#: Poses at once: their rows of results stay in the cache until they are written to their places. A
#: multiple of all widths of vectors, so that no bit depends on it; no power of two, at which all
#: rows would share a few lines of the cache.
POSES_A_CHUNK = 8184
_LINE = 8  # numbers in a line of the cache


def in_shares(
    work: Callable[[slice], None], count: int, threads: int, chunk: int = POSES_A_CHUNK
) -> None:
    """Do work at so many poses, whole chunks of them in each thread."""
    share = max(1, -(-count // (chunk * threads))) * chunk
    shares = [slice(start, min(start + share, count)) for start in range(0, count, share)]
    if len(shares) <= 1:
        work(slice(0, count))
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(len(shares)) as pool:
        list(pool.map(work, shares))


def chunks_of(part: slice, chunk: int = POSES_A_CHUNK) -> Iterator[slice]:
    """A share of the poses chunk by chunk."""
    for start in range(part.start, part.stop, chunk):
        yield slice(start, min(start + chunk, part.stop))


def room_for(rows: int, poses: int) -> np.ndarray:
    """Room for rows of numbers at poses (rows, poses), which begin with lines of the cache.

    Rows are apart by an odd number of lines: rows that are a power of two apart share a few lines.
    """
    apart = _LINE * (-(-poses // _LINE) | 1)
    memory = np.empty(rows * apart + _LINE)
    start = -(memory.ctypes.data // memory.itemsize) % _LINE
    return memory[start : start + rows * apart].reshape(rows, apart)[:, :poses]


#: An operation with the places of its arguments and result: of rows, and from the end of numbers.
_Instruction = tuple[Any, int, int | None, int]


OneCode = TypeVar("OneCode")


@frozen
class _Code:
    program: Program

    def __getstate__(self) -> dict[str, Any]:
        # What is worked out at the first use cannot be pickled.
        return {"program": self.program}

    @property
    def operations(self) -> int:
        """Number of operations a pose takes."""
        return self.program.operations

    @property
    def rows(self) -> int:
        """Number of results."""
        return len(self.program.outputs)

    def by(self, code: Callable[[Program], OneCode]) -> OneCode:
        """The same program, run by another code."""
        return code(self.program)


@frozen
class ArrayCode(_Code):
    """Runs a program on rows of poses by NumPy, without allocating memory as it goes.

    At a single pose it works on floats.
    """

    def evaluate(self, inputs: np.ndarray, outputs: Rows, threads: int = 1) -> None:
        """Fill `outputs` (results, N) from `inputs` (inputs, N), float64."""
        n = inputs.shape[1]
        found = self.at_one(inputs[:, 0].tolist()) if n == 1 else None
        if found is None and n <= _FEW:
            with np.errstate(all="ignore"):
                found = self.program.evaluate(dict(zip(self.program.inputs, inputs, strict=True)))
        if found is None:
            in_shares(partial(self._fill, inputs, outputs), n, threads, _CHUNK)
            return
        for row, value in zip(outputs, found, strict=True):
            row[:] = value

    def _fill(self, inputs: np.ndarray, outputs: Rows, part: slice) -> None:
        instructions, results, numbers, count = self._plan
        rows = np.empty((count, min(_CHUNK, part.stop - part.start)))
        with np.errstate(all="ignore"):  # out of reach, roots are nan, which the guard detects
            for poses in chunks_of(part, _CHUNK):
                own = rows[:, : poses.stop - poses.start]
                arrays: list[Any] = [*inputs[:, poses], *own, *numbers]
                for function, a, b, out in instructions:
                    if b is None:
                        function(arrays[a], out=arrays[out])
                    else:
                        function(arrays[a], arrays[b], out=arrays[out])
                for row, place in zip(outputs, results, strict=True):
                    row[poses] = arrays[place]

    def at_one(self, inputs: list[float]) -> list[float] | None:
        """Results at one pose; None where some number has no value, as out of reach."""
        return self._one.results(inputs)

    @cached_property
    def _one(self) -> OnePose:
        return OnePose(self.program)

    @cached_property
    def _plan(self) -> tuple[list[_Instruction], list[int], list[float], int]:
        """Instructions, the places of the results, numbers, and how many rows they take.

        Rows are reused when no longer needed.
        """
        steps, first_row = self.program.steps, len(self.program.inputs)
        last = {k: i for i, (_, *pair) in enumerate(steps) for k in pair}
        kept, where, rows = set(self.program.outputs), list(range(first_row)), first_row
        free, numbers, instructions = list[int](), list[float](), list[_Instruction]()
        for i, (operation, a, b) in enumerate(islice(steps, first_row, None), first_row):
            if a < 0:
                numbers.append(steps.numbers[i])
                where.append(-len(numbers))
                continue
            # The result may take the place of an argument.
            idle = (k for k in {a, b} if k >= 0 and last[k] == i and k not in kept)
            free += [where[k] for k in idle if where[k] >= first_row]
            row = free.pop() if free else rows
            rows += row == rows
            second = None if b < 0 else where[b]
            instructions.append((NUMPY_FUNCTIONS[operation], where[a], second, row))
            where.append(row)
        results = [where[k] for k in self.program.outputs]
        return instructions, results, numbers[::-1], rows - first_row


@frozen
class MachineCode(_Code):
    """Runs a program on rows of poses as machine code, several poses an operation.

    It is compiled at the first use, for the processor at hand.
    """

    def evaluate(self, inputs: np.ndarray, outputs: Rows, threads: int = 1) -> None:
        """Fill `outputs` (results, N) from `inputs` (inputs, N), float64, rows contiguous."""
        # Machine code reads and writes as many rows as its program has.
        if len(inputs) != len(self.program.inputs) or len(outputs) != self.rows:
            raise ValueError(f"{len(inputs)} rows of inputs, {len(outputs)} of results")
        in_shares(partial(self._function.fill, inputs, outputs), inputs.shape[1], threads)

    @cached_property
    def _function(self) -> VectorFunction:
        processor = this_processor()
        if processor is None:
            raise RuntimeError("machine code is not available here")
        return VectorFunction.of(self.program, processor)
