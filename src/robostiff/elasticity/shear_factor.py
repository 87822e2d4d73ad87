"""Shear correction factors of Cowper for the usual shapes.

All are from G. R. Cowper, The shear coefficient in Timoshenko's beam theory, Journal of Applied
Mechanics 33(2), 1966, pp. 335-340, doi:10.1115/1.3625046. They depend on the Poisson ratio nu of
the material: from nu = 0 to 0.3 by 2 % (rectangle), 3 % (circle) or 6 % (thin tube). The definition
by strain energy (Pilkey) agrees at nu = 0 and is 2 to 5 % lower for full sections at nu = 0.3.
"""

from __future__ import annotations


def circle_shear_factor(nu: float) -> float:
    """Of a full circle []: ``6 (1 + nu) / (7 + 6 nu)``."""
    return 6 * (1 + nu) / (7 + 6 * nu)


def tube_shear_factor(nu: float, m: float) -> float:
    """Of a circular tube [], m the ratio of inner to outer diameter.

    ``6 (1 + nu) (1 + m^2)^2 / ((7 + 6 nu) (1 + m^2)^2 + (20 + 12 nu) m^2)``
    """
    q = (1 + m * m) ** 2
    return 6 * (1 + nu) * q / ((7 + 6 * nu) * q + (20 + 12 * nu) * m * m)


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


def i_section_shear_factor(nu: float, m: float, n: float) -> float:
    """Of a thin-walled I [], force along the web.

    As the box, with ``30 n^2 (m + m^2) + 5 nu n^2 (8m + 9m^2)`` for its last term;
    m = (area of both flanges) / (area of the web), n = width / height, all on centre lines.
    """
    flanges = 30 * n * n * (m + m * m) + 5 * nu * n * n * (8 * m + 9 * m * m)
    return _thin_walled(nu, m, flanges)


def _thin_walled(nu: float, m: float, flanges: float) -> float:
    static = 12 + 72 * m + 150 * m**2 + 90 * m**3
    lateral = 11 + 66 * m + 135 * m**2 + 90 * m**3
    return 10 * (1 + nu) * (1 + 3 * m) ** 2 / (static + nu * lateral + flanges)
