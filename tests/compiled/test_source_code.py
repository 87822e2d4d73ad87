"""Kernels as C99, compiled and run beside NumPy, and as CUDA, compiled to code of a GPU."""

import ctypes
import subprocess
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff import SourceLanguage
from robostiff.record import Flag
from tests.other_programs import command

# Closed forms; legs that steps close, and an arm at joint coordinates; in the plane
ROBOTS = ["hexapod", "3-puu", "six-joint-arm", "gough-stewart-a", "3-rpr", "two-link-arm"]
OUTPUTS = [rs.StiffnessMatrix(), rs.PrincipalStiffness()]


def compiled(name: str) -> rs.CompiledStiffness:
    return rs.compile(rs.load(name), OUTPUTS, backend=rs.Backend.ARRAYS)


def inputs_near(fast: rs.CompiledStiffness, count: int) -> np.ndarray:
    """Inputs of the kernel at poses near home, some of them far away."""
    given, _ = fast.taken.samples(1, 0)
    start: Any = given.values if isinstance(given, rs.JointCoordinates) else given
    random = np.random.default_rng(2)
    rows = start[np.arange(count) % len(start)] + random.uniform(
        -0.02, 0.02, (count, start.shape[1])
    )
    rows[::7] += 3.0
    return np.ascontiguousarray(rows.T)


@pytest.mark.needs("a C compiler")
@pytest.mark.parametrize("name", ROBOTS)
def test_c_gives_what_the_kernel_gives(name, tmp_path):
    fast = compiled(name)
    source, library = tmp_path / "kernel.c", tmp_path / "kernel.so"
    source.write_text(fast.source(SourceLanguage.C, "of_robot"), encoding="ascii")
    options = ["-std=c99", "-O2", "-Wall", "-Werror", "-shared", "-fPIC", str(source)]
    subprocess.run([command("a C compiler"), *options, "-o", str(library), "-lm"], check=True)
    inputs = inputs_near(fast, 50)
    count = inputs.shape[1]
    shapes = [output.shape(fast.kernel.space) for output in OUTPUTS]
    rows = sum(int(np.prod(shape)) for shape in shapes)
    out, flags = np.empty((rows, count)), np.empty(count, dtype=np.int32)
    arguments = (own.ctypes.data_as(ctypes.c_void_p) for own in (inputs, out, flags))
    ctypes.CDLL(str(library)).of_robot(ctypes.c_longlong(count), *arguments)
    code: Any = fast.kernel.code
    if fast.kernel.checks != ("flags",):
        code = code.whole  # far from home, the library takes more steps
    expected = np.empty((code.rows, count))
    code.evaluate(inputs, expected)
    given = expected[rows].astype(int)
    if len(fast.kernel.checks) > 1:
        arrived = (expected[rows + 1] < 1e-24) & (expected[rows + 2] > 0)
        given[~arrived] |= Flag.DOUBTFUL
    np.testing.assert_array_equal(flags, given)
    fine = flags == 0
    assert np.count_nonzero(fine) > 20
    assert not fine.all() or name in ("gough-stewart-a", "two-link-arm")  # which reach anywhere
    start = 0
    for shape in shapes:  # to 13 digits of the largest entry
        stop = start + int(np.prod(shape))
        size = np.abs(expected[start:stop, fine]).max(axis=0)
        assert np.all(np.abs(out[start:stop, fine] - expected[start:stop, fine]) <= 1e-13 * size)
        start = stop


@pytest.mark.needs("a C compiler")
def test_what_breaks_the_tests_for_numbers_is_refused_by_the_compiler(tmp_path):
    source = tmp_path / "kernel.c"
    source.write_text(compiled("3-rpr").source(SourceLanguage.C), encoding="ascii")
    run = [command("a C compiler"), "-ffast-math", "-fsyntax-only", str(source)]
    assert b"-ffast-math" in subprocess.run(run, check=False, capture_output=True).stderr


@pytest.mark.needs("NVRTC")
@pytest.mark.parametrize("name", ["hexapod", "gough-stewart-a"])
def test_cuda_is_compiled_to_code_of_a_gpu(name):
    found = find_spec("nvidia.cuda_nvrtc")
    assert found is not None
    assert found.submodule_search_locations is not None
    folder = Path(found.submodule_search_locations[0])
    libraries = [*folder.glob("lib/libnvrtc.so.*"), *folder.glob("bin/nvrtc64*0.dll")]
    nvrtc = ctypes.CDLL(str(libraries[0]))
    program, size = ctypes.c_void_p(), ctypes.c_size_t()
    text = compiled(name).source(SourceLanguage.CUDA, "of_robot").encode()
    assert nvrtc.nvrtcCreateProgram(ctypes.byref(program), text, b"k.cu", 0, None, None) == 0
    options = (ctypes.c_char_p * 1)(b"--gpu-architecture=compute_80")
    failed = nvrtc.nvrtcCompileProgram(program, 1, options)
    nvrtc.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    log = ctypes.create_string_buffer(size.value)
    nvrtc.nvrtcGetProgramLog(program, log)
    assert not failed, log.value.decode()
    assert nvrtc.nvrtcGetPTXSize(program, ctypes.byref(size)) == 0
    code = ctypes.create_string_buffer(size.value)
    nvrtc.nvrtcGetPTX(program, code)
    assert b".visible .entry of_robot(" in code.value
    assert b"fma.rn.f64" in code.value


def test_names_do_not_leave_the_comment():
    robot = rs.load("3-rpr")
    named = type(robot)(**{**robot.__dict__, "name": "x */ #error \n\\u2215 \\"})
    text = rs.compile(named).source(SourceLanguage.C)
    comment, code = text.split("*/", 1)
    assert "#error" in comment
    assert "\\" not in comment
    assert code.count("#error") == 1  # that about -ffast-math
