"""Cross-sections of the usual shapes, and of any shape by the package sectionproperties.

Of a shape y is the width, z the height, both principal. Each carries Cowper's shear correction
factors, which depend weakly on the Poisson ratio of the material, 0.3 unless said otherwise. They
matter to the Timoshenko theory alone. A, Iy and Iz are exact. Every dimension may be a formula;
numbers beside it then become exact.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from robostiff.elasticity.checks import (
    Bounds,
    left_open,
    poisson_ratio_of_isotropic,
    positive_number,
)
from robostiff.errors import InputError, needs_extra
from robostiff.frozen import field, frozen
from robostiff.spatial import full_turn
from robostiff.spatial.formula import exact_number, exact_together, is_formula

if TYPE_CHECKING:
    from sectionproperties.analysis.section import Section


@frozen
class CrossSection:
    """Cross-section of a beam along x, in its principal axes y and z through the centroid.

    Each number may be a formula.

    Parameters
    ----------
    A : float
        Area [m^2].
    Iy : float
        Second moment ``integral z^2 dA`` [m^4]: bending in the x-z plane.
    Iz : float
        Second moment ``integral y^2 dA`` [m^4]: bending in the x-y plane.
    J : float
        Saint-Venant torsion constant [m^4]; the polar moment Iy + Iz for circles and tubes only.
    shear_factor_y, shear_factor_z : float, optional
        Shear correction factors [] of a force along y and along z: the shear stiffness is
        ``shear_factor * G * A``. Only the Timoshenko theory uses them.
    bounds : tuple of Bounds, optional
        Inequalities that formulas leave open and without which the shape does not exist; A, Iy, Iz
        and J are positive when left out.

    Raises
    ------
    InputError
        A number is not positive and finite.

    Notes
    -----
    The shear centre is taken to be the centroid, as it is for every doubly symmetric shape.

    Examples
    --------
    >>> CrossSection(A=1e-4, Iy=8e-10, Iz=8e-10, J=1.4e-9).shear_factor_y is None
    True
    """

    A: Any
    Iy: Any
    Iz: Any
    J: Any
    shear_factor_y: Any = None
    shear_factor_z: Any = None
    bounds: Any = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        positive = []
        for name, words, unit in (
            ("A", "area A", "m^2"),
            ("Iy", "second moment of area Iy", "m^4"),
            ("Iz", "second moment of area Iz", "m^4"),
            ("J", "torsion constant J", "m^4"),
            ("shear_factor_y", "shear correction factor along y", ""),
            ("shear_factor_z", "shear correction factor along z", ""),
        ):
            value = getattr(self, name)
            if value is None and name.startswith("shear_factor"):
                continue
            subject = f"{words} of the cross-section"
            object.__setattr__(self, name, number := positive_number(subject, value, unit))
            if is_formula(number):
                positive.append(Bounds(subject, number))
        bounds = positive if self.bounds is None else self.bounds
        object.__setattr__(self, "bounds", left_open(bounds))


def rectangle_shear_factor(nu: float) -> float:
    """Of a full rectangle [], along either side: ``10 (1 + nu) / (12 + 11 nu)``."""
    return 10 * (1 + nu) / (12 + 11 * nu)


def box_shear_factor(nu: float, m: float, n: float) -> float:
    """Of a thin-walled box [], force along the webs.

    ``10 (1 + nu) (1 + 3m)^2 / (12 + 72m + 150m^2 + 90m^3 + nu (11 + 66m + 135m^2 + 90m^3)
    + 10 n^2 ((3 + nu) m + 3 m^2))``; m = (area of a flange) / (area of a web), n = width / height,
    all on centre lines.
    """
    flanges = 10 * n * n * ((3 + nu) * m + 3 * m * m)
    return _thin_walled(nu, m, flanges)


def _thin_walled(nu: float, m: float, flanges: float) -> float:
    static = 12 + 72 * m + 150 * m**2 + 90 * m**3
    lateral = 11 + 66 * m + 135 * m**2 + 90 * m**3
    return 10 * (1 + nu) * (1 + 3 * m) ** 2 / (static + nu * lateral + flanges)


def circle(diameter: Any, *, poisson_ratio: Any = 0.3) -> CrossSection:
    """Full circle: ``A = pi d^2 / 4``, ``Iy = Iz = pi d^4 / 64``, ``J = pi d^4 / 32`` (exact).

    Parameters
    ----------
    diameter : float
        Diameter d [m].
    poisson_ratio : float
        Of the material [], for the shear correction factors.

    Raises
    ------
    InputError
        The diameter is not positive and finite.

    Examples
    --------
    >>> circle(0.02).A
    0.000314159...
    """
    d = positive_number("diameter of the circle", diameter, "m")
    d, nu = exact_together(d, poisson_ratio_of_isotropic(poisson_ratio))
    pi = full_turn(d) / 2
    inertia = pi * d**4 / 64
    factor = 6 * (1 + nu) / (7 + 6 * nu)
    bounds = (Bounds("diameter of the circle", d),)
    return CrossSection(pi * d**2 / 4, inertia, inertia, 2 * inertia, factor, factor, bounds)


def tube(outer_diameter: Any, inner_diameter: Any, *, poisson_ratio: Any = 0.3) -> CrossSection:
    """Circular tube: ``A = pi (D^2 - d^2) / 4``, ``Iy = Iz = J / 2 = pi (D^4 - d^4) / 64`` (exact).

    Parameters
    ----------
    outer_diameter, inner_diameter : float
        Diameters D > d [m].
    poisson_ratio : float
        Of the material [], for the shear correction factors.

    Raises
    ------
    InputError
        A diameter is not positive and finite, or the inner one is not the smaller.

    Examples
    --------
    >>> tube(0.1, 0.06).A
    0.00502654...
    """
    D = positive_number("outer diameter of the tube", outer_diameter, "m")
    subject, hint = "inner diameter of the tube", "for a full bar use circle(diameter)"
    d = positive_number(subject, inner_diameter, "m", hint)
    D, d, nu = exact_together(D, d, poisson_ratio_of_isotropic(poisson_ratio))
    hint = "write tube(outer_diameter, inner_diameter), diameters and not radii"
    bounds = Bounds(subject, d, 0, D, f"less than the outer diameter {D!r}", hint)
    area = full_turn(D) / 2 * (D - d) * (D + d) / 4
    inertia = area * (D * D + d * d) / 16
    m = d / D
    q = (1 + m * m) ** 2
    factor = 6 * (1 + nu) * q / ((7 + 6 * nu) * q + (20 + 12 * nu) * m * m)
    return CrossSection(area, inertia, inertia, 2 * inertia, factor, factor, (bounds,))


def rectangle(width_y: Any, height_z: Any, *, poisson_ratio: Any = 0.3) -> CrossSection:
    """Full rectangle: ``A = b h``, ``Iy = b h^3 / 12``, ``Iz = h b^3 / 12``, J of Saint-Venant.

    Parameters
    ----------
    width_y, height_z : float
        Sides b along y and h along z [m].
    poisson_ratio : float
        Of the material [], for the shear correction factors.

    Raises
    ------
    InputError
        A side is not positive and finite.

    Notes
    -----
    With s the short and l the long side (Timoshenko and Goodier, Theory of Elasticity, 3rd ed.,
    section 109)::

        J = l s^3 / 3 (1 - 192 / pi^5 (s / l) sum over odd n of tanh(n pi l / 2s) / n^5)

    summed to machine precision.

    Examples
    --------
    >>> rectangle(1.0, 1.0).J
    0.14057...
    """
    b = positive_number("width of the rectangle along y", width_y, "m")
    h = positive_number("height of the rectangle along z", height_z, "m")
    b, h, nu = exact_together(b, h, poisson_ratio_of_isotropic(poisson_ratio))
    factor = rectangle_shear_factor(nu)
    J = _rectangle_torsion_constant(b, h)
    bounds = Bounds("width of the rectangle", b), Bounds("height of the rectangle", h)
    return CrossSection(b * h, b * h**3 / 12, h * b**3 / 12, J, factor, factor, bounds)


def box(width_y: Any, height_z: Any, wall: Any, *, poisson_ratio: Any = 0.3) -> CrossSection:
    """Hollow rectangle of one wall thickness, sharp corners; J of Saint-Venant.

    Parameters
    ----------
    width_y, height_z : float
        Outer sides b along y and h along z [m].
    wall : float
        Wall thickness t [m], less than half the shorter side.
    poisson_ratio : float
        Of the material [], for the shear correction factors.

    Raises
    ------
    InputError
        A number is not positive and finite, or the wall leaves no hollow.

    Notes
    -----
    A, Iy and Iz are exact. The torsion constant is Bredt's of closed thin walls and that of the
    walls as open strips, each with what four corners add, on the centre line of the wall::

        J = 4 t (Am - 0.42066 t^2)^2 / (p - 8 ln 2 / pi t) + p t^3 / 3 + 0.28996 t^4
        Am = (b - t) (h - t),  p = 2 (b + h - 2 t)

    The corners are those of infinite walls, by conformal mapping. Walls of a fifth of the shorter
    side have an error of 2e-6, of a quarter 4e-5, of 0.4 of it 0.5 %. Bredt's formula alone is 5 %
    too small where the wall is a tenth of the side. The shear factors are those of thin walls.

    Examples
    --------
    >>> box(0.10, 0.06, 0.005).A
    0.0015
    """
    b = positive_number("outer width of the box along y", width_y, "m")
    h = positive_number("outer height of the box along z", height_z, "m")
    t = positive_number("wall of the box", wall, "m")
    b, h, t, nu = exact_together(b, h, t, poisson_ratio_of_isotropic(poisson_ratio))
    bounds = (
        _below("wall of the box", t, b / 2, "half the width"),
        _below("wall of the box", t, h / 2, "half the height"),
    )
    inner_b, inner_h = b - 2 * t, h - 2 * t
    middle_b, middle_h = b - t, h - t
    ratio, line = middle_b / middle_h, 2 * (middle_b + middle_h)
    area, length, strip = (exact_number(x) if is_formula(t) else x for x in _BOX_CORNERS)
    closed = 4 * t * (middle_b * middle_h + area * t**2) ** 2 / (line + length * t)
    return CrossSection(
        A=t * line,
        Iy=(b * h**3 - inner_b * inner_h**3) / 12,
        Iz=(h * b**3 - inner_h * inner_b**3) / 12,
        J=closed + line * t**3 / 3 + strip * t**4,
        shear_factor_y=box_shear_factor(nu, 1 / ratio, 1 / ratio),
        shear_factor_z=box_shear_factor(nu, ratio, ratio),
        bounds=bounds,
    )


# What the four corners of a box add: to the area within the centre line [t^2], to its length [t],
# and to the torsion constant of the walls as open strips [t^4].
_BOX_CORNERS = -0.4206643841536, -8 * math.log(2) / math.pi, 0.2899625231
# What the free ends of the flanges of an I-section and its junctions add to the torsion constant
# of three strips; that of the junctions is fitted to infinite walls, w from f/4 to 20 f.
_FREE_ENDS, _JUNCTIONS = -0.42018, (0.3448, 0.5368, 0.3057, -0.1598, 0.7606)


def i_section(
    flange_width: Any,
    height: Any,
    web_thickness: Any,
    flange_thickness: Any,
    *,
    poisson_ratio: Any = 0.3,
) -> CrossSection:
    """Doubly symmetric I: flanges along y, web along z, sharp corners; J of Saint-Venant.

    Parameters
    ----------
    flange_width : float
        Width b of the flanges, along y [m].
    height : float
        Height h over the flanges, along z [m].
    web_thickness, flange_thickness : float
        Thickness w of the web and f of each flange [m].
    poisson_ratio : float
        Of the material [], for the shear correction factors.

    Raises
    ------
    InputError
        A number is not positive and finite, the web is not thinner than the flange is wide, or not
        higher than it is thick.

    Notes
    -----
    A, Iy and Iz are exact. The torsion constant is that of three strips, the free ends of the
    flanges and two junctions, within 0.1 % where the flanges stand out by their thickness::

        J = (2 b f^3 + (h - 2 f) w^3) / 3 - 0.42018 f^4
            + w^2 (0.3448 f^3 + 0.5368 f^2 w + 0.3057 f w^2 - 0.1598 w^3) / (f + 0.7606 w)

    The strips alone, on their centre lines, are 3 % to 13 % off. Warping restrained at a clamped
    end is left out, which makes the beam too soft in torsion when it is short. Along z the shear
    factor is Cowper's for the thin-walled I; along y it is that of the two flanges as rectangles,
    referred to the whole area.

    Examples
    --------
    >>> i_section(0.1, 0.2, 0.0056, 0.0085).Iy
    1.84559...e-05
    """
    b = positive_number("flange width of the I-section", flange_width, "m")
    h = positive_number("height of the I-section", height, "m")
    w = positive_number("web thickness of the I-section", web_thickness, "m")
    f = positive_number("flange thickness of the I-section", flange_thickness, "m")
    nu = poisson_ratio_of_isotropic(poisson_ratio)
    b, h, w, f, nu = exact_together(b, h, w, f, nu)
    web = h - 2 * f
    bounds = (
        _below("flange thickness of the I-section", f, h / 2, "half the height"),
        _below("web thickness of the I-section", w, b, "the flange width"),
        _below("web thickness of the I-section", w, web, "the height between the flanges"),
    )
    middle = h - f
    area = 2 * b * f + web * w
    # As of the box, m of both flanges and the web, with another last term.
    m, n = 2 * b * f / (middle * w), b / middle
    flanges = 30 * n * n * (m + m * m) + 5 * nu * n * n * (8 * m + 9 * m * m)
    ends, *c = (exact_number(x) if is_formula(b) else x for x in (_FREE_ENDS, *_JUNCTIONS))
    junctions = c[0] * f**3 + c[1] * f**2 * w + c[2] * f * w**2 + c[3] * w**3
    return CrossSection(
        A=area,
        Iy=(b * h**3 - (b - w) * web**3) / 12,
        Iz=(2 * f * b**3 + web * w**3) / 12,
        J=(2 * b * f**3 + web * w**3) / 3 + ends * f**4 + w**2 * junctions / (f + c[4] * w),
        shear_factor_y=rectangle_shear_factor(nu) * 2 * b * f / area,
        shear_factor_z=_thin_walled(nu, m, flanges),
        bounds=bounds,
    )


def _rectangle_torsion_constant(b: Any, h: Any) -> Any:
    ratio = b / h
    if is_formula(ratio) and ratio.free_symbols:
        # The series holds for either order of the sides, and four terms suffice for b > h: the mean
        # of both orders takes nothing from the other one where these do not suffice.
        p, q = b**20, h**20
        return (p * _torsion_series(b, h) + q * _torsion_series(h, b)) / (p + q)
    short, long = (b, h) if ratio < 1 else (h, b)
    aspect = float(long / short)
    # tanh x = 1 - 2 / (exp(2x) + 1): the ones sum to 31/32 zeta(5), and the rest, at most
    # exp(-n pi), / n^5 is below 1e-20 from the sixth odd n on.
    powers = [(n, math.exp(-n * math.pi * aspect)) for n in range(1, 10, 2)]
    rest = sum(2 * x / (1 + x) / n**5 for n, x in powers)
    factor = (1 - 192 / math.pi**5 / aspect * (_ONES - rest)) / 3
    # Exact arithmetic beside formulas takes a number for it.
    return long * short**3 * (exact_number(factor) if is_formula(ratio) else factor)


_ONES = 31 / 32 * 1.0369277551433699  # zeta(5)


def _torsion_series(long: Any, short: Any) -> Any:
    """J of a rectangle of formulas; hyperbolic tangents from n = 9 on are one."""
    import sympy as sp

    rest = sp.Rational("2.903743942486e-5")
    terms = [sp.tanh(n * sp.pi * long / (2 * short)) / sp.Integer(n) ** 5 for n in (1, 3, 5, 7)]
    return long * short**3 / 3 - 64 * short**4 / sp.pi**5 * (sp.Add(*terms) + rest)


def _below(subject: str, value: Any, limit: Any, words: str) -> Bounds:
    return Bounds(subject, value, high=limit, expected=f"less than {words}, {limit!r}")


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
        expected = "a Section of sectionproperties"
        hint = "mesh the geometry first: Section(geometry.create_mesh(mesh_sizes=...))"
        raise InputError("analysed section", got=analysis, expected=expected, hint=hint)
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
