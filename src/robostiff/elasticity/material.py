"""Materials: Young's modulus and shear modulus, and a table of materials with sources."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from robostiff.elasticity.checks import (
    Bounds,
    left_open,
    poisson_ratio_bounds,
    poisson_ratio_of_isotropic,
    positive_number,
)
from robostiff.errors import InputError
from robostiff.frozen import field, frozen
from robostiff.spatial.formula import exact_together


@frozen
class Material:
    """Linear elastic material of a beam.

    Parameters
    ----------
    name : str
        What it is called.
    E : float or formula
        Young's modulus along the beam [Pa].
    G : float or formula
        Shear modulus [Pa]; free of E, so that a wound composite tube can be written too.
    source : str
        Where the numbers come from.
    density : float, formula or None
        Mass by volume [kg/m^3]; None where it is not known.
    bounds : tuple of Bounds, optional
        Inequalities that formulas leave open; E and G are positive when left out.

    Raises
    ------
    InputError
        A modulus or the density is not a positive finite number.

    Examples
    --------
    >>> Material("PEEK", E=3.7e9, G=1.32e9, source="data sheet").poisson_ratio
    0.4015...
    """

    name: str = "material"
    E: Any = None
    G: Any = None
    source: str = ""
    density: Any = None
    bounds: Any = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        positive = []
        if self.density is not None:
            density = positive_number(f"density of {self.name!r}", self.density, "kg/m^3")
            object.__setattr__(self, "density", density)
        for name, words in (("E", "Young's modulus E"), ("G", "shear modulus G")):
            subject = f"{words} of {self.name!r}"
            object.__setattr__(self, name, positive_number(subject, getattr(self, name), "Pa"))
            positive.append(Bounds(subject, getattr(self, name)))
        bounds = positive if self.bounds is None else self.bounds
        object.__setattr__(self, "bounds", left_open(bounds))

    @classmethod
    def isotropic(
        cls, name: str, E: Any, poisson_ratio: Any, source: str = "", density: Any = None
    ) -> Material:
        """The isotropic material of modulus E and Poisson ratio nu: ``G = E / (2 (1 + nu))``.

        Parameters
        ----------
        name : str
            What it is called.
        E : float or formula
            Young's modulus [Pa].
        poisson_ratio : float or formula
            Poisson ratio nu [], -1 < nu < 0.5.
        source : str
            Where the numbers come from.
        density : float, formula or None
            Mass by volume [kg/m^3].

        Raises
        ------
        InputError
            E is not positive and finite, or nu is outside its bounds.

        Examples
        --------
        >>> round(Material.isotropic("steel", 210e9, 0.3).G / 1e9, 3)
        80.769
        """
        nu = poisson_ratio_of_isotropic(poisson_ratio)
        E = positive_number(f"Young's modulus E of {name!r}", E, "Pa")
        E, nu = exact_together(E, nu)
        bounds = (Bounds(f"Young's modulus E of {name!r}", E), poisson_ratio_bounds(nu))
        return cls(name, E, E / (2 * (1 + nu)), source, density, bounds)

    @property
    def poisson_ratio(self) -> Any:
        """``nu = E / (2 G) - 1`` []; outside (-1, 0.5) for a material that is not isotropic."""
        E, G = exact_together(self.E, self.G)
        return E / (2 * G) - 1


# Young's modulus [Pa], Poisson ratio, density [kg/m^3].
_ISOTROPIC = {
    "steel": (210e9, 0.3, 7850.0),
    "stainless-steel": (200e9, 0.3, 7900.0),
    "cast-iron-grey": (110e9, 0.26, 7200.0),
    "cast-iron-ductile": (169e9, 0.275, 7100.0),
    "aluminium": (70e9, 0.3, 2700.0),
    "aluminium-6061": (68.9e9, 0.33, 2700.0),
    "aluminium-7075": (71.7e9, 0.33, 2810.0),
}
# Young's modulus, shear modulus [Pa], density.
_BY_MODULI = {
    "titanium-6al-4v": (110.3e9, 42.7e9, 4430.0),
    "magnesium-az31b": (44.8e9, 16.5e9, 1770.0),
    "brass": (97e9, 37e9, 8500.0),
}
_SOURCES = {
    "steel": "EN 1993-1-1:2005, 3.2.6 (structural steel); density EN 1993-1-2:2005, 3.2.2",
    "stainless-steel": "EN 1993-1-4:2006, 2.1.3 (austenitic and duplex grades); density EN 10088-1 "
    "(1.4301)",
    "cast-iron-grey": "EN 1561:2011, annex, EN-GJL-250 (middle of 103 to 118 GPa; density)",
    "cast-iron-ductile": "EN 1563:2011, annex, EN-GJS-400-18 (moduli and density)",
    "aluminium": "EN 1999-1-1:2007, 3.2.5 (structural alloys; moduli and density)",
    "aluminium-6061": "Aluminum Association, Aluminum Standards and Data, typical properties "
    "(10.0e3 ksi, mean of tension and compression; density); Poisson ratio of MIL-HDBK-5J, 3.6.2",
    "aluminium-7075": "Aluminum Association, Aluminum Standards and Data, typical properties "
    "(10.4e3 ksi, mean of tension and compression; density); Poisson ratio of MIL-HDBK-5J, 3.7.6",
    "titanium-6al-4v": "MIL-HDBK-5J, 5.4.1 (E 16.0e3 ksi, G 6.2e3 ksi, 0.160 lb/in^3)",
    "magnesium-az31b": "MIL-HDBK-5J, 4.2.1 (E 6.5e3 ksi, G 2.4e3 ksi, 0.064 lb/in^3)",
    "brass": "ASM Handbook vol. 2 (1990), wrought copper, C36000 free-cutting brass (moduli, "
    "density)",
}
_TABLE = (
    *(Material.isotropic(n, E, nu, _SOURCES[n], rho) for n, (E, nu, rho) in _ISOTROPIC.items()),
    *(Material(n, E, G, _SOURCES[n], rho) for n, (E, G, rho) in _BY_MODULI.items()),
)

#: The shipped materials by name: room temperature, small strain.
MATERIALS: Mapping[str, Material] = MappingProxyType({m.name: m for m in _TABLE})


def material(name: str) -> Material:
    """The shipped material of that name.

    Parameters
    ----------
    name : str
        A key of `MATERIALS`: lower case, words joined by hyphens.

    Raises
    ------
    InputError
        No such material; the message names the nearest one and all there are.

    Examples
    --------
    >>> material("steel").E
    210000000000.0
    """
    if isinstance(name, str) and name in MATERIALS:
        return MATERIALS[name]
    spelled = str(name).strip().lower().replace(" ", "-").replace("_", "-")
    near = difflib.get_close_matches(spelled, MATERIALS, n=1)
    advice = f"did you mean {near[0]!r}? " if near else ""
    hint = advice + "any other is written as Material.isotropic(name, E, poisson_ratio, source)"
    raise InputError("material", got=name, expected="one of " + ", ".join(MATERIALS), hint=hint)
