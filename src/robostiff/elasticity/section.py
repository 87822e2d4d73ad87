"""The cross-section of a beam: its area, second moments, torsion constant and shear factors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from robostiff.elasticity._checks import positive_number


@dataclass(frozen=True)
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

    def __post_init__(self) -> None:
        for field, words, unit in (
            ("A", "area A", "m^2"),
            ("Iy", "second moment of area Iy", "m^4"),
            ("Iz", "second moment of area Iz", "m^4"),
            ("J", "torsion constant J", "m^4"),
            ("shear_factor_y", "shear correction factor along y", ""),
            ("shear_factor_z", "shear correction factor along z", ""),
        ):
            value = getattr(self, field)
            if value is None and field.startswith("shear_factor"):
                continue
            subject = f"{words} of the cross-section"
            object.__setattr__(self, field, positive_number(subject, value, unit))
