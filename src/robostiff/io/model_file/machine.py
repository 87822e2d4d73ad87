"""Hybrid machines in model files: modules in series, which are robots, chains or legs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from robostiff.io.document import Document, read_document
from robostiff.io.expression import Mathematics, ParameterError, parse
from robostiff.io.model_file.chains import WrittenCoupled, WrittenElement, WrittenLegs, build_legs
from robostiff.io.model_file.joints import WrittenLaw
from robostiff.io.model_file.parts import (
    Direction,
    Text,
    Value,
    Vector,
    WrittenFrame,
    WrittenHead,
    WrittenPlatformMass,
    build_gravity,
    build_platform_masses,
)
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.robots import distinct_coordinates
from robostiff.io.model_file.stock import WrittenMaterial, WrittenSection, stocked
from robostiff.io.suggest import Words
from robostiff.model import Chain, Robot

#: The file of a shipped robot; None where none has that name.
ShippedFile = Callable[[str], Path | None]


@dataclass(frozen=True)
class ModuleFiles:
    """Where the robots of modules come from."""

    shipped: ShippedFile
    # From a document and values of its parameters to a robot; one of numbers closes at home.
    build: Callable[[Document, Mapping[str, Any], Mathematics, ModuleFiles], Robot]
    open: tuple[Path, ...] = ()  # files that are being read: none of them may be a module of itself
    # values of the symbols, where there are any
    nominal: Mapping[str, float] = field(default_factory=dict)


class WrittenModule(WrittenCoupled):
    """A module of a hybrid machine: a robot by its name or file, a chain, or legs."""

    name: Text = Field(description="the name of the module, with which those of its parts begin")
    mount: WrittenFrame | None = None
    robot: Text | None = Field(
        None, description="a shipped robot, or a model file as seen from this one"
    )
    parameters: dict[str, Value] = Field(
        default_factory=dict, description="other values for parameters of that robot"
    )
    chain: Annotated[list[WrittenElement], Field(min_length=1)] | None = None
    legs: WrittenLegs | None = None
    home: WrittenFrame | None = None
    platform_masses: list[WrittenPlatformMass] = Field(default_factory=list)

    def build(self, place: Place, files: ModuleFiles) -> Robot | Chain:
        """The robot or chain of the module."""
        given = [key for key in ("robot", "chain", "legs") if getattr(self, key) is not None]
        if len(given) != 1:
            raise place.error(
                f"module {self.name!r}",
                got=Words(" and ".join(given) or "none of them"),
                expected="one of robot, chain and legs",
            )
        for key, of in (("parameters", "robot"), ("home", "legs"), ("platform_masses", "legs")):
            if getattr(self, key) and of not in given:
                raise (place / key).error(
                    f"{key} of module {self.name!r}", expected=f"none: they go with {of}", key=True
                )
        if self.chain is not None:
            return self.build_chain(place)
        if self.couplings:
            raise (place / "couplings").error(
                f"couplings of module {self.name!r}", expected="none: they go with chain", key=True
            )
        if self.robot is not None:
            return self._robot_of_file(place, self.robot, files)
        legs = build_legs(place / "legs", self.legs or [])
        home = None if self.home is None else self.home.build(place / "home")
        masses = build_platform_masses(place / "platform_masses", self.platform_masses)
        with place.complaints():
            return Robot(
                self.name,
                tuple(leg for _, leg in legs),
                home=home,
                nominal=files.nominal,
                platform_masses=masses,
            )

    def _robot_of_file(self, place: Place, name: str, files: ModuleFiles) -> Robot:
        here, shipped = place / "robot", files.shipped(name)
        path = Path(place.document.file).parent / name if shipped is None else shipped
        if "\0" in name or not path.is_file():
            raise here.error(
                "robot of a module",
                got=name,
                expected="a shipped robot (see 'robostiff robots'), or a model file, as seen from "
                "this one",
            )
        path = path.resolve()
        if path in files.open:
            raise here.error(
                "robot of a module", got=name, expected="another file: this one is being read"
            )
        document = read_document(path)
        data = document.data
        if not isinstance(data, dict) or "robostiff" not in data or "cables" in data:
            raise here.error(
                "robot of a module",
                got=Words(f"{document.file}, which describes no robot of legs"),
                expected="a model file with legs, dh or modules",
                hint="snapshots stand at one pose; robots of descriptions are joined in Python, by "
                "rs.hybrid_machine",
            )
        values: dict[str, Any] = dict(self.parameters)
        for key, value in values.items():
            if isinstance(value, str):  # perhaps an expression of this file's parameters
                with (place / "parameters" / key).complaints():
                    values[key] = parse(value).evaluate(place.names, place.mathematics)
        inner = replace(files, open=(*files.open, path))
        try:
            robot = files.build(document, values, place.mathematics, inner)
        except ParameterError as error:
            with (place / "parameters" / error.name).complaints():
                raise
        return replace(robot, nominal=files.nominal)


class WrittenMachine(WrittenHead):
    """A whole model file of a hybrid machine, of modules in series."""

    materials: dict[str, WrittenMaterial] = Field(default_factory=dict)
    sections: dict[str, WrittenSection] = Field(default_factory=dict)
    coordinates: list[Literal["x", "y", "z", "rx", "ry", "rz"]] | None = None
    reference_point: Vector | None = None
    platform_masses: list[WrittenPlatformMass] = Field(default_factory=list)
    gravity: Direction | None = None
    modules: Annotated[list[WrittenModule], Field(min_length=1, max_length=50)] = Field(
        description="the modules from base to tool, such as {name: arm, robot: scara}"
    )
    laws: ClassVar[dict[str, WrittenLaw]] = {}

    def build(
        self, top: Place, files: ModuleFiles, holds: Sequence[str] = ()
    ) -> tuple[Robot, list[Place]]:
        """The machine, and no places of legs: each module is verified by itself."""
        from robostiff.kinematics import Module, hybrid_machine

        del holds
        coordinates = None
        if self.coordinates is not None:
            coordinates = distinct_coordinates(top / "coordinates", self.coordinates)
        top = stocked(top, self.materials, self.sections)
        modules = []
        for i, own in enumerate(self.modules):
            place = top / "modules" / i
            part = own.build(place, files)
            mount = None if own.mount is None else own.mount.build(place / "mount")
            with place.complaints():
                modules.append(Module(own.name, part, mount))
        reference = None
        if self.reference_point is not None:
            reference = (top / "reference_point").point(self.reference_point)
        with (top / "modules").complaints():
            machine = hybrid_machine(
                modules,
                name=self.name,
                coordinates=coordinates,
                reference_point=reference,
                gravity=build_gravity(top / "gravity", self.gravity),
                title=self.title,
                source=self.source,
            )
        masses = build_platform_masses(top / "platform_masses", self.platform_masses)
        return replace(machine, platform_masses=(*machine.platform_masses, *masses)), []
