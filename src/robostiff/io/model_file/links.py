"""Rigid and elastic parts in a model file, with their materials and cross-sections."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from annotated_types import MaxLen, MinLen
from pydantic import Field

from robostiff.elasticity import (
    MATERIALS,
    BeamSegment,
    BeamTheory,
    CrossSection,
    Elasticity,
    EulerBernoulli,
    Material,
    Timoshenko,
    beam_compliance,
    box,
    circle,
    elasticity_from_compliance,
    elasticity_from_stiffness,
    i_section,
    in_element_axes,
    rectangle,
    shear_compliance,
    tapered_compliance,
    tube,
)
from robostiff.elasticity.checks import Bounds
from robostiff.errors import Words
from robostiff.io.model_file.joints import WrittenDrive
from robostiff.io.model_file.place import (
    Area,
    Density,
    Direction,
    Length,
    Modulus,
    Name,
    Number,
    Place,
    SecondMoment,
    Value,
    Vector,
    WordOr,
    WrittenMapping,
    WrittenMass,
    WrittenRotation,
    read_mass,
)
from robostiff.io.suggest import values
from robostiff.io.units import Dimension
from robostiff.model import Link, Mass, Rigid, Telescope, TelescopicBeam, beam_axes, beam_link
from robostiff.model.link import beam_mass, section_is_isotropic
from robostiff.spatial import Frame
from robostiff.spatial.formula import is_above, length_of


class WrittenMaterial(WrittenMapping):
    """A material: E with G, or E with the Poisson ratio."""

    E: Modulus = Field(description="Young's modulus")
    G: Modulus | None = None
    poisson_ratio: Value | None = None
    density: Density | None = None
    source: str = ""

    def build(self, place: Place, name: str) -> Material:
        """The material."""
        numbers = self.numbers(place, positive=True)
        if (self.G is None) == (self.poisson_ratio is None):
            got = Words("both G and poisson_ratio" if self.G is not None else "E alone")
            raise place.error("material", got=got, expected="E with either G or poisson_ratio")
        if self.poisson_ratio is None:
            return Material(name, **numbers, source=self.source)
        here, E = place / "poisson_ratio", numbers["E"]
        ratio = here.number(self.poisson_ratio, Dimension.NUMBER)
        with here.complaints(hint="write E and G for a material that is not isotropic"):
            return Material.isotropic(name, E, ratio, self.source, numbers["density"])


class WrittenCircle(WrittenMapping):
    """Full circle."""

    diameter: Length


class WrittenTube(WrittenMapping):
    """Circular tube."""

    outer_diameter: Length
    inner_diameter: Length


class WrittenRectangle(WrittenMapping):
    """Full rectangle."""

    width_y: Length
    height_z: Length


class WrittenBox(WrittenMapping):
    """Hollow rectangle."""

    width_y: Length
    height_z: Length
    wall: Length


class WrittenISection(WrittenMapping):
    """Flanges along y, web along z."""

    flange_width: Length
    height: Length
    web_thickness: Length
    flange_thickness: Length


class WrittenProperties(WrittenMapping):
    """The numbers themselves."""

    A: Area
    Iy: SecondMoment
    Iz: SecondMoment
    J: SecondMoment
    shear_factor_y: Number | None = None
    shear_factor_z: Number | None = None


_SHAPES = {"circle": circle, "tube": tube, "rectangle": rectangle, "box": box, "i": i_section}
_HINTS = {"tube": "both are diameters, not radii"}


class WrittenSection(WrittenMapping):
    """A cross-section: exactly one of these shapes."""

    circle: WrittenCircle | None = None
    tube: WrittenTube | None = None
    rectangle: WrittenRectangle | None = None
    box: WrittenBox | None = None
    i: WrittenISection | None = None
    properties: WrittenProperties | None = None

    def build(self, place: Place, material: Material | None = None) -> CrossSection:
        """The cross-section of a beam of a material."""
        kinds = [kind for kind in (*_SHAPES, "properties") if getattr(self, kind) is not None]
        if len(kinds) != 1:
            got = Words(" and ".join(kinds) if kinds else "no shape")
            expected = f"one of {', '.join(_SHAPES)}, properties"
            raise place.error("section", got=got, expected=expected)
        (kind,) = kinds
        here = place / kind
        numbers = getattr(self, kind).numbers(here, positive=True)
        if kind == "properties":
            return CrossSection(**numbers)
        nu = 0.3 if material is None else material.poisson_ratio  # for the shear factors
        if is_above(-1, nu, or_at=True) or is_above(2 * nu, 1, or_at=True):
            nu = 0.3  # of steel, where a material is not isotropic
        with here.complaints(hint=_HINTS.get(kind)):
            return _SHAPES[kind](**numbers, poisson_ratio=nu)


MaterialChoice = WordOr[WrittenMaterial]

SectionChoice = WordOr[WrittenSection]

Theory = Literal["euler-bernoulli", "timoshenko"]

THEORIES: dict[Theory | None, BeamTheory] = {
    "euler-bernoulli": EulerBernoulli(),
    "timoshenko": Timoshenko(),
}


class WrittenStock(WrittenMapping):
    """Materials and sections of a file, by their names."""

    materials: dict[str, WrittenMaterial] = Field({})
    sections: dict[str, WrittenSection] = Field({})

    def stocked(self, top: Place) -> Place:
        """The document with its materials, beside those shipped, and sections; all checked."""
        here = top / "materials"
        materials = {name: entry.build(here / name, name) for name, entry in self.materials.items()}
        for name, section in self.sections.items():
            section.build(top / "sections" / name)
        return replace(top, materials={**MATERIALS, **materials}, sections=self.sections)


def build_material(place: Place, written: MaterialChoice) -> Material:
    """The material that is named or written at a place."""
    if isinstance(written, WrittenMaterial):
        return written.build(place, "material of this beam")
    if written not in place.materials:
        hint = "define it under materials: or write {E: 70 GPa, poisson_ratio: 0.33}"
        raise place.unknown("unknown material", written, place.materials, hint=hint)
    return place.materials[written]


def build_section(
    place: Place, written: SectionChoice, material: Material, theory: BeamTheory | None
) -> CrossSection:
    """The section that is named or written at a place, of a beam of this material and theory."""
    if isinstance(written, WrittenSection):
        section = written.build(place, material)
    elif written not in place.sections:
        what = "one of" if place.sections else "a shape, as no section is defined"
        hint = "define it under sections: or write {circle: {diameter: 20 mm}}"
        raise place.unknown("unknown section", written, place.sections, what=what, hint=hint)
    else:
        section_place = replace(place, path=("sections", written), leg="")
        section = place.sections[written].build(section_place, material)
    with place.complaints(hint="write them beside A, or leave theory: timoshenko out"):
        if theory is not None:
            theory.shear_factors(section)
    return section


_Six = Annotated[list[Any], MinLen(6), MaxLen(6)]
_MATERIAL = "a name, such as steel, or {E: 70 GPa, poisson_ratio: 0.33}"
_SECTION = "a name, or a shape such as {circle: {diameter: 20 mm}}"

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
_SHORTEST = 1e-9  # of beams [m]; what is shorter is a slip


def _check_y_axis(
    place: Place, y_axis: np.ndarray | None, along: np.ndarray, sections: list[CrossSection]
) -> None:
    with (place / "y_axis").complaints():
        beam_axes(along, y_axis)
    if y_axis is None and not all(map(section_is_isotropic, sections)):
        expected = "the direction of the section's y axis, because Iy and Iz differ"
        hint = "write y_axis: z or y_axis: [0, 0, 1] or the like"
        raise place.error("beam", got=Words("no y_axis"), expected=expected, hint=hint)


def _matrix6(place: Place, rows: list, blocks: tuple[Dimension, ...]) -> np.ndarray:
    """Six lists of six values; or six values, the diagonal of a matrix."""
    matrix = np.zeros((6, 6), dtype=object if place.is_exact else float)
    for i, row in enumerate(rows):
        here, entries = place / i, [(place / i, i, row)]
        if isinstance(row, list):
            entries = [(here / j, j, value) for j, value in enumerate(row)]
            if len(row) != 6:
                got = Words(values(len(row)))
                raise here.error("row of the matrix", got=got, expected="6 values")
        for at, j, value in entries:
            matrix[i, j] = at.any_number("entry of the matrix", value, blocks[i // 3 + j // 3])
    if len({isinstance(row, list) for row in rows}) > 1:
        expected = "six lists of six values, or the six values of the diagonal"
        raise place.error("matrix", got=Words("lists beside single values"), expected=expected)
    return matrix


class WrittenRigid(WrittenRotation, WrittenMass):
    """Rigid part."""

    type: Literal["rigid"]
    name: Name | None = None
    to: Vector | None = None

    def build(self, place: Place, name: str) -> Rigid:
        """The rigid part."""
        turned = self.rotation(place)
        if self.to is None and turned is None:
            raise place.error("rigid part", expected="to: [x, y, z], a rotation, or both")
        to = (place / "to").point(self.to)
        axes = np.eye(3) if turned is None else turned
        return Rigid(Frame(axes, to), name, self.masses(place))


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
    theory: Theory | None = None
    taper: Annotated[list[WrittenSegment], Field(min_length=1)] | None = None

    def build(self, place: Place, name: str) -> Link:
        """The beam, perhaps of several segments."""
        to = (place / "to").point(self.to)
        if not np.any(to) or (to.dtype != object and np.linalg.norm(to) < _SHORTEST):
            expected = f"a point away from the beam's start, by {_SHORTEST:g} m or more"
            raise (place / "to").error("end of the beam", got=self.to, expected=expected)
        theory = THEORIES.get(self.theory)
        y_axis = None if self.y_axis is None else (place / "y_axis").direction(self.y_axis)
        masses = self.masses(place)
        material = build_material(place / "material", self.material)
        if (self.section is None) == (self.taper is None):
            got = Words("neither section nor taper" if self.taper is None else "both")
            raise place.error("beam", got=got, expected="either a section or a taper")
        if self.section is not None:
            section = build_section(place / "section", self.section, material, theory)
            _check_y_axis(place, y_axis, to, [section])
            with place.complaints():
                link = beam_link(to, material, section, y_axis=y_axis, theory=theory, name=name)
            return replace(link, masses=masses) if masses else link
        length: Any = length_of(to) if to.dtype == object else float(np.linalg.norm(to))
        segments, total = [], 0.0
        for i, segment in enumerate(self.taper or ()):
            here = place / "taper" / i
            share = (here / "share").number(segment.share, Dimension.NUMBER, positive=True)
            choice = self.material if segment.material is None else segment.material
            material = build_material(here / "material", choice)
            section = build_section(here / "section", segment.section, material, theory)
            segments.append(BeamSegment(share * length, material, section))
            total += share
        if is_above(total - 1, 1e-9) or is_above(1 - total, 1e-9):
            got = Words(f"{float(total):.9g} in all")
            raise (place / "taper").error("shares of the segments", got=got, expected="1 in all")
        _check_y_axis(place, y_axis, to, [segment.section for segment in segments])
        with place.complaints():
            compliance = tapered_compliance(segments, theory)
            each = tuple(beam_compliance(s.length, s.material, s.section, theory) for s in segments)
            shear = shear_compliance(segments) if theory is None else None
            bounds = [x for s in segments for x in (*s.material.bounds, *s.section.bounds)]
            bounds += (Bounds("length of a segment", s.length) for s in segments)
            elasticity = Elasticity(
                compliance, bounds=tuple(bounds), segments=each, shear_left_out=shear
            )
            spread: list[Mass] = []  # of the segments, as far as their densities are known
            start: Any = 0
            for segment in segments:
                value, end = beam_mass(*segment), start + segment.length / length
                if value is not None:
                    spread.append(Mass(value, span=(start, end)))
                start = end
            return Link(to, elasticity, beam_axes(to, y_axis), name, masses or tuple(spread))


class WrittenMatrices(WrittenRotation):
    """A 6x6 stiffness or compliance: six lists of six numbers, or the six of the diagonal."""

    stiffness: _Six | None = None
    compliance: _Six | None = None

    def elasticity(self, place: Place) -> Elasticity:
        """The stiffness or compliance."""
        if (self.stiffness is None) == (self.compliance is None):
            got = Words("neither" if self.stiffness is None else "both")
            expected = "either stiffness: or compliance:, 6 x 6"
            raise place.error("elastic element", got=got, expected=expected)
        if self.stiffness is not None:
            here, convert = place / "stiffness", elasticity_from_stiffness
            matrix = _matrix6(here, self.stiffness, _STIFFNESS_BLOCKS)
        else:
            here, convert = place / "compliance", elasticity_from_compliance
            matrix = _matrix6(here, self.compliance or [], _COMPLIANCE_BLOCKS)
        with here.complaints():
            return convert(matrix)


class WrittenSpring(WrittenMatrices, WrittenMass):
    """Spring at one place of the chain."""

    type: Literal["spring"]
    name: Name | None = None
    at: Vector | None = None

    def build(self, place: Place, name: str) -> Link:
        """The spring, moved to the origin of the present frame."""
        elasticity, axes = self.elasticity(place), self.turned(place)
        at = (place / "at").point(self.at)
        if np.any(at):
            elasticity, axes = in_element_axes(elasticity, axes, -at), np.eye(3)
        return Link(np.zeros(3), elasticity, axes, name, self.masses(place))


class WrittenLink(WrittenMatrices, WrittenMass):
    """Elastic part given by its 6x6 matrix."""

    type: Literal["link"]
    name: Name | None = None
    to: Vector = Field(description="the far end, [x, y, z] in the present frame")

    def build(self, place: Place, name: str) -> Link:
        """The elastic link."""
        to, axes = (place / "to").point(self.to), self.turned(place)
        return Link(to, self.elasticity(place), axes, name, self.masses(place))


class WrittenTelescopicBeam(WrittenMapping):
    """A beam that a telescope lengthens."""

    share: Number | None = None
    fixed: Length = 0.0
    material: MaterialChoice = Field(description=_MATERIAL)
    section: SectionChoice = Field(description=_SECTION)
    theory: Theory | None = None
    mass: Value | None = None

    def build(self, place: Place, *, alone: bool) -> TelescopicBeam:
        """The beam, the only one of its telescope or one of several."""
        if self.share is None and not alone and "fixed" not in self.model_fields_set:
            raise place.error(
                "beam of a telescope",
                got=Words("no share"),
                expected="the share of the extension that lengthens this beam, such as share: 0.5, "
                "or its fixed length",
            )
        numbers = self.numbers(place)
        if self.share is None:
            numbers["share"] = 1.0 if alone else 0.0
        material = build_material(place / "material", self.material)
        theory = THEORIES.get(self.theory)
        section = build_section(place / "section", self.section, material, theory)
        mass = read_mass(place / "mass", self.mass)
        with place.complaints():
            return TelescopicBeam(material, section, **numbers, theory=theory, mass=mass)


class WrittenTelescope(WrittenDrive):
    """Leg of variable length."""

    type: Literal["telescope"]
    direction: Direction = Field(description="the direction of the slide, such as z")
    y_axis: Direction | None = None
    home: Value | None = None
    beams: list[WrittenTelescopicBeam] = Field([])

    def build(self, place: Place, name: str) -> Telescope:
        """The telescope."""
        along = (place / "direction").direction(self.direction)
        y_axis = None if self.y_axis is None else (place / "y_axis").direction(self.y_axis)
        role = self.build_role(place, (Dimension.LENGTH,))
        home = place.number_at(self, "home", Dimension.LENGTH)
        beams = tuple(
            beam.build(place / "beams" / i, alone=len(self.beams) == 1)
            for i, beam in enumerate(self.beams)
        )
        _check_y_axis(place, y_axis, along, [beam.section for beam in beams])
        with (place / "beams").complaints():
            return Telescope(along, beams, beam_axes(along, y_axis), role, home, name)


#: The elements between joints.
WrittenPart = WrittenRigid | WrittenBeam | WrittenSpring | WrittenLink | WrittenTelescope
