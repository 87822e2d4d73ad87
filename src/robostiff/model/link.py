"""What lies between joints: rigid parts, elastic links, springs, telescopic legs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform

from robostiff.elasticity import (
    BeamTheory,
    CrossSection,
    Elasticity,
    EulerBernoulli,
    Material,
    beam_compliance,
)
from robostiff.errors import InputError
from robostiff.model.checks import unit_vector
from robostiff.model.joint import Role


@dataclass(frozen=True)
class Rigid:
    """A rigid part: the next element begins `transform` away.

    Attributes
    ----------
    transform : scipy.spatial.transform.RigidTransform
        Frame at the far end, in the frame at the near end.
    name : str
    """

    transform: RigidTransform
    name: str = "rigid"


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
    """

    to: np.ndarray
    elasticity: Elasticity
    axes: np.ndarray
    name: str = "link"


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
    """

    material: Material
    section: CrossSection
    share: float
    fixed: float = 0.0
    theory: BeamTheory = field(default_factory=EulerBernoulli)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.share) and 0 <= self.share <= 1):
            raise InputError("share of the extension", got=self.share, expected="0 to 1")
        if not (np.isfinite(self.fixed) and self.fixed >= 0):
            raise InputError("fixed length", got=self.fixed, expected="zero or more metres")


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
    home : float
        Extension in the home configuration [m].
    name : str
    """

    direction: np.ndarray
    beams: tuple[TelescopicBeam, ...]
    axes: np.ndarray
    role: Role
    home: float = 0.0
    name: str = "telescope"

    def __post_init__(self) -> None:
        total = sum(beam.share for beam in self.beams)
        if self.beams and abs(total - 1) > 1e-9:
            raise InputError(
                "shares of the telescope's beams",
                got=[beam.share for beam in self.beams],
                expected="shares that add up to 1",
            )

    @property
    def fixed_length(self) -> float:
        """Length at zero extension [m]."""
        return sum(beam.fixed for beam in self.beams)


def beam_axes(to: np.ndarray, y_axis: np.ndarray | None) -> np.ndarray:
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
    start = np.eye(3)[np.argmin(np.abs(x))] if y_axis is None else unit_vector("y axis", y_axis)
    across = start - x * (x @ start)
    if np.linalg.norm(across) < 1e-6:
        raise InputError(
            "y axis of the section", got=y_axis, expected="a direction across the beam"
        )
    y = across / np.linalg.norm(across)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def beam_link(
    to: np.ndarray,
    material: Material,
    section: CrossSection,
    *,
    y_axis: np.ndarray | None = None,
    theory: BeamTheory | None = None,
    name: str = "beam",
) -> Link:
    """Elastic link that is one straight prismatic beam.

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
    axes = beam_axes(to, y_axis)
    length = float(np.linalg.norm(to))
    compliance = beam_compliance(length, material, section, theory or EulerBernoulli())
    return Link(np.asarray(to, dtype=float), Elasticity(compliance), axes, name)


def section_is_isotropic(section: CrossSection) -> bool:
    """Whether the section bends alike in all directions, so that its y axis does not matter.

    Examples
    --------
    >>> section_is_isotropic(CrossSection(A=1e-4, Iy=1e-9, Iz=1e-9, J=2e-9))
    True
    """
    return abs(section.Iy - section.Iz) <= 1e-9 * section.Iz and (
        section.shear_factor_y == section.shear_factor_z
    )
