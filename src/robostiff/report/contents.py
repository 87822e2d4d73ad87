"""The results of a report, computed once."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

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
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Near, Pose
from robostiff.linkage import Configuration, Linkage
from robostiff.linkage.essential import network_of
from robostiff.markup import Number
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.plot.posed_robot import joints_in_words
from robostiff.report.origin import NO_TITLE_BLOCK, DescribedBy, TitleBlock
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

Reported = Robot | Snapshot | Network | CableRobot

_FACTORS = np.linspace(0.0, 2.0, 9)


@dataclass(frozen=True)
class AnswersUnderLoad:
    """What finite loads do to the robot."""

    equilibrium: Equilibrium
    critical: CriticalLoad  # of the wrench
    curve: xarray.Dataset  # up to twice the wrench


@dataclass(frozen=True)
class OtherDesign:
    """A design that is compared."""

    name: str
    stiffness: Stiffness
    deflection: Deflection | None  # under the same load

    @property
    def status(self) -> Status:
        """Status of the stiffness and, under a load, of the deflection."""
        bent = self.deflection
        return self.stiffness.status if bent is None else self.stiffness.status | bent.status

    @property
    def advice(self) -> tuple[str, ...]:
        """Advice about its results, each once."""
        own = () if self.deflection is None else self.deflection.advice
        return tuple(dict.fromkeys((*self.stiffness.advice, *own)))


@dataclass(frozen=True)
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
    compared: OtherDesign | None = None
    joints: Mapping[str, Number] = field(default_factory=dict)  # of a linkage, their coordinates
    given: tuple[str, ...] = ()  # those that were given, in words
    source: str = ""  # where the numbers of the robot come from

    @property
    def status(self) -> Status:
        """Status of the stiffness and, under a load, of the deflection."""
        own: Any = self.stiffness.status
        return own if self.deflection is None else own | self.deflection.status


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
    """Compute the results of a report.

    Parameters
    ----------
    robot : Robot, Snapshot, Network, Linkage or CableRobot
        Symbols have their nominal values in all but the derivation.
    pose, wrench, at, near, found, finite, title_block, described_by, other
        As of `write_report`.
    symbolic : Robot, optional
        The same robot with symbols, for its formula; `robot` itself when left out.

    Raises
    ------
    InputError
        When an argument does not fit, several poses are given, or the map is of another robot.
    """
    own: dict[str, Any] = {"title_block": title_block, "described_by": described_by}
    place: Any = pose
    own["source"] = getattr(robot, "source", "")
    if isinstance(robot, Linkage):
        part, closed = robot.closed_at(place)
        own |= {"joints": _coordinates(part, closed), "given": joints_in_words(robot, place)}
        robot, place = network_of(part, closed), None
    if not isinstance(robot, Robot | Snapshot | Network | CableRobot):
        raise InputError(
            "robot of a report",
            got=type(robot).__name__,
            expected="a Robot, Snapshot, Network, Linkage or CableRobot",
        )
    _check_map(robot, found)
    if finite and (wrench is None or not np.any(np.asarray(wrench, dtype=float))):
        raise InputError(
            "finite loads of a report", got="no wrench", expected="a wrench other than zero"
        )
    if isinstance(robot, CableRobot):
        given = {"near": near, "finite": finite, "other": other}
        return _of_cables(robot, place, wrench, at, given, found, own)
    numeric = robot.numeric
    result = stiffness(numeric, place, at=at, near=near)
    hint = "make a map of many poses, and give it to the report"
    require_one_pose("a report", result.batch_shape, hint)
    posed = None if Status.UNREACHABLE in result.status else result.placed()
    of_pose = None
    if np.all(result.answered):
        with suppress(NoAnswerError):
            of_pose = indices(result)
    bent = None
    if wrench is not None:
        bent = deflection(numeric, place, wrench, at=at, near=near)
    derivation, why_not = _derivation(robot if symbolic is None else symbolic)
    return ReportContents(
        robot=robot,
        posed=posed,
        stiffness=result,
        indices=of_pose,
        deflection=bent,
        derivation=derivation,
        no_derivation=why_not,
        found=found,
        under_load=_under_load(numeric, place, wrench, at, near) if finite else None,
        modes=_modes(numeric, place, near),
        compared=None if other is None else _other_design(other, result, place, wrench, at),
        **own,
    )


def _coordinates(part: Linkage, found: Configuration) -> dict[str, Number]:
    """Coordinates of all joints, by their names."""
    return {
        joint.name + (f"[{i}]" if joint.size > 1 else ""): Number(float(q), screw.unit)
        for joint in part.joints
        for i, (screw, q) in enumerate(
            zip(joint.freedoms, found.coordinates[joint.name], strict=True)
        )
    }


def _of_cables(
    robot: CableRobot,
    pose: Pose,
    wrench: ArrayLike | None,
    at: ArrayLike | None,
    given: Mapping[str, Any],
    found: xarray.Dataset | None,
    own: Mapping[str, Any],
) -> ReportContents:
    """Tensions and stiffness of a cable robot, and its rest under the load."""
    refused = {**given, "at": at if wrench is not None else None}
    hints = {
        "at": "the load of a cable robot acts at its reference point",
        "other": "write a report of each robot",
        "finite": "its section on the load has the equilibrium; rs.equilibrium and `robostiff "
        "equilibrium` have stiffness and stability under it",
    }
    for name, value in refused.items():
        if value is not None and value is not False:
            raise InputError(
                f"{name} in a report on cable robot {robot.name!r}",
                got=getattr(value, "name", value),
                expected="none",
                hint=hints.get(name),
            )
    result = cable_stiffness(robot, pose)
    require_one_pose("a report", result.batch_shape, "write one pose")
    bent = None if wrench is None else cable_response(robot, pose, wrench)
    return ReportContents(
        robot=robot, posed=result, stiffness=result.about(at), deflection=bent, found=found, **own
    )


def _other_design(
    other: Robot | Snapshot | Network,
    result: Stiffness,
    pose: Pose,
    wrench: ArrayLike | None,
    at: ArrayLike | None,
) -> OtherDesign:
    """Another design at the same pose, and under the same load."""
    if not isinstance(other, Robot | Snapshot | Network) or other.space is not result.space:
        raise InputError(
            "design that is compared",
            got=getattr(other, "name", other),
            expected=f"a robot or a snapshot with {result.space.size} freedoms",
        )
    own, place = other.numeric, None if other.is_frozen else pose
    found = stiffness(own, place, at=at)
    bent = None if wrench is None else deflection(own, place, wrench, at=at)
    return OtherDesign(own.name, found, bent)


def _under_load(
    robot: Robot | Snapshot | Network, pose: Pose, wrench: Any, at: ArrayLike | None, near: Near
) -> AnswersUnderLoad:
    options: dict[str, Any] = {"at": at, "near": near}
    found = equilibrium(robot, pose, wrench, **options)
    require_one_pose("a report", () if isinstance(found, Equilibrium) else (len(found),))
    return AnswersUnderLoad(
        cast("Equilibrium", found),
        critical_load(robot, pose, wrench, **options),
        load_path(robot, pose, wrench, _FACTORS, **options),
    )


def _modes(robot: Robot | Snapshot | Network, pose: Pose, near: Near) -> Modes | None:
    """Of the masses of the model; none without any, and of flexible platforms."""
    if isinstance(robot, Network) or robot.platform is not None:
        return None
    if not has_masses(robot):
        return None
    found = modes(robot, pose, near=near, gravity=np.zeros(3))
    return found if found.each else None


def _check_map(robot: Reported, found: xarray.Dataset | None) -> None:
    if found is None:
        return
    of = found.attrs.get("robot")
    if of is None:
        raise InputError(
            "map of a report",
            got="a dataset without the name of a robot",
            expected="a dataset from rs.stiffness_map or robostiff map",
        )
    if of != robot.name:
        raise InputError("robot of the map", got=str(of), expected=repr(robot.name))


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
