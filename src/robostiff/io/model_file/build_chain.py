"""Chains and legs of the model from those of a file, parallel blocks and copies included."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Protocol, TypeVar, cast

from robostiff.io.expression import ParameterError, parameter_values
from robostiff.io.model_file.build_link import (
    build_beam,
    build_link,
    build_rigid,
    build_spring,
    build_telescope,
)
from robostiff.io.model_file.build_platform import build_attachment
from robostiff.io.model_file.couplings import WrittenCoupling, coupled_chain
from robostiff.io.model_file.joints import build_joint
from robostiff.io.model_file.place import Place, point, transform
from robostiff.io.model_file.stock import Stock
from robostiff.io.model_file.written_elements import (
    WrittenBeam,
    WrittenElement,
    WrittenLink,
    WrittenParallel,
    WrittenParallelogram,
    WrittenRigid,
    WrittenSpring,
    WrittenTelescope,
)
from robostiff.io.model_file.written_parts import WrittenCopy, WrittenCount, WrittenRepeat
from robostiff.io.model_file.written_robot import WrittenLeg, WrittenLegBody, WrittenPattern
from robostiff.io.suggest import Words, numbered
from robostiff.model import Branch, Chain, Elbow, Element, Leg, ParallelBlock, parallelogram


class WrittenChain(Protocol):
    """What has a chain: a leg, a branch, a parallelogram or a module."""

    @property
    def chain(self) -> list[WrittenElement]:
        """Its elements."""
        ...

    @property
    def couplings(self) -> list[WrittenCoupling]:
        """Between its joints."""
        ...


class Named(Protocol):
    """A leg or a branch of its own."""

    name: str


Part = TypeVar("Part", bound="Named | WrittenRepeat")


def each_of(
    place: Place, written: list[Part] | Part, kind: str
) -> Iterator[tuple[str, Place, Part]]:
    """Everything of one kind that is written at a place, copies included: name, place, keys."""
    if isinstance(written, list):
        parts = [(place / i, own) for i, own in enumerate(cast("list[Part]", written))]
    else:
        parts = [(place, cast("Part", written))]
    taken = set()
    for where, own in parts:
        for name, named_at, here in _named_copies(where, own, kind):
            if name in taken:
                raise named_at.error(f"name of a {kind}", got=name, expected="each name once")
            taken.add(name)
            yield name, here, own


def _named_copies(
    place: Place, written: Named | WrittenRepeat, kind: str
) -> Iterator[tuple[str, Place, Place]]:
    """For one of a kind, or each copy of a repeated one: its name, where that is, its own place."""
    if not isinstance(written, WrittenRepeat):
        yield written.name, place / "name", place
        return
    here, let = place / "repeat", (place / "let", written.let)
    if isinstance(written.repeat, WrittenCount):
        count = written.repeat
        for number in range(1, count.count + 1):
            name = f"{count.name or kind}{number}"
            own = {count.variable: float(number)}
            yield name, here, _with_variables(place, name, (here / "variable", own), let)
        return
    for i, copy in enumerate(written.repeat):
        name = _copy_name(here / i, copy, written.repeat[0], kind)
        own = {key: value for key, value in copy.items() if key != "name"}
        yield name, here / i, _with_variables(place, name, (here / i, own), let)


def _copy_name(place: Place, copy: WrittenCopy, first: WrittenCopy, kind: str) -> str:
    name = copy.get("name")
    if not isinstance(name, str) or not name.strip():
        raise place.error(
            f"copy of the {kind}",
            got=Words("no name" if name is None else repr(name)),
            expected=f"a name, such as {{name: {kind}1, phi: 0 deg}}",
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
        names = parameter_values(known, mathematics=place.mathematics)
    except ParameterError as error:
        raise places[error.name].error(
            error.subject.replace("parameter", "variable", 1),
            got=error.got,
            expected=error.expected,
            hint=error.hint,
        ) from None
    return replace(place, names=names, leg=leg)


_MOST_PARTS = 1000
_MOST_ELEMENTS = 200


def build_chain(place: Place, own: WrittenChain, stock: Stock) -> Chain:
    """The chain that is written at the place of a leg or branch, with its couplings."""
    couplings, place, written = place / "couplings", place / "chain", own.chain
    if len(written) > _MOST_ELEMENTS:
        raise (place / _MOST_ELEMENTS).error(
            "elements of a chain", got=len(written), expected=f"at most {_MOST_ELEMENTS}"
        )
    given = [element.name for element in written]
    for i, name in enumerate(given):
        if name is not None and name in given[:i]:
            raise (place / i / "name").error(
                "name of an element", got=name, expected="each name once in a chain"
            )
    names = numbered(given, [element.type for element in written])
    elements = [
        build_element(place / i, element, name, stock)
        for i, (element, name) in enumerate(zip(written, names, strict=True))
    ]
    with place.complaints():
        return coupled_chain(elements, couplings, own.couplings)


def build_element(place: Place, written: WrittenElement, name: str, stock: Stock) -> Element:
    """The element that is written at a place."""
    match written:
        case WrittenRigid():
            element: Element = build_rigid(place, written, name)
        case WrittenBeam():
            element = build_beam(place, written, name, stock)
        case WrittenSpring():
            element = build_spring(place, written, name)
        case WrittenLink():
            element = build_link(place, written, name)
        case WrittenTelescope():
            element = build_telescope(place, written, name, stock)
        case WrittenParallelogram() | WrittenParallel():
            element = _block(place, written, name, stock)
        case _:
            element = build_joint(place, written, name)
    return element


def _block(
    place: Place, written: WrittenParallelogram | WrittenParallel, name: str, stock: Stock
) -> ParallelBlock:
    if isinstance(written, WrittenParallelogram):
        across = point(place / "across", written.across)
        chain = build_chain(place, written, stock)
        _refuse_many(place, 2 * _parts(chain))
        with (place / "across").complaints():
            return parallelogram(chain, across, name=name)
    branches = tuple(
        Branch(
            own,
            transform(here / "start", part.start),
            build_chain(here, part, stock),
            transform(here / "end", part.end),
        )
        for own, here, part in each_of(place / "branches", written.branches, "branch")
    )
    _refuse_many(place, sum(_parts(branch.chain) for branch in branches))
    with (place / "branches").complaints(hint="write at least two branches"):
        return ParallelBlock(branches, name)


def _parts(chain: Chain) -> int:
    """Number of elements of a chain, those inside its blocks included."""
    return sum(
        sum(_parts(branch.chain) for branch in element.branches)
        if isinstance(element, ParallelBlock)
        else 1
        for element in chain.elements
    )


def _refuse_many(place: Place, parts: int) -> None:
    """Each parallelogram inside another doubles what is in it."""
    if parts > _MOST_PARTS:
        raise place.error(
            "elements inside a parallel block",
            got=parts,
            expected=f"at most {_MOST_PARTS}",
            hint="nest fewer blocks in one another",
        )


MOST_LEGS = 200


def build_legs(
    place: Place, written: list[WrittenLeg | WrittenPattern] | WrittenPattern, stock: Stock
) -> list[tuple[Place, Leg]]:
    """The legs that are written at a place, each with its own place."""
    built: list[tuple[Place, Leg]] = []
    for name, here, part in each_of(place, written, "leg"):
        if len(built) == MOST_LEGS:
            raise here.error(
                "legs", got=Words(f"more than {MOST_LEGS}"), expected=f"at most {MOST_LEGS}"
            )
        built.append((here, build_leg(here, part, name, stock)))
    return built


def build_leg(place: Place, written: WrittenLegBody, name: str, stock: Stock) -> Leg:
    """The leg that is written at a place."""
    chain = build_chain(place, written, stock)
    base = transform(place / "base", written.base)
    attachment, node = build_attachment(place / "platform", written.platform)
    with (place / "chain").complaints():
        return Leg(name, base, chain, attachment, Elbow(written.elbow), node)
