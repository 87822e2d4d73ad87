"""The stiffness of a beam with two free ends, against the theory of beams."""

import numpy as np
import pytest

from robostiff.elasticity import EulerBernoulli, Timoshenko, beam_stiffness
from robostiff.network import beam_stiffness_12
from tests.network.frames import BAR, STEEL

L = 0.7
THEORIES = pytest.mark.parametrize(
    "theory", [EulerBernoulli(), Timoshenko()], ids=["euler", "timoshenko"]
)


def matrix(theory):
    return beam_stiffness_12(beam_stiffness(L, STEEL, BAR, theory), L)


def printed(theory):
    """Entry by entry, as Przemieniecki prints it (1968, section 5.6)."""
    E, G, A, Iy, Iz, J = STEEL.E, STEEL.G, BAR.A, BAR.Iy, BAR.Iz, BAR.J
    ky, kz = theory.shear_factors(BAR)
    p = 0.0 if ky is None else 12 * E * Iz / (ky * G * A * L**2)
    q = 0.0 if kz is None else 12 * E * Iy / (kz * G * A * L**2)
    z, y = E * Iz / (1 + p), E * Iy / (1 + q)
    K = np.zeros((12, 12))
    for i, stiff in ((0, E * A / L), (3, G * J / L)):
        K[np.ix_([i, i + 6], [i, i + 6])] = stiff * np.array([[1, -1], [-1, 1]])
    for rows, B, shear, sign in (((1, 5, 7, 11), z, p, 1), ((2, 4, 8, 10), y, q, -1)):
        a, b = 12 / L**3, sign * 6 / L**2
        c, d = (4 + shear) / L, (2 - shear) / L
        K[np.ix_(rows, rows)] = B * np.array(
            [[a, b, -a, b], [b, c, -b, d], [-a, -b, a, -b], [b, d, -b, c]]
        )
    return K


@THEORIES
def test_it_is_the_matrix_that_is_printed(theory):
    expected = printed(theory)
    np.testing.assert_allclose(matrix(theory), expected, atol=1e-12 * np.abs(expected).max())
