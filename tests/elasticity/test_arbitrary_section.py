"""Sections of sectionproperties against closed forms, and what is refused."""

import pytest

from robostiff.elasticity import i_section, rectangle, section_from_sectionproperties, tube
from robostiff.errors import InputError

pytestmark = pytest.mark.needs("sectionproperties")


def shape(name, **sizes):
    from sectionproperties.pre import library

    return getattr(library, name)(**sizes)


def material(name, E):
    from sectionproperties.pre.pre import Material

    return Material(name, E, 0.0, 250e6, 7850, "grey")


def meshed(geometry, size):
    from sectionproperties.analysis.section import Section

    return Section(geometry.create_mesh(mesh_sizes=size))


def assert_close(section, expected, **tolerances):
    for name in ("A", "Iy", "Iz", "J", "shear_factor_y", "shear_factor_z"):
        rel = tolerances.get(name, tolerances["rel"])
        assert getattr(section, name) == pytest.approx(getattr(expected, name), rel=rel), name


def test_tube():
    analysis = meshed(shape("circular_hollow_section", d=0.05, t=0.008, n=96), 4e-6)
    expected = tube(0.05, 0.034, poisson_ratio=0)
    assert_close(section_from_sectionproperties(analysis), expected, rel=2e-3)


@pytest.mark.parametrize("has_material", [False, True], ids=["geometric", "steel"])
def test_rectangle_wide_along_x_is_wide_along_y_here(has_material):
    more = {"material": material("steel", 210e9)} if has_material else {}
    analysis = meshed(shape("rectangular_section", b=0.06, d=0.02, **more), 4e-6)
    section = section_from_sectionproperties(analysis)
    assert_close(section, rectangle(0.06, 0.02, poisson_ratio=0), rel=1e-3)
    assert section.Iz == pytest.approx(9 * section.Iy, rel=1e-9)


def test_thin_walled_i():
    geometry = shape("i_section", d=0.2, b=0.1, t_f=0.005, t_w=0.004, r=0, n_r=1)
    section = section_from_sectionproperties(meshed(geometry, 6e-6))
    expected = i_section(0.1, 0.2, 0.004, 0.005, poisson_ratio=0)
    # Open thin walls: the shear factors of the formulas are a few per cent off.
    assert_close(section, expected, rel=1e-9, J=0.03, shear_factor_y=0.03, shear_factor_z=0.03)


def test_analyses_already_run_are_used():
    analysis = meshed(shape("rectangular_section", b=0.06, d=0.02), 4e-5)
    analysis.calculate_geometric_properties()
    analysis.calculate_warping_properties()
    omega = analysis.section_props.omega
    section_from_sectionproperties(analysis)
    assert analysis.section_props.omega is omega


@pytest.mark.parametrize("angle", [17.0, -30.0, 44.0])
@pytest.mark.parametrize(("b", "d"), [(0.06, 0.02), (0.02, 0.06)])
def test_axes_that_are_not_principal_are_refused_with_the_angle_to_rotate_by(b, d, angle):
    turned = shape("rectangular_section", b=b, d=d).rotate_section(angle=angle)
    with pytest.raises(InputError) as error:
        section_from_sectionproperties(meshed(turned, 4e-5))
    message = str(error.value)
    assert "product of inertia Ixy: got " in message
    assert f"geometry.rotate_section(angle={-angle:.10g})" in message
    assert f"turn the beam by {angle:.10g} degrees about its x axis" in message
    back = turned.rotate_section(angle=-angle)
    section_from_sectionproperties(meshed(back, 4e-5))


def test_shear_centre_away_from_the_centroid_is_refused():
    channel = shape("channel_section", d=0.1, b=0.05, t_f=0.005, t_w=0.005, r=0, n_r=1)
    with pytest.raises(InputError) as error:
        section_from_sectionproperties(meshed(channel, 1e-5))
    message = str(error.value)
    assert message.startswith("distance from centroid to shear centre of the analysed section [m]")
    assert "shear and torsion couple in this beam: give it as a 6x6 matrix instead" in message


def test_two_materials_are_refused():
    lower = shape("rectangular_section", b=0.06, d=0.02, material=material("steel", 210e9))
    upper = shape("rectangular_section", b=0.06, d=0.02, material=material("timber", 10e9))
    upper = upper.align_to(lower, on="top")
    with pytest.raises(InputError) as error:
        section_from_sectionproperties(meshed(lower + upper, 4e-5))
    assert "materials of the analysed section: got ['steel', 'timber']" in str(error.value)


def test_a_geometry_without_a_mesh_is_refused():
    geometry = shape("rectangular_section", b=0.06, d=0.02)
    with pytest.raises(InputError, match="expected a Section of sectionproperties; mesh the geom"):
        section_from_sectionproperties(geometry)
