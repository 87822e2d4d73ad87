"""The closed form (25) of the hexapod in C, written for this robot alone."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from batched_stiffness import K_ACTUATOR, Hexapod

from peers.way import PeerMissing, Way

_C_SOURCE = r"""
#include <math.h>
#include <stddef.h>

#define BLOCK 256

/* Sines and cosines have loops of their own: gcc does not vectorise the two together. */
static void block(const double *restrict in, double *restrict out, ptrdiff_t n, int m) {
    double angle[BLOCK], sine[BLOCK], cosine[BLOCK];
    for (int i = 0; i < m; ++i) {
        const double r0 = in[3*n + i], r1 = in[4*n + i], r2 = in[5*n + i];
        angle[i] = sqrt(r0*r0 + r1*r1 + r2*r2 + 1e-300);
    }
    for (int i = 0; i < m; ++i) sine[i] = sin(0.5*angle[i]);
    for (int i = 0; i < m; ++i) cosine[i] = cos(0.5*angle[i]);
    #pragma omp simd
    for (int i = 0; i < m; ++i) {
        const double x = in[i], y = in[n + i], z = in[2*n + i];
        const double r0 = in[3*n + i], r1 = in[4*n + i], r2 = in[5*n + i];
        const double s = sine[i] / angle[i], w = cosine[i];
        const double p = s*r0, q = s*r1, r = s*r2;
        const double R00 = 1 - 2*(q*q + r*r), R01 = 2*(p*q - w*r), R02 = 2*(p*r + w*q);
        const double R10 = 2*(p*q + w*r), R11 = 1 - 2*(p*p + r*r), R12 = 2*(q*r - w*p);
        const double R20 = 2*(p*r - w*q), R21 = 2*(q*r + w*p), R22 = 1 - 2*(p*p + q*q);
        double %(zero)s;
        %(legs)s
        %(store)s
    }
}

void stiffness(const double *restrict in, double *restrict out, ptrdiff_t n) {
    for (ptrdiff_t i = 0; i < n; i += BLOCK)
        block(in + i, out + i, n, n - i < BLOCK ? (int)(n - i) : BLOCK);
}
"""

_C_LEG = r"""{
            const double b0 = R00*(%(B0)s) + R01*(%(B1)s) + R02*(%(B2)s);
            const double b1 = R10*(%(B0)s) + R11*(%(B1)s) + R12*(%(B2)s);
            const double b2 = R20*(%(B0)s) + R21*(%(B1)s) + R22*(%(B2)s);
            const double d0 = x + b0 - (%(A0)s), d1 = y + b1 - (%(A1)s), d2 = z + b2 - (%(A2)s);
            const double L = sqrt(d0*d0 + d1*d1 + d2*d2), by = 1/L;
            const double k = 1/(%(compliance)s + L*%(by_EA)s);
            const double f0 = d0*by, f1 = d1*by, f2 = d2*by;
            const double f3 = b1*f2 - b2*f1, f4 = b2*f0 - b0*f2, f5 = b0*f1 - b1*f0;
            const double g0 = k*f0, g1 = k*f1, g2 = k*f2, g3 = k*f3, g4 = k*f4, g5 = k*f5;
            %(sums)s
        }
        """


def closed_form_in_c(robot: Hexapod) -> Way:
    """K_C compiled for this machine; PeerMissing without a C compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise PeerMissing("no C compiler")
    places = [(i, j) for i in range(6) for j in range(i, 6)]
    numbers = {"compliance": repr(1 / K_ACTUATOR), "by_EA": repr(1 / (robot.E * robot.A))}
    numbers["sums"] = " ".join(f"K{i}{j} += g{i}*f{j};" for i, j in places)
    legs = [
        _C_LEG % {**numbers, **_coordinates("A", a), **_coordinates("B", b)}
        for a, b in zip(robot.base, robot.platform, strict=True)
    ]
    source = _C_SOURCE % {
        "zero": ", ".join(f"K{i}{j} = 0" for i, j in places),
        "legs": "".join(legs),
        "store": " ".join(f"out[{e}*n + i] = K{i}{j};" for e, (i, j) in enumerate(places)),
    }
    folder = Path(tempfile.mkdtemp(prefix="robostiff-bench-"))
    program = folder / "stiffness.c"
    program.write_text(source)
    library = folder / "stiffness.so"
    flags = ["-O3", "-march=native", "-ffast-math", "-fopenmp-simd", "-shared", "-fPIC"]
    wide = "-mprefer-vector-width=512"  # as the kernel
    command = [compiler, *flags, wide, "-o", str(library), str(program), "-lmvec", "-lm"]
    subprocess.run(command, check=True)  # noqa: S603 - its parts are our own
    function = ctypes.CDLL(str(library)).stiffness
    pointer = ctypes.POINTER(ctypes.c_double)
    function.argtypes = [pointer, pointer, ctypes.c_ssize_t]
    function.restype = None

    buffers: dict[int, np.ndarray] = {}  # as the kernel's rows have: memory touched before

    def evaluate(rows: np.ndarray) -> np.ndarray:
        out = buffers.setdefault(rows.shape[1], np.empty((21, rows.shape[1])))
        function(rows.ctypes.data_as(pointer), out.ctypes.data_as(pointer), rows.shape[1])
        return out

    return evaluate


def _coordinates(name: str, point: np.ndarray) -> dict[str, str]:
    return {f"{name}{i}": repr(float(x)) for i, x in enumerate(point)}
