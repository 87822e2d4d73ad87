"""From a model file or document to a robot, checked as a whole; hybrid machines of modules."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.io.document import Document, read_document
from robostiff.io.expression import ParameterError, exact_mathematics, parse
from robostiff.io.model_file.build_chain import build_chain, build_legs
from robostiff.io.model_file.build_link import build_gravity, build_masses, build_platform_masses
from robostiff.io.model_file.build_platform import (
    attached,
    build_body_springs,
    build_platform,
    check_body_springs,
    check_platform,
)
from robostiff.io.model_file.joints import WrittenOneAxisJoint, build_joint, with_written_laws
from robostiff.io.model_file.place import Place, point, top_place, transform
from robostiff.io.model_file.stock import Stock
from robostiff.io.model_file.symbols import (
    ParameterChoice,
    Symbols,
    chosen_parameters,
    completed,
    meaning_of,
    symbolic_values,
)
from robostiff.io.model_file.written_robot import (
    WrittenArm,
    WrittenDHRow,
    WrittenMachine,
    WrittenModel,
    WrittenModule,
    WrittenRobot,
    written_model,
)
from robostiff.io.suggest import Words
from robostiff.io.units import Dimension
from robostiff.kinematics import Module, hybrid_machine, place_chain, posture_finder
from robostiff.kinematics.mobility import determine_pose, fitting_coordinates, platform_mobility
from robostiff.model import (
    ALL_COORDINATES,
    Chain,
    Coordinate,
    DHConvention,
    DHRow,
    Joint,
    Leg,
    Robot,
    serial_arm,
)
from robostiff.model.checks import check_in_plane
from robostiff.spatial import Space

# Coordinates this far from home, in radians and metres, say how many freedoms an arm has elsewhere.
_ASIDE, _SEED = 1e-1, 5


def verified(robot: Robot, top: Place, places: list[Place], *, chosen: bool) -> Robot:
    """The robot with its pose coordinates chosen, by the file or else as they follow from the legs.

    Raises at the leg that does not close at home, at the joint that leaves the plane, or at
    coordinates that do not determine the pose. `top` is the document, `places` are of the legs.
    """
    if robot.space is Space.PLANAR:
        for place, leg in zip(places, robot.legs, strict=True):
            _check_plane(place, leg)
    finder = posture_finder(robot)
    q = []
    for i, place in enumerate(places):
        with place.complaints():
            q.append(finder.closing(i).home)
    every = _PLANAR_COORDINATES if robot.space is Space.PLANAR else ALL_COORDINATES
    if robot.is_posed_by_joints or (chosen and len(robot.coordinates) == len(every)):
        return robot
    mobility = platform_mobility(robot, finder.home_pose, q, finder.length)
    if determine_pose(mobility, robot.coordinates):
        return robot
    fitting = fitting_coordinates(mobility)
    if not chosen:  # none for a structure, which has the home pose only
        at_home_alone = robot.is_serial and _is_singular(robot, finder.home_pose, q[0])
        return robot if at_home_alone else replace(robot, coordinates=fitting)
    words = " ".join(coordinate.value for coordinate in robot.coordinates) or "none"
    raise (top / "coordinates").error(
        "coordinates of the platform",
        got=Words(words),
        expected=f"as many as the {len(fitting)} freedoms that the legs leave it in the home "
        "configuration, and independent",
        hint=f"write coordinates: [{', '.join(c.value for c in fitting)}], or leave it out; where "
        "the home configuration is singular, choose another one, or all six coordinates",
    )


def _is_singular(robot: Robot, pose: np.ndarray, q: np.ndarray) -> bool:
    """Whether an arm without blocks has fewer freedoms at its home than aside."""
    if robot.legs[0].chain.has_blocks:
        return False
    aside = q + np.random.default_rng(_SEED).uniform(-_ASIDE, _ASIDE, q.shape)
    at_home, usual = (platform_mobility(robot, pose, [one], 1.0).shape[1] for one in (q, aside))
    return at_home < usual


def _check_plane(place: Place, leg: Leg) -> None:
    freedoms = place_chain(leg.chain, leg.chain.home, leg.base.R, leg.base.p).freedoms
    numbers = {
        id(inner): i
        for i, element in enumerate(leg.chain.elements)
        for inner in (element, *(inner for inner, _ in Chain((element,)).moving))
    }
    for element, where in leg.chain.moving:
        for freedom in freedoms[where]:
            with (place / "chain" / numbers[id(element)]).complaints():
                check_in_plane(f"{element.name} in a planar robot", freedom)


_PLANAR_COORDINATES = (Coordinate.X, Coordinate.Y, Coordinate.RZ)


def _verified(top: Place, written: WrittenModel, files: ModuleFiles) -> Robot:
    """The robot of numbers that is written, which closes at home."""
    robot, places = _assembled(top, written, files)
    if not isinstance(written, WrittenMachine):  # whose modules are, each for itself
        robot = verified(robot, top, places, chosen=written.coordinates is not None)
        check_platform(top / "platform", robot)
        check_body_springs(top / "springs", robot)
    if isinstance(written, WrittenRobot):
        robot = with_written_laws(top / "laws", robot, written.laws)
    return robot


def _assembled(
    top: Place, written: WrittenModel, files: ModuleFiles, holds: Sequence[str] = ()
) -> tuple[Robot, list[Place]]:
    """The robot that is written, not yet verified, and the places of its legs.

    Nodes that hold the legs are found with numbers before formulas are built.
    """
    if isinstance(written, WrittenArm):
        coordinates = _coordinates(top / "coordinates", written)
        return build_arm(top, written, coordinates), [top / "dh"]
    if isinstance(written, WrittenMachine):
        place = top / "coordinates"
        words = written.coordinates
        given = None if words is None else distinct_coordinates(place, words)
        return build_machine(top, written, given, files), []
    stock = Stock.of_file(top, written.materials, written.sections)
    here = top / "platform"
    platform = build_platform(here, written.platform, stock)
    legs = build_legs(top / "legs", written.legs, stock)
    legs = attached(legs, platform, here, written.platform, holds)
    home = None if written.home is None else transform(top / "home", written.home)
    if home is None and len(legs) > 1:
        raise (top / "home").error(
            "missing key",
            hint="home is the pose of the platform, for a robot with several legs; write "
            "home: {at: [0, 0, 800 mm]} or the like",
        )
    with top.complaints():
        robot = Robot(
            name=written.name,
            legs=tuple(leg for _, leg in legs),
            home=home,
            reference_point=point(top / "reference_point", written.reference_point),
            coordinates=_coordinates(top / "coordinates", written),
            space=Space.PLANAR if written.planar else Space.SPATIAL,
            title=written.title,
            source=written.source,
            platform=platform,
            platform_masses=build_platform_masses(top / "platform_masses", written.platform_masses),
            gravity=build_gravity(top / "gravity", written.gravity),
            springs=build_body_springs(top / "springs", written.springs),
        )
    return robot, [place for place, _ in legs]


def _coordinates(place: Place, written: WrittenRobot | WrittenArm) -> tuple[Coordinate, ...]:
    if written.coordinates is None:
        if written.home is None:
            return ()  # a serial arm, posed by its joints
        return _PLANAR_COORDINATES if written.planar else ALL_COORDINATES
    chosen = distinct_coordinates(place, written.coordinates)
    outside = [c for c in chosen if written.planar and c not in _PLANAR_COORDINATES]
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


def build_arm(top: Place, written: WrittenArm, coordinates: Sequence[Coordinate]) -> Robot:
    """The arm of a table that is written, not yet verified."""
    place, table = top / "dh", written.dh
    where = [place / "joints" / i for i in range(len(table.joints))]
    rows, joints = zip(*map(_row, where, table.joints), strict=True)
    with place.complaints():
        arm = serial_arm(
            rows,
            convention=DHConvention(table.convention),
            joint_stiffness=[joint.role.stiffness for joint in joints],
            limits=[joint.role.limits for joint in joints],
            home=[joint.home[0] if joint.home_given else None for joint in joints],
            base=transform(place / "base", table.base),
            tool=None if table.tool is None else transform(place / "tool", table.tool),
            name=written.name,
            coordinates=coordinates,
            title=written.title,
            source=written.source,
        )
    return replace(
        arm,
        reference_point=point(top / "reference_point", written.reference_point),
        platform_masses=build_platform_masses(top / "platform_masses", written.platform_masses),
        gravity=build_gravity(top / "gravity", written.gravity),
    )


def _row(place: Place, written: WrittenDHRow) -> tuple[DHRow, Joint]:
    drive = {key: getattr(written, key) for key in ("type", "stiffness", "limits", "home")}
    joint = build_joint(place, WrittenOneAxisJoint(**drive, role="actuated", axis="z"), "")
    with place.complaints():
        row = DHRow(
            a=place.number_at(written, "a", Dimension.LENGTH),
            alpha=place.number_at(written, "alpha", Dimension.ANGLE),
            d=place.number_at(written, "d", Dimension.LENGTH),
            theta=place.number_at(written, "theta", Dimension.ANGLE),
            slides=written.type == "prismatic",
            name=written.name or "",
            masses=build_masses(place, written),
        )
    return row, joint


#: The file of a shipped robot; None where none has that name.
ShippedFile = Callable[[str], Path | None]

_KINDS = ("robot", "chain", "legs")


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
        part = _module_part(place, own, stock, files)
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


def _module_part(
    place: Place, written: WrittenModule, stock: Stock, files: ModuleFiles
) -> Robot | Chain:
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
    here, name = place / "robot", written.robot or ""
    shipped = files.shipped(name)
    path = Path(place.document.file).parent / name if shipped is None else shipped
    if "\0" in name or not path.is_file():
        raise here.error(
            "robot of a module",
            got=name,
            expected="a shipped robot (see 'robostiff robots'), or a model file, as seen from this "
            "one",
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
    model = written_model(document)
    values: dict[str, Any] = dict(written.parameters)
    for key, value in values.items():
        if isinstance(value, str):  # perhaps an expression of this file's parameters
            with (place / "parameters" / key).complaints():
                values[key] = parse(value).evaluate(place.names, place.mathematics)
    try:
        top = top_place(document, model.parameters, values, place.mathematics)
    except ParameterError as error:
        with (place / "parameters" / error.name).complaints():
            raise
    robot = files.build(top, model, replace(files, open=(*files.open, path)))
    return replace(robot, nominal=files.nominal)


def read_model(
    source: Path | str,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
) -> Robot:
    """A robot from a model file, ``-`` for standard input, as `model_from_document` makes it.

    `robostiff.load` takes shipped robots by name, and snapshots too.
    """
    return model_from_document(read_document(source), parameters, symbols=symbols)


def model_from_document(
    document: Document,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
    shipped: ShippedFile = lambda _: None,
) -> Robot:
    r"""The robot that a document describes.

    Parameters
    ----------
    document : Document
    parameters : mapping of str to (str or float), optional
        Other values for some of its parameters: quantities, expressions, or bare numbers in the SI
        unit of what they replace.
    symbols : iterable of str, or ALL_PARAMETERS
        Parameters that stay SymPy symbols of the same name, or a mapping: all of them, those in it
        under shorter names; `parameters` gives their nominal
        values then.
    shipped : callable
        The file of a shipped robot that a module names; None for any other name.

    Raises a FileError at the place in the document that is to blame.

    Examples
    --------
    >>> from robostiff.io.document import parse_document
    >>> robot = model_from_document(parse_document('''
    ... robostiff: 1
    ... name: cantilever
    ... source: an example
    ... parameters: {L: 300 mm}
    ... legs:
    ...   - name: arm
    ...     chain:
    ...       - type: beam
    ...         to: [L, 0, 0]
    ...         material: steel
    ...         section: {circle: {diameter: 20 mm}}
    ... '''), parameters={"L": "400 mm"})
    >>> robot.legs[0].chain.elements[0].to
    array([0.4, 0. , 0. ])
    """
    written, overrides = written_model(document), parameters or {}
    top = top_place(document, written.parameters, overrides)
    path = Path(document.file)
    files = ModuleFiles(shipped, _verified, (path.resolve(),) if path.is_file() else ())
    robot = _verified(top, written, files)
    names = chosen_parameters(symbols, written.parameters, overrides)
    if not names and not isinstance(symbols, ParameterChoice):
        return robot
    # Symbols stay in a robot that is built beside the one of numbers, which has been verified.
    exact = exact_mathematics()
    quantities, nominal = symbolic_values(names, top.names)
    meanings = {symbol: meaning_of(top.names[name]) for name, symbol in names.items()}
    top = top_place(document, written.parameters, {**overrides, **quantities}, exact)
    files = replace(files, build=lambda *part: _assembled(*part)[0], nominal=nominal)
    symbolic, _ = _assembled(top, written, files, robot.holds)
    return completed(symbolic, robot, nominal, meanings)
