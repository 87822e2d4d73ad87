"""What a report is about, and its results, computed once."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis import (
    CableResponse,
    CableStiffness,
    Deflection,
    Stiffness,
    cable_stiffness,
    deflection,
    stiffness,
)
from robostiff.analysis.indices import StiffnessIndices, indices
from robostiff.analysis.result import require_one_pose
from robostiff.analytic import AtHome, RobotDerivation
from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError, PlausibilityWarning, Words
from robostiff.frozen import field, frozen
from robostiff.kinematics import Near, Pose
from robostiff.linkage import Linkage, closed_at
from robostiff.linkage.essential import network_of
from robostiff.markup import Number
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.model.subject import Subject
from robostiff.network import Network
from robostiff.plot.posed_robot import joints_in_words
from robostiff.statics import (
    CriticalLoad,
    Equilibrium,
    Modes,
    cable_response,
    critical_load,
    equilibrium,
    has_masses,
    load_path,
    modes,
)

if TYPE_CHECKING:
    import xarray


_LONGEST = 120


@frozen
class TitleBlock:
    """What a report is filed under; lines that are left empty are not printed.

    Raises InputError when one is no text, or longer than a line.
    """

    project: str = ""
    author: str = ""
    date: str = ""
    revision: str = ""

    def __post_init__(self) -> None:
        for name, text in vars(self).items():
            if not isinstance(text, str) or len(text) > _LONGEST:
                expected = f"text of at most {_LONGEST} characters"
                raise InputError(f"{name} of a report", got=text, expected=expected)

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """Names and texts of the lines that are printed."""
        return tuple((name, text) for name, text in vars(self).items() if text.strip())


NO_TITLE_BLOCK = TitleBlock()


@frozen
class DescribedBy:
    """The files that describe a robot, as they were when the report was written."""

    name: str  #: of the first file
    text: str  #: what it says
    #: names of all files that were read for the robot, the first among them, and the SHA-256 of
    #: each, by which a file is recognised
    files: Mapping[str, str] = field(default_factory=dict)
    #: as they are written in the first
    parameters: Mapping[str, Any] = field(default_factory=dict)
    #: other values for some of them, with which the robot was computed
    changed: Mapping[str, Any] = field(default_factory=dict)


def described_by(
    path: str | Path, changed: Mapping[str, Any] | None = None, **options: Any
) -> DescribedBy | None:
    """The files of a robot; None where the first is no text.

    Parameters
    ----------
    path : str or path
        A model file, a snapshot, a robot description, or the name of a shipped robot.
    changed : mapping of str to value, optional
        Parameters that were given other values.
    side, allow_xacro
        As for `robostiff.load`, which reads the files once more.

    Raises
    ------
    InputError
        When there is no such file, or it cannot be used.
    """
    from robostiff.io.bounded_file import files_that_are_read
    from robostiff.io.document import parse_document
    from robostiff.robots import load, robot_file, shipped_names

    file = robot_file(str(path)) if str(path) in shipped_names() else Path(path)
    if not file.is_file():
        raise InputError("file of a report", got=str(path), expected="a file that is there")
    content = file.read_bytes()
    try:
        text = content.decode()
    except UnicodeDecodeError:
        return None
    with warnings.catch_warnings(), files_that_are_read() as files:
        warnings.simplefilter("ignore", PlausibilityWarning)  # given when it was loaded
        load(path, changed, **options)
    whole = os.path.realpath(file)
    named = {file.name: hashlib.sha256(content).hexdigest()}
    for name in files.keys() - {whole}:
        named[os.path.relpath(name, os.path.dirname(whole))] = files[name]
    parameters: Any = {}
    if file.suffix.lower() in {".yaml", ".yml", ".json"}:
        data = parse_document(text, file.name).data
        parameters = data.get("parameters") if isinstance(data, dict) else {}
    known = parameters if isinstance(parameters, dict) else {}
    return DescribedBy(file.name, text, named, known, dict(changed or {}))


Reported = Robot | Snapshot | Network | CableRobot

# of what a report on cables does not take
_INSTEAD = {
    "at": "the load of a cable robot acts at its reference point",
    "other": "write a report of each robot",
    "finite": "its section on the load has the equilibrium; rs.equilibrium and `robostiff "
    "equilibrium` have stiffness and stability under it",
}
_FACTORS = np.linspace(0.0, 2.0, 9)


@frozen
class AnswersUnderLoad:
    """What finite loads do to the robot."""

    equilibrium: Equilibrium
    critical: CriticalLoad  # of the wrench
    curve: xarray.Dataset  # up to twice the wrench


@frozen
class ReportContents:
    """The results that a report shows for a robot at a pose; None where there are none."""

    robot: Reported
    posed: Snapshot | Network | CableStiffness | None  # at the pose, where its legs reach it
    stiffness: Stiffness | CableStiffness
    indices: StiffnessIndices | None = None
    deflection: Deflection | CableResponse | None = None  # under the load, where one is given
    derivation: RobotDerivation | None = None  # the formula in the home configuration
    no_derivation: str = ""  # why there is none
    found: xarray.Dataset | None = None  # a map of the same robot
    under_load: AnswersUnderLoad | None = None  # of finite loads, where they are asked for
    modes: Modes | None = None  # without load, of a robot whose model has masses
    title_block: TitleBlock = NO_TITLE_BLOCK
    described_by: DescribedBy | None = None
    compared: ReportContents | None = None  # stiffness and deflection of another design
    joints: Mapping[str, Number] = field(default_factory=dict)  # of a linkage, their coordinates
    given: tuple[str, ...] = ()  # those that were given, in words
    source: str = ""  # where the numbers of the robot come from

    @property
    def status(self) -> Status:
        """Status of the stiffness and, under a load, of the deflection."""
        status: Any = self.stiffness.status
        return status if self.deflection is None else status | self.deflection.status

    @property
    def advice_of_load(self) -> tuple[str, ...]:
        """Advice about the deflection that the stiffness does not give."""
        words = () if self.deflection is None else self.deflection.advice
        return tuple(line for line in words if line not in self.stiffness.advice)


def report_contents(
    robot: Reported | Linkage,
    pose: Pose | Mapping[str, Any] = None,
    *,
    wrench: ArrayLike | None = None,
    at: ArrayLike | None = None,
    near: Near = None,
    found: xarray.Dataset | None = None,
    symbolic: Robot | None = None,
    finite: bool = False,
    title_block: TitleBlock = NO_TITLE_BLOCK,
    described_by: DescribedBy | None = None,
    other: Robot | Snapshot | Network | None = None,
) -> ReportContents:
    """Compute the results of a report, with arguments as those of `write_report`.

    Symbols have their nominal values in all but the derivation; `symbolic` is the same robot with
    symbols, for its formula, and `robot` itself when left out.

    Raises InputError when an argument does not fit, several poses are given, or the map is of
    another robot.
    """
    base: dict[str, Any] = {"title_block": title_block, "described_by": described_by}
    place: Any = pose
    base["source"] = getattr(robot, "source", "")
    if isinstance(robot, Linkage):
        part, closed = closed_at(robot, place)
        joints = {
            joint.name + (f"[{i}]" if joint.size > 1 else ""): Number(float(q), screw.unit)
            for joint in part.joints
            for i, (screw, q) in enumerate(
                zip(joint.freedoms, closed.coordinates[joint.name], strict=True)
            )
        }
        base |= {"joints": joints, "given": joints_in_words(robot, place)}
        robot, place = network_of(part, closed), None
    if not isinstance(robot, Subject):
        expected = "a Robot, Snapshot, Network, Linkage or CableRobot"
        raise InputError("robot of a report", got=type(robot).__name__, expected=expected)
    if found is not None and (of := found.attrs.get("robot")) != robot.name:
        if of is not None:
            raise InputError("robot of the map", got=str(of), expected=repr(robot.name))
        got = Words("a dataset without the name of a robot")
        expected = "a dataset from rs.stiffness_map or robostiff map"
        raise InputError("map of a report", got=got, expected=expected)
    if finite and (wrench is None or not np.any(np.asarray(wrench, dtype=float))):
        expected = "a wrench other than zero"
        raise InputError("finite loads of a report", got=Words("no wrench"), expected=expected)
    base |= {"robot": robot, "found": found}
    if isinstance(robot, CableRobot):
        others = {"near": near, "finite": finite or None, "other": other}
        for name, value in {**others, "at": None if wrench is None else at}.items():
            if value is not None:
                subject = f"{name} in a report on cable robot {robot.name!r}"
                got = getattr(value, "name", value)
                raise InputError(subject, got=got, expected="none", hint=_INSTEAD.get(name))
        cables = cable_stiffness(robot, place)
        require_one_pose("a report", cables.batch_shape, "write one pose")
        response = None if wrench is None else cable_response(robot, place, wrench)
        return ReportContents(posed=cables, stiffness=cables.about(at), deflection=response, **base)
    numeric: Any = robot.numeric
    options: dict[str, Any] = {"at": at, "near": near}
    result = stiffness(numeric, place, **options)
    hint = "make a map of many poses, and give it to the report"
    require_one_pose("a report", result.batch_shape, hint)
    of_pose = bent = under_load = vibrations = None
    if np.all(result.answered):
        with suppress(NoAnswerError):
            of_pose = indices(result)
    if wrench is not None:
        bent = deflection(numeric, place, wrench, **options)
    if finite:
        at_rest = equilibrium(numeric, place, wrench, **options)
        require_one_pose("a report", at_rest.batch_shape)
        under_load = AnswersUnderLoad(
            at_rest,
            critical_load(numeric, place, wrench, **options),
            load_path(numeric, place, wrench, _FACTORS, **options),
        )
    # of the masses of the model, without a flexible platform
    if getattr(numeric, "platform", "") is None and has_masses(numeric):
        vibrations = modes(numeric, place, near=near, gravity=np.zeros(3))
    derivation, why_not = _derivation(robot if symbolic is None else symbolic)
    return ReportContents(
        posed=None if Status.UNREACHABLE in result.status else result.placed(),
        stiffness=result,
        indices=of_pose,
        deflection=bent,
        derivation=derivation,
        no_derivation=why_not,
        under_load=under_load,
        modes=vibrations if vibrations is not None and vibrations.each else None,
        compared=None if other is None else _other_design(other, result, place, wrench, at),
        **base,
    )


def _other_design(
    other: Robot | Snapshot | Network,
    result: Stiffness,
    pose: Pose,
    wrench: ArrayLike | None,
    at: ArrayLike | None,
) -> ReportContents:
    """Another design at the same pose, and under the same load."""
    has_legs = isinstance(other, Subject) and not hasattr(other, "cables")
    if not has_legs or other.space is not result.space:
        got = getattr(other, "name", other)
        expected = f"a robot or a snapshot with {result.space.size} freedoms"
        raise InputError("design that is compared", got=got, expected=expected)
    numeric, place = other.numeric, None if other.is_frozen else pose
    answer = stiffness(numeric, place, at=at)
    bent = None if wrench is None else deflection(numeric, place, wrench, at=at)
    return ReportContents(numeric, None, answer, deflection=bent)


def _derivation(robot: Robot | Snapshot | Network) -> tuple[RobotDerivation | None, str]:
    """The formula at home; in steps where the closed form would be too long to read."""
    from robostiff.analytic import derive_robot

    if not isinstance(robot, Robot):
        return None, f"a {robot.kind} has no symbols"
    if not robot.symbols:
        # without symbols a formula adds nothing to the matrix, and exact roots can take hours
        return None, "all dimensions are numbers; rs.load(..., symbols=...) keeps them as symbols"
    try:
        return derive_robot(robot, AtHome()), ""
    except (InputError, NoAnswerError) as error:
        return None, str(error)
