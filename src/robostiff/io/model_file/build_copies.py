"""Copies of a leg or a branch: the name of each, and its variables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Protocol

from robostiff.io.expression import ParameterError, Parameters
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_parts import WrittenCopy, WrittenCount, WrittenRepeat
from robostiff.io.suggest import Words


class Named(Protocol):
    """A leg or a branch of its own."""

    name: str


def named_copies(
    place: Place, written: Named | WrittenRepeat, kind: str = "leg"
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
        names = Parameters(known, mathematics=place.mathematics).values
    except ParameterError as error:
        raise places[error.name].error(
            error.subject.replace("parameter", "variable", 1),
            got=error.got,
            expected=error.expected,
            hint=error.hint,
        ) from None
    return replace(place, names=names, leg=leg)
