"""Sections against handbooks and closed forms, and the table of materials."""

import dataclasses
import math
import sys

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.elasticity import MATERIALS, section_from_sectionproperties

side = st.floats(1e-3, 1.0)


def test_thin_tube_keeps_its_digits():
    # 2 pi r t and pi r^3 t, the limits of a thin wall: here 1 um on 1 m.
    section = rs.tube(1.0 + 1e-6, 1.0 - 1e-6)
    assert section.A == pytest.approx(math.pi * 1e-6, rel=1e-9)
    assert section.Iy == pytest.approx(math.pi / 8 * 1e-6, rel=1e-9)


@pytest.mark.parametrize("ratio", ["1", "1.01", "1.7", "3", "12", "250"])
def test_rectangle_torsion_constant_to_14_digits(ratio):
    # The series of Saint-Venant term by term, 30 digits.
    with mpmath.workdps(30):
        r = mpmath.mpf(ratio)

        def term(k):
            n = 2 * k + 1
            return mpmath.tanh(n * mpmath.pi * r / 2) / n**5

        series = mpmath.nsum(term, [0, mpmath.inf])
        exact = float(r / 3 * (1 - 192 / mpmath.pi**5 / r * series))
    assert rs.rectangle(float(ratio), 1.0).J == pytest.approx(exact, rel=1e-14)


def test_thin_square_box_has_the_torsion_constant_t_b3():
    assert rs.box(1.0, 1.0, 1e-6).J == pytest.approx(1e-6, rel=1e-5)


def test_i_section_moments_by_steiner():
    b, h, w, f = 0.1, 0.2, 0.0056, 0.0085
    section = rs.i_section(b, h, w, f)
    web = h - 2 * f
    assert section.A == pytest.approx(2 * b * f + web * w, rel=1e-14)
    steiner = 2 * (b * f**3 / 12 + b * f * ((h - f) / 2) ** 2) + w * web**3 / 12
    assert section.Iy == pytest.approx(steiner, rel=1e-13)
    assert section.Iz == pytest.approx(2 * f * b**3 / 12 + web * w**3 / 12, rel=1e-13)


# By particular solutions of the stress function, which at the corners are r^(2k/3), with 70 terms;
# of a T-junction of an I-section, the excess over its strips [f^4] at w/f.
@pytest.mark.parametrize(
    ("b", "h", "wall", "J", "rel"),
    [
        (1, 1, 0.05, 0.043945964, 1e-7),
        (1, 1, 0.1, 0.077093409, 1e-8),
        (1, 2, 0.2, 0.348629, 2e-6),
        (1, 1, 0.2, 0.11812214, 3e-6),
        (1, 1, 0.25, 0.12913154, 6e-5),
        (3, 1, 0.3, 0.72011157, 2e-4),
        (1, 1, 0.3333, 0.13812, 2e-3),
    ],
)
def test_torsion_constant_of_boxes_with_thick_walls(b, h, wall, J, rel):
    assert rs.box(b, h, wall).J == pytest.approx(J, rel=rel)


def test_a_box_without_hollow_has_nearly_the_torsion_constant_of_a_rectangle():
    assert rs.box(1, 2, 0.4999999).J == pytest.approx(rs.rectangle(1, 2).J, rel=0.013)


@pytest.mark.parametrize(
    ("ratio", "excess"),
    [(0.5, 0.0604627), (1, 0.2919551), (1.5, 0.68168), (2, 1.079972), (4, -5.596), (8, -260.24)],
)
def test_torsion_constant_of_junctions_of_an_i_section(ratio, excess):
    b, h, f = 100.0, 200.0, 1.0
    strips = (2 * b * f**3 + (h - 2 * f) * ratio**3) / 3 - 0.42018 * f**4
    J = rs.i_section(b, h, ratio, f).J
    assert (J - strips) / 2 == pytest.approx(excess, abs=5e-4 * max(1, ratio) ** 3.5)


def test_cowper_shear_factors_of_full_sections():
    # Cowper 1966, table 1, at nu = 0.3: circle 0.886, rectangle 0.850; thin tube 0.531.
    assert rs.circle(0.02).shear_factor_y == pytest.approx(0.886, abs=5e-4)
    assert rs.rectangle(0.02, 0.05).shear_factor_z == pytest.approx(0.850, abs=5e-4)
    assert rs.tube(1.0, 0.9999).shear_factor_y == pytest.approx(0.531, abs=5e-4)


def test_shear_factors_without_lateral_strain_are_those_of_elementary_theory():
    # nu = 0: 6/7 circle, 5/6 rectangle, 1/2 thin tube.
    assert rs.circle(1.0, poisson_ratio=0).shear_factor_z == pytest.approx(6 / 7, rel=1e-15)
    assert rs.rectangle(1, 2, poisson_ratio=0).shear_factor_y == pytest.approx(5 / 6, rel=1e-15)
    assert rs.tube(1, 1 - 1e-9, poisson_ratio=0).shear_factor_y == pytest.approx(0.5, rel=1e-8)


def _cowper(nu, strips):
    """Cowper's general formula (1966) on centre lines: force along z, one quarter of the section.

    k = 2 (1 + nu) Iy / (nu/2 (Iz - Iy) - A/Iy integral of z (chi + z y^2) dA), where chi, the
    flexure function of Saint-Venant, follows along each wall from the shear flow:
    dchi/ds = -2 (1 + nu) Q/t - z' (nu/2 z^2 + (1 - nu/2) y^2) - y' (2 + nu) y z.
    Every strip is (thickness, length, y(s), z(s), Q(s)/t) with polynomials in s, in the order of
    the flow from the neutral axis on; Q/t is positive where the flow runs along s.
    """
    area = Iy = Iz = last = 0.0
    chi_end = 0.0
    for thickness, length, y, z, flow in strips:
        slope = -2 * (1 + nu) * flow - z.deriv() * (nu / 2 * z**2 + (1 - nu / 2) * y**2)
        slope = slope - y.deriv() * (2 + nu) * y * z
        chi = slope.integ() + chi_end
        chi_end = chi(length)
        area += thickness * length
        Iy += thickness * (z**2).integ()(length)
        Iz += thickness * (y**2).integ()(length)
        last += thickness * (z * (chi + z * y**2)).integ()(length)
    return 2 * (1 + nu) * Iy / (nu / 2 * (Iz - Iy) - area / Iy * last)


S = np.polynomial.Polynomial([0.0, 1.0])


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
def test_cowper_equation_on_a_narrow_rectangle(nu):
    # The narrow rectangle, where the formula is 10 (1 + nu) / (12 + 11 nu): the test is tested.
    half = (1.0, 0.5, 0 * S, S, (0.25 - S**2) / 2)
    expected = rs.rectangle(1.0, 1.0, poisson_ratio=nu).shear_factor_y
    assert _cowper(nu, [half]) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
@pytest.mark.parametrize(("b", "h"), [(1.0, 1.0), (2.0, 1.0), (0.4, 1.0)])
def test_box_factor_from_cowper_equation(b, h, nu):
    t = 1e-7
    web = (1.0, h / 2, 0 * S + b / 2, S, b * h / 4 + (h**2 / 4 - S**2) / 2)
    flange = (1.0, b / 2, b / 2 - S, 0 * S + h / 2, h / 2 * (b / 2 - S))
    section = rs.box(b + t, h + t, t, poisson_ratio=nu)
    assert section.shear_factor_z == pytest.approx(_cowper(nu, [web, flange]), rel=1e-6)
    turned = rs.box(h + t, b + t, t, poisson_ratio=nu)
    assert turned.shear_factor_y == pytest.approx(section.shear_factor_z, rel=1e-14)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
@pytest.mark.parametrize(("b", "h", "w", "f"), [(0.5, 1, 1e-7, 1e-7), (1, 1, 2e-7, 3e-7)])
def test_i_factor_from_cowper_equation(b, h, w, f, nu):
    # Half of the web belongs to each side.
    web = (w / 2, h / 2, 0 * S, S, f * b * h / (2 * w) + (h**2 / 4 - S**2) / 2)
    flange = (f, b / 2, S, 0 * S + h / 2, h / 2 * (b / 2 - S))
    section = rs.i_section(b, h + f, w, f, poisson_ratio=nu)
    assert section.shear_factor_z == pytest.approx(_cowper(nu, [web, flange]), rel=1e-5)
    if nu == 0:
        assert section.shear_factor_y == pytest.approx(5 / 6 * 2 * b * f / section.A, rel=1e-12)


@given(b=side, h=side, nu=st.floats(0, 0.49))
def test_shear_factors_are_factors(b, h, nu):
    wall = min(b, h) / 10
    for section in (
        rs.circle(b, poisson_ratio=nu),
        rs.tube(b, 0.7 * b, poisson_ratio=nu),
        rs.rectangle(b, h, poisson_ratio=nu),
        rs.box(b, h, wall, poisson_ratio=nu),
        rs.i_section(b, h, wall, wall, poisson_ratio=nu),
    ):
        assert 0 < section.shear_factor_y < 1  # type: ignore[operator]
        assert 0 < section.shear_factor_z < 1  # type: ignore[operator]


@given(length_unit=st.sampled_from([1e3, 1e-3, 39.37]))
def test_units_of_length_scale_out(length_unit):
    def sections(unit):
        yield rs.circle(0.02 * unit)
        yield rs.tube(0.03 * unit, 0.02 * unit)
        yield rs.rectangle(0.02 * unit, 0.05 * unit)
        yield rs.box(0.02 * unit, 0.05 * unit, 0.003 * unit)
        yield rs.i_section(0.02 * unit, 0.05 * unit, 0.003 * unit, 0.004 * unit)

    for ours, theirs in zip(sections(1.0), sections(length_unit), strict=True):
        assert theirs.A == pytest.approx(ours.A * length_unit**2, rel=1e-12)
        for name in ("Iy", "Iz", "J"):
            expected = getattr(ours, name) * length_unit**4
            assert getattr(theirs, name) == pytest.approx(expected, rel=1e-12)
        assert theirs.shear_factor_y == pytest.approx(ours.shear_factor_y, rel=1e-12)


def test_a_missing_package_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "sectionproperties", None)
    with pytest.raises(rs.InputError) as error:
        section_from_sectionproperties(None)  # type: ignore[arg-type]
    assert str(error.value) == (
        "sections of any shape need 'sectionproperties', which is not installed; "
        "write pip install 'robostiff[sections]'"
    )


def test_structural_steel_of_eurocode_3():
    steel = rs.material("steel")
    assert steel.E == 210e9
    assert steel.G == pytest.approx(80.769e9, rel=1e-5)
    assert steel.poisson_ratio == pytest.approx(0.3, rel=1e-14)


@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_has_a_source_and_sane_moduli(name):
    entry = MATERIALS[name]
    assert entry.name == name == name.lower()
    assert " " not in name
    assert len(entry.source) > 10
    assert 40e9 < entry.E < 250e9
    assert 0.2 < entry.poisson_ratio < 0.37


@pytest.mark.parametrize(
    ("name", "ksi_E", "ksi_G"),
    [
        ("aluminium-6061", 10.0e3, 3.8e3),
        ("aluminium-7075", 10.4e3, 3.9e3),
        ("titanium-6al-4v", 16.0e3, 6.2e3),
        ("magnesium-az31b", 6.5e3, 2.4e3),
        ("brass", 14.0e3, 5.3e3),
    ],
)
def test_handbook_values_in_inch_units(name, ksi_E, ksi_G):
    ksi = 6.894757e6
    assert rs.material(name).E == pytest.approx(ksi_E * ksi, rel=6e-3)
    assert rs.material(name).G == pytest.approx(ksi_G * ksi, rel=2e-2)


def test_the_table_cannot_be_changed():
    with pytest.raises(TypeError):
        MATERIALS["steel"] = rs.Material("steel", 1.0, 1.0)  # type: ignore[index]
    with pytest.raises(dataclasses.FrozenInstanceError):
        rs.material("steel").E = 1.0  # type: ignore[misc]


def test_numpy_numbers_become_floats():
    entry = rs.Material("x", np.int64(2), np.float32(1.0))  # type: ignore[arg-type]
    assert type(entry.E) is float
    assert type(entry.G) is float


def test_poisson_ratio_returns():
    assert rs.Material.isotropic("x", 3.0, -0.4).poisson_ratio == pytest.approx(-0.4, rel=1e-14)
