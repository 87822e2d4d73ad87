"""Elements of a network: bodies, beams and what loads between their ends do, springs and joints."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elasticity import (
    BeamTheory,
    CrossSection,
    Elasticity,
    Material,
    beam_compliance,
    uniform_beam,
)
from robostiff.elasticity.beam import DEFAULT_THEORY, compliance_in_series
from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen
from robostiff.model import PlacedFreedom, PlacedMass, beam_axes
from robostiff.model.checks import vector3
from robostiff.model.link import axes_towards, beam_mass
from robostiff.spatial import as_float, as_floats, move_compliance, twist_transport
from robostiff.spatial.batch import Float

_ROUNDING = 1e-9  # of the length of a beam
# Points from -1 to 1 and weights, exact up to the fifth degree.
_GAUSS = (-(0.6**0.5), 0.0, 0.6**0.5), (5 / 9, 8 / 9, 5 / 9)


@frozen
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

    def __post_init__(self) -> None:
        if not isinstance(self.point, np.ndarray):
            subject, expected = f"point of node {self.name!r}", "three finite numbers [x, y, z]"
            at = as_floats(subject, self.point, expected, "m", (3,))
            object.__setattr__(self, "point", at)


@frozen
class NodeForce:
    """A force (3,) [N] at a point (3,) [m] of a node, and a moment (3,) [N m], world axes."""

    node: str
    force: np.ndarray
    point: np.ndarray
    moment: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def wrench(self) -> np.ndarray:
        """(6,) about its point [N, N m]."""
        return np.append(self.force, self.moment)


@frozen
class BeamElement:
    """A straight beam whose ends are rigidly attached to two nodes.

    Attributes
    ----------
    name, a, b : str
        Its own name, and the nodes that hold its start and its end. Under load its axes are those
        of the start; the other way round, displacements differ by about the square of its turn.
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
    masses: tuple[PlacedMass, ...] = field(default_factory=tuple)

    @property
    def length(self) -> float:
        """From start to end [m]."""
        return float(np.linalg.norm(self.end - self.start))

    def __getattr__(self, name: str) -> Any:
        """What follows from the section of a beam of `beam_between`, once it is asked for."""
        if name in ("rotation", "tip_compliance"):
            find_properties([self])
        elif name == "masses":
            value = beam_mass(self.length, *self.section[:2])
            vars(self)[name] = uniform_mass(self.name, value, self.start, self.end)
        return object.__getattribute__(self, name)


def find_properties(beams: Iterable[BeamElement]) -> None:
    """Find axes and tip compliance of those beams of `beam_between` that have none yet, at once."""
    alike: dict[tuple[int, ...], list[BeamElement]] = defaultdict(list)
    for beam in beams:
        if "tip_compliance" not in vars(beam):
            alike[tuple(map(id, beam.section))].append(beam)
    for own in alike.values():
        along = np.array([beam.end for beam in own]) - np.array([beam.start for beam in own])
        length = np.sqrt(np.sum(along**2, axis=1))
        x = along / length[:, None]
        # that axis of the world is never along a beam
        axes: Any = axes_towards(x, np.eye(3)[np.argmin(np.abs(x), axis=1)])
        C = beam_compliance(length if len(own) > 1 else length.item(), *own[0].section)
        for beam, R, C_own in zip(own, axes, C.reshape(-1, 6, 6), strict=True):
            vars(beam).setdefault("rotation", R)
            vars(beam)["tip_compliance"] = C_own


@frozen
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
        Of node b against node a, in axes that move with node a under load. Of a full matrix
        displacements differ by about the turn [rad] where a and b are exchanged. A zero compliance
        is a rigid connection.
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


@frozen
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


@frozen
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
    theory: BeamTheory = DEFAULT_THEORY,
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
    if along @ along == 0.0:
        subject = f"beam {name!r} from {a.name!r} to {b.name!r}"
        expected = "nodes at different points"
        raise InputError(subject, got=Words("two nodes at one point"), expected=expected)
    if not (isinstance(material, Material) and isinstance(section, CrossSection)):
        beam_compliance(1.0, material, section, theory)  # says what is wrong
    theory.shear_factors(section)
    beam = BeamElement.__new__(BeamElement)
    known = {"name": name, "a": a.name, "b": b.name, "start": start, "end": end}
    vars(beam).update(known, section=(material, section, theory))
    if y_axis is not None:
        vars(beam)["rotation"] = beam_axes(along, np.asarray(y_axis, dtype=float))
    return beam


def uniform_mass(
    name: str, value: float | None, start: np.ndarray, end: np.ndarray
) -> tuple[PlacedMass, ...]:
    """A mass [kg] that is spread evenly between two points [m]; none where it is None."""
    if value is None:
        return ()
    return (PlacedMass(name, np.asarray(value), 0.5 * (start + end), 0, start, (0.0, 1.0)),)


def weights_on_ends(
    element: BeamElement | SpringElement, gravity: np.ndarray
) -> Iterator[NodeForce]:
    """Weights of the masses of an elastic part under a gravity (3,) [m/s^2], on its ends.

    Of a tapered beam weights act on the ends of its segments. One where two of them meet is shared
    as by a beam clamped at both ends: with the compliance C of all, and that of what is before it,
    about its point, the far end gets ``C^-1 C_before`` of it.
    """
    is_spring = isinstance(element, SpringElement)
    end = element.point if is_spring else element.end
    beams = element.elasticity.beams if is_spring else ()
    at = np.cumsum([own.length for own in beams]) if len(beams) > 1 else np.ones(1)
    for mass in element.masses:
        for own in mass.lumped((0.0, *(at / at[-1])), mass.end_of_part(end)):
            i, force = own.after, own.value * gravity
            if not is_spring or i in (0, len(at)):
                node = element.b if i or mass.start is None else element.a
                yield NodeForce(node, force, own.point)
                continue
            R, elasticity, before = element.rotation, element.elasticity, at[i - 1] - at[-1]
            point = end + before * R[:, 0]
            load = np.append(force, np.cross(own.point - point, force)).reshape(2, 3) @ R
            lengths = [beam.length for beam in beams[:i]]
            near = compliance_in_series(elasticity.pieces[:i], lengths)
            whole = move_compliance(elasticity.compliance, np.array([before, 0.0, 0.0]))
            far = np.linalg.solve(whole, near @ load.ravel()).reshape(2, 3)
            for node, (F, M) in ((element.b, far @ R.T), (element.a, (load - far) @ R.T)):
                yield NodeForce(node, F, point, M)


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


@frozen
class DistributedForce:
    """A uniform force along a whole beam, on its axis.

    Attributes
    ----------
    per_length : (3,) array
        World axes [N/m].
    """

    per_length: ArrayLike


@frozen
class ForceOnBeam:
    """A force at a point of the axis of a beam.

    Attributes
    ----------
    force : (3,) array
        World axes [N].
    distance : float
        From the start of the beam [m].
    """

    force: ArrayLike
    distance: float


@frozen
class BeamLoad:
    """What the loads of a beam do when its start is clamped and its end free, in its axes."""

    at_start: np.ndarray  # (6,): their sum about the start [N, N m]
    tip_twist: np.ndarray  # (6,): of the end [m, rad]
    own_energy: float  # elastic energy [J]

    def energy(self, end: np.ndarray) -> float:
        """What the loads add to the energy ``f S f / 2`` of a wrench `end` on the end [J]."""
        return float(end @ self.tip_twist) + self.own_energy


def beam_load(beam: BeamElement, loads: Sequence[DistributedForce | ForceOnBeam]) -> BeamLoad:
    """All loads of a uniform beam together.

    At the distance u from the end a section carries the wrench w(u) of the loads beyond it. With
    the compliance c of the section for a unit of length, the end deflects by the integral of
    ``A(u)^T c w(u)``, where A(u) moves a wrench from the end to the section, and the energy is half
    the integral of ``w(u)^T c w(u)``. The wrenches are polynomials of u, of degree two at most.

    Raises InputError when a load is no vector, or is beyond the ends; when the beam is not uniform.
    """
    # Strains and curvatures of the section under unit forces and moments [1/N, 1/(N m^2)]: 0 for no
    # deflection by shear, and of a rigid beam
    c = np.zeros(6)
    if np.any(beam.tip_compliance):
        own = uniform_beam(beam.tip_compliance)
        if own is None or abs(own.length - beam.length) > _ROUNDING * beam.length:
            raise InputError(
                f"beam {beam.name!r} with a load between its ends",
                got=Words("a compliance that is not that of a uniform beam"),
                expected="one section along the beam, its axes principal",
                hint="divide the beam into pieces, and load their ends",
            )
        c[:] = 1 / own.EA, own.shear_y, own.shear_z, 1 / own.GJ, 1 / own.EIy, 1 / own.EIz
    L, e = beam.length, np.array([1.0, 0.0, 0.0])
    # Pieces end where forces are.
    at = sorted({0.0, L, *(_distance(beam, own) for own in loads if isinstance(own, ForceOnBeam))})
    total = np.zeros(6)  # of the loads, about the start of the beam
    for arm, force in (resultant(beam, own) for own in loads):
        total += np.concatenate([force, arm * np.cross(e, force)])
    tip, energy = np.zeros(6), 0.0
    for (low, high), (x, weight) in product(pairwise(at), zip(*_GAUSS, strict=True)):
        u, w = 0.5 * (low + high + x * (high - low)), np.zeros(6)
        for own in loads:  # what is beyond, as a force, and its arm from there
            if isinstance(own, DistributedForce):
                F, arm = u * _in_axes(beam, "force per length", own.per_length, "N/m"), 0.5 * u
            elif (arm := u - _distance(beam, own)) > 0:
                F = _in_axes(beam, "force", own.force, "N")
            else:
                continue
            w += np.concatenate([F, arm * np.cross(e, F)])
        strain = 0.5 * weight * (high - low) * c * w
        # A(u)^T strain: the displacement of the end, e u before it, gains rotation x e u.
        tip += strain
        tip[:3] += np.cross(strain[3:], u * e)
        energy += 0.5 * float(strain @ w)
    return BeamLoad(total, tip, energy)


def resultant(beam: BeamElement, load: DistributedForce | ForceOnBeam) -> tuple[float, np.ndarray]:
    """Where a load acts, from the start of the beam [m], and its force (3,) in its axes [N]."""
    if isinstance(load, DistributedForce):
        per_length = _in_axes(beam, "force per length", load.per_length, "N/m")
        return beam.length / 2, beam.length * per_length
    return beam.length - _distance(beam, load), _in_axes(beam, "force", load.force, "N")


def _distance(beam: BeamElement, load: ForceOnBeam) -> float:
    """Of the point of a force from the end of the beam [m]."""
    subject = f"distance of a force on beam {beam.name!r}"
    expected = f"a number from 0 to {beam.length:g} [m], from its start"
    s = as_float(subject, load.distance, expected, "m")
    if not 0.0 <= s <= beam.length:
        raise InputError(subject, got=load.distance, expected=expected)
    return beam.length - s


def _in_axes(beam: BeamElement, what: str, value: ArrayLike, unit: str) -> np.ndarray:
    subject = f"{what} on beam {beam.name!r}"
    return beam.rotation.T @ as_floats(subject, value, f"three numbers [{unit}]", unit, (3,))
