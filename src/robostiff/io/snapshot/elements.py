"""From the elements of a snapshot file to placed joints and springs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from robostiff.elasticity import (
    BeamTheory,
    CrossSection,
    Elasticity,
    EulerBernoulli,
    Material,
    Timoshenko,
    beam_compliance,
    elasticity_from_compliance,
    elasticity_from_stiffness,
)
from robostiff.errors import warn_of_slip
from robostiff.io.document import DocumentPlace
from robostiff.io.plausibility import question
from robostiff.io.snapshot.format import (
    BeamData,
    BeamPart,
    ElementPart,
    FreedomPart,
    MassData,
    PassivePart,
    Spring6Data,
    Spring6Part,
    SpringPart,
)
from robostiff.io.units import Dimension
from robostiff.model import (
    Actuated,
    Mass,
    Passive,
    PlacedFreedom,
    PlacedMass,
    PlacedSpring,
    Role,
    beam_axes,
)
from robostiff.model.checks import rotation_matrix, unit_vector
from robostiff.network.elements import uniform_mass

# Part of a beam's length by which the axis of a joint may miss it, with a rigid part between.
_FAR = 0.5


def placed(
    element: BeamPart | Spring6Part | PassivePart | SpringPart, name: str, place: DocumentPlace
) -> PlacedFreedom | PlacedSpring:
    """A joint or spring in the world.

    Raises FileError when a direction, matrix or length makes no sense, at the key that has it.
    """
    if isinstance(element, BeamPart):
        return placed_beam(element, name, place)
    if isinstance(element, Spring6Part):
        return placed_spring6(element, name, place)
    role = Passive()
    if isinstance(element, SpringPart):
        role = Actuated(element.k, inertia=element.inertia)
    return placed_freedom(element, role, name, place)


def placed_freedom(
    element: PassivePart | SpringPart | FreedomPart, role: Role, name: str, place: DocumentPlace
) -> PlacedFreedom:
    """A joint about or along an axis in the world."""
    with place.at("axis").complaints():
        axis = _direction("axis", element.axis)
    return PlacedFreedom(axis, np.array(element.point, dtype=float), element.advance, name, role)


def placed_beam(element: BeamData, name: str, place: DocumentPlace) -> PlacedSpring:
    """A beam in the world, about its end."""
    end = np.array(element.end, dtype=float)
    along = end - np.array(element.start, dtype=float)
    if not along.any():
        raise place.at("end").error(
            "beam of no length", got=place.at("end").value, expected="a point other than its start"
        )
    with place.at("end").complaints():
        length = float(np.hypot.reduce(along))
        x = _direction("direction of the beam", along)
    with place.at("y_axis").complaints():
        rotation = beam_axes(x, _direction("y axis of the section", element.y_axis))
    theory: BeamTheory = EulerBernoulli() if element.shear_factor_y is None else Timoshenko()
    with place.complaints():
        section = CrossSection(
            element.A,
            element.Iy,
            element.Iz,
            element.J,
            element.shear_factor_y,
            element.shear_factor_z,
        )
        material = Material(name, element.E, element.G)
        compliance = beam_compliance(length, material, section, theory)
    if not np.isfinite(compliance).all():
        raise place.error(
            "compliance of the beam", expected="finite numbers", hint="check the units of the beam"
        )
    where = place.document.location
    question(length, Dimension.LENGTH, where, place.at("end").path, in_si=True)
    question(element.E, Dimension.MODULUS, where, place.at("E").path, in_si=True)
    return PlacedSpring(name, end, rotation, Elasticity(compliance))


def question_joints(chain: Sequence[ElementPart], place: DocumentPlace) -> None:
    """Warn of joints in a chain whose axis passes far from the beam beside them."""
    for i, (one, other) in enumerate(pairwise(chain)):
        for beam, joint, j in ((one, other, i + 1), (other, one, i)):
            if isinstance(beam, BeamPart) and isinstance(joint, PassivePart | SpringPart):
                _question_joint(beam, joint, place.at(j))


def _question_joint(beam: BeamPart, joint: PassivePart | SpringPart, place: DocumentPlace) -> None:
    if joint.kind == "P":
        return
    ends, axis = np.array([beam.start, beam.end]), np.array(joint.axis)
    axis = axis / np.linalg.norm(axis)
    gap = float(np.min(np.linalg.norm(np.cross(ends - joint.point, axis), axis=1)))
    length = float(np.linalg.norm(ends[1] - ends[0]))
    if gap > _FAR * length:
        warn_of_slip(
            f"{place.document.location(place.at('point').path)}: the axis of this joint passes "
            f"{gap:g} m from the beam beside it, which is {length:g} m long; are both in metres?"
        )


def placed_spring6(element: Spring6Data, name: str, place: DocumentPlace) -> PlacedSpring:
    """A spring in the world, from its matrix."""
    with place.at("rotation").complaints():
        rotation = rotation_matrix("rotation", element.rotation)
    if element.K is not None:
        with place.at("K").complaints():
            elasticity = elasticity_from_stiffness(element.K)
    else:
        with place.at("compliance").complaints():
            elasticity = elasticity_from_compliance(element.compliance or [])
    return PlacedSpring(name, np.array(element.point, dtype=float), rotation, elasticity)


def placed_masses(
    data: MassData, place: DocumentPlace, carrier: str, usual: np.ndarray, after: int = 0
) -> Iterator[PlacedMass]:
    """A mass of a file in the world, as one or, with an inertia, as six.

    What carries it has a name and a `usual` place (3,) [m]: where the mass is if the file does not
    say so, or where the elastic part ends.
    """
    at = None if data.at is None else np.array(data.at, dtype=float)
    if data.start is None:
        with place.complaints():
            mass = Mass(data.mass, inertia=data.inertia, name=data.name or carrier)
        yield from mass.placed(mass.name, np.eye(3), usual if at is None else at, after)
        return
    start, span = np.array(data.start, dtype=float), None
    if at is None:
        span = (0.0, 1.0) if data.span is None else (data.span[0], data.span[1])
        at = start + 0.5 * sum(span) * (usual - start)
    yield PlacedMass(carrier, np.asarray(data.mass), at, after, start, span)


def beam_masses(element: BeamData, name: str, after: int = 0) -> tuple[PlacedMass, ...]:
    """The mass of a beam, from its density."""
    start, end = np.array(element.start, dtype=float), np.array(element.end, dtype=float)
    value = None if element.density is None else element.density * element.A
    if value is not None:
        value *= float(np.linalg.norm(end - start))
    return tuple(replace(own, after=after) for own in uniform_mass(name, value, start, end))


def _direction(subject: str, value: Sequence[float] | np.ndarray) -> np.ndarray:
    """Unit vector of components of any size, which would overflow or vanish when squared."""
    vector = np.array(value, dtype=float)
    largest = np.abs(vector).max()
    return unit_vector(subject, vector / largest if 0 < largest < np.inf else value)
