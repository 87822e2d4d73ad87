"""Materials and cross-sections of a model file, named or written in place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, Tag

from robostiff.elasticity import (
    MATERIALS,
    BeamTheory,
    CrossSection,
    EulerBernoulli,
    Material,
    Timoshenko,
    box,
    circle,
    i_section,
    rectangle,
    tube,
)
from robostiff.io.model_file.parts import Value, WrittenMapping, either
from robostiff.io.model_file.place import Place
from robostiff.io.suggest import Words, did_you_mean, listing
from robostiff.io.units import Dimension
from robostiff.spatial.formula import is_above


class WrittenMaterial(WrittenMapping):
    """A material: E with G, or E with the Poisson ratio."""

    E: Value = Field(description="Young's modulus")
    G: Value | None = None
    poisson_ratio: Value | None = None
    density: Value | None = None
    source: str = ""

    def build(self, place: Place, name: str) -> Material:
        """The material."""
        E = (place / "E").positive(self.E, Dimension.MODULUS)
        if (self.G is None) == (self.poisson_ratio is None):
            raise place.error(
                "material",
                got=Words("both G and poisson_ratio" if self.G is not None else "E alone"),
                expected="E with either G or poisson_ratio",
            )
        density = None
        if self.density is not None:
            density = (place / "density").positive(self.density, Dimension.DENSITY)
        if self.G is not None:
            G = (place / "G").positive(self.G, Dimension.MODULUS)
            return Material(name, E, G, self.source, density)
        here = place / "poisson_ratio"
        ratio = here.number(self.poisson_ratio or 0, Dimension.NUMBER)
        with here.complaints(hint="write E and G for a material that is not isotropic"):
            return Material.isotropic(name, E, ratio, self.source, density)


class WrittenCircle(WrittenMapping):
    """Full circle."""

    diameter: Value


class WrittenTube(WrittenMapping):
    """Circular tube."""

    outer_diameter: Value
    inner_diameter: Value


class WrittenRectangle(WrittenMapping):
    """Full rectangle."""

    width_y: Value
    height_z: Value


class WrittenBox(WrittenMapping):
    """Hollow rectangle."""

    width_y: Value
    height_z: Value
    wall: Value


class WrittenISection(WrittenMapping):
    """Flanges along y, web along z."""

    flange_width: Value
    height: Value
    web_thickness: Value
    flange_thickness: Value


class WrittenProperties(WrittenMapping):
    """The numbers themselves."""

    A: Value
    Iy: Value
    Iz: Value
    J: Value
    shear_factor_y: Value | None = None
    shear_factor_z: Value | None = None


_SHAPES = {"circle": circle, "tube": tube, "rectangle": rectangle, "box": box, "i": i_section}
_HINTS = {"tube": "both are diameters, not radii"}
_PROPERTIES = {
    "A": Dimension.AREA,
    "Iy": Dimension.SECOND_MOMENT,
    "Iz": Dimension.SECOND_MOMENT,
    "J": Dimension.SECOND_MOMENT,
    "shear_factor_y": Dimension.NUMBER,
    "shear_factor_z": Dimension.NUMBER,
}


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
            raise place.error(
                "section",
                got=Words(" and ".join(kinds) if kinds else "no shape"),
                expected=f"one of {', '.join(_SHAPES)}, properties",
            )
        (kind,) = kinds
        here = place / kind
        numbers: dict[str, Any] = {
            key: (here / key).positive(value, _PROPERTIES.get(key, Dimension.LENGTH))
            for key, value in getattr(self, kind)
            if value is not None
        }
        if kind == "properties":
            return CrossSection(**numbers)
        with here.complaints(hint=_HINTS.get(kind)):
            return _SHAPES[kind](**numbers, poisson_ratio=_usable_ratio(material))


MaterialChoice = Annotated[
    Annotated[str, Tag("name")] | Annotated[WrittenMaterial, Tag("mapping")],
    either(str, "name", "mapping"),
]

SectionChoice = Annotated[
    Annotated[str, Tag("name")] | Annotated[WrittenSection, Tag("mapping")],
    either(str, "name", "mapping"),
]

Theory = Literal["euler-bernoulli", "timoshenko"]


def stocked(
    top: Place, materials: Mapping[str, WrittenMaterial], sections: Mapping[str, WrittenSection]
) -> Place:
    """The whole document with its materials, beside those shipped, and sections; all checked."""
    own = {name: one.build(top / "materials" / name, name) for name, one in materials.items()}
    for name, section in sections.items():
        section.build(top / "sections" / name)
    return replace(top, materials={**MATERIALS, **own}, sections=sections)


def build_material(place: Place, written: MaterialChoice) -> Material:
    """The material that is named or written at a place."""
    if isinstance(written, WrittenMaterial):
        return written.build(place, "material of this beam")
    if written not in place.materials:
        raise place.error(
            "unknown material",
            got=written,
            expected=f"one of {listing(list(place.materials))}",
            hint=did_you_mean(written, place.materials)
            or "define it under materials: or write {E: 70 GPa, poisson_ratio: 0.33}",
        )
    return place.materials[written]


def build_section(
    place: Place, written: SectionChoice, material: Material, theory: BeamTheory
) -> CrossSection:
    """The cross-section that is named or written at a place, of a beam of this material."""
    if isinstance(written, WrittenSection):
        section = written.build(place, material)
    elif written not in place.sections:
        raise place.error(
            "unknown section",
            got=written,
            expected=f"one of {listing(list(place.sections))}"
            if place.sections
            else "a shape, as no section is defined",
            hint=did_you_mean(written, place.sections)
            or "define it under sections: or write {circle: {diameter: 20 mm}}",
        )
    else:
        there = replace(place, path=("sections", written), leg="")
        section = place.sections[written].build(there, material)
    with place.complaints(hint="write them beside A, or leave theory: timoshenko out"):
        theory.shear_factors(section)
    return section


def read_theory(written: str) -> BeamTheory:
    """The beam theory of that name."""
    return Timoshenko() if written == "timoshenko" else EulerBernoulli()


def _usable_ratio(material: Material | None) -> Any:
    """The Poisson ratio for the shear factors; steel's where a material is not isotropic."""
    if material is None:
        return 0.3
    nu = material.poisson_ratio
    return 0.3 if is_above(-1, nu, or_at=True) or is_above(2 * nu, 1, or_at=True) else nu
