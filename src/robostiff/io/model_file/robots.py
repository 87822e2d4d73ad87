"""Whole model files, of robots of legs, arms by a table and hybrid machines; their reading."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import Field

from robostiff.errors import FileError, Words
from robostiff.io.document import Document, read_document
from robostiff.io.expression import ParameterError, exact_mathematics, parse
from robostiff.io.model_file.chains import WrittenCoupled, WrittenElement, WrittenLegs, build_legs
from robostiff.io.model_file.joints import WrittenLaw, WrittenOneAxisJoint
from robostiff.io.model_file.links import WrittenStock
from robostiff.io.model_file.place import (
    Angle,
    Direction,
    Length,
    Pair,
    Place,
    Text,
    Value,
    Vector,
    WrittenFrame,
    WrittenHead,
    WrittenMapping,
    WrittenMass,
    WrittenPlatformMass,
    build_platform_masses,
    check_version,
    top_place,
)
from robostiff.io.model_file.platform import WrittenBodySpring, WrittenPlatform, attach
from robostiff.io.model_file.symbols import (
    ParameterChoice,
    Symbols,
    chosen_parameters,
    complete,
    symbolic_values,
)
from robostiff.io.units import Dimension
from robostiff.io.validation import validate
from robostiff.model import (
    Chain,
    Coordinate,
    DHConvention,
    DHRow,
    Joint,
    Robot,
    pose_coordinates,
    serial_arm,
)
from robostiff.spatial import Space

if TYPE_CHECKING:
    from robostiff.io.model_file.cables import WrittenCableRobot


class WrittenPosed(WrittenHead):
    """Common keys of robots of joints."""

    coordinates: list[Literal["x", "y", "z", "rx", "ry", "rz"]] | None = None
    reference_point: Vector | None = None
    platform_masses: list[WrittenPlatformMass] = Field([])
    gravity: Direction | None = None

    def posed(self, top: Place) -> dict[str, Any]:
        """Reference point, gravity and masses of the platform, as `Robot` takes them."""
        gravity: Any = self.gravity
        if isinstance(gravity, list):
            gravity = (top / "gravity").vector(gravity, Dimension.ACCELERATION)
        masses = build_platform_masses(top / "platform_masses", self.platform_masses)
        point = (top / "reference_point").point(self.reference_point)
        return {"reference_point": point, "gravity": gravity, "platform_masses": masses}


class WrittenRobot(WrittenPosed, WrittenStock):
    """A whole model file."""

    planar: bool = False
    home: WrittenFrame | None = None
    platform: WrittenPlatform | None = None
    springs: list[WrittenBodySpring] = Field([])
    laws: dict[str, WrittenLaw] = Field({})
    legs: WrittenLegs = Field(description="a list of legs, or one leg with repeat:")

    def build(self, top: Place, holds: Sequence[str]) -> tuple[Robot, list[Place]]:
        """The robot, not yet verified, and the places of its legs.

        Nodes that hold the legs are found with numbers before formulas are built.
        """
        top = self.stocked(top)
        here = top / "platform"
        platform = None if self.platform is None else self.platform.build(here)
        legs = build_legs(top / "legs", self.legs)
        legs = attach(legs, platform, here, self.platform, holds)
        with top.complaints():
            robot = Robot(
                name=self.name,
                legs=tuple(leg for _, leg in legs),
                home=None if self.home is None else self.home.build(top / "home"),
                coordinates=_coordinates(top / "coordinates", self),
                space=Space.PLANAR if self.planar else Space.SPATIAL,
                title=self.title,
                source=self.source,
                platform=platform,
                **self.posed(top),
                springs=tuple(one.build(top / "springs" / i) for i, one in enumerate(self.springs)),
            )
        return robot, [place for place, _ in legs]


class WrittenDHRow(WrittenMass):
    """A row of the table: the joint, and the link that goes with it."""

    name: Text | None = None
    type: Literal["revolute", "prismatic"] = "revolute"
    a: Length = 0
    alpha: Angle = 0
    d: Length = 0
    theta: Angle = 0
    stiffness: Value | None = None
    limits: Pair | None = None
    home: Value | None = None

    def build(self, place: Place) -> tuple[DHRow, Joint]:
        """The row, and its joint."""
        drive = {key: getattr(self, key) for key in ("type", "stiffness", "limits", "home")}
        joint = WrittenOneAxisJoint(**drive, role="actuated", axis="z").build(place, "")
        with place.complaints():
            row = DHRow(
                **self.numbers(place),
                slides=self.type == "prismatic",
                name=self.name or "",
                masses=self.masses(place),
            )
        return row, joint


class WrittenDH(WrittenMapping):
    """A table of Denavit and Hartenberg, with the frames at its ends."""

    convention: Literal["standard", "modified"] = Field(
        description="standard (Rz Tz Tx Rx) or modified (Rx Tx Rz Tz, after Craig)"
    )
    base: WrittenFrame = WrittenFrame()
    joints: Annotated[list[WrittenDHRow], Field(min_length=1, max_length=200)] = Field(
        description="a row for each joint, such as {a: 0, alpha: 90 deg, d: 89 mm, "
        "stiffness: 2e4 N m/rad}"
    )
    tool: WrittenFrame | None = None


class WrittenArm(WrittenPosed):
    """A whole model file of a serial arm."""

    dh: WrittenDH = Field(description="convention, and a row for each joint")
    planar: ClassVar[bool] = False
    home: ClassVar[None] = None
    laws: ClassVar[dict[str, WrittenLaw]] = {}

    def build(self, top: Place, _holds: Sequence[str]) -> tuple[Robot, list[Place]]:
        """The arm of the table, not yet verified, and the place of its only leg."""
        coordinates = _coordinates(top / "coordinates", self)
        place, table = top / "dh", self.dh
        built = [row.build(place / "joints" / i) for i, row in enumerate(table.joints)]
        rows, joints = zip(*built, strict=True)
        with place.complaints():
            arm = serial_arm(
                rows,
                convention=DHConvention(table.convention),
                joint_stiffness=[joint.role.stiffness for joint in joints],
                limits=[joint.role.limits for joint in joints],
                home=[joint.home[0] if joint.home_given else None for joint in joints],
                base=table.base.build(place / "base"),
                tool=None if table.tool is None else table.tool.build(place / "tool"),
                name=self.name,
                coordinates=coordinates,
                title=self.title,
                source=self.source,
            )
        return replace(arm, **self.posed(top)), [place]


def _coordinates(place: Place, written: WrittenRobot | WrittenArm) -> tuple[Coordinate, ...]:
    if written.coordinates is None:
        if written.home is None:
            return ()  # a serial arm, posed by its joints
        return pose_coordinates(Space.PLANAR if written.planar else Space.SPATIAL)
    chosen = distinct_coordinates(place, written.coordinates)
    outside = [c for c in chosen if written.planar and c not in pose_coordinates(Space.PLANAR)]
    if outside:
        i = chosen.index(outside[0])
        raise (place / i).error(
            "coordinate of a planar robot", got=outside[0].value, expected="x, y or rz"
        )
    return chosen


def distinct_coordinates(place: Place, words: Sequence[str]) -> tuple[Coordinate, ...]:
    """The pose coordinates that are written at a place, each once."""
    chosen = tuple(Coordinate(word) for word in words)
    if len(set(chosen)) < len(chosen):
        raise place.error("coordinates", got=list(words), expected="each one once")
    return chosen


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
    platform_masses: list[WrittenPlatformMass] = Field([])

    def build(self, place: Place) -> Robot | Chain:
        """The robot or chain of the module."""
        written = [key for key in ("robot", "chain", "legs") if getattr(self, key) is not None]
        if len(written) != 1:
            got = Words(" and ".join(written) or "none of them")
            expected = "one of robot, chain and legs"
            raise place.error(f"module {self.name!r}", got=got, expected=expected)
        for key, of in (
            *(("parameters", "robot"), ("home", "legs"), ("platform_masses", "legs")),
            ("couplings", "chain"),
        ):
            if getattr(self, key) and of not in written:
                raise (place / key).error(
                    f"{key} of module {self.name!r}", expected=f"none: they go with {of}", key=True
                )
        if self.chain is not None:
            return self.build_chain(place)
        if self.robot is not None:
            return self._robot_of_file(place, self.robot)
        legs = build_legs(place / "legs", self.legs or [])
        home = None if self.home is None else self.home.build(place / "home")
        masses = build_platform_masses(place / "platform_masses", self.platform_masses)
        with place.complaints():
            return Robot(
                self.name,
                tuple(leg for _, leg in legs),
                home=home,
                nominal=place.nominal,
                platform_masses=masses,
            )

    def _robot_of_file(self, place: Place, name: str) -> Robot:
        here, shipped = place / "robot", place.shipped(name)
        path = Path(place.document.file).parent / name if shipped is None else shipped
        if "\0" in name or not path.is_file():
            raise here.error(
                "robot of a module",
                got=name,
                expected="a shipped robot (see 'robostiff robots'), or a model file, as seen from "
                "this one",
            )
        path = path.resolve()
        if path in place.open:
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
        try:
            written = written_model(document)
            more = {"shipped": place.shipped, "open": (*place.open, path), "nominal": place.nominal}
            top = top_place(document, written.parameters, values, place.mathematics, **more)
            robot = _built(written, top)
        except ParameterError as error:
            with (place / "parameters" / error.name).complaints():
                raise
        return replace(robot, nominal=place.nominal)


class WrittenMachine(WrittenPosed, WrittenStock):
    """A whole model file of a hybrid machine, of modules in series."""

    modules: Annotated[list[WrittenModule], Field(min_length=1, max_length=50)] = Field(
        description="the modules from base to tool, such as {name: arm, robot: scara}"
    )

    def build(self, top: Place, _holds: Sequence[str]) -> tuple[Robot, list[Place]]:
        """The machine, and no places of legs: each module is verified by itself."""
        from robostiff.kinematics import Module, hybrid_machine

        coordinates = None
        if self.coordinates is not None:
            coordinates = distinct_coordinates(top / "coordinates", self.coordinates)
        top = self.stocked(top)
        modules = []
        for i, module in enumerate(self.modules):
            place = top / "modules" / i
            part = module.build(place)
            mount = None if module.mount is None else module.mount.build(place / "mount")
            with place.complaints():
                modules.append(Module(module.name, part, mount))
        posed = self.posed(top)
        with (top / "modules").complaints():
            machine = hybrid_machine(
                modules,
                name=self.name,
                coordinates=coordinates,
                reference_point=None if self.reference_point is None else posed["reference_point"],
                gravity=posed["gravity"],
                title=self.title,
                source=self.source,
            )
        masses = (*machine.platform_masses, *posed["platform_masses"])
        return replace(machine, platform_masses=masses), []


WrittenModel: TypeAlias = "WrittenRobot | WrittenArm | WrittenMachine | WrittenCableRobot"

#: Keys that show what describes a robot, and what to write instead of legs beside them.
_BESIDE_LEGS = {
    "cables": "robots with legs and cables are not supported",
    "dh": "a table describes a serial arm as a whole; write its elements as a leg to add elastic "
    "links",
    "modules": "legs beside other modules are a module of their own",
}


def written_model(document: Document) -> WrittenModel:
    """A model file as it is written: of legs, of cables, an arm by its table, a hybrid machine."""
    check_version(document)
    for key, hint in _BESIDE_LEGS.items():
        if key in document.data:
            if "legs" in document.data:
                raise FileError(
                    document.key_location(("legs",)),
                    "description of the robot",
                    got=Words(f"legs beside {key}"),
                    expected="one of them",
                    hint=hint,
                )
            if key == "cables":  # which a robot of legs does not need
                from robostiff.io.model_file.cables import WrittenCableRobot

                return validate(WrittenCableRobot, document)
            return validate(WrittenArm if key == "dh" else WrittenMachine, document)
    return validate(WrittenRobot, document)


def model_from_document(
    document: Document,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
    shipped: Callable[[str], Path | None] = lambda _: None,
) -> Any:
    r"""The robot that a document describes, a `Robot` or a `CableRobot`, which has no symbols.

    Parameters
    ----------
    document : Document
    parameters : mapping of str to (str or float), optional
        Other values for some of its parameters: quantities, expressions, or bare numbers in the SI
        unit of what they replace.
    symbols : iterable of str, or ALL_PARAMETERS
        Parameters that stay SymPy symbols of the same name, or a mapping: all of them, those in it
        under shorter names; `parameters` gives their nominal values then.
    shipped : callable
        The file of a shipped robot that a module names; None for any other name.

    Raises a FileError at the place in the document that is to blame.
    """
    written, overrides = written_model(document), parameters or {}
    path = Path(document.file)
    files: Any = {"shipped": shipped, "open": (path.resolve(),) if path.is_file() else ()}
    top = top_place(document, written.parameters, overrides, **files)
    robot = _built(written, top)
    names = chosen_parameters(symbols, written.parameters, overrides)
    if not names and not isinstance(symbols, ParameterChoice):
        return robot
    # Symbols stay in a robot that is built beside the one of numbers, which has been verified.
    quantities, nominal = symbolic_values(names, top.names)
    numbers = {symbol: top.names[name] for name, symbol in names.items()}
    exact, overrides = exact_mathematics(), {**overrides, **quantities}
    top = top_place(document, written.parameters, overrides, exact, nominal=nominal, **files)
    symbolic = _built(written, top, robot.holds)
    return complete(symbolic, robot, nominal, numbers)


def _built(written: WrittenModel, top: Place, holds: Sequence[str] = ()) -> Any:
    """The robot that is written; verified, unless it is one of formulas, or has no legs here."""
    model: Any = written
    robot, places = model.build(top, holds)
    if top.is_exact or not places:
        return robot
    from robostiff.io.model_file.at_home import at_home

    return at_home(top, robot, places, chosen=model.coordinates is not None, laws=model.laws)
