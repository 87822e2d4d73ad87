"""Rigid and elastic parts in a model file, and their masses: keys, and what is built of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from annotated_types import MaxLen, MinLen
from pydantic import Field

from robostiff.elasticity import (
    BeamSegment,
    BeamTheory,
    CrossSection,
    Elasticity,
    elasticity_from_compliance,
    elasticity_from_stiffness,
    moved,
    tapered_compliance,
)
from robostiff.elasticity.bounds import Bounds
from robostiff.io.model_file.joints import WrittenDrive, build_role
from robostiff.io.model_file.place import Place, axes_of, direction, point, rotation, vector
from robostiff.io.model_file.stock import MaterialChoice, SectionChoice, Stock, Theory, read_theory
from robostiff.io.model_file.written_parts import (
    Direction,
    Name,
    Text,
    Value,
    Vector,
    WrittenMapping,
    WrittenMass,
    WrittenRotation,
)
from robostiff.io.suggest import Words, shown, values
from robostiff.io.units import Dimension
from robostiff.model import (
    Link,
    Mass,
    Rigid,
    Telescope,
    TelescopicBeam,
    beam_axes,
    beam_link,
    gravity_vector,
)
from robostiff.model.link import beam_mass, section_is_isotropic
from robostiff.spatial import Frame
from robostiff.spatial.formula import is_above, length_of

_Six = Annotated[list[Any], MinLen(6), MaxLen(6)]

_MATERIAL = "a name, such as steel, or {E: 70 GPa, poisson_ratio: 0.33}"

_SECTION = "a name, or a shape such as {circle: {diameter: 20 mm}}"


class WrittenRigid(WrittenRotation, WrittenMass):
    """Rigid part."""

    type: Literal["rigid"]
    name: Name | None = None
    to: Vector | None = None


class WrittenSegment(WrittenMapping):
    """A uniform piece of a beam."""

    share: Value = Field(description="the part of the beam's length that this segment has")
    material: MaterialChoice | None = None
    section: SectionChoice = Field(description=_SECTION)


class WrittenBeam(WrittenMass):
    """Straight beam."""

    type: Literal["beam"]
    name: Name | None = None
    to: Vector = Field(description="the end of the beam, [x, y, z] in the present frame")
    y_axis: Direction | None = None
    material: MaterialChoice = Field(description=_MATERIAL)
    section: SectionChoice | None = None
    theory: Theory = "euler-bernoulli"
    taper: Annotated[list[WrittenSegment], Field(min_length=1)] | None = None


class WrittenMatrices(WrittenRotation):
    """A 6x6 stiffness or compliance: six lists of six numbers, or the six of the diagonal."""

    stiffness: _Six | None = None
    compliance: _Six | None = None


class WrittenSpring(WrittenMatrices, WrittenMass):
    """Spring at one place of the chain."""

    type: Literal["spring"]
    name: Name | None = None
    at: Vector | None = None


class WrittenLink(WrittenMatrices, WrittenMass):
    """Elastic part given by its 6x6 matrix."""

    type: Literal["link"]
    name: Name | None = None
    to: Vector = Field(description="the far end, [x, y, z] in the present frame")


class WrittenTelescopicBeam(WrittenMapping):
    """A beam that a telescope lengthens."""

    share: Value | None = None
    fixed: Value = 0.0
    material: MaterialChoice = Field(description=_MATERIAL)
    section: SectionChoice = Field(description=_SECTION)
    theory: Theory = "euler-bernoulli"
    mass: Value | None = None


class WrittenTelescope(WrittenDrive):
    """Leg of variable length."""

    type: Literal["telescope"]
    direction: Direction = Field(description="the direction of the slide, such as z")
    y_axis: Direction | None = None
    home: Value | None = None
    beams: list[WrittenTelescopicBeam] = Field(default_factory=list)


class WrittenPlatformMass(WrittenMapping):
    """The mass of the platform, or of something that it carries."""

    name: Text | None = None
    mass: Value = Field(description="the mass, such as 25 kg")
    centre: Vector | None = None


def read_mass(place: Place, written: Value | None) -> Any:
    """The mass that is written at a place [kg]; None where there is none."""
    if written is None:
        return None
    value = place.number(written, Dimension.MASS)
    if is_above(0, value):
        raise place.error("mass", got=written, expected="zero or more, such as 2 kg")
    return value


def build_masses(place: Place, written: WrittenMass) -> tuple[Mass, ...]:
    """The mass of a part, as far as it is written."""
    if written.mass is None and written.centre is not None:
        raise (place / "centre").error(
            "centre of mass",
            got=Words("no mass beside it"),
            expected="mass: beside centre:",
            hint="a beam has its mass from the density of its material, in its middle",
            key=True,
        )
    value = read_mass(place / "mass", written.mass)
    if value is None:
        return ()
    centre = None if written.centre is None else point(place / "centre", written.centre)
    return (Mass(value, centre),)


def build_platform_masses(place: Place, written: Sequence[WrittenPlatformMass]) -> tuple[Mass, ...]:
    """Masses of the platform and of what it carries."""
    return tuple(
        Mass(
            read_mass(place / i / "mass", own.mass),
            None if own.centre is None else point(place / i / "centre", own.centre),
            name=own.name or f"platform{i + 1}",
        )
        for i, own in enumerate(written)
    )


def build_gravity(place: Place, written: str | list[Value] | None) -> np.ndarray | None:
    """Acceleration of free fall [m/s^2]; None where none is written."""
    if written is None:
        return None
    if isinstance(written, str):
        return gravity_vector("gravity", written)
    return vector(place, written, Dimension.ACCELERATION)


_STIFFNESS_BLOCKS = (
    Dimension.TRANSLATIONAL_STIFFNESS,
    Dimension.COUPLING_STIFFNESS,
    Dimension.ROTATIONAL_STIFFNESS,
)
_COMPLIANCE_BLOCKS = (
    Dimension.TRANSLATIONAL_COMPLIANCE,
    Dimension.COUPLING_COMPLIANCE,
    Dimension.ROTATIONAL_COMPLIANCE,
)


SHORTEST = 1e-9
"""Of beams [m]; what is shorter is a slip."""


def build_rigid(place: Place, written: WrittenRigid, name: str) -> Rigid:
    """The rigid part that is written at a place."""
    turned = rotation(place, written)
    if written.to is None and turned is None:
        raise place.error("rigid part", expected="to: [x, y, z], a rotation, or both")
    to = point(place / "to", written.to)
    axes = np.eye(3) if turned is None else turned
    return Rigid(Frame(axes, to), name, build_masses(place, written))


def build_beam(place: Place, written: WrittenBeam, name: str, stock: Stock) -> Link:
    """The beam that is written at a place, perhaps of several segments."""
    to = point(place / "to", written.to)
    if not np.any(to) or (to.dtype != object and np.linalg.norm(to) < SHORTEST):
        raise (place / "to").error(
            "end of the beam",
            got=written.to,
            expected=f"a point away from the beam's start, by {SHORTEST:g} m or more",
        )
    theory = read_theory(written.theory)
    y_axis = None if written.y_axis is None else direction(place / "y_axis", written.y_axis)
    own = build_masses(place, written)
    material = stock.material(place / "material", written.material)
    if (written.section is None) == (written.taper is None):
        raise place.error(
            "beam",
            got=Words("neither section nor taper" if written.taper is None else "both"),
            expected="either a section or a taper",
        )
    if written.section is not None:
        section = stock.section(place / "section", written.section, material, theory)
        _check_y_axis(place, y_axis, to, [section])
        with place.complaints():
            link = beam_link(to, material, section, y_axis=y_axis, theory=theory, name=name)
        return replace(link, masses=own) if own else link
    segments = _segments(place, written, stock, _length(to), theory)
    _check_y_axis(place, y_axis, to, [segment.section for segment in segments])
    with place.complaints():
        compliance = tapered_compliance(segments, theory)
        bounds = [x for s in segments for x in (*s.material.bounds, *s.section.bounds)]
        bounds += (Bounds("length of a segment", s.length) for s in segments)
        elasticity = Elasticity(compliance, bounds=tuple(bounds))
        masses: list[Mass] = []  # of the segments, as far as their densities are known
        start: Any = 0
        for segment in segments:
            value, end = beam_mass(*segment), start + segment.length / _length(to)
            if value is not None:
                masses.append(Mass(value, span=(start, end)))
            start = end
        return Link(to, elasticity, beam_axes(to, y_axis), name, own or tuple(masses))


def build_spring(place: Place, written: WrittenSpring, name: str) -> Link:
    """The spring that is written at a place, moved to the origin of the present frame."""
    own, axes = build_elasticity(place, written), axes_of(place, written)
    at = point(place / "at", written.at)
    if np.any(at):
        own, axes = moved(own, axes, -at), np.eye(3)
    return Link(np.zeros(3), own, axes, name, build_masses(place, written))


def build_link(place: Place, written: WrittenLink, name: str) -> Link:
    """The elastic link that is written at a place."""
    to = point(place / "to", written.to)
    axes = axes_of(place, written)
    return Link(to, build_elasticity(place, written), axes, name, build_masses(place, written))


def build_telescope(place: Place, written: WrittenTelescope, name: str, stock: Stock) -> Telescope:
    """The telescope that is written at a place."""
    along = direction(place / "direction", written.direction)
    y_axis = None if written.y_axis is None else direction(place / "y_axis", written.y_axis)
    role = build_role(place, written, (Dimension.LENGTH,))
    home = place.number_at(written, "home", Dimension.LENGTH)
    beams = tuple(
        _telescopic_beam(place / "beams" / i, beam, stock, alone=len(written.beams) == 1)
        for i, beam in enumerate(written.beams)
    )
    _check_y_axis(place, y_axis, along, [beam.section for beam in beams])
    with (place / "beams").complaints():
        return Telescope(along, beams, beam_axes(along, y_axis), role, home, name)


def _telescopic_beam(place: Place, written: Any, stock: Stock, *, alone: bool) -> TelescopicBeam:
    has_length = "fixed" in written.model_fields_set
    if written.share is None and not alone and not has_length:
        raise place.error(
            "beam of a telescope",
            got=Words("no share"),
            expected="the share of the extension that lengthens this beam, such as share: 0.5, "
            "or its fixed length",
        )
    share = 1.0 if alone else 0.0
    if written.share is not None:
        share = (place / "share").number(written.share, Dimension.NUMBER)
    fixed = (place / "fixed").number(written.fixed, Dimension.LENGTH)
    material = stock.material(place / "material", written.material)
    theory = read_theory(written.theory)
    section = stock.section(place / "section", written.section, material, theory)
    mass = read_mass(place / "mass", written.mass)
    with place.complaints():
        return TelescopicBeam(material, section, share, fixed, theory, mass)


def _length(to: np.ndarray) -> Any:
    return length_of(to) if to.dtype == object else float(np.linalg.norm(to))


def _check_y_axis(
    place: Place, y_axis: np.ndarray | None, along: np.ndarray, sections: list[CrossSection]
) -> None:
    with (place / "y_axis").complaints():
        beam_axes(along, y_axis)
    if y_axis is None and not all(map(section_is_isotropic, sections)):
        raise place.error(
            "beam",
            got=Words("no y_axis"),
            expected="the direction of the section's y axis, because Iy and Iz differ",
            hint="write y_axis: z or y_axis: [0, 0, 1] or the like",
        )


def _segments(
    place: Place, written: WrittenBeam, stock: Stock, length: Any, theory: BeamTheory
) -> list[BeamSegment]:
    segments, total = [], 0.0
    for i, segment in enumerate(written.taper or ()):
        here = place / "taper" / i
        share = (here / "share").positive(segment.share, Dimension.NUMBER)
        choice = written.material if segment.material is None else segment.material
        material = stock.material(here / "material", choice)
        section = stock.section(here / "section", segment.section, material, theory)
        segments.append(BeamSegment(share * length, material, section))
        total += share
    if is_above(total - 1, 1e-9) or is_above(1 - total, 1e-9):
        raise (place / "taper").error(
            "shares of the segments", got=Words(f"{float(total):.9g} in all"), expected="1 in all"
        )
    return segments


def build_elasticity(place: Place, written: WrittenMatrices) -> Elasticity:
    """The stiffness or compliance that is written at a place."""
    if (written.stiffness is None) == (written.compliance is None):
        raise place.error(
            "elastic element",
            got=Words("neither" if written.stiffness is None else "both"),
            expected="either stiffness: or compliance:, 6 x 6",
        )
    if written.stiffness is not None:
        here, convert = place / "stiffness", elasticity_from_stiffness
        matrix = _matrix6(here, written.stiffness, _STIFFNESS_BLOCKS)
    else:
        here, convert = place / "compliance", elasticity_from_compliance
        matrix = _matrix6(here, written.compliance or [], _COMPLIANCE_BLOCKS)
    with here.complaints():
        return convert(matrix)


def _matrix6(place: Place, rows: list, blocks: tuple[Dimension, ...]) -> np.ndarray:
    """Six lists of six values; or six values, the diagonal of a matrix."""
    matrix = np.zeros((6, 6), dtype=object if place.is_exact else float)
    for i, row in enumerate(rows):
        if not isinstance(row, list):
            matrix[i, i] = (place / i).number(_plain(place / i, row), blocks[2 * (i // 3)])
            continue
        if len(row) != 6:
            raise (place / i).error(
                "row of the matrix", got=Words(values(len(row))), expected="6 values"
            )
        for j, value in enumerate(row):
            here = place / i / j
            matrix[i, j] = here.number(_plain(here, value), blocks[i // 3 + j // 3])
    if len({isinstance(row, list) for row in rows}) > 1:
        raise place.error(
            "matrix",
            got=Words("lists beside single values"),
            expected="six lists of six values, or the six values of the diagonal",
        )
    return matrix


def _plain(place: Place, value: Any) -> str | float:
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise place.error(
            "entry of the matrix", got=shown(value), expected="a number or an expression"
        )
    return value
