"""Compliance and stiffness of uniform beams of a material and a cross-section."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robostiff.elasticity._checks import positive_numbers
from robostiff.elasticity.beam_theory import BeamTheory, EulerBernoulli
from robostiff.elasticity.cantilever import cantilever_compliance, cantilever_stiffness
from robostiff.elasticity.material import Material
from robostiff.elasticity.section import CrossSection
from robostiff.errors import InputError
from robostiff.spatial.formula import exact_together

#: The theory used unless another is named.
DEFAULT_THEORY = EulerBernoulli()


def beam_compliance(
    length: ArrayLike,
    material: Material,
    section: CrossSection,
    theory: BeamTheory = DEFAULT_THEORY,
) -> NDArray[np.float64]:
    """Tip compliance of a beam clamped at its base, in its own axes.

    ``diag(L/EA, L^3/3EIz, L^3/3EIy, L/GJ, L/EIy, L/EIz)`` with ``C[y, rz] = +L^2/2EIz`` and
    ``C[z, ry] = -L^2/2EIy``, x along the beam, y and z principal; `Timoshenko` adds
    ``L/(ky G A)`` to C[y, y] and ``L/(kz G A)`` to C[z, z].

    Parameters
    ----------
    length : float, formula or (...) array
        Length L [m]; an array gives one matrix for each length (telescopic legs).
    material : Material
        Moduli E and G.
    section : CrossSection
        A, Iy, Iz, J and shear factors.
    theory : BeamTheory
        `EulerBernoulli()`, the default, or `Timoshenko()`.

    Returns
    -------
    (..., 6, 6) array
        Compliance [m/N, rad/N, rad/(N m)] of the tip, symmetric positive definite; objects when
        any of the numbers is a formula.

    Raises
    ------
    InputError
        A length is not positive and finite; `Timoshenko` without shear factors.

    Notes
    -----
    J. S. Przemieniecki, Theory of Matrix Structural Analysis, McGraw-Hill 1968, section 5.6.

    Examples
    --------
    One metre of steel bar, 20 mm thick, under 100 N across its tip [mm]:

    >>> from robostiff.elasticity import beam_compliance, circle, material
    >>> C = beam_compliance(1.0, material("steel"), circle(0.020))
    >>> round(float(C[1, 1]) * 100 * 1e3, 3)
    20.21
    """
    return cantilever_compliance(*_beam(length, material, section, theory))


def beam_stiffness(
    length: ArrayLike,
    material: Material,
    section: CrossSection,
    theory: BeamTheory = DEFAULT_THEORY,
) -> NDArray[np.float64]:
    """Tip stiffness of a beam clamped at its base, the inverse of `beam_compliance`.

    ``K[y, y] = 12EIz/(L^3 (1+p))``, ``K[rz, rz] = (4+p)EIz/(L (1+p))``,
    ``K[y, rz] = -6EIz/(L^2 (1+p))`` with ``p = 12EIz/(ky G A L^2)``, alike for z.

    Parameters
    ----------
    length, material, section, theory
        As for `beam_compliance`.

    Returns
    -------
    (..., 6, 6) array
        Stiffness [N/m, N/rad, N m/rad] of the tip, symmetric positive definite.

    Raises
    ------
    InputError
        As for `beam_compliance`.

    Examples
    --------
    >>> from robostiff.elasticity import beam_stiffness, circle, material
    >>> float(round(beam_stiffness(1.0, material("steel"), circle(0.020))[0, 0]))
    65973446.0
    """
    return cantilever_stiffness(*_beam(length, material, section, theory))


def _beam(length: ArrayLike, material: Any, section: Any, theory: BeamTheory) -> tuple[Any, ...]:
    if not isinstance(material, Material):
        raise InputError(
            "material of the beam",
            got=material,
            expected="a Material",
            hint='write material("steel") or Material.isotropic(name, E, poisson_ratio, source)',
        )
    if not isinstance(section, CrossSection):
        raise InputError(
            "cross-section of the beam",
            got=section,
            expected="a CrossSection",
            hint="write tube(outer_diameter, inner_diameter) or another shape",
        )
    L = positive_numbers("length of the beam", length, "m")
    s = section
    numbers = (material.E, material.G, s.A, s.Iy, s.Iz, s.J, *theory.shear_factors(section))
    return exact_together(L, *numbers)
