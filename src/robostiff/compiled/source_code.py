"""Kernels as text of C99 and CUDA, which needs nothing of this package."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from enum import Enum

from robostiff.compiled.closed import ClosedCode
from robostiff.compiled.kernel import Kernel
from robostiff.compiled.one_pose import EXPRESSIONS, written_steps
from robostiff.errors import InputError, NoAnswerError
from robostiff.record import CLOSED, Flag, Operation, Program


class SourceLanguage(Enum):
    """Language of the source of a kernel: ``C`` (C99), or ``CUDA``."""

    C = "c"
    CUDA = "cuda"


_HEADS = {
    SourceLanguage.C: """\
#include <math.h>
#ifdef __FAST_MATH__
#error "-ffast-math removes the tests for what is no number"
#endif

void {name}(long long n, const double *restrict in, double *restrict out, int *restrict flags)
{{
    for (long long i = 0; i < n; ++i) {{
""",
    SourceLanguage.CUDA: """\
extern "C" __global__ void {name}(long long n, const double *__restrict__ in,
                                  double *__restrict__ out, int *__restrict__ flags)
{{
    const long long i = (long long)blockIdx.x * blockDim.x + threadIdx.x;
    if (i < n) {{
""",
}
_EXPRESSIONS = {
    **EXPRESSIONS,
    Operation.INPUT: "in[{i} * n + i]",
    # The lower one, or that which is no number.
    Operation.LEAST: "{b} < {a} || {b} != {b} ? {b} : {a}",
    Operation.GREATER: "{a} > {b} ? 1.0 : 0.0",
}
_FLAGS = (
    "1: an actuator is beyond its limits; 2: out of reach; 4: doubtful; 8: the rank is doubtful;",
    "16: eigenvalues meet, which have no derivatives; 32: no tensions of cables within limits;",
    "64: a cable without tension; 128: given tensions out of balance; where any of 2, 4, 8, 16 and",
    "32 is set the answer is not to be used",
)
_UNSAFE = re.compile(r"[^ -~]|[*\\?]")  # what could end a comment
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")


def source_of(kernel: Kernel, language: SourceLanguage, name: str, about: Sequence[str]) -> str:
    """The source of a function of a kernel, one pose after the other, or one a thread.

    Parameters
    ----------
    kernel : Kernel
    language : SourceLanguage
    name : str
        Of the function.
    about : sequence of str
        Lines of a comment in front of it.

    Raises
    ------
    InputError
        When the language is none, or the name no identifier.
    NoAnswerError
        When steps from home close the legs that are too many to be written out.
    """
    if not isinstance(language, SourceLanguage):
        raise InputError("language", got=language, expected="SourceLanguage.C or .CUDA")
    if not _IDENTIFIER.fullmatch(name):
        raise InputError("name of the function", got=name, expected="an identifier of C")
    code = kernel.code.whole if isinstance(kernel.code, ClosedCode) else kernel.code
    if code is None:
        raise NoAnswerError(f"no source of {kernel!r}: its steps from home are too many for one")
    rows = [f"{x.name}{list(x.shape(kernel.space)) or ''}" for x in kernel.outputs]
    lines = [
        *about,
        f"in: n numbers of each input, input after input (m, rad, SI): {' '.join(kernel.inputs)}",
        f"out: n numbers of each result, row after row of a matrix: {' '.join(rows)}",
        "flags[i]: the sum of what holds at pose i; 0 where the answer is right as it is",
        *_FLAGS,
    ]
    comment = "".join(f" * {_UNSAFE.sub('_', line)}\n" for line in lines)
    body = "".join(f"        {line}\n" for line in _statements(code.program, len(kernel.checks)))
    return f"/*\n{comment} */\n{_HEADS[language].format(name=name)}{body}    }}\n}}\n"


def _statements(program: Program, checks: int) -> Iterator[str]:
    """One a step, then the results; of the checks the flags, which a closure that fails adds to."""
    lines, results = written_steps(program, _EXPRESSIONS)
    yield from (f"const double {name} = {value};" for name, value in lines)
    for k, value in enumerate(results[: len(results) - checks]):
        yield f"out[{k} * n + i] = {value};"
    flags, *closure = results[len(results) - checks :]
    missed = ""
    if closure:
        arrives = f"{closure[0]} < {CLOSED!r} && {closure[1]} > 0.0"
        missed = f" | ({arrives} ? 0 : {Flag.DOUBTFUL.value})"
    yield f"flags[i] = (int)({flags}){missed};"
