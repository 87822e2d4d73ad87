"""Elements between joints: rigid parts, elastic links, springs, telescopic legs."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

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
from robostiff.model.joint import Role
from robostiff.model.mass import Mass, mass_value, masses_of
from robostiff.spatial import Frame, Screw, refuse_quantities
from robostiff.spatial.formula import is_above, is_formula, is_possible


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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
    theory : BeamTheory
    mass : float or None
        Of the whole beam [kg], spread evenly along it; None for that of its length at the pose,
        with the density of its material.
    """

    material: Material
    section: CrossSection
    share: Any
    fixed: Any = 0.0
    theory: BeamTheory = field(default_factory=EulerBernoulli)
    mass: Any = None

    def __post_init__(self) -> None:
        if self.mass is not None:
            object.__setattr__(self, "mass", mass_value("mass of a telescopic beam", self.mass))
        refuse_quantities("share of the extension", self.share, "0 to 1")
        refuse_quantities("fixed length", self.fixed, "zero or more metres")
        if not (_may_be_at_least_zero(self.share) and not is_above(self.share, 1)):
            raise InputError("share of the extension", got=self.share, expected="0 to 1")
        if not _may_be_at_least_zero(self.fixed):
            raise InputError("fixed length", got=self.fixed, expected="zero or more metres")

    @cached_property
    def fixed_elasticity(self) -> Elasticity | None:
        """That of a beam of known length; None where the extension changes it."""
        known = isinstance(self.share, int | float) and isinstance(self.fixed, int | float)
        if not known or self.share != 0 or not self.fixed > 0:
            return None
        return Elasticity(beam_compliance(self.fixed, self.material, self.section, self.theory))

    def mass_at(self, length: np.ndarray) -> np.ndarray | None:
        """Mass at lengths (...) [kg]; None where neither it nor a density is known."""
        if self.mass is not None:
            return np.full(np.shape(length), self.mass)
        density = self.material.density
        return None if density is None else density * self.section.A * length


@dataclass(frozen=True)
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
            raise InputError(
                "shares of the telescope's beams",
                got=[beam.share for beam in self.beams],
                expected="shares that add up to 1",
            )

    @property
    def freedoms(self) -> tuple[Screw]:
        """Its slide alone, through the origin of the present frame."""
        return (Screw(self.direction, np.zeros(3), None),)

    @property
    def fixed_length(self) -> Any:
        """Length at zero extension [m]."""
        return sum(beam.fixed for beam in self.beams)


def _may_be_at_least_zero(value: Any) -> bool:
    if is_formula(value):
        return is_possible(value) and getattr(value, "is_negative", None) is not True
    return bool(np.isfinite(value) and value >= 0)
