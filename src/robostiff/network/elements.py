"""Elements of a network: bodies, beams, springs and joints; the stiffness of a free beam."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elasticity import (
    BeamTheory,
    CrossSection,
    Elasticity,
    EulerBernoulli,
    Material,
    beam_compliance,
)
from robostiff.errors import InputError
from robostiff.model import PlacedFreedom, PlacedMass, beam_axes
from robostiff.model.checks import vector3
from robostiff.model.link import beam_mass
from robostiff.spatial import twist_transport
from robostiff.spatial.shapes import Float

_DEFAULT_THEORY = EulerBernoulli()
_ROUNDING = 1e-12  # part of a deflection: less is no shear


@dataclass(frozen=True)
class Node:
    """A rigid body, with six displacements about its own point.

    Attributes
    ----------
    name : str
        Unique in the network.
    point : (3,) array
        World coordinates [m].
    masses : tuple of PlacedMass
        That it carries.
    """

    name: str
    point: np.ndarray
    masses: tuple[PlacedMass, ...] = ()


@dataclass(frozen=True)
class NodeForce:
    """A force (3,) [N] at a point (3,) [m] of a node, world axes."""

    node: str
    force: np.ndarray
    point: np.ndarray


@dataclass(frozen=True)
class BeamElement:
    """A straight beam whose ends are rigidly attached to two nodes.

    Attributes
    ----------
    name, a, b : str
        Its own name, and the nodes that hold its start and its end.
    start, end : (3,) arrays
        World coordinates [m].
    rotation : (3, 3) array
        Columns: the beam's axes, x from start to end, y and z principal.
    tip_compliance : (6, 6) array
        Of the end with the start clamped, in the beam's axes [m/N, rad/N, rad/(N m)].
    masses : tuple of PlacedMass
        Along it.
    """

    name: str
    a: str
    b: str
    start: np.ndarray
    end: np.ndarray
    rotation: np.ndarray
    tip_compliance: np.ndarray
    masses: tuple[PlacedMass, ...] = ()

    @property
    def length(self) -> float:
        """From start to end [m]."""
        return float(np.linalg.norm(self.end - self.start))


@dataclass(frozen=True)
class SpringElement:
    """An elastic part between two nodes that sits at one point.

    Attributes
    ----------
    name, a, b : str
    point : (3,) array
        About which the elasticity is given [m].
    rotation : (3, 3) array
        Columns: the spring's axes.
    elasticity : Elasticity
        Of node b against node a. A zero compliance is a rigid connection.
    masses : tuple of PlacedMass
        Along it, which its ends carry, or without a `start` on node b.
    """

    name: str
    a: str
    b: str
    point: np.ndarray
    rotation: np.ndarray
    elasticity: Elasticity
    masses: tuple[PlacedMass, ...] = ()


@dataclass(frozen=True)
class JointElement:
    """A joint between two nodes; without freedoms it is a weld.

    Attributes
    ----------
    name, a, b : str
    freedoms : tuple of PlacedFreedom
        Passive ones move without resistance, those with a stiffness as springs, all others not.
    """

    name: str
    a: str
    b: str
    freedoms: tuple[PlacedFreedom, ...] = ()

    @property
    def moving(self) -> list[PlacedFreedom]:
        """Freedoms that no rigid drive or lock holds."""
        return [f for f in self.freedoms if f.is_passive or f.stiffness is not None]

    def place(self, number: int) -> int | None:
        """Of a freedom among those that move; None where it is held."""
        own = self.freedoms[number]
        return next((i for i, one in enumerate(self.moving) if one is own), None)

    @property
    def point(self) -> np.ndarray | None:
        """Mean of the points about which it turns (3,) [m]; None for slides and welds."""
        turns = [f.point for f in self.freedoms if f.turns]
        return np.mean(turns, axis=0) if turns else None


Element = BeamElement | SpringElement | JointElement


@dataclass(frozen=True)
class CouplingElement:
    """A gear or differential: a held sum of coordinates of joints."""

    name: str
    # joints of the network, which freedom of each, and its factor
    terms: tuple[tuple[JointElement, int, float], ...]
    stiffness: float | None = None  # against the sum [N/m, N m/rad]; None where it is rigid


def beam_between(
    a: Node,
    b: Node,
    material: Material,
    section: CrossSection,
    *,
    y_axis: ArrayLike | None = None,
    theory: BeamTheory = _DEFAULT_THEORY,
    name: str = "beam",
) -> BeamElement:
    """Beam from the point of node a to the point of node b, with the mass of its material.

    Parameters
    ----------
    a, b : Node
        At different points.
    material : Material
    section : CrossSection
    y_axis : (3,) array, optional
        Direction of the section's y axis; any direction across when left out.
    theory : BeamTheory
        `EulerBernoulli()`, the default, or `Timoshenko()`.
    name : str

    Raises
    ------
    InputError
        When the nodes are at one point, or `y_axis` runs along the beam.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([0, 0, 2.0]))
    >>> beam_between(wall, tip, material("steel"), circle(0.02)).length
    2.0
    """
    start, end = vector3("start of the beam", a.point), vector3("end of the beam", b.point)
    along = end - start
    length = float(np.linalg.norm(along))
    if length == 0.0:
        raise InputError(
            f"beam {name!r} from {a.name!r} to {b.name!r}",
            got="two nodes at one point",
            expected="nodes at different points",
        )
    rotation = beam_axes(along, None if y_axis is None else np.asarray(y_axis, dtype=float))
    tip_compliance = beam_compliance(length, material, section, theory)
    masses = uniform_mass(name, beam_mass(length, material, section), start, end)
    return BeamElement(name, a.name, b.name, start, end, rotation, tip_compliance, masses)


def uniform_mass(
    name: str, value: float | None, start: np.ndarray, end: np.ndarray
) -> tuple[PlacedMass, ...]:
    """A mass [kg] that is spread evenly between two points [m]; none where it is None."""
    if value is None:
        return ()
    return (PlacedMass(name, np.asarray(value), 0.5 * (start + end), 0, start, (0.0, 1.0)),)


def beam_stiffness_12(
    tip_stiffness: Float[np.ndarray, "6 6"], length: float
) -> Float[np.ndarray, "12 12"]:
    """Stiffness of a free beam, ``B^T K B`` with ``B = [-J_v, I]``, v from start to end.

    ``B`` gives how far the end is from where the start would carry it as a rigid body; the wrench
    at the start follows by equilibrium. So rigid body motions meet no stiffness, exactly.

    Parameters
    ----------
    tip_stiffness : (6, 6) array
        K, of the end with the start clamped, in the beam's axes [N/m, N/rad, N m/rad].
    length : float
        Along the beam's x axis [m].

    Returns
    -------
    (12, 12) array
        Wrenches (start, end) for twists (start, end), each about its own end of the beam, in the
        beam's axes.

    Notes
    -----
    J. S. Przemieniecki, Theory of Matrix Structural Analysis, McGraw-Hill 1968, section 5.6, prints
    the matrix entry by entry.

    Examples
    --------
    >>> K = beam_stiffness_12(np.diag([5.0, 0, 0, 0, 0, 0]), 2.0)
    >>> K[np.ix_([0, 6], [0, 6])]
    array([[ 5., -5.],
           [-5.,  5.]])
    """
    B = np.hstack([-twist_transport(np.array([length, 0.0, 0.0])), np.eye(6)])
    return B.T @ tip_stiffness @ B


def section_compliance(
    tip_compliance: Float[np.ndarray, "6 6"], length: float
) -> Float[np.ndarray, 6]:
    """Strains and curvatures (6,) of the section of a uniform beam under unit forces and moments.

    1 / (EA, G A_y, G A_z, GJ, EI_y, EI_z) [1/N, 1/(N m^2)]; 0 for no deflection by shear. The
    compliance is that of the tip with the start clamped, in the beam's axes.

    Examples
    --------
    >>> section_compliance(np.diag([2.0, 8 / 3, 8 / 3, 6.0, 2.0, 2.0]), 2.0)
    array([1., 0., 0., 3., 1., 1.])
    """
    whole = np.diagonal(tip_compliance) / length
    c = whole.copy()
    c[1:3] -= c[[5, 4]] * length**2 / 3
    c[1:3] = np.where(c[1:3] < _ROUNDING * whole[1:3], 0.0, c[1:3])
    return c
