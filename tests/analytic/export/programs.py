"""Exported functions as functions of Python: run, compiled, or read by a small reader."""

import ctypes
import subprocess

import numpy as np
import pytest

from robostiff.analytic.export import c_function, julia_function, matlab_function, python_function
from tests.analytic.export import small_readers
from tests.other_programs import command, is_there


def in_python(derivation, name="stiffness"):
    module = {}
    exec(compile(python_function(derivation, name), "generated", "exec"), module)  # noqa: S102
    return module[name]


def compiled(source, folder, name="stiffness"):
    code, library = folder / "formula.c", folder / "formula.so"
    code.write_text(source, encoding="ascii")
    options = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "-shared", "-fPIC"]
    words = [command("a C compiler"), *options, str(code), "-o", str(library), "-lm"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return getattr(ctypes.CDLL(str(library)), name)


def called(function, values, n, count=1):
    """K (n, n) of a function in C, or `count` matrices; ValueError where it refuses."""
    size = n * n
    found = [(ctypes.c_double * size)(*([-7.0] * size)) for _ in range(count)]
    if function(*found, (ctypes.c_double * max(len(values), 1))(*values)):
        assert all(x == -7.0 for own in found for x in own)
        raise ValueError("the formula does not hold")
    matrices = [np.array(own).reshape(n, n) for own in found]
    return matrices[0] if count == 1 else matrices


def in_c(derivation, folder):
    function, matrices = compiled(c_function(derivation), folder), derivation.matrices
    return lambda *values: called(function, values, matrices[0].rows, len(matrices))


WRITERS = {
    "python": python_function,
    "c": c_function,
    "julia": julia_function,
    "matlab": matlab_function,
}
READERS = {
    "python": lambda derivation, _: in_python(derivation),
    "c": in_c,
    "julia": lambda derivation, _: small_readers.julia(julia_function(derivation)),
}
in_all_languages = pytest.mark.parametrize(
    "language",
    [pytest.param(x, marks=[pytest.mark.needs("a C compiler")] * (x == "c")) for x in READERS],
)


def in_all(derivation, folder):
    """A function of each language of which there is a compiler, or a reader."""
    there = [x for x in READERS if x != "c" or is_there("a C compiler")]
    return [READERS[language](derivation, folder) for language in there]


def largest_difference(K, expected):
    return np.max(np.abs(K - expected)) / max(np.max(np.abs(expected)), 1e-300)
