"""Beams: textbook deflections, virtual work integrals, closed-form inverse, batches, messages."""

import numpy as np
import pytest
import scipy.integrate
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.elasticity import beam_compliance, beam_stiffness, circle, material, rectangle
from robostiff.errors import InputError

THEORIES = [rs.EulerBernoulli(), rs.Timoshenko()]
ALUMINIUM = rs.Material("aluminium", E=70e9, G=26e9)
# All six numbers and both shear factors differ: an exchange of axes cannot hide.
ODD = rs.CrossSection(
    A=1.3e-3, Iy=2.1e-7, Iz=5.5e-7, J=3.7e-7, shear_factor_y=0.81, shear_factor_z=0.43
)


def virtual_work(L, m, s, theory):
    """Tip compliance by the unit load method: C = integral of S^T diag(flexibility) S ds.

    S(x) is statics written out for the section at x under a tip wrench: with the lever a = L - x,
    N = Fx, Vy = Fy, Vz = Fz, T = Mx, My(x) = My - a Fz, Mz(x) = Mz + a Fy.
    """
    ky, kz = theory.shear_factors(s)
    flexibility = np.diag(
        [
            1 / (m.E * s.A),
            0 if ky is None else 1 / (ky * m.G * s.A),
            0 if kz is None else 1 / (kz * m.G * s.A),
            1 / (m.G * s.J),
            1 / (m.E * s.Iy),
            1 / (m.E * s.Iz),
        ]
    )

    def integrand(x):
        S = np.eye(6)
        S[4, 2] = -(L - x)
        S[5, 1] = L - x
        return S.T @ flexibility @ S

    integral, _ = scipy.integrate.quad_vec(integrand, 0, L, epsrel=1e-13)
    return integral


@pytest.mark.parametrize("theory", THEORIES)
@pytest.mark.parametrize("L", [0.03, 0.4, 7.0])
def test_compliance_is_the_virtual_work_integral(L, theory):
    C = beam_compliance(L, ALUMINIUM, ODD, theory)
    expected = virtual_work(L, ALUMINIUM, ODD, theory)
    np.testing.assert_allclose(C, expected, rtol=1e-12, atol=0)


def test_cantilever_of_gere_and_timoshenko():
    # Gere and Timoshenko, Mechanics of Materials, 4th ed., table G-1, case 4 (force P at the free
    # end: P L^3/3EI, P L^2/2EI) and case 6 (moment M: M L^2/2EI, M L/EI); section 3.3, torsion
    # T L/GJ; section 2.2, P L/EA. Up is positive, so a force along y turns the tip about +z, one
    # along z turns it about -y.
    m, s, L = material("steel"), rectangle(0.03, 0.05), 0.8
    C = beam_compliance(L, m, s)
    P, M = 120.0, 45.0
    by_force_y = C @ [0, P, 0, 0, 0, 0]
    np.testing.assert_allclose(by_force_y[1], P * L**3 / (3 * m.E * s.Iz), rtol=1e-14)
    np.testing.assert_allclose(by_force_y[5], P * L**2 / (2 * m.E * s.Iz), rtol=1e-14)
    by_force_z = C @ [0, 0, P, 0, 0, 0]
    np.testing.assert_allclose(by_force_z[2], P * L**3 / (3 * m.E * s.Iy), rtol=1e-14)
    np.testing.assert_allclose(by_force_z[4], -P * L**2 / (2 * m.E * s.Iy), rtol=1e-14)
    by_moment = C @ [0, 0, 0, 0, 0, M]
    np.testing.assert_allclose(by_moment[1], M * L**2 / (2 * m.E * s.Iz), rtol=1e-14)
    np.testing.assert_allclose(by_moment[5], M * L / (m.E * s.Iz), rtol=1e-14)
    np.testing.assert_allclose((C @ [P, 0, 0, 0, 0, 0])[0], P * L / (m.E * s.A), rtol=1e-14)
    np.testing.assert_allclose((C @ [0, 0, 0, M, 0, 0])[3], M * L / (m.G * s.J), rtol=1e-14)


def test_only_two_couplings():
    C = beam_compliance(0.5, ALUMINIUM, ODD, rs.Timoshenko())
    pattern = np.eye(6, dtype=bool)
    pattern[[1, 5, 2, 4], [5, 1, 4, 2]] = True
    assert (C[~pattern] == 0).all()
    assert (C[pattern] != 0).all()


def test_timoshenko_adds_shear_to_the_deflections_and_nothing_else():
    L = 0.5
    extra = beam_compliance(L, ALUMINIUM, ODD, rs.Timoshenko()) - beam_compliance(L, ALUMINIUM, ODD)
    expected = np.zeros((6, 6))
    expected[1, 1] = L / (0.81 * ALUMINIUM.G * ODD.A)
    expected[2, 2] = L / (0.43 * ALUMINIUM.G * ODD.A)
    np.testing.assert_allclose(extra, expected, rtol=1e-9, atol=1e-25)


def test_shear_share_of_a_stubby_steel_bar():
    # 3 E / (16 k G) (d / L)^2 = 0.55 (d / L)^2 of the bending deflection at nu = 0.3.
    d = 0.02
    for slenderness, share in ((10, 0.0055), (5, 0.022)):
        bar = (slenderness * d, material("steel"), circle(d))
        ratio = beam_compliance(*bar, rs.Timoshenko())[1, 1] / beam_compliance(*bar)[1, 1]
        assert ratio - 1 == pytest.approx(share, rel=0.01)


@pytest.mark.parametrize("theory", THEORIES)
@given(L=st.floats(1e-2, 1e2))
def test_stiffness_is_the_inverse(L, theory):
    C = beam_compliance(L, ALUMINIUM, ODD, theory)
    K = beam_stiffness(L, ALUMINIUM, ODD, theory)
    # Scaled by the length, a beam is well conditioned: 1e-12 is then rounding.
    D = np.diag([1, 1, 1, L, L, L])
    D_inverse = np.diag(1 / np.diagonal(D))
    product = (D @ C @ D) @ (D_inverse @ K @ D_inverse)
    np.testing.assert_allclose(product, np.eye(6), atol=1e-12)
    scale = 1 / np.sqrt(np.diagonal(C))
    inverse = scale[:, None] * np.linalg.inv(scale[:, None] * C * scale) * scale
    np.testing.assert_allclose(K, inverse, rtol=1e-11, atol=1e-12 * np.abs(K).max())


@pytest.mark.parametrize("theory", THEORIES)
@given(L=st.floats(1e-2, 1e2))
def test_symmetric_and_positive_definite(L, theory):
    for matrix in (
        beam_compliance(L, ALUMINIUM, ODD, theory),
        beam_stiffness(L, ALUMINIUM, ODD, theory),
    ):
        assert (matrix == matrix.T).all()
        scale = 1 / np.sqrt(np.diagonal(matrix))
        assert np.linalg.eigvalsh(scale[:, None] * matrix * scale).min() > 0.01


@pytest.mark.parametrize("theory", THEORIES)
def test_from_metres_to_millimetres(theory):
    # In mm and N: E [N/mm^2], twist (mm, rad), wrench (N, N mm).
    mm = 1e3
    m = rs.Material("x", ALUMINIUM.E / mm**2, ALUMINIUM.G / mm**2)
    s = rs.CrossSection(
        ODD.A * mm**2,
        ODD.Iy * mm**4,
        ODD.Iz * mm**4,
        ODD.J * mm**4,
        ODD.shear_factor_y,
        ODD.shear_factor_z,
    )
    T = np.diag([mm, mm, mm, 1, 1, 1])
    in_mm = beam_compliance(0.5 * mm, m, s, theory)
    wrench = np.diag([1, 1, 1, mm, mm, mm])
    expected = T @ beam_compliance(0.5, ALUMINIUM, ODD, theory) @ np.linalg.inv(wrench)
    np.testing.assert_allclose(in_mm, expected, rtol=1e-12, atol=0)


@pytest.mark.parametrize("shape", [(), (1,), (4,), (3, 1, 2, 1), (0,)])
@pytest.mark.parametrize("theory", THEORIES)
@pytest.mark.parametrize("function", [beam_compliance, beam_stiffness])
def test_batches_of_lengths(function, theory, shape):
    L = np.random.default_rng(1).uniform(0.2, 2.0, shape)
    batch = function(L, ALUMINIUM, ODD, theory)
    assert batch.shape == (*shape, 6, 6)
    assert batch.dtype == np.float64
    for index in np.ndindex(*shape):
        single = function(float(L[index]), ALUMINIUM, ODD, theory)
        np.testing.assert_allclose(batch[index], single, rtol=1e-14, atol=0)


def test_whole_numbers_and_lists_are_lengths_too():
    expected = beam_compliance(2.0, ALUMINIUM, ODD)
    np.testing.assert_array_equal(beam_compliance(2, ALUMINIUM, ODD), expected)
    np.testing.assert_array_equal(beam_compliance([1, 2], ALUMINIUM, ODD)[1], expected)
    # int16 would overflow in L^3 at 40.
    small = beam_compliance(np.int16(40), ALUMINIUM, ODD)
    np.testing.assert_array_equal(small, beam_compliance(40.0, ALUMINIUM, ODD))


@pytest.mark.parametrize("bad", [0.0, -0.3, np.nan, np.inf])
@pytest.mark.parametrize("function", [beam_compliance, beam_stiffness])
def test_length_must_be_positive(function, bad):
    with pytest.raises(InputError) as error:
        function(bad, ALUMINIUM, ODD)
    assert str(error.value) == (
        f"length of the beam: got {bad!r}, expected a positive finite number [m]"
    )


def test_the_first_bad_length_of_a_batch_is_named():
    lengths = np.ones((2, 3))
    lengths[1, 2] = -0.3
    with pytest.raises(InputError) as error:
        beam_compliance(lengths, ALUMINIUM, ODD)
    assert str(error.value) == (
        "length of the beam[1, 2]: got -0.3, expected a positive finite number [m]"
    )


@pytest.mark.parametrize("bad", ["0.3 m", None, True, 1j, [0.3, [0.4, 0.5]]])
def test_length_must_be_a_number(bad):
    with pytest.raises(InputError, match=r"length of the beam.*call cantilever_compliance"):
        beam_compliance(bad, ALUMINIUM, ODD)


def test_timoshenko_needs_shear_factors():
    section = rs.CrossSection(1e-3, 1e-7, 1e-7, 2e-7, shear_factor_y=0.85)
    beam_compliance(1.0, ALUMINIUM, section)
    with pytest.raises(InputError) as error:
        beam_compliance(1.0, ALUMINIUM, section, rs.Timoshenko())
    assert str(error.value) == (
        "shear correction factors of the cross-section: got (0.85, None), expected two numbers, as "
        "the Timoshenko theory needs them; write CrossSection(..., shear_factor_y=0.85, "
        "shear_factor_z=0.85), take a shape such as tube(...), or leave shear out with "
        "EulerBernoulli()"
    )


def test_names_in_place_of_objects():
    with pytest.raises(InputError) as error:
        beam_compliance(1.0, "steel", ODD)  # type: ignore[arg-type]
    assert str(error.value) == (
        "material of the beam: got 'steel', expected a Material; "
        'write material("steel") or Material.isotropic(name, E, poisson_ratio, source)'
    )
    with pytest.raises(InputError) as error:
        beam_compliance(1.0, ALUMINIUM, 0.02)  # type: ignore[arg-type]
    assert str(error.value) == (
        "cross-section of the beam: got 0.02, expected a CrossSection; "
        "write tube(outer_diameter, inner_diameter) or another shape"
    )
