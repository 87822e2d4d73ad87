"""Quantiles of the normal distribution, a few nanoseconds each."""

from __future__ import annotations

from functools import cache, reduce

import numpy as np

from robostiff.compiled import Backend
from robostiff.compiled.codes import ArrayCode, MachineCode
from robostiff.compiled.kernel import code_of
from robostiff.compiled.machine_code import machine_code_is_available
from robostiff.record import Program, Record, least, reciprocal, square_root

# Quantiles nearer to 0 and 1 are as this one is: 6.2 standard deviations away.
_LEAST = 2.0**-32
# A ratio of polynomials, highest powers first, of t = s - _MIDDLE: the best of its degrees.
_MIDDLE = 0.6363134665811736
_ABOVE = (
    *(176.76572677318285, -390.5979180905768, 62.57672311603761, 648.1094190991798),
    *(-866.8785895851253, 387.9081220677906, 191.57595245981105, -415.7177195674008),
    *(321.8095824936342, -89.19136152964228, -34.701475560106715, 61.523790871622325),
    *(-27.080660384270324, 7.136373810116257),
)
_BELOW = (
    *(-17.352298890236565, 62.93612196477979, 41.52544559068546, -7.706107435125373),
    *(96.92227301585747, 18.149665071557443, 5.011370647322665, 37.593933237939105),
    *(-6.434405109913506, 5.362724046475741, 4.994757429888054, -1.9554275363045632, 1.0),
)


def normal_quantiles(u: np.ndarray, out: np.ndarray) -> np.ndarray:
    """Values below which a normally distributed number is with probability u.

    ``(u - 1/2) r(s)``, ``s = (4 u (1 - u))^(1/16)``. Beside the first factor nothing is odd in
    ``u - 1/2``, and s makes the singular places at 0 and 1 a mild one, so that r is a ratio of
    polynomials. Right to 1.2e-15 of the value.

    Parameters
    ----------
    u : array
        Between 0 and 1, float64, contiguous; those within 2^-32 of 0 and 1 as these.
    out : array
        Filled and returned.
    """
    _code().evaluate(u.reshape(1, -1), out.reshape(1, -1))
    return out


@cache
def _code() -> MachineCode | ArrayCode:
    record = Record({"u": [0.3, 0.7]})
    u = record.input("u")
    s = -least(-4.0 * u * (1.0 - u), -4.0 * _LEAST * (1.0 - _LEAST))
    for _ in range(4):
        s = square_root(s)
    t = s - _MIDDLE
    above, below = (reduce(lambda x, c: x * t + c, part) for part in (_ABOVE, _BELOW))
    program = Program.of(record, [(u - 0.5) * above * reciprocal(below)])
    backend = Backend.BEST if machine_code_is_available() else Backend.ARRAYS
    return code_of(backend)(program)
