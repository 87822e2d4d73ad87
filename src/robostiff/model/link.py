"""Elements between joints: rigid parts, elastic links, springs, telescopic legs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from robostiff.elasticity import (
    BeamSegment,
    BeamTheory,
    CrossSection,
    Elasticity,
    Material,
    SlenderBeam,
    beam_compliance,
    shear_compliance,
)
from robostiff.elasticity.checks import Bounds
from robostiff.errors import InputError
from robostiff.frozen import field, frozen
from robostiff.model.checks import axis_across, finite_coordinates, unit_vector, vector3
from robostiff.model.entries import formulas
from robostiff.model.joint import Role
from robostiff.model.mass import Mass, mass_value, masses_of
from robostiff.spatial import Frame, Screw, cross, refuse_quantities
from robostiff.spatial.formula import (
    Entries,
    Scalar,
    exact_array,
    exact_arrays,
    exact_together,
    is_above,
    is_formula,
    length_of,
    tidy,
    vanishes,
)

# Of a unit vector: what is left across a beam of one along it.
_ALONG = 1e-6


@frozen
class Rigid:
    """A rigid part: the next element begins `transform` away.

    Attributes
    ----------
    transform : Frame
        Frame at the far end, in the frame at the near end.
    name : str
    masses : tuple of Mass
        Without a centre in the middle between its ends.
    """

    transform: Frame
    name: str = "rigid"
    masses: tuple[Mass, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "masses", masses_of(self.masses))
        object.__setattr__(self, "transform", Frame.of(self.transform))


@frozen
class Link:
    """An elastic part that runs `to` a point of the present frame, whose axes it keeps.

    Attributes
    ----------
    to : (3,) array
        Far end in the frame at the near end [m]; zero for a spring in one place.
    elasticity : Elasticity
        Of the far end against the near end, about the far end, in the link's own `axes`.
    axes : (3, 3) array
        Columns: the link's own axes in the present frame.
    name : str
    masses : tuple of Mass
        Without a centre spread evenly from end to end.
    """

    to: np.ndarray
    elasticity: Elasticity
    axes: np.ndarray
    name: str = "link"
    masses: tuple[Mass, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "masses", masses_of(self.masses))


@frozen
class TelescopicBeam:
    """One beam of a telescopic leg; its length is ``fixed + share * extension``.

    Attributes
    ----------
    material, section
        What it is made of.
    share : float
        Part of the extension that lengthens this beam.
    fixed : float
        Length at zero extension [m].
    theory : BeamTheory or None
        That of Euler and Bernoulli where none is chosen.
    mass : float or None
        Of the whole beam [kg], spread evenly along it; None for that of its length at the pose,
        with the density of its material.
    """

    material: Material
    section: CrossSection
    share: Scalar
    fixed: Scalar = 0.0
    theory: BeamTheory | None = None
    mass: Any = None

    def __post_init__(self) -> None:
        if self.mass is not None:
            object.__setattr__(self, "mass", mass_value("mass of a telescopic beam", self.mass))
        refuse_quantities("share of the extension", self.share, "0 to 1")
        refuse_quantities("fixed length", self.fixed, "zero or more metres")
        _ = finite_coordinates("share and fixed length of a beam", (self.share, self.fixed), 2)
        _ = self.bounds

    @property
    def bounds(self) -> tuple[Bounds, ...]:
        """Inequalities without which it does not exist."""
        return (
            Bounds("share of the extension", self.share, 0, 1, "0 to 1", or_at=True),
            Bounds("fixed length", self.fixed, expected="zero or more metres", or_at=True),
            *(x for mass in masses_of(self.mass) for x in mass.bounds),
        )

    @cached_property
    def fixed_elasticity(self) -> Elasticity | None:
        """That of a beam of known length; None where the extension changes it."""
        known = isinstance(self.share, int | float) and isinstance(self.fixed, int | float)
        if not known or self.share != 0 or not self.fixed > 0:
            return None
        C = beam_compliance(self.fixed, self.material, self.section, self.theory)
        return Elasticity(C, segments=())

    def mass_at(self, length: np.ndarray) -> np.ndarray | None:
        """Mass at lengths (...) [kg]; None where neither it nor a density is known."""
        if self.mass is not None:
            return np.full(np.shape(length), self.mass)
        density = self.material.density
        return None if density is None else density * self.section.A * length


@frozen
class Telescope:
    """A leg of variable length along `direction`: a slide, and the beams that it lengthens.

    Attributes
    ----------
    direction : (3,) array
        Unit vector in the present frame.
    beams : tuple of TelescopicBeam
        Base to tip; empty for a rigid leg. Their shares add up to 1, and the leg is as long as
        they are: the sum of the fixed lengths plus the extension.
    axes : (3, 3) array
        Columns: the beams' own axes in the present frame, x along `direction`.
    role : Passive, Actuated or Locked
        Of the slide.
    home : float or None
        Extension in the home configuration [m]; zero when left out.
    name : str
    home_given : bool
        Whether the home extension was chosen, and not left out.
    """

    direction: np.ndarray
    beams: tuple[TelescopicBeam, ...]
    axes: np.ndarray
    role: Role
    home: Any = None
    name: str = "telescope"
    home_given: bool | None = field(default=None, compare=False, repr=False)
    size: ClassVar[int] = 1  # coordinates, as a joint has them

    def __post_init__(self) -> None:
        refuse_quantities("home of the telescope", self.home, "metres")
        if self.home_given is None:
            object.__setattr__(self, "home_given", self.home is not None)
        if self.home is None:
            object.__setattr__(self, "home", 0.0)
        excess = sum(beam.share for beam in self.beams) - 1
        if self.beams and (is_above(excess, 1e-9) or is_above(-excess, 1e-9)):
            subject = "shares of the telescope's beams"
            expected = "shares that add up to 1"
            raise InputError(subject, got=[beam.share for beam in self.beams], expected=expected)

    @property
    def freedoms(self) -> tuple[Screw]:
        """Its slide alone, through the origin of the present frame."""
        return (Screw(self.direction, np.zeros(3), None),)

    @property
    def fixed_length(self) -> Any:
        """Length at zero extension [m]."""
        return sum(beam.fixed for beam in self.beams)


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
        # z first, from vectors that are not yet of unit length: no roots within roots.
        x, along, start = exact_arrays(x, vector3("direction of the beam", to), start)
        across = np.cross(along, start)
        if not vanishes(across):
            z = across / length_of(across)
            return np.stack([x, tidy(np.cross(z, x)), z], axis=-1)
    elif (axes := axes_towards(x, start)) is not None:
        return axes
    raise InputError("y axis of the section", got=y_axis, expected="a direction across the beam")


def axes_towards(x: np.ndarray, y: np.ndarray) -> np.ndarray | None:
    """Axes (..., 3, 3) in columns of unit directions x (..., 3), with the parts of y across them.

    None where one of these is nothing.
    """
    across = y - np.sum(x * y, axis=-1, keepdims=True) * x
    size = np.sqrt(np.sum(across**2, axis=-1, keepdims=True))
    if np.any(size <= _ALONG):
        return None
    across = across / size
    return np.stack([x, across, cross(x, across)], axis=-1)


def beam_link(
    to: Entries,
    material: Material,
    section: CrossSection,
    *,
    y_axis: Entries | None = None,
    theory: BeamTheory | None = None,
    name: str = "beam",
    mass: Mass | float | Sequence[Mass] | None = None,
) -> Link:
    """Elastic link that is one straight prismatic beam.

    Its mass [kg] follows from the density of the material where `mass` is left out.

    Raises
    ------
    InputError
        When `to` is zero, or the section needs a `y_axis` (Iy and Iz differ) and has none.
    """
    if y_axis is None and not section_is_isotropic(section):
        subject = f"y axis of the section of {name}"
        expected = "a direction, because Iy and Iz differ"
        raise InputError(subject, expected=expected, hint="write y_axis: [0, 0, 1] or the like")
    to = vector3("end of the beam", to)
    if any(True for _ in formulas((material, section))):
        to = exact_array(to)
    axes = beam_axes(to, y_axis)
    length = length_of(to) if to.dtype == object else float(np.linalg.norm(to))
    compliance = beam_compliance(length, material, section, theory)
    masses = beam_mass(length, material, section) if mass is None else mass
    beam = SlenderBeam.of(length, material, section, theory)
    bounds = (*material.bounds, *section.bounds)
    shear = shear_compliance([BeamSegment(length, material, section)]) if theory is None else None
    elasticity = Elasticity(compliance, bounds=bounds, beam=beam, segments=(), shear_left_out=shear)
    return Link(to, elasticity, axes, name, masses_of(masses))


def beam_mass(length: Any, material: Material, section: CrossSection) -> Any:
    """Mass of a uniform beam [kg], a number or a formula; None without a density."""
    if material.density is None:
        return None
    density, A, L = exact_together(material.density, section.A, length)
    return density * A * L


def section_is_isotropic(section: CrossSection) -> bool:
    """Whether the section has equal second moments, so that its y axis does not matter."""
    if is_formula(section.Iy) or is_formula(section.Iz):
        inertias = np.array([section.Iy - section.Iz], dtype=object)
        return vanishes(inertias) and section.shear_factor_y == section.shear_factor_z
    return abs(section.Iy - section.Iz) <= 1e-9 * section.Iz and (
        section.shear_factor_y == section.shear_factor_z
    )
