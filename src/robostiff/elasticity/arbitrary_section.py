"""Cross-sections of any shape, from the finite elements of the package sectionproperties."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from robostiff.elasticity.shapes import CrossSection
from robostiff.errors import InputError, needs_extra

if TYPE_CHECKING:
    from sectionproperties.analysis.section import Section

# What is neglected when the axes are not quite principal, or the shear centre not quite the
# centroid, is of this relative size. The product of inertia is integrated exactly; the shear
# centre is a finite element result and scatters with the mesh.
_PRODUCT_OF_INERTIA = 1e-6
_SHEAR_CENTRE = 1e-2


def section_from_sectionproperties(analysis: Section) -> CrossSection:
    """The cross-section of any shape: axis x of sectionproperties becomes y here, and y becomes z.

    Parameters
    ----------
    analysis : sectionproperties.analysis.section.Section
        A meshed section of one material, its sides in metres, its axes principal. Its geometric and
        warping analyses are run if they have not been.

    Raises
    ------
    InputError
        Not such an object; more than one material; axes that are not principal (the message gives
        the angle to rotate by); a shear centre away from the centroid, so that shear and torsion
        couple.

    Notes
    -----
    ``Iy = integral y_sp^2 dA``, ``Iz = integral x_sp^2 dA``, J by Saint-Venant warping, and the
    shear factors ``A_s / A`` by energy (W. D. Pilkey, Analysis and Design of Elastic Beams,
    Wiley 2002, chapter 6). At Poisson ratio 0, the default material of sectionproperties, those
    agree with Cowper's; with another they differ by some per cent.

    Examples
    --------
    A steel rectangle 40 mm by 60 mm; the optional package comes with
    ``pip install 'robostiff[sections]'``::

        from sectionproperties.analysis import Section
        from sectionproperties.pre.library import rectangular_section

        geometry = rectangular_section(b=0.040, d=0.060)
        section = section_from_sectionproperties(Section(geometry.create_mesh(mesh_sizes=1e-5)))
    """
    with needs_extra("sections of any shape", "sections"):
        from sectionproperties.analysis.section import Section
    if not isinstance(analysis, Section):
        raise InputError(
            "analysed section",
            got=analysis,
            expected="a Section of sectionproperties",
            hint="mesh the geometry first: Section(geometry.create_mesh(mesh_sizes=...))",
        )
    if len(set(analysis.materials)) > 1:
        raise InputError(
            "materials of the analysed section",
            got=[m.name for m in analysis.materials],
            expected="one material",
            hint="give the beam as a 6x6 matrix instead",
        )
    properties = analysis.section_props
    if properties.phi is None:
        analysis.calculate_geometric_properties()
    if properties.j is None:
        analysis.calculate_warping_properties()
    area = float(analysis.get_area())
    if analysis.is_composite():
        E = analysis.materials[0].elastic_modulus
        ixx, iyy, ixy = analysis.get_eic(e_ref=E)
        torsion = analysis.get_ej(e_ref=E)
        shear_x, shear_y = analysis.get_eas(e_ref=E)
    else:
        ixx, iyy, ixy = analysis.get_ic()
        torsion = analysis.get_j()
        shear_x, shear_y = analysis.get_as()

    if abs(ixy) > _PRODUCT_OF_INERTIA * math.sqrt(ixx * iyy):
        # From x to the nearer principal axis: tan 2a = -2 Ixy / (Ixx - Iyy).
        angle = math.degrees(0.5 * math.atan2(-2 * ixy, ixx - iyy))
        angle -= math.copysign(90, angle) if abs(angle) > 45 else 0.0
        raise InputError(
            f"axes of the analysed section (Ixx {ixx:.4g}, Iyy {iyy:.4g}), product of inertia Ixy",
            got=float(ixy),
            expected="0, that is principal axes",
            hint=f"write geometry.rotate_section(angle={-angle:.10g}) before meshing, "
            f"and turn the beam by {angle:.10g} degrees about its x axis",
        )
    offset = math.dist(analysis.get_sc(), analysis.get_c())
    radius = math.sqrt((ixx + iyy) / area)
    if offset > _SHEAR_CENTRE * radius:
        raise InputError(
            "distance from centroid to shear centre of the analysed section [m]",
            got=offset,
            expected=f"at most {_SHEAR_CENTRE:g} of its radius of gyration {radius:.3g} m",
            hint="shear and torsion couple in this beam: give it as a 6x6 matrix instead, "
            "elasticity_from_compliance(C), or refine the mesh if the section is symmetric",
        )
    return CrossSection(
        A=area,
        Iy=float(ixx),
        Iz=float(iyy),
        J=float(torsion),
        shear_factor_y=float(shear_x) / area,
        shear_factor_z=float(shear_y) / area,
    )
