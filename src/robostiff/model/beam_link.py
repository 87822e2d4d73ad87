"""An elastic link that is one straight beam, and the axes of its cross-section."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.elasticity import (
    BeamTheory,
    CrossSection,
    Elasticity,
    EulerBernoulli,
    Material,
    beam_compliance,
)
from robostiff.errors import InputError
from robostiff.model.checks import axis_across, unit_vector, vector3
from robostiff.model.entries import formulas
from robostiff.model.link import Link
from robostiff.model.mass import Mass, masses_of
from robostiff.spatial.formula import (
    Entries,
    exact_array,
    exact_arrays,
    exact_together,
    is_formula,
    length_of,
    tidied,
    vanishes,
)


def beam_axes(to: Entries, y_axis: Entries | None) -> np.ndarray:
    """Axes of a beam that runs along `to`: x along it, y across it towards `y_axis`, z = x x y.

    Parameters
    ----------
    to : (3,) array
        From start to end; not zero.
    y_axis : (3,) array or None
        Direction of the section's y axis; its part along the beam is taken away. None for a
        section that is alike in all directions: some direction across is taken.

    Returns
    -------
    (3, 3) array
        Columns x, y, z.

    Raises
    ------
    InputError
        When `y_axis` runs along the beam.

    Examples
    --------
    >>> beam_axes(np.array([0, 0, 2.0]), np.array([1.0, 0, 0.5])) + 0.0
    array([[0., 1., 0.],
           [0., 0., 1.],
           [1., 0., 0.]])
    """
    x = unit_vector("direction of the beam", to)
    start = axis_across(x) if y_axis is None else unit_vector("y axis", y_axis)
    if object in (x.dtype, start.dtype):
        return _axes_of_formulas(x, vector3("direction of the beam", to), start, y_axis)
    across = start - x * (x @ start)
    if np.linalg.norm(across) < 1e-6:
        raise InputError(
            "y axis of the section", got=y_axis, expected="a direction across the beam"
        )
    y = across / np.linalg.norm(across)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _axes_of_formulas(x: np.ndarray, to: np.ndarray, start: np.ndarray, y_axis: Any) -> np.ndarray:
    # z first, from vectors that are not yet of unit length: no roots within roots.
    x, to, start = exact_arrays(x, to, start)
    across = np.cross(to, start)
    if vanishes(across):
        raise InputError(
            "y axis of the section", got=y_axis, expected="a direction across the beam"
        )
    z = across / length_of(across)
    return np.stack([x, tidied(np.cross(z, x)), z], axis=-1)


def beam_link(
    to: Entries,
    material: Material,
    section: CrossSection,
    *,
    y_axis: Entries | None = None,
    theory: BeamTheory | None = None,
    name: str = "beam",
    mass: Mass | float | None = None,
) -> Link:
    """Elastic link that is one straight prismatic beam.

    Its mass [kg] follows from the density of the material where `mass` is left out.

    Raises
    ------
    InputError
        When `to` is zero, or the section needs a `y_axis` (Iy and Iz differ) and has none.
    """
    if y_axis is None and not section_is_isotropic(section):
        raise InputError(
            f"y axis of the section of {name}",
            expected="a direction, because Iy and Iz differ",
            hint="write y_axis: [0, 0, 1] or the like",
        )
    to = vector3("end of the beam", to)
    if any(True for _ in formulas((material, section))):
        to = exact_array(to)
    axes = beam_axes(to, y_axis)
    length = length_of(to) if to.dtype == object else float(np.linalg.norm(to))
    compliance = beam_compliance(length, material, section, theory or EulerBernoulli())
    own = beam_mass(length, material, section) if mass is None else mass
    return Link(to, Elasticity(compliance), axes, name, masses_of(own))


def beam_mass(length: Any, material: Material, section: CrossSection) -> Any:
    """Mass of a uniform beam [kg], a number or a formula; None without a density.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> round(beam_mass(1.0, material("steel"), circle(0.02)), 3)
    2.466
    """
    if material.density is None:
        return None
    density, A, L = exact_together(material.density, section.A, length)
    return density * A * L


def section_is_isotropic(section: CrossSection) -> bool:
    """Whether the section has equal second moments, so that its y axis does not matter.

    Examples
    --------
    >>> section_is_isotropic(CrossSection(A=1e-4, Iy=1e-9, Iz=1e-9, J=2e-9))
    True
    """
    if is_formula(section.Iy) or is_formula(section.Iz):
        inertias = np.array([section.Iy - section.Iz], dtype=object)
        return vanishes(inertias) and section.shear_factor_y == section.shear_factor_z
    return abs(section.Iy - section.Iz) <= 1e-9 * section.Iz and (
        section.shear_factor_y == section.shear_factor_z
    )
