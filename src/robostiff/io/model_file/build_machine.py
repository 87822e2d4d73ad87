"""From the modules of a hybrid machine in a model file to a robot of the model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from robostiff.io.document import Document, read_document
from robostiff.io.expression import ParameterError, parse
from robostiff.io.model_file.build_chain import build_chain, build_legs
from robostiff.io.model_file.build_link import build_gravity, build_platform_masses
from robostiff.io.model_file.place import Place, point, top_place, transform
from robostiff.io.model_file.stock import Stock
from robostiff.io.model_file.written_robot import (
    WrittenMachine,
    WrittenModel,
    WrittenModule,
    written_model,
)
from robostiff.io.suggest import Words
from robostiff.kinematics import Module, hybrid_machine
from robostiff.model import Chain, Coordinate, Robot

#: The file of a shipped robot; None where none has that name.
ShippedFile = Callable[[str], Path | None]

_KINDS = ("robot", "chain", "legs")


def no_shipped_file(name: str) -> None:
    """No file: for readers that know no shipped robots."""
    del name


@dataclass(frozen=True)
class ModuleFiles:
    """Where the robots of modules come from."""

    shipped: ShippedFile
    # from a place and what is written there to a robot, which is closed at home where it is of
    # numbers
    build: Callable[[Place, WrittenModel, ModuleFiles], Robot]
    open: tuple[Path, ...] = ()  # files that are being read: none of them may be a module of itself
    # values of the symbols, where there are any
    nominal: Mapping[str, float] = field(default_factory=dict)


def build_machine(
    top: Place,
    written: WrittenMachine,
    coordinates: Sequence[Coordinate] | None,
    files: ModuleFiles,
) -> Robot:
    """The machine of modules that are written."""
    stock = Stock.of_file(top, written.materials, written.sections)
    modules = []
    for i, own in enumerate(written.modules):
        place = top / "modules" / i
        part = _part(place, own, stock, files)
        mount = None if own.mount is None else transform(place / "mount", own.mount)
        with place.complaints():
            modules.append(Module(own.name, part, mount))
    reference = written.reference_point
    with (top / "modules").complaints():
        machine = hybrid_machine(
            modules,
            name=written.name,
            coordinates=coordinates,
            reference_point=None
            if reference is None
            else point(top / "reference_point", reference),
            gravity=build_gravity(top / "gravity", written.gravity),
            title=written.title,
            source=written.source,
        )
    masses = build_platform_masses(top / "platform_masses", written.platform_masses)
    return replace(machine, platform_masses=(*machine.platform_masses, *masses))


def _part(place: Place, written: WrittenModule, stock: Stock, files: ModuleFiles) -> Robot | Chain:
    given = [key for key in _KINDS if getattr(written, key) is not None]
    if len(given) != 1:
        raise place.error(
            f"module {written.name!r}",
            got=Words(" and ".join(given) or "none of them"),
            expected="one of robot, chain and legs",
        )
    for key, of in (("parameters", "robot"), ("home", "legs"), ("platform_masses", "legs")):
        if getattr(written, key) and of not in given:
            raise (place / key).error(
                f"{key} of module {written.name!r}", expected=f"none: they go with {of}", key=True
            )
    if written.chain is not None:
        return build_chain(place, written, stock)
    if written.couplings:
        raise (place / "couplings").error(
            f"couplings of module {written.name!r}", expected="none: they go with chain", key=True
        )
    if written.robot is not None:
        return _robot_of_file(place, written, files)
    legs = build_legs(place / "legs", written.legs or [], stock)
    home = None if written.home is None else transform(place / "home", written.home)
    masses = build_platform_masses(place / "platform_masses", written.platform_masses)
    with place.complaints():
        return Robot(
            written.name,
            tuple(leg for _, leg in legs),
            home=home,
            nominal=files.nominal,
            platform_masses=masses,
        )


def _robot_of_file(place: Place, written: WrittenModule, files: ModuleFiles) -> Robot:
    path = _path(place / "robot", written.robot or "", files)
    if path in files.open:
        raise (place / "robot").error(
            "robot of a module", got=written.robot, expected="another file: this one is being read"
        )
    document = read_document(path)
    model = _model(place / "robot", document)
    values = {
        name: _value(place / "parameters" / name, value)
        for name, value in written.parameters.items()
    }
    try:
        top = top_place(document, model.parameters, values, place.mathematics)
    except ParameterError as error:
        raise (place / "parameters" / error.name).error(
            error.subject, got=error.got, expected=error.expected, hint=error.hint
        ) from None
    robot = files.build(top, model, replace(files, open=(*files.open, path)))
    return replace(robot, nominal=files.nominal)


def _path(place: Place, name: str, files: ModuleFiles) -> Path:
    shipped = files.shipped(name)
    path = Path(place.document.file).parent / name if shipped is None else shipped
    if "\0" in name or not path.is_file():
        raise place.error(
            "robot of a module",
            got=name,
            expected="a shipped robot (see 'robostiff robots'), or a model file, as seen from this "
            "one",
        )
    return path.resolve()


def _model(place: Place, document: Document) -> WrittenModel:
    data = document.data
    if not isinstance(data, dict) or "robostiff" not in data or "cables" in data:
        raise place.error(
            "robot of a module",
            got=Words(f"{document.file}, which describes no robot of legs"),
            expected="a model file with legs, dh or modules",
            hint="snapshots stand at one pose; robots of descriptions are joined in Python, by "
            "rs.hybrid_machine",
        )
    return written_model(document)


def _value(place: Place, value: str | float) -> Any:
    """A parameter of the other file, which may be an expression of this one's."""
    if not isinstance(value, str):
        return value
    with place.complaints():
        return parse(value).evaluate(place.names, place.mathematics)
