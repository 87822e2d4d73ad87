"""From written legs, repeated ones too, to legs of the model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from robostiff.io.expression import ParameterError, Parameters
from robostiff.io.model_file.build_joint import build_joint
from robostiff.io.model_file.build_link import (
    build_beam,
    build_link,
    build_rigid,
    build_spring,
    build_telescope,
)
from robostiff.io.model_file.geometry import transform
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.stock import Stock
from robostiff.io.model_file.written_elements import (
    WrittenBeam,
    WrittenElement,
    WrittenLink,
    WrittenRigid,
    WrittenSpring,
    WrittenTelescope,
)
from robostiff.io.model_file.written_robot import (
    WrittenCopy,
    WrittenCount,
    WrittenLeg,
    WrittenLegBody,
    WrittenPattern,
)
from robostiff.io.suggest import Words
from robostiff.model import Chain, Elbow, Element, Leg


def build_legs(
    place: Place, written: list[WrittenLeg | WrittenPattern] | WrittenPattern, stock: Stock
) -> list[tuple[Place, Leg]]:
    """The legs that are written at a place, each with its own place."""
    if isinstance(written, WrittenPattern):
        parts = [(place, written)]
    else:
        parts = [(place / i, part) for i, part in enumerate(written)]
    built: dict[str, tuple[Place, Leg]] = {}
    for where, part in parts:
        for name, named_at, here in _named(where, part):
            if name in built:
                raise named_at.error("name of a leg", got=name, expected="each name once")
            built[name] = here, build_leg(here, part, name, stock)
    return list(built.values())


def build_leg(place: Place, written: WrittenLegBody, name: str, stock: Stock) -> Leg:
    """The leg that is written at a place."""
    names = _element_names(place / "chain", written.chain)
    elements = [
        build_element(place / "chain" / i, element, own, stock)
        for i, (element, own) in enumerate(zip(written.chain, names, strict=True))
    ]
    base = transform(place / "base", written.base)
    attachment = transform(place / "platform", written.platform)
    with (place / "chain").complaints():
        return Leg(name, base, Chain(tuple(elements)), attachment, Elbow(written.elbow))


def build_element(place: Place, written: WrittenElement, name: str, stock: Stock) -> Element:
    """The element that is written at a place."""
    match written:
        case WrittenRigid():
            return build_rigid(place, written, name)
        case WrittenBeam():
            return build_beam(place, written, name, stock)
        case WrittenSpring():
            return build_spring(place, written, name)
        case WrittenLink():
            return build_link(place, written, name)
        case WrittenTelescope():
            return build_telescope(place, written, name, stock)
    return build_joint(place, written, name)


def _element_names(place: Place, chain: list[WrittenElement]) -> list[str]:
    """A name for each element: its own, or its type and a number."""
    names: list[str] = []
    count: dict[str, int] = {}
    own = {element.name for element in chain}
    for i, element in enumerate(chain):
        name = element.name
        if name in names:
            raise (place / i / "name").error(
                "name of an element", got=name, expected="each name once in a leg"
            )
        while name is None or (element.name is None and name in own):
            count[element.type] = count.get(element.type, 0) + 1
            name = f"{element.type}{count[element.type]}"
        names.append(name)
    return names


def _named(
    place: Place, written: WrittenLeg | WrittenPattern
) -> Iterator[tuple[str, Place, Place]]:
    """For a leg, or each copy of a repeated one: its name, where that is, and its own place."""
    if isinstance(written, WrittenLeg):
        yield written.name, place / "name", place
        return
    here, let = place / "repeat", (place / "let", written.let)
    if isinstance(written.repeat, WrittenCount):
        count = written.repeat
        for number in range(1, count.count + 1):
            name = f"{count.name}{number}"
            own = {count.variable: float(number)}
            yield name, here, _with_variables(place, name, (here / "variable", own), let)
        return
    for i, copy in enumerate(written.repeat):
        name = _copy_name(here / i, copy, written.repeat[0])
        own = {key: value for key, value in copy.items() if key != "name"}
        yield name, here / i, _with_variables(place, name, (here / i, own), let)


def _copy_name(place: Place, copy: WrittenCopy, first: WrittenCopy) -> str:
    name = copy.get("name")
    if not isinstance(name, str) or not name.strip():
        raise place.error(
            "copy of the leg",
            got=Words("no name" if name is None else repr(name)),
            expected="a name, such as {name: leg1, phi: 0 deg}",
        )
    if copy.keys() != first.keys():
        missing = sorted(first.keys() - copy.keys()) or sorted(copy.keys() - first.keys())
        raise place.error(
            f"variables of the copy {name!r}",
            got=Words(", ".join(key for key in copy if key != "name") or "none"),
            expected=Words(", ".join(key for key in first if key != "name") or "none"),
            hint=f"{missing[0]} must have a value in every copy",
        )
    return name


def _with_variables(place: Place, leg: str, *variables: tuple[Place, WrittenCopy]) -> Place:
    """The template's place, with the variables of one copy among its names."""
    places: dict[str, Place] = {}
    values: WrittenCopy = {}
    for here, own in variables:
        for name, value in own.items():
            where = here if here.path[-1] == "variable" else here / name
            if name in place.names or name in values:
                taken = "parameter" if name in place.names else "variable"
                raise where.error(
                    "variable",
                    got=name,
                    expected=f"a name of its own; a {taken} has it already",
                    key=True,
                )
            places[name], values[name] = where, value
    known: dict[str, Any] = {**place.names, **values}
    try:
        names = Parameters(known, mathematics=place.mathematics).values
    except ParameterError as error:
        raise places[error.name].error(
            error.subject.replace("parameter", "variable", 1),
            got=error.got,
            expected=error.expected,
            hint=error.hint,
        ) from None
    return replace(place, names=names, leg=leg)
