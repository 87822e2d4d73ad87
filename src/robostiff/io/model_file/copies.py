"""Patterns in a model file: one leg, branch or cable written for several copies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any, TypeVar, cast

from pydantic import Field, Tag

from robostiff.io.expression import ParameterError, parameter_values
from robostiff.io.model_file.parts import Text, Value, WrittenMapping, either, with_key
from robostiff.io.model_file.place import Place
from robostiff.io.suggest import Words


class WrittenCount(WrittenMapping):
    """Numbered copies: the variable is 1, 2, ... and the name has the same number."""

    count: Annotated[int, Field(ge=1, le=1000)] = Field(description="how many copies there are")
    variable: Text = Field(description="the name of the variable that numbers the copies")
    name: Text | None = None


WrittenCopy = dict[str, Value]
"""The name of a copy and the values of its variables."""


class WrittenRepeat(WrittenMapping):
    """Copies of a leg or branch: the list or number of copies, and their variables."""

    repeat: Annotated[
        Annotated[list[WrittenCopy], Tag("list"), Field(min_length=1)]
        | Annotated[WrittenCount, Tag("mapping")],
        either(list, "list", "mapping"),
    ] = Field(description="a list of copies, such as {name: leg1, phi: 0 deg}, or a count")
    let: dict[str, Value] = Field(default_factory=dict)

    def copies(self, place: Place, kind: str) -> Iterator[tuple[str, Place, Place]]:
        """Each copy: its name, where that is written, and the place of its values."""
        here, let = place / "repeat", (place / "let", self.let)
        if isinstance(self.repeat, WrittenCount):
            count = self.repeat
            for number in range(1, count.count + 1):
                name = f"{count.name or kind}{number}"
                own = {count.variable: float(number)}
                yield name, here, _with_variables(place, name, (here / "variable", own), let)
            return
        for i, copy in enumerate(self.repeat):
            name = _copy_name(here / i, copy, self.repeat[0], kind)
            own = {key: value for key, value in copy.items() if key != "name"}
            yield name, here / i, _with_variables(place, name, (here / i, own), let)


One = TypeVar("One", bound=WrittenMapping)

Pattern = TypeVar("Pattern", bound=WrittenMapping)

_OneOrPattern = Annotated[
    Annotated[One, Tag("one")] | Annotated[Pattern, Tag("pattern")],
    with_key("repeat", "pattern", "one"),
]

OneOrSeveral = Annotated[
    Annotated[list[_OneOrPattern[One, Pattern]], Tag("list"), Field(min_length=1)]
    | Annotated[Pattern, Tag("mapping")],
    either(list, "list", "mapping"),
]
"""A list in which patterns stand for several, or one pattern alone."""


Part = TypeVar("Part")


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
        alone: Any = own
        copies = (
            own.copies(where, kind)
            if isinstance(own, WrittenRepeat)
            else [(alone.name, where / "name", where)]
        )
        for name, named_at, here in copies:
            if name in taken:
                raise named_at.error(f"name of a {kind}", got=name, expected="each name once")
            taken.add(name)
            yield name, here, own


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
        subject = error.subject.replace("parameter", "variable", 1)
        words = {"got": error.got, "expected": error.expected, "hint": error.hint}
        raise places[error.name].error(subject, **words) from None
    return replace(place, names=names, leg=leg)
