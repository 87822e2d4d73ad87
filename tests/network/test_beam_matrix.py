"""The stiffness of a beam with two free ends, against the theory of beams."""

import numpy as np
import pytest

from robostiff.elasticity import EulerBernoulli, Timoshenko, beam_stiffness
from robostiff.network import beam_stiffness_12
from robostiff.spatial import twist_transport
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


@THEORIES
def test_it_is_symmetric_of_rank_six_and_never_negative(theory):
    s = np.tile(np.repeat([1.0, L], 3), 2)
    K = matrix(theory) / np.outer(s, s)
    values = np.linalg.eigvalsh(K)
    np.testing.assert_allclose(K, K.T, atol=1e-14 * values[-1])
    assert np.all(np.abs(values[:6]) < 1e-13 * values[-1])
    assert np.all(values[6:] > 1e-6 * values[-1])


@THEORIES
def test_a_rigid_body_motion_meets_no_stiffness(theory):
    K = matrix(theory)
    carried = np.vstack([np.eye(6), twist_transport(np.array([L, 0, 0]))])
    assert np.abs(K @ carried).max() < 1e-14 * np.abs(K).max()


@THEORIES
def test_wrenches_on_both_ends_are_in_equilibrium(theory):
    K = matrix(theory)
    to_start = twist_transport(np.array([L, 0, 0])).T
    assert np.abs(K[:6] + to_start @ K[6:]).max() < 1e-14 * np.abs(K).max()


@THEORIES
def test_clamped_at_its_end_it_is_the_mirrored_cantilever(theory):
    K = matrix(theory)
    turn = np.diag([-1.0, 1, -1, -1, 1, -1])  # half a turn about y swaps the ends
    np.testing.assert_allclose(turn @ K[:6, :6] @ turn, K[6:, 6:], rtol=1e-12, atol=1e-6)
