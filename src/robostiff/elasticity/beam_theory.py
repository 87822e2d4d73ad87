"""Beam theories: which deformations of a beam count."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from robostiff.elasticity.section import CrossSection
from robostiff.errors import InputError


class BeamTheory(Protocol):
    """What a beam theory takes from a cross-section."""

    def shear_factors(self, section: CrossSection) -> tuple[float | None, float | None]:
        """Shear correction factors along y and z []; None where shear does not deform the beam."""
        ...


@dataclass(frozen=True)
class EulerBernoulli:
    """Slender beams: cross-sections stay normal to the axis, shear does not deform the beam.

    Examples
    --------
    >>> EulerBernoulli().shear_factors(CrossSection(1.0, 1.0, 1.0, 1.0, 0.85, 0.85))
    (None, None)
    """

    def shear_factors(self, section: CrossSection) -> tuple[None, None]:
        """None and None, whatever the section."""
        return None, None


@dataclass(frozen=True)
class Timoshenko:
    """Stubby beams: shear adds ``L / (ky G A)`` to C[y, y] and ``L / (kz G A)`` to C[z, z].

    Of the tip deflection of a steel bar of length L and diameter d, shear is 0.5 % at L = 10 d and
    2 % at L = 5 d.

    Examples
    --------
    >>> Timoshenko().shear_factors(CrossSection(1.0, 1.0, 1.0, 1.0, 0.85, 0.44))
    (0.85, 0.44)
    """

    def shear_factors(self, section: CrossSection) -> tuple[float, float]:
        """The factors of the section.

        Raises
        ------
        InputError
            The section has none.
        """
        ky, kz = section.shear_factor_y, section.shear_factor_z
        if ky is None or kz is None:
            raise InputError(
                "shear correction factors of the cross-section",
                got=(ky, kz),
                expected="two numbers, as the Timoshenko theory needs them",
                hint="write CrossSection(..., shear_factor_y=0.85, shear_factor_z=0.85), take a "
                "shape such as tube(...), or leave shear out with EulerBernoulli()",
            )
        return ky, kz
